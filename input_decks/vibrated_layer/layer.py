"""A layer on a plate that shakes up and down, as a run wrote it: the waves on its surface at each level of the acceleration."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dembark.input_decks.common.drive_levels import Level, levels
from dembark.input_decks.common.drive_phases import read_phases
from dembark.input_decks.common.vibration import PHASES
from dembark.postproc import DumpError
from dembark.postproc.measurement import Array, Estimate, Replica, block_mean
from dembark.postproc.replica import cached_per_replica

from .standing_waves import Waves, amplitude, onset, order_onset, surface_levels

# Power at f/2 over that of noise from which a level counts as one with waves.
SEEN = 4.0


@dataclass(frozen=True)
class Layer:
    """One run: `levels` and the `waves` of each; `centres` (levels, periods, PHASES): height (m) of the centre of mass over the middle of
    the plate; `works` (levels, periods): work (J) of the plate in each period; `weight` in N; `rows`: the columns of time.csv; `diameter`
    and `height` of the layer at rest in m; `outward`: number of levels before those of the way back."""

    levels: Sequence[Level]
    waves: Sequence[Waves]
    centres: Array
    works: Array
    weight: float
    rows: Mapping[str, Array]
    diameter: float
    height: float
    outward: int

    def onset(self, back: bool = False) -> Estimate:
        """Acceleration (g) from which on there are waves, of the levels from the first to the last, or of these and the way back."""
        chosen = slice(self.outward - 1, None) if back else slice(0, self.outward)
        drive = np.array([one.gamma for one in self.levels[chosen]])
        power = [mean_power(one) for one in self.waves[chosen]]
        seen = [one.value > (SEEN - 1.0) * float(waves.noise().sum()) for one, waves in zip(power, self.waves[chosen], strict=True)]
        return onset(drive, np.array([one.value for one in power]), np.array([one.half for one in power]), np.array(seen))

    def order_onset(self) -> Estimate:
        """Acceleration (g) from which on the waves of the levels from the first to the last are ordered."""
        chosen = slice(0, self.outward)
        return order_onset(np.array([one.gamma for one in self.levels[chosen]]), np.array([one.ordered() for one in self.waves[chosen]]))


def mean_power(waves: Waves) -> Estimate:
    """Power at f/2 above the noise with its interval over the windows."""
    return block_mean(np.array([waves.subharmonic(slice(k, k + 1)) for k in range(len(waves.power))]))


def wave_amplitude(waves: Waves) -> Estimate:
    """Amplitude (d) of one standing wave of that power."""
    power = mean_power(waves)
    size = amplitude(power.value)
    return Estimate(size, 2.0 * power.half / size if size > 0.0 else math.inf, power.basis)


@cached_per_replica
def read(replica: Replica) -> Layer:
    """What was written; DumpError when frames of a level are missing."""
    p, derived = replica.parameters, replica.derived
    run = read_phases((frame.select(frame.types == 1) for frame in replica.grains()), derived["period_steps"], replica.time_step)
    d, planned = p["grain_diameter"], levels(p)
    surface = np.array([surface_levels(frame, p["layer_length"], p["layer_depth"], d) for frame in run.frames])
    centre = np.array([np.average(frame.positions[:, 2], weights=frame.masses) for frame in run.frames])
    rows, stride = replica.times(), int(derived["period_steps"]) // PHASES
    waves, centres, works = [], [], []
    for level in planned:
        numbers = (derived["rest_periods"] + level.start) * PHASES + np.arange(p["periods"] * PHASES)
        chosen = np.searchsorted(run.numbers, numbers)
        if chosen[-1] >= len(surface) or (run.numbers[chosen] != numbers).any():
            raise DumpError(f"{replica.folder}: grains.dump does not hold the {p['periods']} periods at the level of {level.gamma:g} g")
        waves.append(Waves(surface[chosen], p["layer_length"], d))
        centres.append(centre[chosen].reshape(-1, PHASES))
        ends = stride * (numbers[0] + np.arange(p["periods"] + 1) * PHASES)
        at = np.searchsorted(rows["step"], ends)
        if at[-1] >= len(rows["step"]) or (rows["step"][at] != ends).any():
            raise DumpError(f"{replica.folder}: time.csv has no rows at the ends of the periods at the level of {level.gamma:g} g")
        works.append(np.diff(rows["walls"][at]))
    weight = float(run.frames[0].masses.sum() * p["gravity"])
    return Layer(planned, waves, np.array(centres), np.array(works), weight, rows, d, p["layer_height"] * d, p["levels"])
