"""The statements of docs/migration.md about models of YADE, tried with them."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation import engines

SCRIPT = """
mat = O.materials.append(ViscElCapMat(young=1e6, poisson=0.3, density=2500, frictionAngle=0, kn=1e3, cn=0.0, ks=0.0, cs=0.0,
                                      Capillar=True, Vb=8e-11, gamma=0.072, theta=0.0, CapillarType="Willett_numeric"))
O.bodies.append([utils.sphere((x, 0, 0), 0.0025, material=mat) for x in (0, 0.005 - 1e-9)])
for body in O.bodies:
    body.state.blockedDOFs = "xyzXYZ"
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(aabbEnlargeFactor=1.3)], verletDist=0),
             InteractionLoop([Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.3)],
                             [Ip2_ViscElCapMat_ViscElCapMat_ViscElCapPhys()], [Law2_ScGeom_ViscElCapPhys_Basic()]), NewtonIntegrator()]
O.dt = 1e-6
pulls = []
for gap in (-1e-9, 1e-9, -1e-9):
    O.bodies[1].state.pos = (0.005 + gap, 0, 0)
    O.step()
    pulls.append(O.forces.f(0)[0])
print("pulls:", *pulls)
"""


def test_the_capillary_force_of_viscelcapmat_ends_where_the_spheres_overlap(tmp_path: Path) -> None:
    try:
        yade = engines.find("yade")
    except DembarkError as error:
        pytest.skip(str(error))
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    done = engines.call(yade.command(script, {}), tmp_path, yade.environment())
    found = re.search(r"pulls: (\S+) (\S+) (\S+)", done.stdout)
    assert found, done.stderr
    before, apart, after = map(float, found.groups())
    assert before == after == pytest.approx(-5e-7, rel=1e-3), "the spring alone"
    assert 0.5 < apart / (2.0 * math.pi * 0.0025 * 0.072) < 1.0
