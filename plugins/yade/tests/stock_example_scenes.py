"""Runs inside YADE: `yade -n -x stock_example_scenes.py out.json steps script.py words...`: an example of YADE, at most so many steps.

The script is not edited: its windows are stand-ins, random numbers begin with the same seed, O.run counts steps and waits for them. Steps
that the script leaves to the PLAY button are made at its end. Written are a digest of all bodies and numbers to look at.
"""

import hashlib
import json
import os
import random
import sys
from pathlib import Path
from unittest.mock import MagicMock

import numpy

os.environ["MPLBACKEND"] = "Agg"
import yade.plot
from yade import pack

OUT, STEPS, SCRIPT = Path(sys.argv[1]).resolve(), int(sys.argv[2]), Path(sys.argv[3]).resolve()


class EnoughSteps(BaseException):
    """The script has made all steps that it gets."""


class Steps:
    """Takes the place of O.run; waits, or the script would end before its steps."""

    own = type(O).run
    made = 0

    def run(self, count=-1, wait=False):
        left, before = STEPS - Steps.made, self.iter
        Steps.own(self, min(count, left) if count > 0 else left, True)
        Steps.made += max(self.iter - before, 0)
        if Steps.made >= STEPS:
            raise EnoughSteps


_cloud = pack.SpherePack.makeCloud


def _seeded(packing, *values, **words):
    if len(values) < 11:
        words.setdefault("seed", 1)
    return _cloud(packing, *values, **words)


type(O).run = Steps.run
pack.SpherePack.makeCloud = _seeded
random.seed(1)
numpy.random.seed(1)  # noqa: NPY002 (what scripts draw from)
yade.qt = sys.modules["yade.qt"] = sys.modules["gi"] = MagicMock()
yade.plot.plot = MagicMock()


def _numbers(stopped):
    bodies = [body for body in O.bodies if body]
    digest = hashlib.sha256()
    for body in bodies:
        for vector in (body.state.pos, body.state.vel, body.state.angVel):
            digest.update(" ".join(float(number).hex() for number in vector).encode())
    real = [one for one in O.interactions if one.isReal]
    found = {"digest": digest.hexdigest(), "steps": O.iter, "made": Steps.made, "time_step": O.dt, "bodies": len(bodies),
             "contacts": len(real), "kinetic": kineticEnergy(), "stopped": stopped,
             "height": max((body.state.pos[2] + body.shape.radius for body in bodies if isinstance(body.shape, Sphere)), default=None),
             "force": max((one.phys.normalForce.norm() for one in real), default=0.0)}
    for engine in O.engines:
        if isinstance(engine, (TriaxialStressController, TriaxialCompressionEngine)):
            found |= {"mean_stress": engine.meanStress, "porosity": engine.porosity}
        elif isinstance(engine, PeriTriaxController):
            found |= {"stress": list(engine.stress), "strain": list(engine.strain)}
        elif isinstance(engine, BoxFactory):
            found |= {"inserted": engine.numParticles}
    found["plot"] = {name: [values[-1], max(values)] for name, values in yade.plot.data.items()
                     if values and all(isinstance(value, (int, float)) for value in values)}
    return found


sys.argv = [str(SCRIPT), *sys.argv[4:]]
stopped = False
try:
    exec(compile(SCRIPT.read_text(encoding="utf-8"), str(SCRIPT), "exec"), globals())
    if not Steps.made:
        O.run(STEPS, True)
except EnoughSteps:
    stopped = True
OUT.write_text(json.dumps(_numbers(stopped)), encoding="utf-8")
