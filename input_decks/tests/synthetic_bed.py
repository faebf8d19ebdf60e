"""A bed in a vibrated trough with a known motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.common.drive_phases import read_phases
from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.common.vibratory_trough import Trough
from dembark.postproc import GrainsDump
from dembark.postproc.tests.dumps import grains_text

D, STEPS, STEP, PERIODS = 0.005, 800, 1e-4, 12
PERIOD = STEPS * STEP


def trough(folder: Path, *, turning: float = 0.5, noise: float = 0.0, part: bool = True, still: bool = False) -> Trough:
    """A disc of grains that turns as a body about a centre which shakes; its last body is the part, `still` or carried along."""
    random = np.random.default_rng(4)
    side = np.arange(-8, 9) * D
    x, z = (axis.ravel() for axis in np.meshgrid(side, side))
    inside = np.hypot(x, z) < 8.0 * D
    start = np.column_stack([x[inside], np.zeros(inside.sum()), z[inside]])
    if part:
        start = np.vstack([start, [3.3 * D, 0.0, 0.0]])
    text, wander = [], np.zeros_like(start)
    for k in range(PHASES * PERIODS + 1):
        angle = turning * k / PHASES * PERIOD
        turned = np.column_stack([start[:, 0] * np.cos(angle) + start[:, 2] * np.sin(angle), start[:, 1],
                                  start[:, 2] * np.cos(angle) - start[:, 0] * np.sin(angle)])
        wander += noise * random.standard_normal(wander.shape) * [1, 0, 1]
        place = turned + wander + 0.002 * np.array([np.sin(2 * np.pi * k / PHASES), 0.0, np.cos(2 * np.pi * k / PHASES)])
        if still:
            place[-1] = start[-1]
        text.append(grains_text(k * STEPS // PHASES, place, np.full(len(place), 0.5 * D)))
    (folder / "grains.dump").write_text("".join(text))
    run = read_phases(GrainsDump(folder / "grains.dump"), STEPS, STEP)
    time = np.arange(PERIODS * 128 + 1) * PERIOD / 128
    weight = 9.81 * float(run.frames[0].masses.sum())
    rows: dict[str, Any] = {"time": time, "trough_work": 0.3 * weight * 0.25 * time, "trough_jx": 0.0 * time, "trough_jy": 0.0 * time}
    rows["trough_jz"] = weight * (time + 0.5 * PERIOD / (2 * np.pi) * np.sin(2 * np.pi * time / PERIOD))
    return Trough(run, len(start) - 1 if part else -1, rows, weight, 0.25, D)
