"""The levels of a drive's acceleration: set-ups move walls by them, and measurements look for them in what a run wrote."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Level:
    """A level of the drive: its acceleration `gamma` in g, and the period `start` of the motion with which its measuring window begins."""

    gamma: float
    start: int


def acceleration(p: Mapping[str, Any]) -> float:
    """Largest acceleration of the wall over g: as given, or from the amplitude."""
    given = p["motion_gamma"]
    return float(p["motion_amplitude"] * (2.0 * math.pi * p["motion_frequency"]) ** 2 / p["gravity"] if given is None else given)


def levels(p: Mapping[str, Any]) -> list[Level]:
    """The levels of a run with the parameters `p`: from motion_gamma to last_gamma, and back where that is asked for."""
    first = acceleration(p)
    there = [first] if p["levels"] == 1 else list(np.linspace(first, p["last_gamma"], p["levels"]))
    every = there + (there[-2::-1] if p["back"] == "yes" else [])
    length = p["level_ramp"] + p["run_in"] + p["periods"]
    return [Level(float(one), math.ceil(p["motion_ramp"]) + p["run_in"] + k * length) for k, one in enumerate(every)]
