"""A mistake ends the run and not the session: it reaches Python as RuntimeError from engines and from loops that run with OpenMP."""

import json

import pytest

SCENE = """
import json
from yade import dembark
said = {}

def scene(**words):
    global ip2
    O.reset()
    O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
    for k in range(8):
        O.bodies.append([sphere((0.01 * k, 0, 0), 0.0025), sphere((0.01 * k + 0.0049, 0, 0), 0.0025)])
    ip2 = Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
        **{**dict(restitution=0.5, staticFriction=0.5, kineticFriction=0.4, criticalSlipDistance=1e-5), **words})
    O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()]),
                 InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [ip2], [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]),
                 NewtonIntegrator(damping=0)]
    O.dt = 1e-6

def told(name, call):
    try:
        call()
        said[name] = "nothing"
    except RuntimeError as error:
        said[name] = str(error)

for name, call in (("step", O.step), ("run", lambda: O.run(5, True))):
    scene(restitution=2.0)
    engines = [type(each).__name__ for each in O.engines]
    told(name, call)
    assert [type(each).__name__ for each in O.engines] == engines and O.iter == 0
    still = [list(b.state.pos) for b in O.bodies]
    assert still == [[0.01 * (k // 2) + 0.0049 * (k % 2), 0, 0] for k in range(16)]
    O.save("alive.xml")
    # Mended, the same session goes on.
    ip2.restitution = 0.5
    O.run(5, True)
    assert O.iter == 5 and O.interactions[0, 1].phys.normalForce.norm() > 0
scene(restitution=2.0)
for k in range(1, 16, 2):
    # Impacts begin with logs that hardly overlap.
    O.bodies[k].state.pos += Vector3(0.0001, 0, 0)
O.bodies.append(dembark.drum((0, 0, 0), 1.0))
impact = LcpImpact(stiffness=1e7)
newton = NewtonIntegrator(damping=0.2)
O.engines = [ForceResetter(), impact, newton]
told("engine", lambda: O.run(5, True))
newton.damping = 0
O.run(5, True)
assert O.iter == 5
# The same from Python, in a script and in an engine.
told("helper", lambda: dembark.log((0, 0, 0), -1.0, 0.1))
scene()
O.engines = [*O.engines, PyRunner(command="dembark.fail('no word', 3)", iterPeriod=1, firstIterRun=1)]
told("runner", lambda: O.run(5, True))
O.engines = O.engines[:-1]
O.run(5, True)
assert O.iter == 6
json.dump(said, open("said.json", "w"))
print("went on")
"""


@pytest.mark.parametrize("threads", [1, 2])
def test_a_mistake_is_a_runtime_error_and_the_session_goes_on(yade, threads):
    path = yade.folder / "report.py"
    path.write_text(SCENE)
    done = yade(path, threads=threads)
    assert "went on" in done.stdout, done.stderr
    said = json.loads((yade.folder / "said.json").read_text())
    assert said["helper"].startswith("dembark: log: ") and "\n" not in said["helper"]
    assert "\ndembark: no word\n" in said["runner"] and "Traceback" not in said["runner"] + done.stderr
    for name, parts in (("step", ("restitution must", "not 2")), ("run", ("restitution must", "not 2")), ("engine", ("damping is 0.2",))):
        assert said[name].startswith("dembark: ") and "\n" not in said[name]
        assert all(part in said[name] for part in parts), said[name]
