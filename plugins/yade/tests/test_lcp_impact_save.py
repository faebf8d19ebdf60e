"""A run of LcpImpact that goes on from a saved scene is the run that was never interrupted, to the bit, with its file of impacts."""

import pytest


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("save_load", script="log_scenes.py")["save_load"]


@pytest.mark.parametrize("ending", ["xml", "yade.gz", "bin"])
def test_motion_is_the_same_to_the_bit(found, ending):
    case = found[ending]
    assert case["straight"] == case["resumed"] == case["again"]
    assert case["end"] == case["last"]
    assert case["end"]["impactsBegun"] > case["loaded"]["impactsBegun"] > 20
    assert case["end"]["dissipatedEnergy"] > case["loaded"]["dissipatedEnergy"] > 0.0


@pytest.mark.parametrize("ending", ["xml", "yade.gz", "bin"])
def test_no_impact_is_lost_or_comes_twice(found, ending):
    case = found[ending]
    assert case["twice"] == case["lines"]
    assert case["lines"].startswith(case["half"])
    lines = case["lines"].splitlines()[1:]
    assert len(lines) == len(set(lines)) > case["half"].count("\n") > 10


def test_scene_saved_in_the_middle_of_a_step_does_that_step_once(found):
    case = found["middle"]
    assert case["begin"] == 9000
    assert case["straight"] == case["resumed"]
    assert case["end"] == case["last"]


def test_settings_come_back(found):
    case = found["xml"]
    assert case["stiffness"] == 1e7
    assert case["friction"] == {"static": 0.5, "kinetic": 0.3, "slip": 1e-4, "strength": 1e30, "healing": 0.1, "area": 0.0}
    (name, stiffness, bodies, friction), other = case["walls"]
    assert (name, stiffness, bodies, friction) == ("shell", 3e7, [0], None)
    assert other[0] == "flat"
    assert other[3]["static"] == 0.1


def test_new_time_step_keeps_histories_and_totals(found):
    case = found["bin"]
    assert case["half step"]["steps"] == case["end"]["steps"] + 10
    assert case["half step"]["impactsBegun"] >= case["end"]["impactsBegun"]
    assert case["half step"]["impulseSum"] > case["end"]["impulseSum"]


def test_file_that_is_gone_is_said_in_one_line(found):
    said = found["lost"]
    assert said.startswith("dembark: LcpImpact.impactsFile: file lost.txt is not there")
    assert "\n" not in said


def test_scene_of_another_version_is_refused_with_one_line(yade):
    lines = yade.scenes("other_format", script="log_scenes.py")["other_format"]
    for number in ("0", "2"):
        found, line = lines[number]
        assert found == 1
        assert "\n" not in line
        assert "saved with another version" in line and f"LcpImpact has other attributes (format {number}, not 1)" in line
