"""Frames that are picked, contact forces as lines, and the view of the last frame in pictures of logs."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from dembark.postproc.pictures import sections as cross_section

HEAD = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF {}\n{}\nITEM: BOX BOUNDS ff ff ff\n-1 1\n-1 1\n-1 1\nITEM: {} "
GRAINS = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass\n"
LOG = "{} 1 {} {} 0 0 0 0 1 0 0 0 0 0 0 0 0 0.1 1\n"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Two logs that sink from y = 2 to y = 0.1 in eleven frames; at the end they touch each other and the first touches a wall."""
    grains = contacts = ""
    columns = " ".join(f"f_impacts[{i}]" for i in range(1, 14)) + "\n"
    for frame in range(11):
        y = 2.0 - 0.19 * frame
        grains += HEAD.format(frame, "ATOMS", 2, "ATOMS") + GRAINS + LOG.format(1, 0.0, y) + LOG.format(2, 0.2, y)
        rows = ["1 2 -1 0 0 0 400 0 0 0 0.1 0.1 0\n", "1 -1 0 1 0 0 100 0 0 0 0 0 0\n"] if frame == 10 else []
        contacts += HEAD.format(frame, "ENTRIES", len(rows), "ENTRIES") + columns + "".join(rows)
    (tmp_path / "grains.dump").write_text(grains)
    (tmp_path / "contacts.dump").write_text(contacts)
    return tmp_path


def test_chains_join_logs_and_reach_to_walls(run: Path) -> None:
    found = cross_section.scene(run, "xy", speed=1.0, chains=True)
    assert found.forces.tolist() == [400.0, 100.0]
    np.testing.assert_allclose(found.links, [[[0.0, 0.1], [0.2, 0.1]], [[0.0, 0.1], [0.0, 0.0]]], atol=1e-12)
    assert not len(cross_section.scene(run, "xy", speed=1.0).forces)
    axes = Figure().subplots()
    cross_section._last(axes, found)
    lines = [one for one in axes.collections if type(one).__name__ == "LineCollection"]
    assert len(lines) == 1
    wide, narrow = lines[0].get_linewidths()
    assert wide == pytest.approx(2.0 * narrow)


@pytest.mark.parametrize("point", [-1.0, 1.0, 3.0])
def test_chains_in_a_periodic_box_stay_with_the_logs_that_are_drawn(tmp_path: Path, point: float) -> None:
    """The first log has gone around twice; it touches the second across the face, a third, and the wall below. A line across the face ends
    at the contact."""
    logs = "".join(LOG.format(number, x, 0.1).replace("0 0 0 1", f"{turns} 0 0 1", 1)
                   for number, x, turns in ((1, 0.9, 2), (2, -0.9, 1), (3, 0.7, -1)))
    rows = f"1 2 -1 0 0 0 400 0 0 0 {point} 0.1 0\n3 1 -1 0 0 0 300 0 0 0 0.8 0.1 0\n1 -1 0 1 0 0 100 0 0 0 {point - 0.1} 0 0\n"
    for name, what, body in (("grains", "ATOMS", GRAINS + logs), ("contacts", "ENTRIES", " ".join("abcdefghijklm") + "\n" + rows)):
        (tmp_path / f"{name}.dump").write_text(HEAD.format(0, what, 3, what).replace("BOUNDS ff", "BOUNDS pp") + body)
    found = cross_section.scene(tmp_path, "xy", speed=1.0, chains=True)
    np.testing.assert_allclose(found.places[0, :, 0], [0.9, -0.9, 0.7])
    np.testing.assert_allclose(found.links, [[[0.9, 0.1], [1.0, 0.1]], [[0.7, 0.1], [0.9, 0.1]], [[0.9, 0.1], [0.9, 0.0]]], atol=1e-12)


def test_frames_are_picked_evenly_with_the_last(run: Path) -> None:
    assert cross_section.scene(run, "xy", speed=1.0, frames=3).times.tolist() == [0.0, 5.0, 10.0]
    for count in (0, 11, 50):
        assert len(cross_section.scene(run, "xy", speed=1.0, frames=count).times) == 11


def test_the_picture_has_no_room_for_what_has_fallen(run: Path) -> None:
    found = cross_section.scene(run, "xy", speed=1.0)
    assert found.view == pytest.approx((-0.1, 0.3, 0.0, 2.1))
    assert found.last_view == pytest.approx((-0.1, 0.3, 0.0, 0.2))
