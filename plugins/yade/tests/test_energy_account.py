"""EnergyAccount in YADE: every part of the energy against formulas and known values, and the balance of whole runs."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from dembark.physics import capillary_force, effective_shear_modulus, effective_youngs_modulus, rupture_distance, viscous_resistance

HERE = Path(__file__).parent
YOUNG, POISSON, DENSITY, RESTITUTION, STEP, R = 5e6, 0.3, 2500.0, 0.6, 2e-6, 0.0025
E_STAR, G_STAR = effective_youngs_modulus(YOUNG, POISSON, YOUNG, POISSON), effective_shear_modulus(YOUNG, POISSON, YOUNG, POISSON)
BRIDGE, TENSION, ANGLE, VISCOSITY, SMALLEST_GAP = 2e-11, 0.072, 0.35, 5e-3, 1e-5
PARTS = "normal_elastic normal_viscous tangential_elastic tangential_viscous capillary liquid_viscous".split()
ROLLING = ["rolling_elastic", "rolling_viscous"]
WORKS = ["gravity", *PARTS, "walls", "numerical_damping", "other", "imposed", *ROLLING]
KEYS = ["kinetic", "first_kinetic", *WORKS[:-2], "balance", "normal_stored", "tangential_stored", "step_error", "scale", *ROLLING,
        "rolling_stored"]
SCENES = ("impacts elastic dry wet damped box_gate drum rolling_drum periodic carried two_steps briefly save_load come_and_go in_a_step "
          "set_in_a_step reset table messages clumps").split()


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes(*SCENES, script="energy_scenes.py")


def mass(radius):
    return 4.0 / 3.0 * math.pi * radius**3 * DENSITY


def assert_balanced(energies, tolerance=1e-12):
    """The lines add up, and nothing is missing or was invented; compared with the sum of the sizes of all works."""
    assert list(energies) == KEYS
    assert energies["scale"] == pytest.approx(energies["first_kinetic"] + sum(abs(energies[name]) for name in WORKS), rel=1e-14)
    explained = energies["first_kinetic"] + sum(energies[name] for name in WORKS)
    assert energies["kinetic"] - explained == pytest.approx(energies["balance"], abs=1e-14 * energies["scale"])
    assert abs(energies["balance"]) < tolerance * energies["scale"]


def works_of_motion(motion, radii, law):
    """Works of the parts of a contact's force by the formulas of the laws, from positions and velocities alone but for xi."""
    rows, xi = np.asarray(motion["rows"]), np.asarray(motion["displacement"])
    wall = math.isinf(radii[1])
    radius = radii[0] if wall else radii[0] * radii[1] / (radii[0] + radii[1])
    m_1 = mass(radii[0])
    reduced_mass = m_1 if wall else m_1 * mass(radii[1]) / (m_1 + mass(radii[1]))
    beta = math.log(RESTITUTION) / math.hypot(math.log(RESTITUTION), math.pi)
    before, after = rows[:-1], rows[1:]
    separation = before[:, 0, :3] - before[:, 1, :3]
    if wall:
        separation[:, :2] = 0.0
    distance = np.linalg.norm(separation, axis=1)
    normal = separation / distance[:, None]
    overlap = radii[0] + (0.0 if wall else radii[1]) - distance
    touching = np.maximum(overlap, 0.0)
    arms = [radii[0] - 0.5 * overlap, np.zeros_like(overlap) if wall else radii[1] - 0.5 * overlap]

    def motion_at_contact(state):
        velocity = state[:, 0, 3:6] - state[:, 1, 3:6]
        spin = arms[0][:, None] * state[:, 0, 6:9] + arms[1][:, None] * (0.0 if wall else 1.0) * state[:, 1, 6:9]
        along = (velocity * normal).sum(axis=1)
        return along, velocity - along[:, None] * normal - np.cross(spin, normal)

    (v_n, v_t), (u_n, u_t) = motion_at_contact(before), motion_at_contact(0.5 * (before + after))
    if law.get("normalLaw") == "hooke":
        rigidity = math.sqrt(radius) * E_STAR
        k_n = 16 / 15 * rigidity * (15 * reduced_mass * law["characteristicVelocity"]**2 / (16 * rigidity)) ** 0.2
        spring, k_t, gamma = k_n * touching, np.full_like(touching, k_n), -2 * beta * math.sqrt(reduced_mass * k_n) * (touching > 0)
    else:
        root = np.sqrt(radius * touching)
        spring, k_t = 4 / 3 * E_STAR * root * touching, 8 * G_STAR * root
        gamma = -2 * math.sqrt(5 / 6) * beta * np.sqrt(2 * E_STAR * root * reduced_mass)
    force = spring - gamma * v_n
    if law.get("limitForce"):
        force = np.maximum(force, 0.0)
    pull, resisting = np.zeros_like(force), np.zeros((len(force), 3))
    if "capillaryModel" in law:
        gap = -overlap
        there = (np.cumsum(overlap > 0.0) > 0) & (gap <= rupture_distance(BRIDGE, ANGLE, *radii, model="willett"))
        pull[there] = capillary_force(*radii, gap[there], BRIDGE, TENSION, ANGLE, model="willett")
        resistance = viscous_resistance(*radii, gap[there], BRIDGE, VISCOSITY, SMALLEST_GAP)
        resisting[there] = -(resistance.normal * v_n[there])[:, None] * normal[there] - resistance.tangential[:, None] * v_t[there]
    whole = m_1 * (after[:, 0, 3:6] - before[:, 0, 3:6]) / STEP
    held = -k_t[:, None] * xi
    dot = lambda a, b: float((a * b).sum() * STEP)
    motion = u_n[:, None] * normal + u_t
    return {"normal_elastic": dot(spring, u_n), "normal_viscous": dot(force - spring, u_n), "tangential_elastic": dot(held, u_t),
            "tangential_viscous": dot(whole - resisting - (force - pull)[:, None] * normal - held, u_t), "capillary": dot(-pull, u_n),
            "liquid_viscous": dot(resisting, motion), "walls": dot(whole, before[:, 1, 3:6]) if wall else 0.0}


@pytest.mark.parametrize("name", ["grains", "grains+hooke+0.5", "grains+True", "grains+willett", "grains+constant_torque",
                                  "grains+elastic_plastic", "wall0", "wall1", "wall0+willett", "wall1+elastic_plastic"])
def test_parts_of_an_impact_are_those_of_its_motion(found, name):
    impact = found["impacts"][name]
    energies, radii = impact["energies"], (R, math.inf) if name.startswith("wall") else (0.003, R)
    expected = works_of_motion(impact, radii, impact["law"])
    assert_balanced(energies)
    for part, work in expected.items():
        assert energies[part] == pytest.approx(work, rel=1e-9, abs=1e-11 * energies["scale"]), part
    # All parts act, and what damps takes.
    assert (energies["liquid_viscous"] < -1e-3 * energies["scale"] and energies["capillary"] != 0.0) == ("willett" in name)
    assert all(energies[part] < -1e-3 * energies["scale"] for part in ("normal_viscous", "tangential_elastic"))
    # The works balance, and so those of rolling are what the other parts leave.
    assert (energies["rolling_viscous"] < -1e-4 * energies["scale"]) == name.endswith(("torque", "plastic"))
    assert (energies["rolling_elastic"] < 0.0) == name.endswith("plastic") and energies["rolling_stored"] == 0.0
    assert energies["tangential_viscous"] < -1e-6 * energies["scale"] and abs(energies["normal_elastic"]) > 1e-7 * energies["scale"]


def test_spring_holds_the_energy_of_the_impact(found):
    """Head-on and elastic: half of m* v^2 is in the spring at the turning point, all comes back, and the error of the step is of second
    order."""
    coarse, fine = found["elastic"]
    energy = 0.5 * 0.5 * mass(R) * 0.5**2
    assert fine["highest"] == pytest.approx(energy, rel=1e-4)
    for case in (coarse, fine):
        end = case["end"]
        assert_balanced(end)
        assert end["normal_stored"] == 0.0
        assert end["kinetic"] == pytest.approx(end["first_kinetic"], rel=1e-3)
        assert end["first_kinetic"] == pytest.approx(0.5 * mass(R) * 0.5**2, rel=1e-14)
        assert all(abs(end[name]) < 1e-14 * end["scale"] for name in WORKS if name != "normal_elastic")
        assert end["step_error"] == pytest.approx(end["normal_elastic"], rel=1e-9, abs=1e-16)
    assert 3.5 < coarse["error"] / fine["error"] < 4.5


@pytest.mark.parametrize("name", ["dry", "wet", "damped"])
def test_collapse_of_a_column_balances(found, name):
    """Over the collapse of a column of 300 grains that a moving gate begins, compared with the work of gravity alone."""
    rows = found[name]["rows"]
    assert found[name]["grains"] == 300 and found[name]["step"] == found[name]["iter"] - 1
    assert found[name]["handed"] > 0  # contacts went from facet to facet
    falling = ["normal_viscous", "tangential_viscous"] + ["liquid_viscous"] * (name != "dry") + ["numerical_damping"] * (name == "damped")
    for before, now in itertools.pairwise([dict.fromkeys(KEYS, 0.0), *rows]):
        assert_balanced(now)
        assert abs(now["balance"]) < 1e-12 * now["gravity"]
        assert abs(now["other"]) < 1e-12 * now["gravity"] and now["imposed"] == 0.0
        for part in falling:
            assert now[part] <= before[part], part
        # A spring whose stiffness follows the overlap is no potential: before anything slips it may give a little.
        assert now["tangential_elastic"] + now["tangential_stored"] <= 1e-5 * now["gravity"]
    end = rows[-1]
    assert end["tangential_elastic"] < -0.1 * end["gravity"]
    assert end["gravity"] > 1e-3 and abs(end["walls"]) > 1e-3 * end["gravity"]
    assert all(end[part] < -1e-2 * end["gravity"] for part in falling if part != "tangential_viscous")
    assert (end["capillary"] != 0.0) == (name != "dry") and (end["numerical_damping"] != 0.0) == (name == "damped")
    # The law's own sum of what friction and its damping took, by another rule.
    lost = -(end["tangential_elastic"] + end["tangential_stored"] + end["tangential_viscous"])
    assert lost == pytest.approx(found[name]["law"], rel=0.1)


def test_error_of_the_step_falls_with_its_square(found):
    """From 40 to 20 and 10 us in the first contacts of a column."""
    sizes = [float(np.sqrt(np.mean(np.square(errors)))) for errors in found["two_steps"]]
    orders = [math.log2(a / b) for a, b in itertools.pairwise(sizes)]
    assert all(1.6 < order < 2.4 for order in orders), (sizes, orders)


@pytest.mark.parametrize("name", ["box_gate", "drum", "rolling_drum"])
def test_work_of_moving_walls(found, name):
    energies = found[name]
    assert_balanced(energies)
    assert (energies["rolling_elastic"] < -1e-3 * energies["scale"]) == (energies["rolling_viscous"] < 0.0) == name.startswith("rolling")
    assert abs(energies["walls"]) > 2e-3 * energies["scale"]
    assert abs(energies["other"]) < 1e-12 * energies["scale"] and energies["imposed"] == 0.0


def test_periodic_cell_and_carried_liquid(found):
    assert_balanced(found["periodic"])
    assert found["periodic"]["capillary"] != 0.0 and found["periodic"]["liquid_viscous"] < 0.0
    assert found["periodic"]["walls"] == 0.0
    assert_balanced(found["carried"]["energies"])
    bridges = found["carried"]["bridges"]
    assert max(bridges) > 5 and any(a > b for a, b in itertools.pairwise(bridges))
    assert found["carried"]["energies"]["liquid_viscous"] < 0.0


def test_two_threads_find_the_same_energies(yade, found):
    one, two = found["briefly"], yade.scenes("briefly", script="energy_scenes.py", threads=2)["briefly"]
    assert_balanced(two)
    for name in KEYS:
        if name not in ("balance", "other"):
            assert two[name] == pytest.approx(one[name], rel=1e-9, abs=1e-12 * one["scale"]), name


@pytest.mark.parametrize("ending", ["xml", "yade.gz", "bin"])
def test_saved_account_goes_on(found, ending):
    case = found["save_load"][ending]
    assert case["after"] == case["before"]
    for row in case.values():
        assert_balanced(row)
    assert case["straight"]["gravity"] > 1.1 * case["before"]["gravity"]
    for name in KEYS:
        if name not in ("balance", "other"):
            assert case["resumed"][name] == pytest.approx(case["straight"][name], rel=1e-9, abs=1e-12 * case["straight"]["scale"]), name


def test_a_saved_account_of_another_size_is_refused(yade):
    """It would go on from zero with the kinetic energies of its bodies, and its balance would be false."""
    line = yade.scenes("cut_ledger", script="energy_scenes.py")["cut_ledger"]
    assert line.startswith("dembark: EnergyAccount: ") and "another version of dembark" in line and "\n" not in line


def test_bodies_come_and_go(found):
    rows = found["come_and_go"]
    quiet, inserted, erased, flown, held, freed, pushed, shorter = rows
    for row in rows:
        assert_balanced(row)
    assert quiet["imposed"] == 0.0
    assert inserted["imposed"] == pytest.approx(0.5 * mass(R) * (0.01**2 + 0.02**2), rel=1e-9)
    assert erased["imposed"] < inserted["imposed"]
    assert flown["imposed"] != erased["imposed"] and held["imposed"] < flown["imposed"] and freed["imposed"] > held["imposed"]
    # Springs that come and go with bodies are no error of the step.
    held_then = inserted["normal_stored"]
    assert held_then > 1e-8 and all(abs(row["step_error"]) < 1e-3 * held_then for row in rows), rows
    assert abs(freed["other"]) < 1e-14 * freed["scale"] and pushed["other"] > 1e-9
    assert shorter["other"] > pushed["other"]


@pytest.mark.parametrize(("name", "order"), [("delValle2023", 2), ("Omelyan1998", 2), ("Fincham1992", 1)])
def test_clumps_balance_up_to_the_error_of_their_turning(found, name, order):
    """No other forces act, so works of contacts are those of members that move with their clump; only its turning is not exact. Spins of
    the oldest algorithm are half a step off."""
    worst = []
    for rows in found["clumps"][name]:
        for row in rows:
            energies = row["energies"]
            assert energies["kinetic"] == pytest.approx(row["kinetic"], rel=1e-12)
            assert abs(energies["other"]) + abs(energies["imposed"]) < 1e-12 * energies["scale"]
            assert_balanced(energies, 2e-3)
        assert all(rows[-1]["energies"][part] < -1e-3 * rows[-1]["energies"]["scale"] for part in ("normal_viscous", "tangential_elastic"))
        assert rows[-1]["energies"]["walls"] > 1e-3 * rows[-1]["energies"]["scale"]
        worst.append(max(abs(row["energies"]["balance"]) for row in rows))
    assert 0.8 * 2**order < worst[0] / worst[1] < 1.2 * 2**order


def test_clumps_that_turn_as_spheres_balance_to_round_off(found):
    for row in found["clumps"]["as spheres"]:
        assert_balanced(row["energies"])


def test_damped_and_resumed_clumps(found):
    for row in found["clumps"]["damped"]:
        assert_balanced(row["energies"], 2e-3)
        assert abs(row["energies"]["other"]) < 1e-12 * row["energies"]["scale"] and row["energies"]["numerical_damping"] < 0.0
    assert found["clumps"]["resumed"] == found["clumps"]["straight"]


def test_numbers_belong_to_the_last_step_that_is_over(found):
    """Asked within a step, before the integrator or behind it, the account is that of the step before."""
    case = found["in_a_step"]
    for where, iteration, _, balance, step in case["seen"]:
        assert step == iteration - 1 and abs(balance) < 1e-14 * case["end"]["first_kinetic"], where
    by_step = {}
    for _, iteration, kinetic, _, _ in case["seen"]:
        by_step.setdefault(iteration, set()).add(kinetic)
    assert all(len(values) == 1 for values in by_step.values()) and len({value for values in by_step.values() for value in values}) == 49
    assert case["step"] == 49
    assert_balanced(case["end"])


def test_velocities_set_and_forces_added_behind_the_account_are_told(found):
    """One grain gets 13 kicks of 1 mN for 2 us beside its 0.1 m/s, the last in the last step; the other nine times 0.01 m/s."""
    energies = found["set_in_a_step"]
    assert_balanced(energies)
    kicked = 0.1 + 13 * 1e-3 * 2e-6 / mass(R)
    assert energies["imposed"] == pytest.approx(0.5 * mass(R) * (kicked**2 - 0.1**2 + 0.09**2), rel=1e-9)
    assert energies["kinetic"] == pytest.approx(0.5 * mass(R) * (kicked**2 + 0.09**2), rel=1e-12)
    assert energies["other"] == 0.0


def test_account_begins_anew(found):
    before, zero, after = found["reset"]
    assert set(zero.values()) == {0.0}
    assert before["gravity"] != 0.0 and after["first_kinetic"] == before["kinetic"]
    for row in (before, after):
        assert_balanced(row)
    assert abs(after["step_error"]) < 1e-2 * before["normal_stored"]


def test_table_and_mapping(found):
    case = found["table"]
    header, *lines = case["text"].splitlines()
    assert header.split(",") == ["step", "time", *KEYS] and case["keys"] == KEYS
    rows = [dict(zip(header.split(","), map(float, line.split(",")), strict=True)) for line in lines]
    assert [row["step"] for row in rows] == [10, 20, 30]
    assert rows[-1]["kinetic"] > 0.0 and rows[-1]["gravity"] != rows[-2]["gravity"]
    assert case["energies"] == case["found"] == dict(case["items"])


SAID = {"no integrator": ("no NewtonIntegrator", "exactly one"), "two integrators": ("more than one NewtonIntegrator", "exactly one"),
        "before the loop": ("after InteractionLoop and before NewtonIntegrator",),
        "after the integrator": ("after InteractionLoop and before NewtonIntegrator",), "density scaling": ("densityScaling", "False"),
        "time step": ("after GlobalStiffnessTimeStepper", "changes the time step"),
        "clump": ("clump 2", "block none or all"),
        "cell": ("cell deforms", "velGrad"), "missed": ("expected step 1", "step 2", "reset()"),
        "unknown": ("'heat'", "kinetic, first_kinetic")}


@pytest.mark.parametrize("name", SAID)
def test_scene_that_cannot_be_tallied_is_refused(found, name):
    said = found["messages"][name]
    assert said.startswith("dembark: EnergyAccount") and "\n" not in said
    assert all(part in said for part in SAID[name]), said


@pytest.mark.parametrize(("name", "parts"), [
    ("other_law", ("bodies 0 and 1", "FrictPhys", "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz")),
    ("without_account", ("energies", "EnergyAccount in O.engines"))])
def test_scene_without_known_energies_ends_with_a_line(yade, found, name, parts):
    assert found["messages"]["all right"] == "nothing"
    done = yade(HERE / "energy_scenes.py", str(yade.folder / "none.json"), name)
    line = next(line for line in done.stderr.splitlines() if line.startswith("dembark: "))
    assert done.returncode == 2 and all(part in line for part in parts), done.stderr
