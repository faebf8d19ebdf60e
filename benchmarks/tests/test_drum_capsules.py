"""The drum of logs in space: its filling, its starts, and what is measured on a motion that is known."""

import math

import numpy as np
import pytest

from benchmarks import drum_capsules as drum
from dembark.common.errors import DembarkError


def test_logs_fill_the_drum_as_said() -> None:
    r, length, mass = drum.logs(300)
    assert (length + 2 * r == pytest.approx(drum.TOTAL))
    volume = math.pi * r**2 * length + 4 / 3 * math.pi * r**3
    assert mass == pytest.approx(drum.DENSITY * volume)
    assert volume.sum() / (math.pi * drum.RADIUS**2 * drum.drum_length(300)) == pytest.approx(drum.FILLING)
    assert 6.5 < np.mean(drum.TOTAL / (2 * r)) < 7.6


@pytest.mark.parametrize("slope", [None, 2.0])
def test_free_fall_along_the_slope(slope: float | None) -> None:
    """Starts without overlap, and before anything touches the speed along the drum is that of the slope."""
    motion = drum.space(150, slope).run(0.01, drum.STEP, every=5)
    fall = drum.GRAVITY * math.sin(math.radians(slope or 0.0))
    found = drum.along(motion)
    assert found["axial_speed"][0] == pytest.approx(0.5 * fall * 0.01, abs=1e-9)
    assert found["tilt"][0] == pytest.approx(0.0, abs=1e-6)


def test_as_many_discs_as_logs_start_without_overlap() -> None:
    discs, speed = drum.section(100)
    motion = discs.run(2e-4, drum.STEP)
    assert motion.report["active"].max() == 0
    assert speed <= drum.SPEED * 1.1
    radius = math.sqrt(float((drum.logs(100)[0] ** 2).sum()) / drum.FILLING)
    assert speed**2 * radius == pytest.approx(drum.SPEED**2 * drum.RADIUS)


def test_debarking_counts_the_impacts_of_a_motion() -> None:
    """Of logs that have fallen on the shell and on each other: the sums over all impacts, worked out one by one."""
    r, _, mass = drum.logs(150)
    motion = drum.space(150, None).run(1.4, drum.STEP, every=100)
    found = drum.debarked(motion, r, mass, drum.SPEED)
    quarters = int((motion.time[-1] - motion.time[0]) * drum.SPEED / (2 * math.pi) * 4 + 1e-6)
    inside = [i for i in motion.impacts if i.time < quarters * math.pi / (2 * drum.SPEED)]
    hits = sum(1 + (i.b >= 0) for i in inside if i.relative_speed >= drum.SLOWEST and drum.RANGE.bark <= i.peak_force <= drum.RANGE.wood)
    assert quarters == 1 and hits > 20
    assert found["useful_impacts"][0] == pytest.approx(4 * hits / 150)
    area = 2 * math.pi * r.sum() * drum.TOTAL
    assert found["friction_work"][0] == pytest.approx(4 * sum(i.friction_loss for i in inside) / area)


def test_too_many_logs_are_refused() -> None:
    with pytest.raises(ValueError, match="1000 logs do not fit into the drum"):
        drum.places(1000, 1.0, 2)


def test_intervals_are_those_of_quarters_of_a_revolution() -> None:
    mean, half = drum.interval(np.repeat([1.0, 3.0], drum.SAMPLES // 2))
    assert mean == pytest.approx(2.0)
    assert half == pytest.approx(3.182 * math.sqrt(4 / 3) / 2, rel=1e-3)


@pytest.mark.parametrize("in_space", [True, False])
def test_the_drum_in_yade_is_that_of_python(*, in_space: bool) -> None:
    """Until logs have met logs and the shell."""
    try:
        cost, place = drum.in_yade(150, 1500, in_space=in_space)
    except DembarkError as error:
        pytest.skip(str(error))
    motion = (drum.space(150, None) if in_space else drum.section(150)[0]).run(1500 * drum.STEP, drum.STEP, every=1500)
    assert motion.report["impacts_begun"][-1] > 20
    assert place[:, : motion.position.shape[2]] == pytest.approx(motion.position[-1], abs=1e-8)
    assert cost > 0.0
