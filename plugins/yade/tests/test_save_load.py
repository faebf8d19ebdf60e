"""Saving and loading a scene in the middle of sliding, wet contacts."""

import numpy as np
import pytest


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("save_load")["save_load"]


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
