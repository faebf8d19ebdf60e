"""Saving and loading a scene in the middle of sliding, wet contacts."""

import re
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="module", params=["save_load", "save_load_partial_slip"])
def found(yade, request):
    return yade.scenes(request.param)[request.param]


@pytest.mark.parametrize("ending", ["xml", "xml.gz", "yade.gz", "bin"])
def test_state_of_contacts_is_the_same_to_the_bit(found, ending):
    before, after = found[ending]["before"], found[ending]["after"]
    assert len(before) >= 4
    assert before == after
    slips = [float.fromhex(state["slip"]) for state in before.values()]
    assert max(slips) > 0.0
    assert any(float.fromhex(state["bridgeVolume"]) > 0.0 for state in before.values())
    assert found[ending]["lost"][1] == found[ending]["lost"][0] > 0.0
    assert found[ending]["model"][0] == "exact"
    assert found[ending]["model"][1] >= 4


@pytest.mark.parametrize("ending", ["xml", "xml.gz", "yade.gz", "bin"])
def test_loaded_run_goes_on_as_the_straight_one(found, ending):
    straight, resumed = np.asarray(found[ending]["straight"]), np.asarray(found[ending]["resumed"])
    assert np.abs(resumed - straight).max() < 1e-10 * np.abs(straight).max()


def test_partial_slip_and_rolling_are_saved(yade):
    """Rings that hold load, of which a linear contact has none, and springs that rolling has turned."""
    for scene, rings in (("save_load_partial_slip", 21), ("save_load", 0)):
        states = yade.scenes(scene)[scene]["bin"]["after"].values()
        assert {len(state["slipRings"]) for state in states} == {rings}
        assert not rings or any(float.fromhex(number) != 0.0 for state in states for number in state["slipRings"][:16])
        assert any(float.fromhex(number) != 0.0 for state in states for number in state["rollingAngle"]) == bool(rings)


def test_scenes_of_other_versions_are_refused_with_one_line(yade):
    for name, (found, line) in yade.scenes("other_formats")["other_formats"].items():
        assert found == 1, name
        assert line.startswith(f"the scene was saved with another version of dembark, whose {name} has other attributes"), line
        assert "\n" not in line


def test_each_class_that_a_scene_holds_has_a_format_and_refuses_unknown_attributes():
    """Classes without attributes of their own need no format; a DembarkSnapshot is in no scene."""
    text = "".join(path.read_text() for path in sorted(Path(__file__).parents[1].glob("*.[ch]pp")))
    classes = re.findall(r"YADE_CLASS_BASE_DOC\w*\((\w+),(.*?)\n\t// clang-format on", text, re.DOTALL)
    assert len(classes) > 15
    for name, body in classes:
        assert "DEMBARK_REFUSES_UNKNOWN_ATTRIBUTES" in body or body.startswith("LcpImpact,"), name
        if "\n\t\t((" in body and name != "DembarkSnapshot":
            assert f"DEMBARK_SAVED_FORMAT({name}, " in text, name
