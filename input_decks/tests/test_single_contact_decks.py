"""The decks of single_contact do the same, which is what the contact law demands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dembark.common.files import check_times, count_frames
from dembark.input_decks.single_contact.impacts import read
from dembark.input_decks.tests.measuring import module
from dembark.physics.exact.contact_law import stepped
from dembark.postproc import GrainsDump
from dembark.validation.case.folders import find

impacts = module("single_contact").impacts
ENGINES = find("single_contact").engines
# Their decks write states to resume from.
RESUMED = ("liggghts", "yade", "lammps")
SCENES: dict[str, dict[str, Any]] = {
    "test_3": {"time_step": 1e-7, "duration": 4e-5},
    "test_4": {"points": 2, "sweep_from": 20.0, "sweep_to": 60.0, "time_step": 1e-7},
    "test_6": {"points": 3, "time_step": 1e-5},
    "test_7": {"points": 2, "time_step": 1e-5},
    "test_8_b": {"points": 3, "time_step": 1e-5},
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scene", SCENES)
def test_every_sphere_does_what_the_law_demands_in_this_scheme(scene: str, engine: str, simulate: Any) -> None:
    """Material, restitution coefficient, partner and start of each one: the scheme, written down again, says where each ends."""
    run = simulate("single_contact", engine, SCENES[scene], scene)
    folder, p = run.folder, run.parameters
    one = impacts(p)
    assert count_frames(folder / "grains.dump", "ATOMS") == p["frames"]
    assert check_times(folder / "time.csv") >= 200
    frame = GrainsDump(folder / "grains.dump")[0]
    np.testing.assert_allclose(frame.masses[np.argsort(frame.ids)][: len(one)], one.mass[0], rtol=1e-12)
    due = stepped(one, p["time_step"], p["lead_steps"] % 1.0, p["duration"])
    flight = read(run, one, p["lead_steps"] * p["time_step"])
    after = flight.after
    for value, wanted in ((after.normal, due.normal), (after.slide, due.slide), (one.arm * after.spin, one.arm * due.spin)):
        np.testing.assert_allclose(value / one.closing, wanted / one.closing, rtol=0.0, atol=1e-10)
    # The flights before and after are free of forces.
    assert flight.overlaps[-1].max() < 0.0
    assert np.abs(flight.forces[[0, -1]]).max() == 0.0
