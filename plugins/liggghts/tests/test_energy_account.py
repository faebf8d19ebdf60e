"""fix energy/account: the works of all forces balance the kinetic energy to round-off, in impacts and in a column that collapses."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rig import liggghts_driver
from rig.energy_account import FIX, THERMO, Account
from rig.liggghts_driver import Run, models, properties, run_deck
from rig.python_driver import contact
from rig.scenarios import CONSTANT, SPRING, Grain, Material, Scenario

from dembark.physics import Body, collide, effective_youngs_modulus

DRY = Material(static_friction=0.5, kinetic_friction=0.4, restitution=0.6, youngs_modulus=5e6)
WET = replace(DRY, bridge_volume=5e-11, viscosity=0.01, capillary_model="willett")
ROLLING, CONSTANT_TORQUE = replace(DRY, **SPRING), replace(DRY, **CONSTANT)


def grains() -> tuple[Grain, ...]:
    return (Grain(position=(1e-3, 5e-4, 9e-3), velocity=(-0.3, 0.2, -0.8), angular_velocity=(40.0, -25.0, 60.0)),
            Grain(radius=3e-3, position=(0.0, 0.0, 7.4e-4), velocity=(0.1, -0.1, 0.2), angular_velocity=(-10.0, 30.0, 15.0)))


def account_of(folder: Path, case: Scenario) -> Account:
    deck = liggghts_driver.deck(case, start=f"{FIX}\n{THERMO}").replace(f"thermo {case.steps}", f"thermo {case.stride}")
    return Account(run_deck(folder, deck))


def works_in_python(case: Scenario) -> dict[str, float]:
    """J, of the same impact in Python alone: forces as the laws give them, times the velocity of the full step."""
    m, dt = case.material, case.time_step
    bodies = [Body(radius=g.radius, mass=g.mass, position=g.position, velocity=g.velocity, angular_velocity=g.angular_velocity)
              for g in case.grains]
    out = collide(contact(m), *bodies, time_step=dt, steps=case.steps)
    elastic = effective_youngs_modulus(m.youngs_modulus, m.poisson_ratio, m.youngs_modulus, m.poisson_ratio)
    one, two = (g.radius for g in case.grains)
    works = dict.fromkeys(("normal_spring", "normal_damping", "tangential", "bridges", "viscous", "rolling"), 0.0)
    for x, v, spin, c in zip(out.position, out.velocity, out.angular_velocity, out.contacts, strict=True):
        normal = (x[0] - x[1]) / np.linalg.norm(x[0] - x[1])
        moved = v[0] - v[1]
        parting = moved @ normal
        sliding = moved - parting * normal - np.cross((one - c.overlap / 2) * spin[0] + (two - c.overlap / 2) * spin[1], normal)
        spring = 4.0 / 3.0 * elastic * np.sqrt(one * two / (one + two)) * max(c.overlap, 0.0) ** 1.5
        works["normal_spring"] += spring * parting * dt
        works["normal_damping"] += (c.normal_force - spring) * parting * dt
        works["tangential"] += np.dot(c.tangential, sliding) * dt
        works["bridges"] -= c.capillary_force * parting * dt
        works["rolling"] += np.dot(c.rolling, spin[0] - spin[1]) * dt
        works["viscous"] += (c.viscous_normal * parting + np.dot(c.viscous_tangential, sliding)) * dt
    return works


# Contacts of viscous bridges are computed by the engine's loop, all others in packs.
@pytest.mark.parametrize("material", [DRY, replace(DRY, restitution=1.0), replace(WET, kinetic_friction=0.2),
                                      replace(WET, kinetic_friction=0.2, viscosity=0.0), replace(DRY, presliding="partial_slip"), ROLLING,
                                      CONSTANT_TORQUE],
                         ids=["dry", "elastic", "wet", "bridge", "partial slip", "rolling spring", "constant torque"])
def test_parts_of_an_oblique_impact_are_those_of_the_laws(tmp_path, material):
    case = Scenario(name="impact", material=material, grains=grains(), time_step=2e-6, steps=1250, stride=10)
    account = account_of(tmp_path, case)
    account.assert_balanced()
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)
    for name, expected in works_in_python(case).items():
        together = name in ("tangential", "rolling")
        found = getattr(account, f"{name}_spring") + getattr(account, f"{name}_damping") if together else getattr(account, name)
        assert found[-1] == pytest.approx(expected, rel=1e-9, abs=1e-13 * account.turnover), name
        # Each part is there in the wet case; the spring has given back what it took.
        absent = ("normal_spring", "rolling") if material.viscosity else ("normal_spring", "rolling", "viscous")
        assert not material.bridge_volume or name in absent or abs(expected) > 1e-4 * account.turnover
    assert account.normal_spring.min() < -0.1 * account.turnover
    assert (account.tangential_damping[-1] == 0.0) == (material.restitution == 1.0)
    assert account.normal_stored[-1] == account.tangential_stored[-1] == account.rolling_stored[-1] == 0.0
    assert (account.rolling_damping[-1] < -1e-4 * account.turnover) == (material.rolling_resistance != "off")
    assert (account.rolling_stored.max() > 0.0) == (account.rolling_spring[-1] < 0.0) == (material.rolling_resistance == "elastic_plastic")


def step_errors(folder: Path, time_step: float) -> np.ndarray:
    """J, while a grain without damping and friction bounces on the floor, at the same times for all steps."""
    smooth = replace(DRY, restitution=1.0, static_friction=0.0, kinetic_friction=0.0)
    case = Scenario(name="drop", material=smooth, grains=(Grain(position=(0.0, 0.0, 5.01e-3), velocity=(0.1, 0.0, -0.5)),), wall=True,
                    gravity=(0.0, 0.0, -9.81), time_step=time_step, steps=round(1.6e-3 / time_step), stride=round(8e-5 / time_step))
    account = account_of(folder, case)
    account.assert_balanced()
    # Gravity and the spring are all there is: energy that comes or goes is the step's.
    np.testing.assert_allclose(account.step_error, account.kinetic - account.start - account.gravity + account.normal_stored,
                               atol=1e-14 * account.turnover)
    return account.step_error


def test_error_of_the_step_is_of_second_order(tmp_path):
    coarse, fine, finest = (np.abs(step_errors(tmp_path / str(n), 8e-6 / n)).max() for n in (1, 2, 4))
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)
    assert np.log2(fine / finest) == pytest.approx(2.0, abs=0.2)


COLUMN = "\n".join(f"create_atoms 1 single {0.0026 + 0.0052 * i} {0.0026 + 0.0052 * j} {0.0026 + 0.0052 * k} units box"
                   for i in range(5) for j in range(5) for k in range(12))
GATE = """\
solid gate
facet normal 1 0 0
outer loop
vertex 0.0262 -0.001 -0.0005
vertex 0.0262 0.027 -0.0005
vertex 0.0262 0.027 0.08
endloop
endfacet
facet normal 1 0 0
outer loop
vertex 0.0262 -0.001 -0.0005
vertex 0.0262 0.027 0.08
vertex 0.0262 -0.001 0.08
endloop
endfacet
endsolid gate
"""


def column(folder: Path, m: Material, run: str, *, ranks: int = 1) -> Account:
    """The account of 300 grains of many sizes between four walls, let loose by a gate that is drawn aside and up."""
    return Account(collapse(folder, m, f"{FIX}\n{THERMO}", run, ranks=ranks))


def collapse(folder: Path, m: Material, start: str, run: str, *, ranks: int = 1) -> Run:
    """What the engine says of them; `start`: commands before the run."""
    walls = "\n".join(f"fix {name} all wall/gran {models(m, wall=f'primitive type 2 {axis}plane {at}')}"
                      for name, axis, at in (("floor", "z", 0.0), ("left", "x", 0.0), ("front", "y", 0.0), ("back", "y", 0.026)))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "gate.stl").write_text(GATE)
    return run_deck(folder, f"""\
units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
processors {({1: "1 1 1", 2: "1 1 2", 4: "2 1 2"})[ranks]}
region domain block -0.001 0.1 -0.002 0.028 -0.001 0.1 units box
create_box 2 domain
{COLUMN}
neighbor 0.002 bin
neigh_modify delay 0
timestep 1e-5
{properties(m)}
pair_style gran {models(m)}
pair_coeff * *
variable size atom 0.005*(1+0.05*sin(37*id))
variable push_x atom 0.1*sin(91*id)
variable push_y atom 0.1*sin(53*id)
set group all density 2500 diameter v_size density 2500
set group all vx v_push_x vy v_push_y
fix gate all mesh/surface file gate.stl type 2
fix guard all wall/gran {models(m, wall="mesh n_meshes 1 meshes gate")}
{walls}
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
fix lift all move/mesh mesh gate linear 0.03 0 0.05
{start}
thermo 250
{run}
""", ranks=ranks)


@pytest.mark.parametrize(("material", "steps"), [(DRY, 5000), (WET, 3000), (ROLLING, 3000)], ids=["dry", "wet", "rolling"])
def test_collapse_balances(tmp_path, material, steps):
    account = column(tmp_path, material, f"run {steps}")
    account.assert_balanced()
    assert (account.atoms == 300).all() and (account.imposed == 0.0).all()
    np.testing.assert_allclose(account.kinetic, account.full, rtol=1e-14)
    # All of it happens: the column falls, everything that can be lost is, and the gate takes up what the grains push.
    assert account.gravity[-1] > account.start[0] and account.walls[-1] < -1e-3 * account.turnover
    present = ("normal_damping", "tangential_spring", "tangential_damping") + (("bridges", "viscous") if material is WET else ())
    present += ("rolling_spring", "rolling_damping") if material is ROLLING else ()
    for name in present:
        assert getattr(account, name)[-1] < -1e-3 * account.turnover, name
    if material is DRY:
        assert (account.bridges == 0.0).all() and (account.viscous == 0.0).all()
    assert 0.0 < abs(account.step_error[-1]) < 1e-3 * account.turnover
    assert account.normal_stored[-1] > 10.0 * account.tangential_stored[-1] > 0.0


@pytest.mark.parametrize("material", [DRY, replace(WET, viscosity=0.0), replace(DRY, presliding="partial_slip"), ROLLING],
                         ids=["dry", "bridges", "partial slip", "rolling"])
def test_a_run_is_the_same_to_the_bit_with_the_account_and_without(tmp_path, material):
    columns = "id x y z vx vy vz omegax omegay omegaz"
    dump = f"dump end all custom 600 end.dump {columns}\ndump_modify end sort id format \"%d {' '.join(['%a'] * 9)}\"\nrun 600"
    found = []
    for name, start in (("with", f"{FIX}\n{THERMO}"), ("without", "")):
        collapse(tmp_path / name, material, start, dump)
        found.append((tmp_path / name / "end.dump").read_text(encoding="utf-8"))
    assert "0x1." in found[0]
    assert found[0] == found[1]


def test_ranks_account_alike(tmp_path):
    one, two, four = (column(tmp_path / str(ranks), WET, "run 300", ranks=ranks) for ranks in (1, 2, 4))
    for other in (two, four):
        other.assert_balanced()
        assert (other.imposed == 0.0).all()
        np.testing.assert_allclose(other.rows, one.rows, atol=1e-11 * one.turnover)
