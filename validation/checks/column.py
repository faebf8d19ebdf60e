"""A silo as measured: forces and stresses over height bands and sectors of the circumference, and Janssen's law for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.postproc import ContactFrame, GrainFrame, profiles, stress
from dembark.postproc.spheres import slice_volumes
from dembark.validation.checks.run import Replica, kinetic_friction, wall_friction
from dembark.validation.statistics import Estimate, block_mean
from numpy.typing import NDArray
from scipy.optimize import least_squares

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def janssen(depth: Array, length: float, weight: float) -> Array:
    """Janssen's sigma_zz in Pa at `depth` (m) for the decay length (m) and the specific weight rho_b g (N/m3)."""
    return weight * length * -np.expm1(-depth / length)


def two_parameter(depth: Array, length: float, onset: float, weight: float) -> Array:
    """The same with a hydrostatic zone down to the depth `onset` (m), exponential below it (Walker 1966, Vanel & Clement 1999)."""
    return np.where(depth < onset, weight * depth, weight * (length + (onset - length) * np.exp(-(depth - onset) / length)))


@dataclass(frozen=True)
class Column:
    """One replica: arrays over frames, height bands (or the levels between them) and sectors of the circumference, in SI units.

    Sectors (with soft borders) are equivalent by symmetry, so they resample the disorder of the packing: what is measured on those that
    are kept is scaled up to the whole circumference. `normal`, `shear` (frames, bands, sectors): wall forces (N);
    `lift`, `level_lift`: what the wall carries above; `weight_above`, `level_weight` (frames, bands): the grains' weight above;
    `field` (frames, bands): contact stress (Pa); `volume` (frames, bands, sectors): solid volume; `base` (frames,): force on the base.
    """

    edges: Array
    height: float
    radius: float
    diameter: float
    gravity: float
    mass: float
    normal: Array
    shear: Array
    lift: Array
    level_lift: Array
    weight_above: Array
    level_weight: Array
    field: Array
    volume: Array
    base: Array
    force_error: Estimate
    wall_friction: float
    kinetic_friction: float

    @property
    def middle(self) -> Array:
        """Mid-heights of the bands."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    @property
    def area(self) -> float:
        """Cross-section pi R^2."""
        return np.pi * self.radius**2

    @property
    def wall_area(self) -> Array:
        """Wall area 2 pi R dz of each band."""
        return 2.0 * np.pi * self.radius * np.diff(self.edges)

    @property
    def weight(self) -> float:
        """Specific weight rho_b g, the whole mass over the volume up to the surface."""
        return self.mass * self.gravity / (self.area * self.height)

    @property
    def lower(self) -> Mask:
        """Bands of the lower half, without the lowest diameter, where the base orders the packing."""
        return (self.middle > self.diameter) & (self.middle < 0.5 * self.height)

    def wall(self, forces: Array, frames: Mask, sectors: Mask) -> Array:
        """Mean wall stress (bands,) in Pa from `forces` on the kept sectors."""
        return self._whole(forces, frames, sectors) / self.wall_area

    def balance(self, frames: Mask) -> Array:
        """Mean sigma_zz (bands,) in Pa: weight above minus what the wall carries above, over the cross-section."""
        return (self.weight_above[frames] - self.lift[frames].sum(axis=2)).mean(axis=0) / self.area

    def level_balance(self, frames: Mask, sectors: Mask) -> Array:
        """The same at the levels between the bands (bands + 1,)."""
        return (self.level_weight[frames].mean(axis=0) - self._whole(self.level_lift, frames, sectors)) / self.area

    def _whole(self, values: Array, frames: Mask, sectors: Mask) -> Array:
        return values[frames][:, :, sectors].sum(axis=2).mean(axis=0) * (len(sectors) / sectors.sum())

    def stress_ratio(self, frames: Mask, sectors: Mask) -> float:
        """K. The balance stress is that of the whole column: it is known, and no sector has one of its own."""
        return float(self.wall(self.normal, frames, sectors)[self.lower].sum() / self.balance(frames)[self.lower].sum())

    def mobilisation(self, frames: Mask, sectors: Mask) -> float:
        """tau / sigma_rr."""
        return float(self.wall(self.shear, frames, sectors)[self.lower].sum() / self.wall(self.normal, frames, sectors)[self.lower].sum())

    def predicted_length(self, frames: Mask, sectors: Mask) -> float:
        """lambda = R / (2 K mu_mob)."""
        return self.radius / (2.0 * self.stress_ratio(frames, sectors) * self.mobilisation(frames, sectors))

    def fitted_length(self, frames: Mask, sectors: Mask) -> float:
        """lambda that fits the balance stress, the apparent mass above each level, best."""
        depth, measured = self._fit_data(frames, sectors)
        scale = measured.max()
        fit = least_squares(lambda p: (janssen(depth, np.exp(p[0]), self.weight) - measured) / scale, [np.log(2.0 * self.radius)])
        return float(np.exp(fit.x[0]))

    def fitted_pair(self, frames: Mask, sectors: Mask) -> tuple[float, float, float]:
        """(lambda, onset, gain): the two-parameter form and the share of Janssen's squared residuals that it removes."""
        depth, measured = self._fit_data(frames, sectors)
        scale, low, high = measured.max(), [0.01 * self.radius, 0.0], [100.0 * self.radius, 0.9 * self.height]
        fits = [
            least_squares(
                lambda p: (two_parameter(depth, p[0], p[1], self.weight) - measured) / scale,
                [2.0 * self.radius, min(start * self.radius, 0.8 * self.height)],
                bounds=(low, high),
                x_scale=self.radius,
            )
            for start in (0.1, 0.5, 1.0)
        ]
        best = min(fits, key=lambda fit: fit.cost)
        one = janssen(depth, self.fitted_length(frames, sectors), self.weight)
        rest = float(np.sum((two_parameter(depth, *best.x, self.weight) - measured) ** 2))
        # Where the second parameter helps nothing, the fit ends at a few rounding errors from zero.
        onset = float(best.x[1]) if best.x[1] > 1e-6 * self.radius else 0.0
        return float(best.x[0]), onset, max(0.0, 1.0 - rest / float(np.sum((one - measured) ** 2))) if onset else 0.0

    def _fit_data(self, frames: Mask, sectors: Mask) -> tuple[Array, Array]:
        levels = self.edges > 0.5 * self.diameter
        return self.height - self.edges[levels], self.level_balance(frames, sectors)[levels]

    def worst_deviation(self, frames: Mask, sectors: Mask) -> float:
        """Largest |predicted / measured - 1| of sigma_zz over the lower half."""
        predicted = janssen(self.height - self.middle, self.predicted_length(frames, sectors), self.weight)
        return float(np.abs(predicted / self.balance(frames) - 1.0)[self.lower].max())

    def base_share(self, frames: Mask, _: Mask | None = None) -> float:
        """Force on the base over the weight."""
        return float(self.base[frames].mean()) / (self.mass * self.gravity)

    def predicted_base_share(self, frames: Mask, sectors: Mask) -> float:
        """The same by Janssen's law with the predicted length."""
        return float(janssen(np.array([self.height]), self.predicted_length(frames, sectors), self.weight)[0]) / (self.weight * self.height)

    def solid_fraction(self, frames: Mask, sectors: Mask) -> float:
        """Between one diameter above the base and one below the surface."""
        inside = (self.middle > self.diameter) & (self.middle < self.height - self.diameter)
        return float(self._whole(self.volume, frames, sectors)[inside].sum() / (self.area * np.diff(self.edges)[inside].sum()))

    def field_errors(self) -> Array:
        """Relative deviation (frames,) of the contact-stress field from the balance, over the bands below the uppermost two diameters."""
        chosen = self.middle < self.height - 2.0 * self.diameter
        balance = (self.weight_above - self.lift.sum(axis=2)) / self.area
        total = balance[:, chosen].sum(axis=1)
        return (self.field[:, chosen].sum(axis=1) - total) / total.mean()


def read(replica: Replica) -> Column:
    """Measure one run folder."""
    values = replica.parameters
    radius, diameter, gravity = float(values["cylinder_radius"]), float(values["grain_diameter"]), float(values["gravity"])
    area = np.pi * radius**2
    height = float(np.mean([profiles.surface_height(frame.positions[:, 2], frame.radii, area) for frame in replica.grains()]))
    edges = np.linspace(0.0, height, max(4, round(height / diameter)) + 1)
    # About four diameters of arc each: further than forces at the wall know of each other.
    sectors = int(np.clip(round(2.0 * np.pi * radius / (4.0 * diameter)), 6, 24))
    rows: dict[str, list[Any]] = {}
    mass, first = 0.0, 0
    for grains, contacts in replica.paired_frames():
        first = first or grains.step
        mass = float(grains.masses.sum())
        for name, row in _frame_rows(grains, contacts, radius, gravity, edges, sectors).items():
            rows.setdefault(name, []).append(row)
    times = replica.times()
    lift = (times["side_fz"] + times["base_fz"])[times["step"] >= first]
    return Column(
        edges=edges,
        height=height,
        radius=radius,
        diameter=diameter,
        gravity=gravity,
        mass=mass,
        force_error=block_mean(lift / (mass * gravity) - 1.0),
        wall_friction=wall_friction(values),
        kinetic_friction=kinetic_friction(values),
        **{name: np.array(row) for name, row in rows.items()},
    )


def _shares(place: Array, sectors: int) -> Array:
    """Share (n, sectors) of each grain in the sectors: linear between the middles of the two it lies between.

    With sharp borders the chance on which side a grain's centre lies would pass for disorder of the packing.
    """
    turn = (np.arctan2(place[:, 1], place[:, 0]) / (2.0 * np.pi)) % 1.0 * sectors
    distance = np.abs(turn[:, None] - np.arange(sectors))
    return np.clip(1.0 - np.minimum(distance, sectors - distance), 0.0, None)


def overlap(sectors: int) -> float:
    """Variance among the sums over sectors that share grains in this way, over that of separate ones, for uncorrelated forces.

    Of each grain's share u and 1 - u, u even in [0, 1], the squares have the mean 2/3 and the products 1/3, the latter as covariance.
    """
    return 2.0 / 3.0 - 1.0 / (3.0 * (sectors - 1))


def _frame_rows(grains: GrainFrame, contacts: ContactFrame, radius: float, gravity: float, edges: Array, sectors: int) -> dict[str, Any]:
    place, side, base = grains.positions, grains.wall_forces["side"], grains.wall_forces["base"]
    heights, weights, area = place[:, 2], grains.masses * gravity, np.pi * radius**2
    shares = _shares(place, sectors).T
    wall_area = 2.0 * np.pi * radius * np.diff(edges)
    walls = [stress.cylinder_wall_stress(place, side * share[:, None], radius, edges) for share in shares]
    lines = [
        (contacts.first, contacts.branch, contacts.forces),
        stress.wall_branches(place, side, stress.on_cylinder(place, radius)),
        stress.wall_branches(place, base, stress.on_plane(place, 2, 0.0)),
    ]
    field = sum(stress.pair_stress(*line, axis=2, edges=edges, area=area) for line in lines)
    field = field + stress.kinetic_stress(place, grains.velocities, grains.masses, 2, edges, area)
    return {
        "normal": np.stack([normal * wall_area for normal, _ in walls], axis=1),
        "shear": np.stack([shear * wall_area for _, shear in walls], axis=1),
        "lift": np.stack([stress.mean_load_above(heights, side[:, 2] * share, edges) for share in shares], axis=1),
        "level_lift": np.stack([stress.load_above(heights, side[:, 2] * share, edges) for share in shares], axis=1),
        "weight_above": stress.mean_load_above(heights, weights, edges),
        "level_weight": stress.load_above(heights, weights, edges),
        "field": field[:, 2, 2],
        "volume": slice_volumes(heights, grains.radii, edges).T @ shares.T,
        "base": base[:, 2].sum(),
    }
