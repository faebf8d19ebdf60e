"""The deck of docs/how-to/cases.md with glued grains and a wall of a mesh runs in LIGGGHTS and LAMMPS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from blocks import blocks, built

from dembark.postproc import GrainsDump, read_times
from dembark.validation.cli import main

SETUP = '''
import numpy as np
from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Setup, contacts, rows_and_frames, time_step

def setup(p):
    d, half = p.grain_diameter, 0.03
    grains = packing.grains(p, packing.cylinder(2.2 * d, 1.2 * d, 0.06, 8), [(-half, half), (-half, half), (-d, 0.12)])
    x, y = np.meshgrid(*[1.05 * d * np.arange(-4, 5)] * 2)
    floor = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.5 * d)], 1)
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    low, high = (np.stack([r * np.cos(turn), r * np.sin(turn), np.full(25, z)], 1) for r, z in ((2.0 * d, 2.2 * d), (5.0 * d, 0.11)))
    funnel = np.concatenate([np.stack([low[:-1], low[1:], high[1:]], 1), np.stack([low[:-1], high[1:], high[:-1]], 1)])
    step = time_step(p)
    numbers = rows_and_frames(step, 0.0, p.settle_time, p.frames)
    return Setup(numbers["steps"], step, grains.joined(floor, d, p.grain_density, 2), {**numbers, **contacts(p)}, meshes={"funnel": funnel})
'''


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_glued_grains_below_a_funnel(engine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built(engine)
    (block,) = blocks("template")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DEMBARK_CASES", str(tmp_path))
    assert main(["new-case", "heap", "--template", "packing"]) == 0
    case = Path("heap")
    (case / "deck.in").write_text(block.text)
    (case / "setup.py").write_text(SETUP)
    assert main(["run", "heap", "--engine", engine, "--set", "replicas=1", "--set", "grain_count=40", "--set", "settle_time=0.15 s",
                 "--out", "out"]) == 0
    frame = list(GrainsDump(tmp_path / "out/replica-1/grains.dump"))[-1]
    glued = frame.types == 2
    assert glued.sum() == 81 and not frame.velocities[glued].any()
    times = read_times(tmp_path / "out/replica-1/time.csv")
    assert times["floor_fz"].any() and times["funnel_fz"].any()
    assert np.isfinite(frame.positions).all() and frame.positions[~glued][:, 2].min() > 0.0
