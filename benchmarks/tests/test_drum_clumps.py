"""The drum of logs of soft spheres: its logs, its step, its overlaps, and the engine against what is known."""

import math

import numpy as np
import pytest

from benchmarks import drum_capsules, drum_clumps
from dembark.common.errors import DembarkError
from dembark.validation import engines


@pytest.mark.parametrize("spacing", [1.0, 0.5])
def test_rods_reach_from_cap_to_cap(spacing: float) -> None:
    r, length, _ = drum_capsules.logs(40)
    along, member = drum_clumps.rods(40, spacing)
    for k in range(40):
        own = along[member == k]
        assert (own.min(), own.max()) == pytest.approx((-0.5 * length[k], 0.5 * length[k]))
        assert 0.5 * spacing * r[k] < np.diff(own).max() <= spacing * r[k] * (1 + 1e-9)
        np.testing.assert_allclose(np.diff(own), np.diff(own)[0])


def test_a_step_is_a_seventeenth_of_the_contact_of_two_logs_side_by_side() -> None:
    """By integration: two of the thinnest logs, as many springs as they have spheres."""
    r, _, mass = drum_capsules.logs(300)
    thin = np.argsort(mass)[:2]
    springs = min(np.bincount(drum_clumps.rods(300, 1.0)[1])[thin])
    step, x, v, time = 1e-7, 0.0, 1.0, 0.0
    while x >= 0.0:
        v -= step * 0.5 * drum_clumps.PAIR * springs * x * (1 / mass[thin]).sum()
        x += step * v
        time += step
    assert drum_clumps.step_of(300, 1.0, 0.5) == pytest.approx(time / 17, rel=1e-3)
    assert r[thin].max() < 0.052


def test_the_deepest_overlap_of_each_pair_of_logs() -> None:
    """Two rods side by side that overlap by 1 mm at one end and 2 mm at the other, and one that touches nothing."""
    z = np.linspace(0.0, 1.0, 5)
    rods = [np.column_stack([np.full(5, x), 0.0 * z, z]) for x in (0.0, 0.199, 0.5)]
    rods[1][:, 0] -= 1e-3 * z
    found = drum_clumps.deepest(np.concatenate(rods), np.full(15, 0.1), np.repeat([0, 1, 2], 5))
    assert found == pytest.approx([2e-3])
    assert len(drum_clumps.deepest(rods[0], np.full(5, 0.1), np.zeros(5, int))) == 0


def test_models_start_at_the_same_places() -> None:
    """In LAMMPS and in Python logs fall freely; the centre of mass keeps its distance from the axis, and nothing touches."""
    try:
        engines.find("lammps")
    except DembarkError as error:
        pytest.skip(str(error))
    _, _, mass = drum_capsules.logs(150)
    capsules = drum_clumps.impacts(drum_capsules.space(150, None), mass, 0.01, 0.02)
    rods = drum_clumps.clumps(150, 1.0, 0.5, 0.01, 0.02)
    assert rods["arm"][0] == pytest.approx(capsules["arm"][0], abs=1e-6)
    assert rods["tilt"][0] == capsules["tilt"][0] == pytest.approx(0.0, abs=1e-5)
    assert rods["points"][0] == capsules["points"][0] == 0.0
    assert rods["spheres"] == len(drum_clumps.rods(150, 1.0)[0])
    assert math.isclose(rods["s_per_second"], 1e-3 * rods["ms_per_step"] / rods["step"])
