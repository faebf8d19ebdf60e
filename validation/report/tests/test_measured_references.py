"""A measured reference is drawn as points with their intervals, a theory as a line; other codes are not taken for the engines."""

import numpy as np
import pytest

from dembark.postproc.resampling import profile
from dembark.validation.judge import result
from dembark.validation.judge.comparison import compare
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.report import sections
from dembark.validation.report.figures import profile_figure, profile_table
from dembark.validation.report.gather import gather

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


def test_other_codes_and_engines_are_told_apart(tmp_path) -> None:
    place = tmp_path / "single_contact/test_4"
    for engine in ("liggghts", "yade"):
        record = QuantityRecord("published_spin", 1.0, "fail", "spin", reference=2.0, deviation=-0.5, tolerance=0.1, evidence="code",
                                agreement=1e-9)
        (place / engine).mkdir(parents=True)
        result.write(place / engine / result.METRICS, Result("single_contact", "test_4", engine, (record,), "quick"))
    result.write(place / result.COMPARISON, compare(place))
    (found,) = [one for one in sections.sections(gather(tmp_path), tmp_path) if one.case == "single_contact"]
    assert [(one.kind, one.standing) for one in found.checks] == [("code", "failed"), ("agreement of the engines", "passed")]
