"""The benchmark of hard grains counts events, and its gas rises as that of `drive_power` does in LIGGGHTS."""

import numpy as np
import pytest

from benchmarks import hard_grains


def test_speed_is_printed_for_three_sizes(capsys):
    assert hard_grains.main(["speed", "--events", "2e4"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["1000", "4096", "10648"]
    assert all(float(line.split()[2]) > 0.0 for line in lines)


def test_a_gas_rises_as_in_a_soft_engine():
    """LIGGGHTS: 3.62 d, with an interval of 0.06 d; single packings of hard grains scatter by 0.09 d."""
    values = [hard_grains.rise(16.0, seed, 0.27, 0.0, 1e-5) for seed in range(6)]
    assert np.mean(values) == pytest.approx(3.62, abs=0.15)
    # Negative control: nearly smooth grains.
    assert hard_grains.rise(16.0, 0, 0.27, -0.6, 1e-5) > 4.0


def test_the_interval_is_printed(capsys):
    assert hard_grains.main(["plate", "--packings", "2", "--gamma", "12"]) == 0
    assert capsys.readouterr().out.startswith("rise ")
