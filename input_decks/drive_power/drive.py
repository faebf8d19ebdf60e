"""A bed on a plate that shakes: power of the drive, time in flight, rise of its centre, time until both are steady. Energies in J; works on
the grains are positive. Amplitude A and angular frequency w of the plate: V = A w, G = A w^2 / g, p = P / (M g V) for a bed of the mass
M."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from dembark.input_decks.common.drive_levels import acceleration
from dembark.input_decks.common.momentum import BRIDGED_PARTS
from dembark.postproc import DumpError
from dembark.postproc.measurement import Array, Curve, Estimate, Replica, block_mean, profile

# What springs of contacts hold, in the energy account.
STORED = ("normal_stored", "tangential_stored")
# Base force over the weight below which the bed flies.
FLIGHT = 0.01
# Share of the steady value that counts as reached.
REACHED = 0.9
# From this acceleration on a sticking block flies for a full period.
LONGEST = math.sqrt(1.0 + math.pi**2)


@dataclass(frozen=True)
class Block:
    """A block that sticks where it lands on the plate: `flight`, share of the time in flight, and `power` over M g V."""

    flight: float
    power: float


def sticking_block(acceleration: float) -> Block | None:
    """The steady motion on a plate A sin(wt), A w^2 = `acceleration` g, one flight a period; None below 1 and from sqrt(1 + pi^2) on, where
    a flight lasts longer. It leaves at sin(phase) = 1 / `acceleration`, falls freely, and loses M u^2 / 2 on landing with the relative
    speed u."""
    if not 1.0 < acceleration < LONGEST:
        return None
    start = math.asin(1.0 / acceleration)
    slope = math.cos(start)

    def above(angle: float) -> float:
        return 1.0 / acceleration + slope * angle - 0.5 * angle**2 / acceleration - math.sin(start + angle)

    # The height above the plate grows as the cube of the angle at first; it is positive up to the landing.
    fine = np.linspace(1e-3, 2.0 * math.pi, 4000)
    landed = int(np.argmax(np.array([above(angle) for angle in fine]) < 0.0))
    angle = brentq(above, fine[landed - 1], fine[landed]) if landed else float(fine[0])
    speed = slope - angle / acceleration - math.cos(start + angle)
    return Block(angle / (2.0 * math.pi), acceleration * speed**2 / (4.0 * math.pi))


@dataclass(frozen=True)
class Drive:
    """One run: `rows`, the columns of time.csv, of which those at `ends` (periods + 1,) are at the ends of full periods, the first when
    the plate begins to move, the last when the window ends; `steady`: number of periods before the measuring window; `weight` in N,
    `period` in s, `speed` V in m/s."""

    rows: Mapping[str, Array]
    ends: NDArray[np.int64]
    steady: int
    weight: float
    period: float
    speed: float

    def gain(self, name: str) -> float:
        """Gain of a column in the measuring window."""
        return float(self.rows[name][self.ends[-1]] - self.rows[name][self.ends[self.steady]])

    def window(self, name: str) -> Array:
        """The rows (periods, rows of each) of a column in the measuring window."""
        return np.asarray(self.rows[name][self.ends[self.steady] + 1 : self.ends[-1] + 1].reshape(len(self.ends) - 1 - self.steady, -1))

    def powers(self, name: str = "walls") -> Array:
        """Mean power (periods,) in each period over M g V, from the account's work of the walls or from that of the force on the plate."""
        return np.diff(self.rows[name][self.ends]) / (self.period * self.weight * self.speed)

    def power(self, name: str = "walls") -> Estimate:
        """Its mean in the measuring window."""
        return block_mean(self.powers(name)[self.steady :])

    def power_gap(self) -> float:
        """Work of the plate's force times its velocity over that in the account, less 1."""
        return self.gain("plate_work") / self.gain("walls") - 1.0

    def dissipation_gap(self) -> float:
        """Work of the walls over what contacts and bridges have taken in the window and do not hold, less 1."""
        return self.gain("walls") / -sum(self.gain(name) for name in (*BRIDGED_PARTS, *STORED)) - 1.0

    def flight(self) -> Estimate:
        """Share of the time in which the force on the plate is below FLIGHT of the weight."""
        return block_mean(self._means((self.rows["plate_fz"] < FLIGHT * self.weight).astype(float))[self.steady :])

    def heights(self) -> Array:
        """Rise (rows,) of the centre of mass in m over the bed at rest."""
        return (self.rows["weight_height"] - self.rows["weight_height"][self.ends[0]]) / self.weight

    def rise(self) -> Estimate:
        """Its mean in the measuring window (m)."""
        return block_mean(self._means(self.heights())[self.steady :])

    def height(self) -> Estimate:
        """Mean height of the centre of mass over the middle of the plate in the measuring window (m)."""
        return block_mean(self._means(self.rows["weight_height"])[self.steady :] / self.weight)

    def spectrum(self) -> tuple[float, float, float]:
        """Of the height of the centre of mass in the measuring window (m): amplitudes of its first two harmonics of the drive, and the root
        mean square of all else."""
        return spectrum(self.window("weight_height") / self.weight)

    def kinetic(self) -> Estimate:
        """Mean kinetic energy in the measuring window (J)."""
        return block_mean(self._means(self.rows["kinetic_energy"])[self.steady :])

    def compaction(self) -> float | None:
        """Height of the centre of mass in the last row over that at the start, less 1; None when the run ends with the window."""
        height = self.rows["weight_height"]
        return None if self.ends[-1] + 1 == len(height) else float(height[-1] / height[self.ends[0]] - 1.0)

    def _means(self, values: Array) -> Array:
        """Mean (periods,) of `values` over the rows of each period, its last one included."""
        first, last = self.ends[0] + 1, self.ends[-1] + 1
        return np.asarray(values[first:last].reshape(len(self.ends) - 1, -1).mean(axis=1))

    def reached(self, means: Array) -> float:
        """Periods since the plate began to move until `means` (periods,) first are REACHED of their steady mean; between the middles of two
        periods a straight line."""
        limit = REACHED * means[self.steady :].mean()
        after = int(np.argmax(means >= limit))
        before = means[after - 1] if after else 0.0
        return float(after - 0.5 + (limit - before) / (means[after] - before)) if means[after] > before else 0.0

    def power_time(self) -> float:
        """Periods until the power is steady."""
        return self.reached(self.powers())

    def rise_time(self) -> float:
        """Periods until the rise is steady."""
        return self.reached(self._means(self.heights()))


def spectrum(heights: Array) -> tuple[float, float, float]:
    """Of `heights` (periods, times): amplitudes of the first two harmonics of the period, and the root mean square of the rest, without the
    mean."""
    mean = heights.mean(axis=0)
    harmonics = np.fft.rfft(mean)[1:3]
    kept = np.fft.irfft(np.concatenate([[mean.sum()], harmonics]), len(mean))
    first, second = 2.0 * np.abs(harmonics) / len(mean)
    return float(first), float(second), float(np.sqrt(np.mean((heights - kept) ** 2)))


def read(replica: Replica) -> Drive:
    """What was written; DumpError when the rows of time.csv do not make full periods."""
    rows, p, derived = replica.times(), replica.parameters, replica.derived
    began, period = int(derived["begin"]), int(derived["period_steps"])
    wanted = np.arange(began, int(derived["held"]) + 1, period)
    ends = np.searchsorted(rows["step"], wanted).astype(np.int64)
    complete = len(wanted) > 1 and ends[-1] < len(rows["step"]) and (rows["step"][ends] == wanted).all()
    if not complete or len(set(np.diff(ends))) > 1:
        raise DumpError(f"{replica.folder}: time.csv has no rows at full periods of {period} steps after step {began}")
    first = replica.grains()[0]
    angular = 2.0 * math.pi * p["motion_frequency"]
    return Drive(rows, ends, round((first.step - began) / period), float(first.masses.sum() * p["gravity"]), period * replica.time_step,
                 acceleration(p) * p["gravity"] / angular)


def transients(runs: list[Drive]) -> list[Curve]:
    """Curves of the power and of the rise, period by period."""
    place = np.arange(0.5, len(runs[0].ends) - 1)
    title = "periods since the plate began to move"
    return [profile("power", "Power of the drive", title, "P / (M g V)", place, [one.powers() for one in runs]),
            profile("rise", "Rise of the centre of mass", title, "m", place, [one._means(one.heights()) for one in runs])]


def phases(runs: list[Drive], block: Block | None) -> Curve:
    """Curve of the force on the plate over the phase; its note says how long a sticking block of this acceleration flies."""
    forces = [one.window("plate_fz").mean(axis=0) / one.weight for one in runs]
    phase: Any = (np.arange(len(forces[0])) + 1.0) / len(forces[0])
    note = "" if block is None else f"a block that sticks where it lands would be in flight for {block.flight:.3f} of the period"
    return profile("force", "Force on the plate over the phase", "phase of the drive (periods)", "F / (M g)", phase, forces, note=note)
