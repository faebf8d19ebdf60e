"""What a run costs on other numbers of grains and ranks than were measured: time, memory and messages, fitted to samples of mpi_scaling.

On a rank with n grains a step takes n * imbalance * t_grain + halo * t_halo + t_step, where `halo` counts the copies of grains that other
ranks own or that are periodic images; between nodes the latency of its messages and their bytes over the bandwidth come on top.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dembark.postproc.statistics import Estimate, student

Array = NDArray[np.float64]
# Of a sample: processor or wall time of `loop` and of `comm` in it (s) for `steps`; grains of a rank (`own`, at `most`, `halo`) and of all;
# peak memory (B) of a rank, `resident`, and of one without grains, `program`; `messages` and `bytes` a step.
COLUMNS = ["grains", "cores", "steps", "loop", "comm", "own", "most", "halo", "resident", "program", "messages", "bytes"]


@dataclass(frozen=True)
class Fit:
    """Relative least squares: `values` (k,), their covariance `spread` (k, k), the relative `variance` of samples, `degrees` of freedom."""

    values: Array
    spread: Array
    variance: float
    degrees: int

    @classmethod
    def of(cls, measured: pd.Series, *columns: pd.Series | float) -> Self:
        """`measured` (n,) as a sum of `columns` (k of n) times numbers; each sample counts by its relative error."""
        scaled = np.column_stack([np.broadcast_to(column, measured.shape) / measured for column in columns])
        values, *_ = np.linalg.lstsq(scaled, np.ones(len(measured)), rcond=None)
        degrees = len(measured) - len(columns)
        variance = float(np.sum((1.0 - scaled @ values) ** 2)) / max(degrees, 1)
        return cls(values, variance * np.linalg.pinv(scaled.T @ scaled), variance, degrees)

    def at(self, *columns: float, sample: bool = False) -> Estimate:
        """The sum for `columns` (k,), with the 95 % interval of its mean, or of another `sample` there."""
        row = np.array(columns)
        value = float(row @ self.values)
        variance = max(0.0, float(row @ self.spread @ row)) + (self.variance * value**2 if sample else 0.0)
        return Estimate(value, student(self.degrees) * math.sqrt(variance) if self.degrees > 0 else math.inf)


@dataclass(frozen=True)
class Network:
    """Between nodes: `latency` (s) of a message, and `bandwidth` (B/s) of a rank."""

    latency: float
    bandwidth: float


@dataclass(frozen=True)
class Model:
    """Of one engine and scene: what its samples were fitted by.

    own : s a step and grain
    halo : s a step and copy; s a step
    memory : B a grain or copy; B of a rank on top of `program`, what it has without grains
    messages, message : messages of a step in each of the `directions` that are cut; B a copy
    density : grains in a piece that is as wide, in these directions, as the range in which grains are copied
    """

    own: Fit
    halo: Fit
    memory: Fit
    program: float
    messages: float
    message: float
    density: float
    directions: int

    @classmethod
    def of(cls, samples: pd.DataFrame, alone: pd.DataFrame, density: float, directions: int) -> Self:
        """From `samples` with COLUMNS, of one and of more ranks; those with 0 steps are only counted. Copies are timed in `alone`, samples
        of one rank in all scenes, where none waits for another."""
        timed, split = samples[samples["steps"] > 0], samples[samples["cores"] > 1]
        held = samples["resident"] - samples["program"] - 4.0 * samples["grains"]
        return cls(Fit.of((timed["loop"] - timed["comm"]) / timed["steps"], timed["most"]),
                   Fit.of(alone["comm"] / alone["steps"], alone["halo"], 1.0), Fit.of(held, samples["own"] + samples["halo"], 1.0),
                   samples["program"].median(), split.loc[split["cores"] == split["cores"].min(), "messages"].median(),
                   (split["bytes"] / split["halo"]).max(), density, directions)

    def copies(self, grains: float) -> float:
        """Halo of a rank with `grains` and neighbours, or periodic images, on both sides in each direction."""
        width = (grains / self.density) ** (1.0 / self.directions)
        return grains * ((1.0 + 2.0 / width) ** self.directions - 1.0)

    def step(self, grains: float, halo: float, imbalance: float = 1.0) -> Estimate:
        """s of a step on ranks of one node with `grains` and `halo` each, the fullest with `imbalance` times as many; the interval
        is that of another run."""
        parts = self.own.at(grains * imbalance, sample=True), self.halo.at(halo, 1.0, sample=True)
        return Estimate(sum(part.value for part in parts), math.hypot(*(part.half for part in parts)))

    def between_nodes(self, halo: float, ranks: int, network: Network) -> float:
        """s of a step on top. All ranks decide together whether to build lists anew, in 2 log2(ranks) messages one after the other."""
        messages = self.messages * self.directions + 2.0 * math.log2(ranks)
        return messages * network.latency + halo * self.message / network.bandwidth

    def resident(self, grains: float, halo: float, everywhere: float) -> Estimate:
        """Peak memory (B) of a rank. The map of ids takes 4 B for each grain there is `everywhere`."""
        held = self.memory.at(grains + halo, 1.0, sample=True)
        return Estimate(self.program + 4.0 * everywhere + held.value, held.half)

    def deviations(self, samples: pd.DataFrame) -> dict[str, float]:
        """Largest relative deviation of the model from each of `samples`: of the `time` of a step, of `memory` and of the `halo`."""
        found: dict[str, list[float]] = {"time": [], "memory": [], "halo": []}
        for row in samples[COLUMNS].itertuples():
            if row.steps:
                step = self.step(row.own, row.halo, row.most / row.own).value
                found["time"].append(step * row.steps / row.loop - 1.0)
            found["memory"].append(self.resident(row.own, row.halo, row.grains).value / row.resident - 1.0)
            found["halo"].append(self.copies(row.own) / row.halo - 1.0)
        return {name: max(values, key=abs, default=math.nan) for name, values in found.items()}
