"""The law inside YADE against the same law in Python, and kinds of walls against each other."""

import math

import numpy as np
import pytest

from dembark.physics import (
    Body,
    Contact,
    FinnieRabinowicz,
    capillary_force,
    collide,
    drop,
    effective_shear_modulus,
    effective_youngs_modulus,
    rupture_distance,
)

YOUNG, POISSON, DENSITY, STEP = 5e6, 0.3, 2500.0, 2e-6
PAIR = {"effective_youngs_modulus": effective_youngs_modulus(YOUNG, POISSON, YOUNG, POISSON),
        "effective_shear_modulus": effective_shear_modulus(YOUNG, POISSON, YOUNG, POISSON), "restitution": 0.6,
        "friction": FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.3, critical_slip_distance=1e-5)}
WET = {"bridge_volume": 2e-10, "surface_tension": 0.072, "contact_angle": 0.35}


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("plain_law", "walls", "held_sphere", "cylinder", "cylinder_fill", "periodic", "bridge", "energy", "hooke",
                       "messages",
                       "bad_values", "hostile")


def mass(radius):
    return 4.0 / 3.0 * math.pi * radius**3 * DENSITY


def assert_path(rows, motion, body, tolerance=1e-9):
    """The same positions after each step, to `tolerance` of the distance travelled; and the velocities between the steps."""
    rows, expected = np.asarray(rows), motion.position[:, body]
    scale = np.abs(expected - expected[0]).max()
    assert np.abs(rows[:, :3] - expected).max() < tolerance * scale
    between = np.diff(expected, axis=0) / STEP
    assert np.abs(rows[1:, 3:6] - between).max() < 1e-6 * np.abs(between).max()


def test_defaults_of_the_law_need_no_word(found):
    """Hertz at overlap 1e-5 m: 4/3 E* sqrt(R) overlap^(3/2)."""
    expected = 4.0 / 3.0 * PAIR["effective_youngs_modulus"] * math.sqrt(0.0025) * 1e-5**1.5
    assert found["plain_law"] == [0.0, 0.0, pytest.approx(expected, rel=1e-9)]


@pytest.mark.parametrize("wall", ["wall", "box", "facet"])
def test_drop_on_every_wall_is_that_of_python(found, wall):
    grain = Body(radius=0.0025, mass=mass(0.0025), position=(0.001, 0.0005, 0.00251), velocity=(0.3, 0.1, -0.5),
                 angular_velocity=(20, -30, 10))
    motion = drop(Contact(**PAIR, **WET, capillary_model="exact"), grain, time_step=STEP, steps=1200, gravity=(0, 0, 0))
    rows = np.asarray(found["walls"][wall]["rows"])[:, 0]
    assert_path(rows, motion, 0)
    assert found["walls"][wall]["bridges"] == 1
    # The bridge is still there, so the contact has ended but not the interaction: its loss must not be forgotten.
    assert max(step.overlap for step in motion.contacts) > 0.0 > motion.contacts[-1].overlap
    assert found["walls"][wall]["dissipated"] > 0.0


def test_held_sphere_has_its_radius_and_no_mass(found):
    """A free sphere against a held one, which is either body of the interaction; Python gets a mass beyond any."""
    free = Body(radius=0.003, mass=mass(0.003), velocity=(0.2, 0.1, 0.0), angular_velocity=(0, 5, 30))
    held = Body(radius=0.0025, mass=1e30, position=(0.0056, 0.0005, 0.0))
    motion = collide(Contact(**PAIR), free, held, time_step=STEP, steps=900)
    assert max(step.overlap for step in motion.contacts) > 1e-5
    for rows in found["held_sphere"]:
        assert_path(np.asarray(rows)[:, 0], motion, 0)


def test_hooke_is_that_of_python(found):
    grain = Body(radius=0.0025, mass=mass(0.0025), position=(0, 0, 0.00251), velocity=(0, 0, -0.5))
    motion = drop(Contact(**PAIR, normal_law="hooke", characteristic_velocity=0.5), grain, time_step=STEP, steps=1500, gravity=(0, 0, 0))
    rows = np.asarray(found["hooke"]["rows"])[:, 0]
    assert_path(rows, motion, 0)
    # A linear contact keeps its coefficient of restitution.
    assert rows[-1, 5] / 0.5 == pytest.approx(PAIR["restitution"], rel=0.02)


def test_cylinder_is_a_plane_at_the_contact(found):
    """A wall's effective radius is the grain's: force and torque are those of a plane wall that moves as the cylinder does in the middle
    of the overlap, where friction acts."""
    flat = found["cylinder"]["flat"]
    for case in ("upright", "turned"):
        for mine, plane in zip(found["cylinder"][case], flat, strict=True):
            assert mine == pytest.approx(plane, rel=1e-9, abs=1e-12)
    assert flat[0][0] < 0.0 and abs(flat[0][1]) > 1e-3 and abs(flat[0][2]) > 1e-3


def test_no_friction_on_a_grain_that_turns_with_the_cylinder(found):
    """Motion as one rigid body strains no contact, whatever the overlap."""
    force, torque, _, _ = found["cylinder"]["rigid"]
    assert force[0] < 0.0
    assert np.abs(force[1:]).max() < 1e-12 * abs(force[0]) and np.abs(torque).max() < 1e-12 * 0.0025 * abs(force[0])


def test_grains_stay_in_the_cylinder(found):
    """Elastic, frictionless grains between curved walls keep their energy, and no overlap exceeds the speed's."""
    fill = found["cylinder_fill"]
    assert fill["end"] == pytest.approx(fill["begin"], rel=2e-3)
    # Hertz: all the energy of one grain at 1.5 times the common speed, 4/3 * 2/5 E* sqrt(R) overlap^(5/2), along the normal.
    radius = 0.003
    limit = (0.5 * mass(radius) * 1.2**2 / (8.0 / 15.0 * PAIR["effective_youngs_modulus"] * math.sqrt(radius))) ** 0.4
    assert 0.0 < fill["out"] < limit


def test_pair_across_a_periodic_face_is_a_free_pair(found):
    free = np.asarray(found["periodic"]["free"])
    assert np.abs(free[-1, 0, 3:6] - free[0, 0, 3:6]).max() > 0.1
    for images in ((0, 0), (2, -3)):
        rows = np.asarray(found["periodic"][f"periodic {images}"])
        moved = rows[:, :, :3] - rows[0, :, :3] + free[0, :, :3]
        assert np.abs(moved - free[:, :, :3]).max() < 1e-9 * np.abs(free[:, :, :3] - free[0, :, :3]).max()
        assert np.abs(rows[:, :, 3:] - free[:, :, 3:]).max() < 1e-8 * np.abs(free[:, :, 3:]).max()


@pytest.mark.parametrize("kind", ["pair", "wall", "box", "facet", "cylinder"])
def test_bridge_forms_at_touch_and_breaks_at_the_rupture_distance(found, kind):
    radii = 0.0025, 0.002 if kind == "pair" else math.inf
    rupture = rupture_distance(WET["bridge_volume"], WET["contact_angle"], *radii, model="exact")
    rows = found["bridge"][kind]
    touched = False
    for gap, force, bridges, stored, capillary in rows:
        touched = touched or gap < 0.0
        holds = touched and gap <= rupture
        assert bridges == int(holds), gap
        if not holds:
            assert force == 0.0
            continue
        assert stored == pytest.approx(rupture, rel=1e-9)
        pull = capillary_force(*radii, gap, WET["bridge_volume"], WET["surface_tension"], WET["contact_angle"], model="exact")
        assert capillary == pytest.approx(pull, rel=1e-9)
        if gap > 0.0:
            assert force == pytest.approx(-pull, rel=1e-9)
    assert sum(row[2] for row in rows) > 10


def test_energy_lost_is_what_the_law_reports(found):
    """A grain set down sliding ends rolling: the kinetic energy that is missing was dissipated, and the speed is 5/7 of the first."""
    e = found["energy"]
    assert e["begin"] - e["end"] == pytest.approx(e["lost"], rel=1e-3)
    assert e["speed"] == pytest.approx(0.5 * 5.0 / 7.0, rel=0.01)
    assert e["spin"] == pytest.approx(e["speed"], rel=0.01)


def test_two_threads_find_the_same_forces(yade):
    """All contacts are new in one step, so both threads want the bridge's force law while it is being built."""
    forces = yade.scenes("many", threads=2)["many"]
    single = 4.0 / 3.0 * PAIR["effective_youngs_modulus"] * math.sqrt(0.00125) * 5e-5**1.5
    pull = capillary_force(0.0025, 0.0025, 0.0, WET["bridge_volume"], WET["surface_tension"], WET["contact_angle"], model="exact")
    assert forces == pytest.approx([pull - single] * 144, rel=1e-9)


def test_wrong_words_name_attribute_and_choices(found):
    said = found["messages"]
    for message, parts in zip(said, (("normalLaw", "'herz'", "hertz or hooke"),
                                     ("presliding", "'bent'", "linear, exponential or partial_slip"),
                                     ("frictionLimit", "'viscous'", "total or elastic"),
                                     ("capillaryModel", "'wet'", "none, exact"), ("CylinderWall.radius", "> 0 m"),
                                     ("CylinderWall.axis", "not zero")), strict=True):
        assert message.startswith("dembark: ") and "\n" not in message
        assert all(part in message for part in parts), message


def test_each_wrong_number_is_told(found):
    """One line that names what is wrong, for wrong, missing and infinite values and those that are no numbers."""
    for case, said in found["bad_values"].items():
        name = case.split()[0]
        assert said.startswith("dembark: ") and "\n" not in said, (case, said)
        assert name.lower() in said.lower().replace(" ", ""), (case, said)


@pytest.mark.parametrize("scene", ["erased", "on_top_of_a_bridge", "crowd"])
def test_hostile_scenes_run(found, scene):
    assert found["hostile"][scene] == [0, ""], found["hostile"][scene]


@pytest.mark.parametrize("scene", ["no_number", "coincident"])
def test_what_has_no_finite_force_ends_with_a_line(found, scene):
    """A velocity that is no number, and coincident centres, which have no normal."""
    code, said = found["hostile"][scene]
    assert code == 1 and said.count("\n") == 0
    assert "has no finite force" in said and "bodies 0 and 1" in said
