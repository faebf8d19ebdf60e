"""Prescribed motion of walls: what the engines move walls by."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import numbers


class WallMotion:
    """A motion that no force changes, a sum of terms given in words; LIGGGHTS's `fix wall/motion` and YADE's `WallMotion` read the same.

    words : e.g. "harmonic amplitude 0 0 1e-3 frequency 20": harmonic, circular, rocking, rotation, uniform, jolts or table, each with its
        keywords (SI units, rad; `docs/how-to/moving_walls.md` has all of them); nothing: at rest. Raises ValueError in one line.
    folder : where the files of tables lie; by default the working directory
    begin : s, when the wall is given the motion: the time of the first step of a `fix wall/motion` or `WallMotion`. Terms without `start`
        start then

    Displacements are from the place that the wall has at `begin`, angles about its axis, which moves with the translation.

    >>> shaken = WallMotion("harmonic amplitude 0 0 1e-3 frequency 20 ramp 0")
    >>> bool(abs(shaken.velocity(0.0)[2] - 1e-3 * 2 * np.pi * 20) < 1e-15)
    True
    >>> WallMotion("uniform velocity 0 0 0.5", begin=2.0).displacement(3.0).tolist()
    [0.0, 0.0, 0.5]
    """

    def __init__(self, words: str, folder: Path | None = None, begin: float = 0.0) -> None:
        self.text = " ".join(words.split())
        self._motion = self._read(folder)
        self._motion.begin(float(numbers("begin", begin, "s")))

    def _read(self, folder: Path | None) -> _physics.PrescribedMotion:
        if folder is None or "file" not in self.words:
            return _physics.PrescribedMotion(self.text) if self.text else _physics.PrescribedMotion()
        # A path may have blanks in it, which words have not: the files are read from a place without.
        with TemporaryDirectory() as place:
            given = list(self.words)
            for k in (k + 1 for k, word in enumerate(given[:-1]) if word == "file"):
                if (folder / given[k]).is_file():
                    shutil.copyfile(folder / given[k], Path(place) / given[k])
                given[k] = f"{place}/{given[k]}"
            try:
                return _physics.PrescribedMotion(" ".join(given))
            except ValueError as error:
                raise ValueError(str(error).replace(place, str(folder))) from None

    @property
    def words(self) -> tuple[str, ...]:
        """The words one by one."""
        return tuple(self.text.split())

    @property
    def shortest_period(self) -> float:
        """Period (s) of the fastest oscillation, or twice the duration of the shortest pulse; infinite without any."""
        return float(self._motion.shortest_period)

    def _at(self, time: ArrayLike, first: int, count: int) -> NDArray[np.float64]:
        times = numbers("time", time, "s")
        rows = self._motion.at(np.ascontiguousarray(times.reshape(-1)))
        return rows[:, first:first + count].reshape(*times.shape, count)

    def displacement(self, time: ArrayLike) -> NDArray[np.float64]:
        """m, of the shape of `time` (s) and then (3,)."""
        return self._at(time, 0, 3)

    def angle(self, time: ArrayLike) -> NDArray[np.float64]:
        """rad, of the shape of `time` (s)."""
        return self._at(time, 3, 1)[..., 0]

    def velocity(self, time: ArrayLike) -> NDArray[np.float64]:
        """m/s, of the shape of `time` (s) and then (3,)."""
        return self._at(time, 4, 3)

    def rate(self, time: ArrayLike) -> NDArray[np.float64]:
        """Angular velocity (rad/s), of the shape of `time` (s)."""
        return self._at(time, 7, 1)[..., 0]

    def acceleration(self, time: ArrayLike) -> NDArray[np.float64]:
        """m/s^2, of the shape of `time` (s) and then (3,)."""
        return self._at(time, 8, 3)

    def angular_acceleration(self, time: ArrayLike) -> NDArray[np.float64]:
        """rad/s^2, of the shape of `time` (s)."""
        return self._at(time, 11, 1)[..., 0]
