"""Vibrated troughs as a run wrote them: circulation of the bed, motion of a free part, force on the walls as noise. The bed lies in the
plane y = 0; gravity points along -z. Turning is positive about y, from z to x, as the drive of positive sense goes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Points, Replica, Value, block_mean, exact, profile
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.statistics import CONFIDENCE, jackknife, joint_limit
from dembark.postproc.studies import measured

from .drive_phases import Phases, cell_means, read_phases
from .vibration import PHASES

# Complex numbers.
Plane = NDArray[np.complex128]

# Width of the cells of the velocity field, in mean diameters.
CELL = 4.0
# Harmonics of the drive from which on the force on the walls counts as noise.
NOISE = 10
# Blocks of time in which the fluctuation is resampled.
BLOCKS = 5


def moment_about_y(places: Array, ways: Array) -> Array:
    """(r x u)_y of `places` r (..., 3) and `ways` u (..., 3)."""
    return np.asarray(places[..., 2] * ways[..., 0] - places[..., 0] * ways[..., 2])


def circulation(places: Array, ways: Array, masses: Array) -> Array:
    """Angle (...,) in rad by which grains at `places` (..., n, 3) with `masses` (n,) turn about their centre of mass when they move by
    `ways`: sum m (r x u) / sum m r^2, where r is measured from the centre to the middle of each way, and u relative to the centre's."""
    weights = masses / masses.sum()
    middle = places + 0.5 * ways

    def relative(values: Array) -> Array:
        return np.asarray(values - np.einsum("n,...na->...a", weights, values)[..., None, :])

    arm, way = relative(middle), relative(ways)
    square = arm[..., 0] ** 2 + arm[..., 2] ** 2
    return np.asarray(np.einsum("n,...n->...", weights, moment_about_y(arm, way)) / np.einsum("n,...n->...", weights, square))


def fluctuation(places: Array, ways: Array, masses: Array, edges: Sequence[Array]) -> tuple[float, float]:
    """Root mean square of `ways` (pairs, n, d) about their mean in the cell between `edges` in which they begin, at `places` (pairs, n, d),
    and the mean size of these means; both in the unit of `ways`, weighted by `masses` (n,)."""
    weights, flat = np.broadcast_to(masses, ways.shape[:2]).ravel(), ways.reshape(-1, ways.shape[-1])
    cells = tuple(np.clip(np.searchsorted(edge, column, side="right") - 1, 0, len(edge) - 2)
                  for edge, column in zip(edges, places.reshape(flat.shape).T, strict=True))
    own = cell_means(flat, places.reshape(flat.shape), weights, edges)[cells]
    off = np.average(((flat - own) ** 2).sum(axis=1), weights=weights)
    return math.sqrt(off), float(np.average(np.linalg.norm(own, axis=1), weights=weights))


@dataclass(frozen=True)
class Trough:
    """One run: `run`, its frames; `free`: rows of the grains without the part; `part`: row of the free part, -1 without one; `rows`: the
    columns of time.csv of the measuring window, the one at its beginning included; `weight` of all that moves (N); `speed`: highest of
    the drive (m/s); `diameter`: mean of the grains (m)."""

    run: Phases
    part: int
    rows: Mapping[str, Array]
    weight: float
    speed: float
    diameter: float

    @property
    def free(self) -> Array:
        """Rows of the grains (n,) without the part."""
        rows = np.arange(len(self.run.frames[0].ids))
        return rows[rows != self.part]

    @property
    def places(self) -> Array:
        """Positions (frames, bodies, 3) in m."""
        return np.array([frame.positions for frame in self.run.frames])

    def turning(self) -> Estimate:
        """Angular velocity (rad/s) of the circulation of the grains, by their displacements in a period."""
        ways = self.run.displacements()[:, self.free]
        angles = circulation(self.places[:-PHASES][:, self.free], ways, self.run.frames[0].masses[self.free])
        return block_mean(angles / self.run.period)

    def spin(self) -> Estimate:
        """Mean angular velocity (rad/s) of the part itself about y."""
        return block_mean(np.array([frame.omegas[self.part, 1] for frame in self.run.frames]))

    def revolution(self) -> Estimate:
        """Mean angular velocity (rad/s) with which the part goes round the centre of mass of the grains."""
        masses = self.run.frames[0].masses[self.free]
        centre = np.einsum("n,tna->ta", masses / masses.sum(), self.places[:, self.free])
        arm = self.places[:, self.part] - centre
        angle = np.unwrap(np.arctan2(arm[:, 0], arm[:, 2]))
        return block_mean((angle[PHASES:] - angle[:-PHASES]) / self.run.period)

    def height(self) -> Estimate:
        """Height (m) of the part over the centre of mass of the grains."""
        masses = self.run.frames[0].masses[self.free]
        return block_mean(self.places[:, self.part, 2] - self.places[:, self.free, 2] @ (masses / masses.sum()))

    def likeness(self) -> float:
        """Logarithm of the part's mean square displacement in a period less the mean of the grains', in standard deviations of these."""
        ways = self.run.displacements()
        logs = np.log(np.maximum((ways**2).sum(axis=2).mean(axis=0), 1e-300))
        return float((logs[self.part] - logs[self.free].mean()) / logs[self.free].std(ddof=1))

    def cells(self) -> list[Array]:
        """Edges (m) of square cells over all that moves, along x and z."""
        width, places = CELL * self.diameter, self.places[:, self.free]
        bounds = [(places[..., axis].min() / width, places[..., axis].max() / width) for axis in (0, 2)]
        return [width * np.arange(math.floor(low), math.ceil(high) + 1, dtype=np.float64) for low, high in bounds]

    def fluctuation_ratio(self) -> Estimate:
        """Fluctuation over mean speed: root mean square of the displacements in a period about the mean of their cell, over the mean size
        of the cells' means, both weighted by mass; resampled in blocks of time."""
        return self._resampled(lambda random, mean: random / mean)

    def agitation(self) -> Estimate:
        """That root mean square over the way which the drive's highest speed makes in a period."""
        return self._resampled(lambda random, _: random / (self.run.period * self.speed))

    def _resampled(self, number: Callable[[float, float], float]) -> Estimate:
        """`number` of fluctuation and mean size (m) of the displacements in a period."""
        edges, ways = self.cells(), self.run.displacements()[:, self.free][..., [0, 2]]
        places = self.places[:-PHASES][:, self.free][..., [0, 2]] + 0.5 * ways
        masses = self.run.frames[0].masses[self.free]
        return jackknife(lambda keep: number(*fluctuation(places[keep], ways[keep], masses, edges)),
                         np.arange(len(ways)) * BLOCKS // len(ways), name="time blocks")

    def momentum_gap(self, wall: str) -> float:
        """Size of the difference, in the plane of the layer, between the change of momentum of all that moves, from the first frame to the
        last, and the impulse of `wall` and weight, over the weight times the time between."""
        first, last = (frame.masses @ frame.velocities for frame in (self.run.frames[0], self.run.frames[-1]))
        impulse = [self.rows[f"{wall}_j{axis}"][-1] - self.rows[f"{wall}_j{axis}"][0] for axis in "xyz"]
        weight = self.weight * self.periods * self.run.period
        gap = last - first - impulse + np.array([0.0, 0.0, weight])
        return float(np.linalg.norm(gap[[0, 2]]) / weight)

    def power(self, *walls: str) -> Estimate:
        """Power of the drive over M g V: work of the forces on the `walls`, period by period."""
        work = np.sum([self.rows[f"{wall}_work"] for wall in walls], axis=0)
        rows = (len(work) - 1) // self.periods
        return block_mean(np.diff(work[::rows]) / (self.run.period * self.weight * self.speed))

    @property
    def periods(self) -> int:
        """Whole periods in the measuring window."""
        return (len(self.run.frames) - 1) // PHASES

    def forces(self, wall: str) -> Array:
        """Mean forces (rows, 3) in N of `wall` on the grains from each row to the next, from its impulse, which counts every step."""
        impulse = np.column_stack([self.rows[f"{wall}_j{axis}"] for axis in "xyz"])
        return np.asarray(np.diff(impulse, axis=0) / np.diff(self.rows["time"])[:, None])

    def spectrum(self, wall: str) -> tuple[Array, Array]:
        """Harmonics of the drive (k,), and the mean square (k,) of the force on `wall` in each, over the weight squared; both without the
        mean. Summed over all k it is the variance."""
        return spectrum(self.forces(wall) / self.weight, self.periods)

    def noise(self, wall: str) -> float:
        """Root mean square of the force from the tenth harmonic of the drive on, over the weight."""
        harmonics, power = self.spectrum(wall)
        return float(math.sqrt(power[harmonics >= NOISE].sum()))


def spectrum(forces: Array, periods: int) -> tuple[Array, Array]:
    """Harmonics (k,) in units of the drive's frequency, and the one-sided mean squares (k,) of `forces` (n, components), which last
    `periods` periods: Parseval's sum is their variance."""
    count = len(forces)
    amplitudes = np.fft.rfft(forces - forces.mean(axis=0), axis=0)
    sides = np.full(len(amplitudes), 2.0)
    sides[0] = 1.0
    if count % 2 == 0:
        sides[-1] = 1.0
    return np.arange(len(amplitudes)) / periods, sides * (np.abs(amplitudes) ** 2).sum(axis=1) / count**2


def body_motion(places: Plane, speeds: Plane, numbers: Mapping[str, float]) -> tuple[Plane, Plane, Plane, Array]:
    """Centre of mass (...,) in m, turn (...,) as a number of size 1, velocity (...,) in m/s, and spin (...,) in rad/s of a rigid body, from
    the `places` (..., spheres) and `speeds` of its spheres, or only of the first and the last, which were at (`first_x`, `first_z`) and
    (`last_x`, `last_z`) (m) from the centre before it turned. Of complex numbers z + i x, whose angle grows from z to x."""
    first, last = (complex(numbers[f"{which}_z"], numbers[f"{which}_x"]) for which in ("first", "last"))
    turned = (places[..., -1] - places[..., 0]) / (last - first)
    turned = turned / np.abs(turned)
    centre = places[..., 0] - turned * first
    middle, mean = places.mean(axis=-1), speeds.mean(axis=-1)
    arm, way = places - middle[..., None], speeds - mean[..., None]
    spin = (np.conj(arm) * way).imag.sum(axis=-1) / (np.abs(arm) ** 2).sum(axis=-1)
    return centre, turned, mean + 1j * spin * (centre - middle), spin


def in_plane(vectors: Array) -> Plane:
    """Numbers z + i x (...,) of `vectors` (..., 3)."""
    return np.asarray(vectors[..., 2] + 1j * vectors[..., 0])


def joined(frame: GrainFrame, numbers: Mapping[str, float]) -> GrainFrame:
    """A frame whose last `body_spheres` grains, the spheres of a rigid body, are one grain with its mass `body_mass` (kg), at the centre of
    mass; see `body_motion`."""
    begin = len(frame.ids) - int(numbers["body_spheres"])
    kept = frame.select(np.arange(len(frame.ids)) <= begin)
    centre, _, velocity, spin = body_motion(in_plane(frame.positions[begin:]), in_plane(frame.velocities[begin:]), numbers)

    def ending(values: Array, last: ArrayLike) -> Array:
        return np.concatenate([values[:-1], [last]])

    positions = ending(kept.positions, [float(centre.imag), 0.0, float(centre.real)])
    return replace(kept, positions=positions, wrapped=positions, masses=ending(kept.masses, numbers["body_mass"]),
                   velocities=ending(kept.velocities, [float(velocity.imag), 0.0, float(velocity.real)]),
                   omegas=ending(kept.omegas, [0.0, float(spin), 0.0]))


def rigidity(frames: Sequence[GrainFrame], spheres: int) -> float:
    """Largest change (m) of the distance, in the plane of the layer, between any of the last `spheres` grains and the first or last of
    them, in any frame; a body that turns out of the plane changes these, too."""
    places = np.array([frame.positions[-spheres:, [0, 2]] for frame in frames])
    apart = np.linalg.norm(places[:, :, None] - places[:, None, [0, -1]], axis=3)
    return float(np.abs(apart - apart[0]).max())


@cached_per_replica
def read(replica: Replica) -> Trough:
    """What was written; the free part, where there is one, is the last body."""
    given, derived = replica.parameters, replica.derived
    frames = [joined(frame, derived) if "body_spheres" in derived else frame for frame in replica.grains()]
    run = read_phases(frames, int(derived["period_steps"]), replica.time_step)
    times = replica.times()
    kept = times["step"] >= run.frames[0].step
    part = len(run.frames[0].ids) - 1 if derived.get("free_part") else -1
    return Trough(run, part, {name: column[kept] for name, column in times.items()}, float(run.frames[0].masses.sum() * given["gravity"]),
                  float(derived["drive_speed"]), float(given["grain_diameter"]))


def numerical_changes(points: Points, quantities: Sequence[str]) -> Measurement:
    """How far steady `quantities` depend on the numerics: the largest less the smallest value over the size of the mean. Any two of
    the n points could have been the ends, so its half-width holds for all n (n - 1) / 2 differences together (Bonferroni)."""
    values = {}
    pairs = max(1, len(points) * (len(points) - 1) // 2)
    for quantity in quantities:
        found = [measured(point, quantity) for point in points]
        low, high = (pick(found, key=lambda one: one.value) for pick in (min, max))
        size = abs(float(np.mean([one.value for one in found])))
        half = joint_limit(low.half, high.half, math.inf, math.inf, 1.0 - (1.0 - CONFIDENCE) / pairs)
        change = Estimate((high.value - low.value) / size, half / size, "propagated from the points")
        values[f"{quantity}_change"] = Value(change, exact(0.0))
    return Measurement(values)


def drifts(runs: Sequence[Trough]) -> Curve:
    """Curve of the drift round the centre of mass of the grains over the distance from it."""
    width = 2.0 * runs[0].diameter
    reach = max(float(np.linalg.norm((one.places - one.places.mean(axis=1, keepdims=True))[..., [0, 2]], axis=2).max()) for one in runs)
    edges = np.arange(0.0, reach, width)

    def drift(one: Trough) -> Array:
        ways = one.run.displacements()[:, one.free]
        arm = one.places[:-PHASES][:, one.free] + 0.5 * ways
        arm = arm - arm.mean(axis=1, keepdims=True)
        distance = np.hypot(arm[..., 0], arm[..., 2])
        along = moment_about_y(arm, ways) / np.maximum(distance, 1e-300) / one.run.period
        return cell_means(along.ravel(), distance.reshape(-1, 1), np.ones(along.size), [edges])

    return profile("drift", "Drift round the bed's centre", "distance from the centre (d)", "m/s, positive from z to x",
                   0.5 * (edges[1:] + edges[:-1]) / runs[0].diameter, [drift(one) for one in runs])


def spectra(runs: Sequence[Trough], wall: str) -> Curve:
    """Curve of the force's spectrum: root mean square in bands of one harmonic."""
    found = []
    for one in runs:
        harmonics, power = one.spectrum(wall)
        band = np.round(harmonics).astype(int)
        found.append(np.sqrt(np.bincount(band, power)[1:]))
    shortest = min(len(one) for one in found)
    place = np.arange(1, shortest + 1)
    along, across = "log₁₀ of the harmonic of the drive", "log₁₀ of the root mean square / (M g)"
    return profile("spectrum", f"Force on the {wall}: spectrum", along, across,
                   np.log10(place), [np.log10(np.maximum(one[:shortest], 1e-12)) for one in found])
