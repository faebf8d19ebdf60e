"""Wrong physics in what is written of a ball that follows the published heights."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from dembark.input_decks.tests.measuring import Control, Verdicts, defaults, judged, module

penetration = module("penetration")
TOUCH = 0.021  # s


def ball(bed: str = "settled", *, gravity: float = 1.0, depth: float = 1.0, duration: float = 1.0, rebound: float = 1.0,
         other: bool = False) -> Verdicts:
    """What the case measures of three packings, or of the public one; each number is a factor that is 1 for the published heights."""
    p = defaults("penetration", bed=bed)
    table = penetration.table("dosta_2024_height.csv" if bed == "settled" or other else "dosta_2024_public.csv")
    known = table[:, 1] if bed == "settled" or other else table[:, 1:].mean(axis=1)
    time = np.arange(2e-4, 0.0451, 2e-4)

    def free(at: Any, g: float) -> Any:
        return p["ball_height"] - p["ball_speed"] * at - 0.5 * g * at**2

    after = np.interp(TOUCH + (time - TOUCH) / duration, table[:, 0], known)
    touched = free(TOUCH, p["gravity"])
    after = touched + depth * (after - touched)
    lowest = int(np.argmin(after))
    after[lowest:] = after[lowest] + rebound * (after[lowest:] - after[lowest])
    path = np.where(time < TOUCH, free(time, gravity * p["gravity"]), after)
    up = p["floor"] + 0.03 * (np.arange(p["grain_count"]) + 0.5) / p["grain_count"]
    frame = SimpleNamespace(ids=np.ones(len(up), dtype=int), positions=np.stack([0.0 * up, 0.0 * up, up], axis=1),
                            radii=np.full(len(up), 0.5 * p["grain_diameter"]))

    def written(shift: float) -> Any:
        rows = {"step": 1 + np.arange(len(time)), "time": time, "ball_height": path + shift * (time > TOUCH)}
        return SimpleNamespace(parameters=p, derived={"first": int((time < TOUCH).sum())}, grains=lambda: [frame], times=lambda: rows)

    return judged("penetration", penetration.measure([written(shift) for shift in ((-1e-5, 0.0, 1e-5) if bed == "settled" else (0.0,))]))


def controls(_folder: Path) -> Iterator[Control]:
    right = ball()
    yield Control("gravity off by 15 %", right, ball(gravity=1.15))
    yield Control("a ball that is stopped after seven tenths of the distance", right, ball(depth=0.7))
    yield Control("a bed that takes 1.4 times as long to stop it", right, ball(duration=1.4))
    yield Control("a bed that returns twice the speed", right, ball(rebound=2.0))
    right = ball("public")
    yield Control("another bed than the public one", right, ball("public", other=True))
    yield Control("a public bed that stops the ball after nine tenths of the distance", right, ball("public", depth=0.9))
