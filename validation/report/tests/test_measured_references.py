"""A measured reference is drawn as points with their intervals, a theory as a line; the table has both."""

import numpy as np
import pytest

from dembark.postproc.resampling import profile
from dembark.validation.report.figures import profile_figure, profile_table

PLACE, VALUE = np.array([1.0, 2.0, 4.0]), np.array([0.5, 0.6, 0.7])


@pytest.mark.parametrize("upward", [False, True])
def test_intervals_of_a_measured_reference_are_drawn(upward: bool) -> None:
    one = profile("e_t", "Restitution", "angle", "e_t", PLACE, [VALUE], vertical=upward, reference=VALUE + 0.1,
                  reference_half=np.array([0.01, 0.02, 0.03]), reference_label="measured")
    axes = profile_figure({"liggghts": [one], "yade": [one]}, ["e_t"]).axes[0]
    reference, *engines = axes.lines
    assert reference.get_linestyle() == "None" and reference.get_marker() == "o" and len(engines) == 2
    (bars,) = axes.collections
    ends = np.array(bars.get_segments())[:, :, 0 if upward else 1]
    np.testing.assert_allclose(np.diff(ends).ravel(), [0.02, 0.04, 0.06])
    header, rows = profile_table({"liggghts": one})
    assert dict(zip(header, rows[2], strict=True)) == pytest.approx(
        {"engine": "liggghts", "place": 4.0, "value": 0.7, "low": None, "high": None, "reference": 0.8, "reference_low": 0.77,
         "reference_high": 0.83})


def test_a_theory_stays_a_line() -> None:
    one = profile("e_t", "Restitution", "angle", "e_t", PLACE, [VALUE], reference=VALUE)
    axes = profile_figure({"liggghts": [one]}, ["e_t"]).axes[0]
    assert axes.lines[0].get_marker() == "None" and not axes.collections and "reference_low" not in one
