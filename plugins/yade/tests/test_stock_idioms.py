"""What scripts bring from YADE's own laws is served, or refused by name: nothing is set that does nothing."""

import math
from pathlib import Path

import pytest

SCENES = Path(__file__).with_name("idiom_scenes.py")


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("attributes", "words", "friction_changed", "friction_set", "materials", "foreign_engines", "time_step", "released",
                       script="idiom_scenes.py")


def test_attributes_that_do_nothing_are_refused_by_name(found):
    """Of another law, misspelt, or computed by the law in every step."""
    assert len(found["attributes"]) > 40
    for what, (kind, line) in found["attributes"].items():
        name = what.split(".")[1]
        assert kind == "AttributeError" and line.startswith("dembark: ") and "\n" not in line, (what, line)
        assert f"'{name}'" in line, line
    said = {what: line for what, (_, line) in found["attributes"].items()}
    assert "staticFriction" in said["contact.tangensOfFrictionAngle"] and "elasticDisplacement" in said["contact.shearForce"]
    assert "restitution" in said["ip2.betan"] and "rollingFriction" in said["law.includeMoment"]
    assert "EnergyAccount" in said["law.calcEnergy"]


def test_words_that_do_nothing_are_refused_when_objects_are_made(found):
    for kind, line in found["words"].values():
        assert kind == "AttributeError" and line


def test_friction_coefficients_that_the_law_does_not_read_are_refused(found):
    """setContactFriction and the triaxial engines write into the contacts; a material is read when the next contact begins."""
    assert len(found["friction_changed"]) == 30
    for how, (kind, line) in found["friction_changed"].items():
        if how.endswith("mended"):
            assert kind == "nothing", line
            continue
        assert kind == "RuntimeError" and line.startswith("dembark: ") and "\n" not in line, (how, line)
        assert "dembark.set_friction" in line and ("frictionAngle" if "material" in how else "setContactFriction()") in line, (how, line)


def test_friction_is_set_for_contacts_that_are_there_and_those_to_come(found):
    one = found["friction_set"]
    assert one["before"] == pytest.approx(0.5, rel=1e-6)
    for loop in ("stock", "short"):
        assert one[loop] == pytest.approx(0.2, rel=1e-6)
        assert one[f"{loop} other pair"] == pytest.approx(0.5, rel=1e-6)
        assert one[f"{loop} after setContactFriction"] == pytest.approx(0.2, rel=1e-6)
    assert one["pairs"] == [0.7, 0.3, 0.6, 0.1]
    assert "kinetic 0.3" in one["wrong"][1] and "no InteractionLoop" in one["no functor"][1]


def test_materials_whose_attributes_the_law_disregards_are_refused(found):
    for name, (kind, line) in found["materials"].items():
        assert kind == "RuntimeError" and f"is a {name}" in line and "FrictMat" in line, line


def test_engines_of_other_laws_are_refused(found):
    """They write into the contacts of this law as if these were their own."""
    for name, (kind, line) in found["foreign_engines"].items():
        assert kind == "RuntimeError" and line.startswith("dembark: ") and name.removesuffix(" again") in line, line


def test_damping_and_energies_beside_the_law_are_said_once(yade):
    out = yade.folder / "warned.json"
    done = yade(SCENES, str(out), "warned")
    lines = [line for line in done.stderr.splitlines() if line.startswith("WARNING: dembark: ")]
    assert len(lines) == 4, done.stderr
    assert "damping is 0.2" in lines[0] and "restitution" in lines[0] and "trackEnergy" not in lines[0]
    assert "trackEnergy" in lines[1] and "EnergyAccount" in lines[1] and "damping is" not in lines[1]
    assert "damping is 0.3" in lines[2] and "trackEnergy" in lines[2]
    assert "damping is 0.4" in lines[3]


def test_time_steppers_see_the_stiffness(found):
    """The stepper takes sqrt(2 m/k) of each degree of freedom."""
    one = found["time_step"]
    assert one["kn"] > one["ks"] > 0.0
    # The normal is z; each translation has its own stiffness.
    translation = math.sqrt(one["mass"] / one["kn"])
    rotation = math.sqrt(one["inertia"] / (one["ks"] * 0.0025**2))
    # It lengthens the step by 5 % at a time.
    assert one["step"] == pytest.approx(0.5 * math.sqrt(2.0) * min(translation, rotation), rel=0.1)
    assert one["wave"] == pytest.approx(0.0025 / math.sqrt(1e7 / 2500.0), rel=1e-9)  # of YADE's default material
    for loop in ("stock", "short"):
        kind, line = one[f"viscous {loop}"]
        assert kind == "RuntimeError" and "needs O.dt <=" in line, line


def test_bodies_that_come_or_grow_find_their_contacts(yade):
    """Larger than all before, on both loops, dry and wet."""
    scenes = yade.scenes("grown_later", "grown_on_facets", script="idiom_scenes.py")
    assert len(scenes["grown_later"]) == 20
    ends = scenes["grown_later"] | scenes["grown_on_facets"]
    for how, end in ends.items():
        assert end["missing"] == 0 and end["touching"] > 0 and end["deepest"] < 0.1, (how, end)
        assert end["count"] == {"append": 6, "factory": 6, "facet": 4, "surface": 4}.get(how.split()[-1], 3), (how, end)


def test_types_of_a_dump_are_those_of_the_moment(found):
    assert found["released"] == [["2", "1"], ["1", "1"], ["1", "2", "1"]]
