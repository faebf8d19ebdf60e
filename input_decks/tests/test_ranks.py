"""Two ranks share the grains where the upper part of the box is empty, and how they share it changes no more than round-off."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.postproc import GrainsDump

HOPPER = {"grain_count": 150, "bin_width": 0.03, "outlet_width": 0.0134, "settle_time": 0.06, "discharge_time": 0.02, "frames": 10,
          "fall": 0.1}
BED = {"plate_width": 0.15, "outlet_width": 0.03, "fill_height": 0.03, "confinement": 0.34, "settle_time": 0.04, "discharge_time": 0.02}
DRUM = {"drum_radius": 0.03, "drum_speed": 4.0, "solid_filling": 0.15, "run_in": 0.05, "measure_time": 0.01, "frames": 10}
GRID = re.compile(r"^processors .*\n", re.MULTILINE)
LINE = re.compile(r"^Nlocal: +(\S+) ave +(\S+) max", re.MULTILINE)


@pytest.mark.parametrize(("case", "engine", "values"), [
    ("hopper_discharge", "liggghts", HOPPER), ("hopper_discharge", "lammps", HOPPER),
    *(pytest.param(case, engine, values, marks=pytest.mark.full) for engine in ("liggghts", "lammps")
      for case, values in (("angle_of_repose", BED), ("rotating_drum", DRUM)))])
def test_two_ranks_share_the_grains_and_change_no_more_than_round_off(case: str, engine: str, values: dict[str, Any], decks: Any,
                                                                      tmp_path: Path) -> None:
    frames, imbalance = {}, {}
    for name, ranks in (("one", 1), ("shared", 2), ("by the engine", 2)):
        run = decks(case, engine, tmp_path / name, values)
        deck = run.folder / run.engine.facts.deck
        if name == "by the engine":
            deck.write_text(GRID.sub("", deck.read_text()))
        mean, most = map(float, LINE.findall(run.run(ranks))[-1])
        frames[name], imbalance[name] = list(GrainsDump(run.folder / "grains.dump")), most / mean
    assert imbalance["shared"] <= min(1.2, imbalance["by the engine"])
    # A tall box is cut at half of its height, where there are no grains above.
    assert imbalance["by the engine"] > 1.5 or case != "hopper_discharge"
    for name in ("shared", "by the engine"):
        for a, b in zip(frames["one"], frames[name], strict=True):
            assert np.abs(a.positions - b.positions).max() < 1e-9 * np.ptp(a.positions)
            assert np.abs(a.velocities - b.velocities).max() < 1e-6 * np.abs(a.velocities).max()
