"""The statements of docs/how-to/migration.md about models of YADE, tried with them."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest
from blocks import FENCE, built

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
    yade = built("yade")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    done = engines.call(yade.command(script, {}), tmp_path, yade.environment())
    found = re.search(r"pulls: (\S+) (\S+) (\S+)", done.stdout)
    assert found, done.stderr
    before, apart, after = map(float, found.groups())
    assert before == after == pytest.approx(-5e-7, rel=1e-3), "the spring alone"
    assert 0.5 < apart / (2.0 * math.pi * 0.0025 * 0.072) < 1.0


BOUNCE = """
units si
atom_style sphere
atom_modify map array
boundary f f f
comm_modify vel yes
region domain block -1 3 -1 1 -1 1 units box
create_box 1 domain
create_atoms 1 single 0 0 0 units box
create_atoms 1 single 0.7501 0 0 units box
group second id 2
set group all diameter 0.75 density 1
velocity second set -2 0 0 units box
neighbor 0.1 bin
{style}
fix move all nve/sphere
timestep 1e-5
run {steps}
variable apart equal vx[2]-vx[1]
variable e equal v_apart/2
print "returned $(v_e:%.6f)"
"""
MATERIAL = "pair_style granular\npair_coeff * * hertz/material 1e5 {} 0.3 tangential linear_nohistory 0 0 damping {}"
OURS = ("pair_style dembark/granular {}\npair_coeff * * youngs_modulus {} poissons_ratio 0.3 restitution {} static_friction 0 "
        "kinetic_friction 0 critical_slip_distance 0")


def test_restitution_of_the_models_of_lammps(tmp_path: Path) -> None:
    """What the page gives for `tsuji`, `coeff_restitution`, `gran/hertz` and `gran/hooke` is what their grains do, and ours with it."""
    lammps = built("lammps")
    page = (Path(__file__).parents[1] / "how-to/migration.md").read_text(encoding="utf-8")
    heads = ("| `hertz/material E e ν … damping", "| `restitution` |")
    tsuji = dict(zip(*(re.findall(r"0\.\d+", line) for line in page.splitlines() if line.startswith(heads)), strict=True))
    (block,) = [one for head, one in FENCE.findall(page) if head == "python" and one.startswith("import numpy as np\nfrom scipy")]
    functions: dict[str, object] = {}
    exec(block, functions)
    mass, stiffness = math.pi / 6 * 0.75**3, 4000
    hertz = functions["restitution_hertz"](stiffness, 100, 0.1875, mass / 2, 2)
    hooke = functions["restitution_hooke"](2000, 50, mass / 2)
    youngs = functions["youngs_modulus_hooke"](2000, 0.1875, mass / 2, 1)
    pairs = [(MATERIAL.format(e, "tsuji"), OURS.format("", 1e5, found), float(found)) for e, found in tsuji.items()]
    pairs += [(MATERIAL.format(e, "coeff_restitution"), OURS.format("", 1e5, e), e) for e in (0.1, 0.5, 0.9)]
    stock = "pair_style gran/{}/history {} NULL {} NULL 0 0\npair_coeff * *"
    pairs += [(stock.format("hertz", stiffness, 100), OURS.format("", 1.5 * 0.91 * stiffness, hertz), hertz),
              (stock.format("hooke", 2000, 50), OURS.format("normal hooke 1", youngs, hooke), hooke)]
    script = tmp_path / "script.in"
    script.write_text("clear\n".join(BOUNCE.format(style=style, steps=12000 if "granular\npair_coeff * * hertz" in pair[0] else 40000)
                                     for pair in pairs for style in pair[:2]))
    done = engines.call(lammps.command(script, {}), tmp_path, lammps.environment())
    found = [float(number) for number in re.findall(r"^returned (\S+)$", done.stdout, re.MULTILINE)]
    assert len(found) == 2 * len(pairs), done.stdout[-2000:]
    for k, (stock, _, expected) in enumerate(pairs):
        assert found[2 * k : 2 * k + 2] == [pytest.approx(expected, rel=0.01)] * 2, stock
