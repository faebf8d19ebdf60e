"""The motion that the parameters of the group `motion` describe, for decks of all engines and for what measures them."""

import math
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace as Parameters

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.physics import WallMotion

Word = str | int | float
# Rows of time (s) and displacement (m), in the folder of each deck of a case.
TABLE = "motion.csv"
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# Right-handed: the two axes of the plane across each.
PLANES = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}


def motion(p: Parameters, start: float | None = None, until: float | None = None, point: Sequence[float] = (0.0, 0.0, 0.0),
           folder: Path | None = None) -> WallMotion:
    """The walls' motion from `start` to `until` (s; None: from the beginning, to the end; a table has an end of its own). `point` (m) lies
    on the axis of rocking and rotation; `folder` has the file `motion.csv` of a table: that of the case in setup.py, that of the run in
    measure.py. Raises ValueError with one line when this is no motion. In setup.py, `tables={"motion_words": motion(p).words}` gives it to
    the decks."""
    if p.motion == "table" and folder is None:
        raise DembarkError("motion = table is not possible in this case", "it reads no motion.csv", "take another motion")
    window: list[Word] = [word for name, time in (("start", start), ("until", until)) if time is not None for word in (name, time)]
    words = _words(p, point, window)
    return WallMotion(" ".join(str(word) if isinstance(word, str | int) else repr(float(word)) for word in words), folder)


def table_length(folder: Path) -> float:
    """Time (s) from the start of a motion to the last row of the `motion.csv` of its folder, which a motion has read already."""
    text = (folder / TABLE).read_text(encoding="utf-8", errors="replace")
    rows = [line.split("#")[0].replace(",", " ").split() for line in text.splitlines()]
    return max(float(row[0]) for row in rows if row)


def about_y(moving: WallMotion, time: float) -> NDArray[np.float64]:
    """(3, 3), of walls turning about y: vectors (n, 3) @ this are those in the walls' frame at a time (s), @ its transpose the reverse."""
    turn = float(np.asarray(moving.angle(time)))
    sine, cosine = math.sin(turn), math.cos(turn)
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def amplitude(p: Parameters) -> float:
    """A (m), from motion_gamma where that is set."""
    if p.motion_gamma is None:
        return float(p.motion_amplitude)
    return float(p.motion_gamma * p.gravity / (2.0 * math.pi * p.motion_frequency) ** 2)


def _along(direction: str, size: float) -> tuple[float, ...]:
    return tuple(size * component for component in AXES[direction])


def _words(p: Parameters, point: Sequence[float], window: list[Word]) -> list[Word]:
    axis: list[Word] = ["point", *map(float, point), "axis", *AXES[p.motion_direction]]
    wave: list[Word] = ["frequency", p.motion_frequency, "phase", p.motion_phase, "ramp", p.motion_ramp, *window]
    push: list[Word] = ["acceleration", *_along(p.motion_direction, p.motion_acceleration)]
    words: list[Word] = [] if p.motion == "none" else [p.motion]
    if p.motion == "harmonic":
        words += ["amplitude", *_along(p.motion_direction, amplitude(p)), *wave]
        if p.motion_second_amplitude > 0.0:
            # Both rise together.
            ramp = p.motion_ramp * p.motion_second_frequency / p.motion_frequency
            second: list[Word] = ["frequency", p.motion_second_frequency, "phase", p.motion_second_phase, "ramp", ramp, *window]
            words += ["harmonic", "amplitude", *_along(p.motion_direction, p.motion_second_amplitude), *second]
    elif p.motion == "circular":
        one, other = PLANES[p.motion_direction]
        # From sine along the second axis and cosine along the first: counter-clockwise about the normal.
        across = p.motion_sense * p.motion_ratio * amplitude(p)
        words += ["first", *_along(other, across), "second", *_along(one, amplitude(p)), *wave]
    elif p.motion == "rocking":
        words += [*axis, "angle", p.motion_angle, *wave]
    elif p.motion == "rotation":
        words += [*axis, "rate", p.motion_rate, "acceleration", p.motion_spin_up, *window]
    elif p.motion == "uniform":
        words += ["velocity", *_along(p.motion_direction, p.motion_speed), *push, *window]
    elif p.motion == "jolts":
        interval = p.motion_duration if p.motion_interval is None else p.motion_interval
        words += ["shape", p.motion_shape, *push, "duration", p.motion_duration, "interval", interval]
        words += ["count", int(p.motion_count), "signs", p.motion_signs, *window]
    elif p.motion == "table":
        words += ["file", TABLE, *(window[:2] if window[:1] == ["start"] else [])]
    return words
