"""Liquid that grains carry: its total and where it is."""

from pathlib import Path

import numpy as np
import pytest

from dembark.input_decks.common.liquid import liquid_values
from dembark.postproc.replica import Replica


def test_carried_liquid_of_any_case(tmp_path: Path) -> None:
    steps = np.arange(1, 401)
    bridges = 0.3 + 0.01 * np.sin(steps)
    header = "step,time,kinetic_energy,base_fz,liquid_grains,liquid_bridges,liquid_walls,liquid_lost,bridge_count"
    for drift, conserved in ((0.0, True), (1e-11, False)):
        table = np.column_stack([steps, steps * 1e-3, steps * 0 + 1.0, steps * 0, (0.7 - bridges) + drift * steps, bridges,
                                 steps * 0 + 0.25, steps * 0 + 0.05, 300 + steps % 3])
        np.savetxt(tmp_path / "time.csv", table, delimiter=",", fmt="%.15g", comments="", header=header)
        run = Replica(tmp_path, {"parameters": {"liquid_content": 0.01, "grain_count": 100}})
        found = liquid_values([run])
        assert (found["liquid_total"].estimate.value < 1e-12) == conserved
        assert found["bridge_count"].estimate.value == pytest.approx(3.01, abs=0.01)
        assert found["liquid_in_bridges"].estimate.value == pytest.approx(0.3, abs=0.002)
    assert liquid_values([Replica(tmp_path, {"parameters": {"liquid_content": 0.0}})]) == {}
