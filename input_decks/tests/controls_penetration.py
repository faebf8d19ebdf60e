"""Wrong physics in what is written of a ball that follows the mean of the published heights."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from dembark.input_decks.tests.measuring import Control, Verdicts, defaults, judged, module

penetration = module("penetration")
TOUCH, START = 0.0215, 0.018  # s


def bed(height: float) -> Any:
    """A frame with as many grains as the published bed has in the box of the case, filled `height` times as high."""
    p, known = defaults("penetration"), penetration.published()
    whole = known["bed_height"][0]
    grain = np.pi / 6.0 * p["grain_diameter"] ** 3
    count = round(known["solid_fraction"][0] * p["box_length"] * p["box_width"] * whole / grain)
    up = p["floor"] + height * whole * (np.arange(count) + 0.5) / count
    return SimpleNamespace(ids=np.ones(count, dtype=int), positions=np.stack([0.0 * up, 0.0 * up, up], axis=1),
                           radii=np.full(count, 0.5 * p["grain_diameter"]))


def ball(*, gravity: float = 1.0, depth: float = 1.0, duration: float = 1.0, rebound: float = 1.0, height: float = 1.0) -> Verdicts:
    """What the case measures of three packings; each argument is a factor that is 1 for the published heights."""
    p = defaults("penetration")
    table = np.loadtxt(penetration.REFERENCE / "dosta_2024_height.csv", delimiter=",", skiprows=1)
    time = np.arange(START, 0.0451, 1e-5)

    def free(at: Any, g: float) -> Any:
        return p["ball_height"] - p["ball_speed"] * at - 0.5 * g * at**2

    after = np.interp(TOUCH + (time - TOUCH) / duration, table[:, 0], table[:, 1])
    touched = free(TOUCH, p["gravity"])
    after = touched + depth * (after - touched)
    lowest = int(np.argmin(after))
    after[lowest:] = after[lowest] + rebound * (after[lowest:] - after[lowest])
    path = np.where(time < TOUCH, free(time, gravity * p["gravity"]), after)
    frame, derived = bed(height), {"start": START, "first": int((time < TOUCH).sum())}

    def written(shift: float) -> Any:
        rows = {"step": 1 + np.arange(len(time)), "time": time - START, "ball_height": path + shift * (time > TOUCH)}
        return SimpleNamespace(parameters=p, derived=derived, grains=lambda: [frame], times=lambda: rows)

    return judged("penetration", penetration.measure([written(shift) for shift in (-1e-5, 0.0, 1e-5)]))


def controls(_folder: Path) -> Iterator[Control]:
    right = ball()
    yield Control("a bed that is 3 % too loose", right, ball(height=1.03))
    yield Control("gravity off by 15 %", right, ball(gravity=1.15))
    yield Control("a ball that is stopped after seven tenths of the distance", right, ball(depth=0.7))
    yield Control("a bed that takes 1.4 times as long to stop it", right, ball(duration=1.4))
    yield Control("a bed that returns twice the speed", right, ball(rebound=2.0))
