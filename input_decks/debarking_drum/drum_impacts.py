"""A drum with logs: impacts, forces and energy in the measuring window, full revolutions. A contact that begins with the speed of approach
`impact_speed` or more is an impact; slower ones are logs that rest or roll on each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark.postproc import DumpError
from dembark.postproc.measurement import Array, Curve, Estimate, Replica, over_replicas, profile
from dembark.postproc.output import cf_dataset, variable, with_interval
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.resampling import resampled
from dembark.postproc.statistics import TimeBlocks, time_blocks

if TYPE_CHECKING:
    import xarray

# Edges of the histograms of places, in degrees from the lowest point of the drum, positive the way it turns.
ANGLES = np.linspace(-180.0, 180.0, 37)
PLACES = 0.5 * (ANGLES[1:] + ANGLES[:-1])
CELLS = 32  # of the map, across the drum
_PEAKS = np.logspace(1.0, 6.0, 51)  # N, edges of the histogram of peak forces
_FORCES = np.logspace(1.0, 6.0, 26)  # N, five bins a decade


@dataclass(frozen=True)
class Drum:
    """The measuring window of one replica. Rows (rows,) are means or sums over a row of time.csv; impacts (impacts,)."""

    logs: int
    radius: float  # m
    weight: float  # N, of all logs
    revolutions: int
    period: float  # s
    steps: int
    work: Array  # J, that the shell does in each row
    lost: Array  # J, dissipated in each row
    stored: Array  # J, at the end of each row, and before the first
    torque: Array  # N m, of the shell on the logs, mean of each row
    lift: Array  # N, upward force of the shell, mean of each row
    impulse: Array  # N s, of all contacts in each row
    pivots: Array  # in each row
    certificate: float  # worst since the start
    quarter: NDArray[np.int64]  # of a revolution, of each impact, counted from the window's begin
    place: Array  # (impacts, 2), x and z in m
    peak: Array  # N
    loss: Array  # J, in each impact
    shell: NDArray[np.bool_]  # is the impact on the shell
    recorded: float  # J, lost in all contacts that have ended

    @property
    def quarters(self) -> int:
        """Number of quarter revolutions: the pieces of time whose scatter makes the intervals."""
        return 4 * self.revolutions

    @property
    def angle(self) -> Array:
        """Place of each impact in degrees from the lowest point; the shell turns about +y, so that point moves towards -x."""
        return np.degrees(np.arctan2(-self.place[:, 0], -self.place[:, 1]))

    @property
    def energy_error(self) -> float:
        """Largest gap in the balance of energy over the window, over the work of the shell in it."""
        gap = np.cumsum(self.work - self.lost) - (self.stored[1:] - self.stored[0])
        return float(np.abs(gap).max() / abs(self.work.sum()))

    def pieces(self, rows: Array, count: int) -> Array:
        """Sums of `rows` over each of `count` equal pieces of the window."""
        return np.asarray(rows.reshape(count, -1).sum(axis=1))

    def power(self, rows: Array, pieces: int) -> Array:
        """W, of the energies `rows` over each of `pieces` parts of a revolution."""
        return self.pieces(rows, pieces * self.revolutions) / (self.period / pieces)

    def per_log(self, number: ArrayLike) -> Array:
        """A `number` of impacts per log and revolution."""
        return np.asarray(number, np.float64) / (self.logs * self.revolutions)

    def exceeding(self, forces: Array) -> Array:
        """Impacts per log and revolution whose peak is above each of `forces` (N); NaN where there is none."""
        number = np.array([np.count_nonzero(self.peak > force) for force in forces], float)
        return self.per_log(np.where(number > 0.0, number, np.nan))

    def at_angle(self, angles: Array) -> Array:
        """How many of `angles` (degrees) lie in each bin of ANGLES, per log, revolution and 10 degrees."""
        return self.per_log(np.histogram(angles, ANGLES)[0]) * 10.0 / float(np.diff(ANGLES)[0])

    def peak_at_angle(self) -> Array:
        """Mean peak force (N) in each bin of ANGLES; NaN where fewer than ten impacts are."""
        chosen = [self.peak[np.digitize(self.angle, ANGLES) - 1 == k] for k in range(len(PLACES))]
        return np.array([peaks.mean() if len(peaks) >= 10 else np.nan for peaks in chosen])

    def lost_in(self, impacts: NDArray[np.bool_]) -> Array:
        """J lost in the chosen impacts of each quarter."""
        return np.bincount(self.quarter[impacts], self.loss[impacts], self.quarters).astype(float, copy=False)


@cached_per_replica
def read(replica: Replica) -> Drum:
    """The window of `replica`; DumpError when its files do not belong together."""
    given, derived, times, impacts = replica.parameters, replica.derived, replica.times(), replica.impacts()
    speed, turns, run_in = given["drum_speed"], int(given["revolutions"]), int(given["run_in"])
    period = 2.0 * math.pi / speed
    rows = round(period / (int(derived["every"]) * replica.time_step))
    before, count = rows * run_in, len(times["step"])
    if count != before + rows * turns:
        raise DumpError(f"{replica.folder / 'time.csv'} has {count} rows instead of {before + rows * turns}")

    def change(name: str) -> Array:
        return np.diff(times[name], prepend=0.0)[before:]

    stored = times["kinetic_energy"] + times["potential_energy"] + times["elastic_energy"]
    ended = impacts[(impacts[:, 2] >= run_in * period) & (impacts[:, 2] < (run_in + turns) * period)]
    hits = ended[ended[:, 6] >= given["impact_speed"]]
    return Drum(
        logs=int(derived["logs"]), radius=derived["inner_radius"], weight=derived["load_weight"], revolutions=turns, period=period,
        steps=int(times["step"][-1] - (times["step"][before - 1] if before else 0)),
        work=times["torque"][before:] * speed * (period / rows), lost=change("dissipated_energy"),
        stored=stored[before - 1 :] if before else np.concatenate([stored[:1], stored]),
        torque=times["torque"][before:], lift=times["shell_fz"][before:], impulse=change("impulse_sum"), pivots=change("pivots"),
        certificate=float(times["certificate"][-1]),
        quarter=np.minimum((4.0 * (hits[:, 2] / period - run_in)).astype(np.int64), 4 * turns - 1),
        place=hits[:, [8, 10]], peak=hits[:, 4], loss=hits[:, 7], shell=hits[:, 1] < 0, recorded=float(ended[:, 7].sum()))


def estimates(drum: Drum) -> dict[str, Estimate]:
    """What is measured of one load, by name: per revolution, or over the weight or what is lost, with intervals from the quarters."""
    counts, everything = np.bincount(drum.quarter, minlength=drum.quarters).astype(float), np.ones(len(drum.peak), bool)
    blocks = time_blocks(counts)
    lost, impulse, pivots, lift, torque = (drum.pieces(rows, drum.quarters)
                                           for rows in (drum.lost, drum.impulse, drum.pivots, drum.lift, drum.torque))
    rows, hits, shell = len(drum.lost) / drum.revolutions, drum.lost_in(everything), drum.lost_in(drum.shell)
    loss_blocks, turn = time_blocks(hits), np.radians(drum.angle[drum.shell])
    east, north = (np.bincount(drum.quarter[drum.shell], drum.loss[drum.shell] * part, drum.quarters)
                   for part in (np.sin(turn), np.cos(turn)))

    def over(measure: Callable[[NDArray[np.bool_]], float], groups: TimeBlocks = blocks) -> Estimate:
        return resampled(lambda keep, _: measure(keep), groups)

    def mean(values: Array, factor: float = 1.0) -> Estimate:
        return over(lambda keep: factor * float(values[keep].mean()))

    def of_impacts(measure: Callable[[Array], float], values: Array) -> Estimate:
        def chosen(keep: NDArray[np.bool_]) -> float:
            kept = values[keep[drum.quarter]]
            return measure(kept) if len(kept) else math.nan
        return over(chosen)

    # Work and loss differ by nothing but the change of what is stored, between two moments that are as good as any.
    spread = 2.0 * math.sqrt(2.0) * float(drum.stored.std() / abs(drum.lost.sum()))
    return {
        "power_ratio": Estimate(float(drum.work.sum() / drum.lost.sum()), spread, "spread of the stored energy"),
        "lift_over_weight": mean(lift, 4.0 / (rows * drum.weight)),
        "impacts_per_revolution": mean(counts, 4.0),
        "impacts_per_log": mean(counts, 4.0 / drum.logs),
        "peak_force_mean": of_impacts(lambda peaks: float(peaks.mean()), drum.peak),
        "peak_force_p99": of_impacts(lambda peaks: float(np.percentile(peaks, 99.0)), drum.peak),
        "peak_force_max": Estimate(float(drum.peak.max(initial=0.0)), math.inf, "one load: only several loads give an interval"),
        "impulse_sum": mean(impulse, 4.0),
        "dissipated_energy": mean(lost, 4.0),
        "torque_arm": mean(torque, 4.0 / (rows * drum.weight * drum.radius)),
        "shell_share": of_impacts(lambda shell: float(shell.mean()), drum.shell.astype(float)),
        "pivots_per_step": mean(pivots, drum.quarters / drum.steps),
        "impact_loss_share": over(lambda keep: float(hits[keep].sum() / lost[keep].sum()), loss_blocks),
        "shell_loss_share": over(lambda keep: float(shell[keep].sum() / hits[keep].sum()) if hits[keep].any() else math.nan, loss_blocks),
        "shell_power_angle": over(lambda keep: math.degrees(math.atan2(east[keep].sum(), north[keep].sum())), loss_blocks),
    }


def profiles(drums: Sequence[Drum], limit: float) -> list[Curve]:
    """Impacts by peak force and by place, and the power over the window; `limit` (m/s): approach that counts as an impact."""
    hit = np.flatnonzero(np.sum([np.histogram(drum.peak, _PEAKS)[0] for drum in drums], axis=0))
    forces = _PEAKS[max(0, hit[0] - 1) : hit[-1] + 3] if len(hit) else _PEAKS
    turned = (np.arange(20.0 * drums[0].revolutions) + 0.5) / 20.0

    def curve(name: str, title: str, along: str, across: str, place: Array, get: Callable[[Drum], Array], **more: Any) -> Curve:
        return profile(name, title, along, across, place, [get(drum) for drum in drums], **more)

    note, around, number = f"approach ≥ {limit:g} m/s", "angle from the lowest point (°)", "per log, revolution and 10°"
    return [
        curve("peak_forces", "Peak forces of impacts", "log₁₀ of the peak force (N)", "per log, revolution and decade",
              np.log10(np.sqrt(forces[1:] * forces[:-1])),
              lambda one: one.per_log(np.histogram(one.peak, forces)[0]) / np.diff(np.log10(forces)), note=note),
        curve("peak_forces_exceeded", "Impacts above F", "log₁₀ of F (N)", "log₁₀ of number per log, revolution", np.log10(forces),
              lambda one: np.log10(one.exceeding(forces)), note=note),
        curve("impacts_at_angle", "Angles of impacts", around, number, PLACES, lambda one: one.at_angle(one.angle), note="all impacts"),
        curve("shell_impacts_at_angle", "Angles of shell impacts", around, number, PLACES,
              lambda one: one.at_angle(one.angle[one.shell]), note="impacts on the shell"),
        curve("peak_force_at_angle", "Peak force against angle", around, "mean peak force (kN)", PLACES,
              lambda one: 1e-3 * one.peak_at_angle()),
        curve("power", "Power", "revolutions in the window", "power of the drum (W)", turned, lambda one: one.power(one.work, 20),
              reference=np.mean([one.power(one.lost, 20) for one in drums], axis=0), reference_label="power dissipated"),
    ]


def fields(replicas: Sequence[Replica]) -> xarray.Dataset:
    """Where impacts take energy from the logs: power over the cross-section and along the shell, and peak forces along the shell."""
    drums, frame, given = [read(replica) for replica in replicas], list(replicas[0].grains())[-1], replicas[0].parameters
    radius, duration = drums[0].radius, drums[0].revolutions * drums[0].period
    edges = np.linspace(-radius, radius, CELLS + 1)
    patch = radius * math.radians(float(np.diff(ANGLES)[0])) * float(given["log_length"])
    cells = np.mean([np.histogram2d(one.place[:, 0], one.place[:, 1], bins=(edges, edges), weights=one.loss)[0] / duration
                     for one in drums], axis=0)
    bins = (ANGLES, np.log10(_FORCES))
    peaks = np.mean([np.histogram2d(one.angle[one.shell], np.log10(np.maximum(one.peak[one.shell], 1e-300)), bins=bins)[0] / one.revolutions
                     for one in drums], axis=0)
    along = [over_replicas(cell) for cell in zip(*(_along_shell(one, patch) for one in drums), strict=True)]
    variables = {
        "impact_power": variable(("x", "z"), cells / (edges[1] - edges[0]) ** 2, "W m-2",
                                 "energy dissipated in impacts per time and area of the cross-section"),
        **with_interval("shell_power", ["angle"], along, "W m-2", "energy dissipated in impacts on the shell per time and area of it"),
        "shell_peaks": variable(("angle", "force"), peaks, "1", "impacts on the shell per revolution, angle bin and force bin"),
        "log_x": variable(["log"], frame.positions[:, 0], "m", "logs of the last frame"),
        "log_z": variable(["log"], frame.positions[:, 2], "m", "logs of the last frame"),
        "log_radius": variable(["log"], frame.radii, "m", "radius of the logs"),
    }
    middle, force = 0.5 * (edges[1:] + edges[:-1]), np.sqrt(_FORCES[1:] * _FORCES[:-1])
    coordinates = {"x": variable(["x"], middle, "m", "across the drum"), "z": variable(["z"], middle, "m", "upward"),
                   "angle": variable(["angle"], PLACES, "degree", "angle from the lowest point in the direction of rotation"),
                   "force": variable(["force"], force, "N", "peak force, middle of the bin on a logarithmic scale")}
    return cf_dataset(variables, coordinates, drum_radius=radius, drum_speed=float(given["drum_speed"]),
                    log_length=float(given["log_length"]), impact_speed=float(given["impact_speed"]), revolutions=drums[0].revolutions,
                    replicas=len(drums), impacts=sum(len(one.peak) for one in drums))


def _along_shell(drum: Drum, patch: float) -> list[Estimate]:
    """Power per area (W/m2) of each bin of angle on the shell, with what varies among quarter revolutions; `patch`: its area in m2."""
    bins = np.clip(np.digitize(drum.angle, ANGLES) - 1, 0, len(PLACES) - 1)
    table = np.zeros((drum.quarters, len(PLACES)))
    np.add.at(table, (drum.quarter[drum.shell], bins[drum.shell]), drum.loss[drum.shell])
    table /= patch * drum.period / 4.0
    blocks = time_blocks(table.sum(axis=1))
    return [resampled(partial(_mean_of, column), blocks) for column in table.T]


def _mean_of(values: Array, keep: NDArray[np.bool_], _: NDArray[np.bool_]) -> float:
    return float(values[keep].mean())
