"""Frames by the phase of a drive: known motions are measured as they are, and incomplete windows are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dembark.input_decks.common.drive_phases import cell_means, read_phases
from dembark.input_decks.common.vibration import PHASES
from dembark.postproc import DumpError, GrainsDump
from dembark.postproc.tests.dumps import grains_text

PERIOD, STEP = 80, 1e-4
SHAKE, DRIFT = 0.01, np.array([0.003, 0.0, -0.001])


def dump(folder: Path, numbers: range, *, lost: int = -1, off: int = 0) -> GrainsDump:
    """Two grains that shake along z with the drive and drift a little in each period; grain 2 is not there in frame `lost`."""
    text = []
    for k in numbers:
        place = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]) + DRIFT * k / PHASES
        place[:, 2] += SHAKE * np.sin(2.0 * np.pi * k / PHASES)
        count = 1 if k == lost else 2
        text.append(grains_text(k * PERIOD // PHASES + off, place[:count], np.full(count, 0.0025)))
    (folder / "grains.dump").write_text("".join(text))
    return GrainsDump(folder / "grains.dump")


def test_frames_are_sorted_by_phase_and_the_shaking_cancels(tmp_path: Path) -> None:
    run = read_phases(dump(tmp_path, range(8, 33)), PERIOD, STEP)
    assert run.period == pytest.approx(8e-3) and run.phases.tolist() == [*range(8)] * 3 + [0]
    assert [frame.step for frame in run.at(2)] == [100, 180, 260]
    np.testing.assert_allclose(run.displacements(), np.broadcast_to(DRIFT, (17, 2, 3)), atol=1e-9)


def test_cell_means_are_weighted() -> None:
    place, edges = np.array([[0.1], [0.2], [0.7]]), [np.array([0.0, 0.5, 1.0])]
    np.testing.assert_allclose(cell_means(np.array([1.0, 4.0, 7.0]), place, np.array([2.0, 1.0, 1.0]), edges), [2.0, 7.0])


@pytest.mark.parametrize(("change", "message"), [
    ({"numbers": range(8, 33), "off": 1}, "an eighth of the period"), ({"numbers": range(8, 33, 2)}, "they must be 10 steps apart"),
    ({"numbers": range(8, 33), "lost": 20}, "grains come or go"), ({"numbers": range(0)}, "no frame"),
])
def test_windows_that_are_not_whole_are_refused(tmp_path: Path, change: dict, message: str) -> None:
    with pytest.raises(DumpError, match=message):
        read_phases(list(dump(tmp_path, **change)) if change["numbers"] else [], PERIOD, STEP)


def test_periods_without_eighths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="multiple of 8"):
        read_phases(dump(tmp_path, range(8, 17)), 81, STEP)
