"""Impacts on a part, from a record of all grains that touch it every few steps: how often, how hard, where, what they wear away, and
their noise. The record has frames `stride` steps apart. An impact begins in a frame whose predecessor does not have the grain, and ends
with the last frame that does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from dembark.physics import effective_youngs_modulus
from dembark.physics.exact.contact_law import solved
from dembark.physics.exact.impacts import Impacts
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Numbers, Value, exact, over_replicas, profile
from dembark.postproc.output.vtkhdf import Surface
from dembark.postproc.statistics import block_mean
from dembark.postproc.walls.mesh import PRECISION, cut
from dembark.postproc.wear import removed_volume

from .estimates import divided, over_chaotic
from .part_noise import Noise, octave_curves

if TYPE_CHECKING:
    from dembark.postproc.walls import MeshWall


@dataclass(frozen=True)
class ContactRecord:
    """All (n,) samples of grains on the part: `steps`, `ids`, `masses` (kg): what a grain hits with, its own with a part that is far
    heavier; `radii` (m): of curvature of both surfaces together, and `run_radii` where the run has another part than the true one;
    `closing` (m/s): speed towards the part along its normal, `slip` (m/s): speed of the centre along the part; `points` (n, 3): in m, where
    on the part, in its own frame; `normals` (n, 3), to the grain; `forces` (n, 3) of the part on the grain (N). Of a window of `periods`
    periods of `period` s after the step `first`, sampled every `stride` steps of `time_step` s; `area` of the part (m2)."""

    steps: NDArray[np.int64]
    ids: NDArray[np.int64]
    masses: Array
    radii: Array
    run_radii: Array
    closing: Array
    slip: Array
    points: Array
    normals: Array
    forces: Array
    stride: int
    time_step: float
    first: int
    periods: int
    period: float
    area: float

    @property
    def begins(self) -> NDArray[np.bool_]:
        """Samples (n,) in which an impact begins: the grain was not on the part one frame before, and came from outside."""
        order = np.lexsort((self.steps, self.ids))
        same = (np.diff(self.ids[order]) == 0) & (np.diff(self.steps[order]) == self.stride)
        begins = np.ones(len(order), bool)
        begins[order[1:]] = ~same
        return begins & (self.closing > 0.0) & (self.steps > self.first)

    @property
    def window(self) -> float:
        """Length (s)."""
        return self.periods * self.period

    def _by_period(self, values: Array, chosen: NDArray[np.bool_]) -> Array:
        number = ((self.steps[chosen] - self.first - 1) * self.time_step / self.period).astype(int)
        return np.bincount(np.clip(number, 0, self.periods - 1), values[chosen], self.periods).astype(float)

    def rate(self, values: Array | None = None) -> Estimate:
        """Impacts per second; or what the `values` (impacts,) of the impacts add up to per second."""
        every = np.zeros(len(self.steps))
        every[self.begins] = 1.0 if values is None else values
        return block_mean(self._by_period(every, self.begins) / self.period)

    def energies(self) -> Array:
        """Energies (impacts,) in J of the normal motion against the part, m v^2 / 2."""
        chosen = self.begins
        return np.asarray(0.5 * self.masses[chosen] * self.closing[chosen] ** 2)

    def energy(self) -> Estimate:
        """Mean energy of an impact (J), with the interval of the ratio of both sums over periods."""
        chosen = self.begins
        sums = self._by_period(0.5 * self.masses * self.closing**2, chosen)
        counts = self._by_period(np.ones(len(self.steps)), chosen)
        mean = float(sums.sum() / counts.sum())
        # Linear in what each period adds: the residuals about the mean have the ratio's error.
        rest = block_mean(sums - mean * counts)
        return Estimate(mean, rest.half / float(counts.mean()), rest.basis)

    def impulse(self) -> Array:
        """Impulse (3,) in N s of the part on the grains in the window."""
        inside = self.steps > self.first
        return np.asarray(self.forces[inside].sum(axis=0) * self.stride * self.time_step)

    def paths(self) -> tuple[Array, Array]:
        """Speeds (impacts,) in m/s of the centres, and angles (impacts,) in rad of their paths from the surface."""
        closing, slip = self.closing[self.begins], self.slip[self.begins]
        return np.hypot(closing, slip), np.arctan2(closing, slip)

    def shadows(self, radii: Array, modulus: float, restitution: float) -> tuple[Array, Array]:
        """Peak forces (impacts,) in N and durations (impacts,) in s of half sines (see `lone_impacts`) of the same impacts, each solved
        anew as that of a single grain, with the `radii` (n,) in m and another `modulus` (Pa, E*)."""
        chosen = self.begins
        return lone_impacts(self.masses[chosen], radii[chosen], self.closing[chosen], modulus, restitution)

    def peaks(self) -> Array:
        """Largest recorded forces (impacts,) in N along the normal, while the grain stays on the part."""
        order = np.lexsort((self.steps, self.ids))
        begins = self.begins[order]
        apart = np.append(True, (np.diff(self.ids[order]) != 0) | (np.diff(self.steps[order]) != self.stride))
        push = np.einsum("na,na->n", self.forces, self.normals)[order]
        starts = np.flatnonzero(apart)
        found = np.zeros(len(order))
        if len(starts):
            found[order[starts]] = np.maximum.reduceat(push, starts)
        assert apart[begins].all()
        return found[self.begins]

    def normal_force(self) -> Array:
        """Sum (frames, 3) in N of the normal forces of the part on the grains, in each frame of the window."""
        last = self.first + round(self.window / self.time_step)
        frames = np.arange(self.first + self.stride, last + 1, self.stride)
        inside = self.steps > self.first
        push = np.einsum("na,na->n", self.forces, self.normals)[:, None] * self.normals
        number = (self.steps[inside] - self.first) // self.stride - 1
        return np.column_stack([np.bincount(number, column, len(frames))[: len(frames)] for column in push[inside].T])


def lone_impacts(masses: Array, radii: Array, closing: Array, modulus: float, restitution: float) -> tuple[Array, Array]:
    """Peak forces (n,) in N of grains with `masses` (kg) and `radii` (m) that each hit a plane of infinite mass with the speeds `closing`
    (m/s) along its normal: Hertz with the `modulus` (Pa, E*) and the dashpot of this `restitution`; and durations (n,) in s of the half
    sines with these peaks and the impulses of the impacts. With the durations of the contacts they would have 1.17 times the impulse of an
    elastic impact, 1.29 times that of a restitution of 0.5."""
    peaks = _damped(restitution) * _on_plane(masses, radii, closing, modulus, restitution).peak_force
    return peaks, 0.5 * np.pi * (1.0 + restitution) * masses * closing / peaks


def mean_pressures(forces: Array, radii: Array, modulus: float) -> Array:
    """Mean pressures (n,) in Pa of contacts of spheres with `radii` (n,) and a plane under `forces` (n,) in N: Hertz, a^3 = 3 F R / (4
    E*), with the `modulus` E* (Pa)."""
    return np.asarray(forces / (np.pi * (0.75 * forces * radii / modulus) ** (2.0 / 3.0)))


def _on_plane(masses: Array, radii: Array, closing: Array, modulus: float, restitution: float) -> Impacts:
    one, zero = np.ones_like(masses), np.zeros((2, len(masses)))
    return Impacts(modulus * one, modulus * one, restitution * one, 0.0 * one, np.array([radii, np.inf * one]),
                   np.array([masses, np.inf * one]), zero, np.array([-closing, 0.0 * one]), zero)


@cache
def _damped(restitution: float) -> float:
    """Peak force over that of an elastic impact: the law has no speed or size of its own, so it holds for all."""
    one = np.ones(1)
    unit = _on_plane(one, one, one, 1.0, restitution)
    return float(solved(unit, 100).force[0] / unit.peak_force[0])


def own_modulus(p: Numbers) -> float:
    """E* (Pa) of a grain on the part in the run."""
    return effective_youngs_modulus(*[p["youngs_modulus"], p["poisson_ratio"]] * 2)


def true_modulus(p: Numbers) -> float:
    """E* (Pa) of what grains and part are made of."""
    return effective_youngs_modulus(p["grain_material_modulus"], p["poisson_ratio"], p["part_material_modulus"], p["poisson_ratio"])


def volumes(one: ContactRecord, p: Numbers) -> Array:
    """Volume (impacts,) in m^3 that each impact removes, by Finnie."""
    return removed_volume(one.masses[one.begins], *one.paths(), p["flow_pressure"])


def lone_impact(one: ContactRecord, p: Numbers) -> float:
    """Median over impacts of the recorded peak force over that of one grain alone, with the modulus of the run."""
    return float(np.median(one.peaks() / one.shadows(one.run_radii, own_modulus(p), p["restitution"])[0]))


def impact_measurement(records: Sequence[ContactRecord], part: MeshWall, p: Numbers, speed: float) -> Measurement:
    """What the group `part_impacts` of quantities declares, its curves, and the map on the surface of the `part`, of the `records` of all
    packings; `speed` (m/s): highest of the drive. Where nothing hit the part in one of them, only the number of impacts."""
    rate = Value(over_replicas([one.rate() for one in records]))
    if not all(one.begins.any() for one in records):
        return Measurement({"impact_rate": rate})
    unit = 0.5 * p["grain_density"] * math.pi / 6.0 * p["grain_diameter"] ** 3 * speed**2
    worn = [volumes(one, p) for one in records]
    shadows = [one.shadows(one.radii, true_modulus(p), p["restitution"]) for one in records]
    forces = [peaks for peaks, _ in shadows]
    surface = surface_map(part, records, forces, worn, p["grain_diameter"])
    wear = surface.values["wear"][0]
    noise = [Noise(one, one.shadows(one.run_radii, own_modulus(p), p["restitution"]), pulses)
             for one, pulses in zip(records, shadows, strict=True)]
    values = {
        "impact_rate": rate, "impact_energy": Value(divided(over_replicas([one.energy() for one in records]), unit)),
        "wear_rate": Value(divided(over_replicas([one.rate(own) for one, own in zip(records, worn, strict=True)]), records[0].area)),
        "wear_of_an_impact": Value(over_chaotic(float(own.mean()) for own in worn)),
        "wear_peak": Value(over_chaotic([float(wear.max() / np.average(wear, weights=surface.areas))])),
        "peak_force": Value(over_chaotic(float(own.mean()) for own in forces)),
        "peak_force_99": Value(over_chaotic(float(np.quantile(own, 0.99)) for own in forces)),
        "dents": Value(over_chaotic(
            (float((mean_pressures(own, one.radii[one.begins], true_modulus(p)) > p["flow_pressure"]).mean())
             for one, own in zip(records, forces, strict=True)), 1.0 / min(map(len, forces)))),
        "lone_impact": Value(over_chaotic(lone_impact(one, p) for one in records), exact(1.0)),
        "octave_sum": Value(exact(max(abs(one.unexplained) for one in noise)), exact(0.0)),
        "pulse_noise": Value(over_chaotic(one.ratio for one in noise)),
        "audible_force": Value(over_chaotic(one.audible for one in noise)),
    }
    return Measurement(values, [histogram(records, unit), force_histogram(records, forces), *octave_curves(noise)], surface=surface)


def histogram(runs: Sequence[ContactRecord], unit: float) -> Curve:
    """Curve of the impacts per second over the logarithm of their energy in units of `unit` (J)."""
    return _counts("impacts", "Impacts on the part", "log₁₀ of the energy / (m V² / 2)", np.linspace(-4.0, 2.0, 25), runs,
                   [one.energies() / unit for one in runs])


def force_histogram(runs: Sequence[ContactRecord], forces: list[Array]) -> Curve:
    """Curve of the impacts per second over the logarithm of their peak `forces` (impacts,) in N of each run."""
    return _counts("forces", "Peak forces on the part", "log₁₀ of the peak force / N", np.linspace(-1.0, 4.0, 26), runs, forces)


def _counts(name: str, title: str, along: str, edges: Array, runs: Sequence[ContactRecord], values: list[Array]) -> Curve:
    found = [np.histogram(np.log10(own), bins=edges)[0] / one.window for one, own in zip(runs, values, strict=True)]
    return profile(name, title, along, "impacts per second and bin", 0.5 * (edges[1:] + edges[:-1]), found)


def surface_area(part: MeshWall, depth: float) -> float:
    """Area (m2) of the outside of the `part` that a layer of grains `depth` (m) wide can reach."""
    return float(np.linalg.norm(np.diff(outline(part), axis=1), axis=2).sum()) * depth


def outline(part: MeshWall) -> Array:
    """Straight pieces (k, 2, 2) of x and z in m of the section of the `part` by y = 0, without those round cavities, out of reach."""
    pieces = cut(part.triangles)
    near = cKDTree(pieces.reshape(-1, 2)).query_pairs(PRECISION, output_type="ndarray") // 2
    count = len(pieces)
    loops, loop = connected_components(coo_matrix((np.ones(len(near)), near.T), shape=(count, count)), directed=False)
    outside = np.ones(loops, bool)
    for number in range(loops):
        # A ray from inside of another loop crosses that an odd number of times.
        x, z = pieces[loop == number][0, 0]
        crossed = (pieces[:, 0, 0] > x) != (pieces[:, 1, 0] > x)
        one, other = np.moveaxis(pieces[crossed], 1, 0)
        above = one[:, 1] + (x - one[:, 0]) / (other[:, 0] - one[:, 0]) * (other[:, 1] - one[:, 1]) > z
        times = np.bincount(loop[crossed][above], minlength=loops)
        outside[number] = not (np.delete(times, number) % 2).any()
    # Where a triangle has but a corner in the plane, its piece has no length.
    return np.asarray(pieces[outside[loop] & (np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1) > PRECISION)])


def strips(part: MeshWall, size: float) -> Array:
    """The `outline` of the `part` in straight pieces (k, 2, 2) of x and z in m, none longer than `size` (m)."""
    pieces = []
    for one, other in outline(part):
        parts = max(1, int(np.ceil(np.linalg.norm(other - one) / size - 1e-9)))
        ends = one + np.linspace(0.0, 1.0, parts + 1)[:, None] * (other - one)
        pieces.append(np.stack([ends[:-1], ends[1:]], axis=1))
    return np.concatenate(pieces)


def nearest(pieces: Array, places: Array) -> NDArray[np.int64]:
    """Number (n,) of the one of the straight `pieces` (k, 2, 2) that is nearest to each of `places` (n, 2)."""
    start, sides = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    along = np.einsum("nka,ka->nk", places[:, None] - start, sides) / (sides**2).sum(axis=1)
    points = start + np.clip(along, 0.0, 1.0)[..., None] * sides
    return np.asarray(np.argmin(((points - places[:, None]) ** 2).sum(axis=2), axis=1), np.int64)


def surface_map(part: MeshWall, runs: Sequence[ContactRecord], forces: list[Array], volumes: list[Array], depth: float) -> Surface:
    """What impacts of all `runs` do to strips of the part, as long as the layer of grains is wide (`depth`, m) and up to half of that wide:
    impacts and energy a second and area, largest and mean of the peak `forces` (N), and depth that is worn away a second, by `volumes`
    (m^3) of the impacts of each run."""
    pieces = strips(part, 0.5 * depth)
    count, window = len(pieces), sum(one.window for one in runs)
    cell = np.concatenate([nearest(pieces, one.points[one.begins][:, [0, 2]]) for one in runs])
    areas = depth * np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)

    def total(values: list[Array]) -> Array:
        return np.asarray(np.bincount(cell, np.concatenate(values), count), float)

    hits, largest = np.bincount(cell, minlength=count), np.zeros(count)
    np.maximum.at(largest, cell, np.concatenate(forces))
    values = {
        "impacts": (hits / (window * areas), "m-2 s-1"), "energy": (total([one.energies() for one in runs]) / (window * areas), "W m-2"),
        "largest_force": (largest, "N"), "mean_force": (total(forces) / np.maximum(hits, 1), "N"),
        "wear": (total(volumes) / (window * areas), "m s-1"),
    }
    # Corners of each strip in turn.
    corners = [np.insert(pieces[:, end], 1, side * depth, axis=1) for end, side in ((0, -0.5), (1, -0.5), (1, 0.5), (0, 0.5))]
    return Surface(np.stack(corners, axis=1).reshape(-1, 3), np.arange(4 * count).reshape(-1, 4), values)
