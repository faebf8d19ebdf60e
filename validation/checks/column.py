"""A silo as measured: forces and stresses over height bands and sectors of the circumference, and Janssen's law for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.physics import capillary_force
from dembark.postproc import ContactFrame, GrainFrame, profiles, stress
from dembark.postproc.spheres import slice_volumes
from dembark.validation.checks import vessel as vessels
from dembark.validation.checks.run import Replica, kinetic_friction, wall_friction
from dembark.validation.checks.vessel import Vessel
from dembark.postproc.statistics import Estimate, block_mean
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
    """One replica: arrays over frames, height bands (or the levels between them) and sectors of the walls, in SI units.

    Sectors (with soft borders) are equivalent by symmetry, so they resample the disorder of the packing: what is measured on those that
    are kept is scaled up to the whole. `normal`, `shear` (frames, bands, sectors): wall forces (N);
    `lift`, `level_lift`: what the wall carries above; `weight_above`, `level_weight` (frames, bands): the grains' weight above;
    `net_above` (frames, bands): the upward force (N) that accelerates the grains above;
    `adhesion` (frames, bands, sectors): what liquid bridges pull the grains to the wall with (N), so that they press on it with `normal` +
    `adhesion`; `field` (frames, bands): contact stress (Pa); `volume` (frames, bands, sectors): solid volume; `base` (frames,): force on
    the base.
    """

    edges: Array
    height: float
    vessel: Vessel
    diameter: float
    gravity: float
    mass: float
    normal: Array
    shear: Array
    adhesion: Array
    lift: Array
    level_lift: Array
    weight_above: Array
    level_weight: Array
    net_above: Array
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
    def size(self) -> float:
        """R of a cylinder, distance W of the walls of a plane silo: the length in Janssen's law."""
        return self.vessel.size

    @property
    def area(self) -> float:
        """Cross-section."""
        return self.vessel.area

    @property
    def wall_area(self) -> Array:
        """Wall area of each band, 2 / size of its volume."""
        return 2.0 * self.area / self.size * np.diff(self.edges)

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

    def adhesive_stress(self, frames: Mask, sectors: Mask) -> float:
        """a: pull of the liquid bridges over the wall's area (Pa), lower half; 0 when dry."""
        return float(self.wall(self.adhesion, frames, sectors)[self.lower].mean())

    def mobilisation(self, frames: Mask, sectors: Mask) -> float:
        """tau / (sigma_rr + a): friction grows with the pressure in the contacts, which is the wall's stress and what bridges add to it."""
        pressure = self.wall(self.normal, frames, sectors) + self.wall(self.adhesion, frames, sectors)
        return float(self.wall(self.shear, frames, sectors)[self.lower].sum() / pressure[self.lower].sum())

    def hanging_weight(self, frames: Mask, sectors: Mask) -> float:
        """rho_b g - 2 mu_mob a / size (N/m3): the specific weight less what adhesion alone hangs on the wall."""
        carried = 2.0 * self.mobilisation(frames, sectors) * self.adhesive_stress(frames, sectors) / self.size
        return self.weight - carried

    def predicted_length(self, frames: Mask, sectors: Mask) -> float:
        """lambda = size / (2 K mu_mob)."""
        return self.size / (2.0 * self.stress_ratio(frames, sectors) * self.mobilisation(frames, sectors))

    def fitted_length(self, frames: Mask, sectors: Mask) -> float:
        """lambda that fits the balance stress, the apparent mass above each level, best."""
        depth, measured = self._fit_data(frames, sectors)
        scale, weight = measured.max(), self.hanging_weight(frames, sectors)
        fit = least_squares(lambda p: (janssen(depth, np.exp(p[0]), weight) - measured) / scale, [np.log(2.0 * self.size)])
        return float(np.exp(fit.x[0]))

    def fitted_pair(self, frames: Mask, sectors: Mask) -> tuple[float, float, float]:
        """(lambda, onset, gain): the two-parameter form and the share of Janssen's squared residuals that it removes."""
        depth, measured = self._fit_data(frames, sectors)
        scale, low, high = measured.max(), [0.01 * self.size, 0.0], [100.0 * self.size, 0.9 * self.height]
        weight = self.hanging_weight(frames, sectors)
        fits = [
            least_squares(
                lambda p: (two_parameter(depth, p[0], p[1], weight) - measured) / scale,
                [2.0 * self.size, min(start * self.size, 0.8 * self.height)],
                bounds=(low, high),
                x_scale=self.size,
            )
            for start in (0.1, 0.5, 1.0)
        ]
        best = min(fits, key=lambda fit: fit.cost)
        one = janssen(depth, self.fitted_length(frames, sectors), weight)
        rest = float(np.sum((two_parameter(depth, *best.x, weight) - measured) ** 2))
        # Where the second parameter helps nothing, the fit ends at a few rounding errors from zero.
        onset = float(best.x[1]) if best.x[1] > 1e-6 * self.size else 0.0
        return float(best.x[0]), onset, max(0.0, 1.0 - rest / float(np.sum((one - measured) ** 2))) if onset else 0.0

    def _fit_data(self, frames: Mask, sectors: Mask) -> tuple[Array, Array]:
        levels = self.edges > 0.5 * self.diameter
        return self.height - self.edges[levels], self.level_balance(frames, sectors)[levels]

    def predicted_stress(self, depth: Array, frames: Mask, sectors: Mask) -> Array:
        """sigma_zz at `depth` (m) by Janssen's law with the predicted length and what adhesion hangs on the wall."""
        return janssen(depth, self.predicted_length(frames, sectors), self.hanging_weight(frames, sectors))

    def worst_deviation(self, frames: Mask, sectors: Mask) -> float:
        """Largest |predicted / measured - 1| of sigma_zz over the lower half."""
        predicted = self.predicted_stress(self.height - self.middle, frames, sectors)
        return float(np.abs(predicted / self.balance(frames) - 1.0)[self.lower].max())

    def base_share(self, frames: Mask, _: Mask | None = None) -> float:
        """Force on the base over the weight."""
        return float(self.base[frames].mean()) / (self.mass * self.gravity)

    def predicted_base_share(self, frames: Mask, sectors: Mask) -> float:
        """The same by Janssen's law with the predicted length."""
        return float(self.predicted_stress(np.array([self.height]), frames, sectors)[0]) / (self.weight * self.height)

    def solid_fraction(self, frames: Mask, sectors: Mask) -> float:
        """Between one diameter above the base and one below the surface."""
        inside = (self.middle > self.diameter) & (self.middle < self.height - self.diameter)
        return float(self._whole(self.volume, frames, sectors)[inside].sum() / (self.area * np.diff(self.edges)[inside].sum()))

    def field_errors(self) -> Array:
        """Relative deviation (frames,) of the contact-stress field from the balance, over the bands below the uppermost two diameters.

        With what accelerates the grains above, the balance holds in each frame, not only in the mean of many.
        """
        chosen = self.middle < self.height - 2.0 * self.diameter
        balance = (self.weight_above - self.lift.sum(axis=2) + self.net_above) / self.area
        total = balance[:, chosen].sum(axis=1)
        return (self.field[:, chosen].sum(axis=1) - total) / total.mean()


def read(replica: Replica) -> Column:
    """Measure one run folder."""
    values = replica.parameters
    vessel, diameter, gravity = vessels.of(values), float(values["grain_diameter"]), float(values["gravity"])
    height = float(np.mean([profiles.surface_height(frame.positions[:, 2], frame.radii, vessel.area) for frame in replica.grains()]))
    edges = np.linspace(0.0, height, max(4, round(height / diameter)) + 1)
    sectors = vessel.sectors(diameter)
    rows: dict[str, list[Any]] = {}
    mass, first = 0.0, 0
    for grains, contacts in replica.paired_frames():
        first = first or grains.step
        mass = float(grains.masses.sum())
        for name, row in _frame_rows(grains, contacts, vessel, gravity, edges, sectors, _wall_bridges(values)).items():
            rows.setdefault(name, []).append(row)
    times = replica.times()
    lift = sum(times[f"{name}_fz"] for name in (*vessel.names, "base"))[times["step"] >= first]
    return Column(
        edges=edges,
        height=height,
        vessel=vessel,
        diameter=diameter,
        gravity=gravity,
        mass=mass,
        force_error=block_mean(lift / (mass * gravity) - 1.0),
        wall_friction=wall_friction(values),
        kinetic_friction=kinetic_friction(values),
        **{name: np.array(row) for name, row in rows.items()},
    )


Bridges = Callable[[Array], Array]


def _wall_bridges(values: Mapping[str, Any]) -> Bridges | None:
    """Force (N) of a liquid bridge between the wall and touching grains of given radii (m); None when the run is dry."""
    own, content = float(values.get("bridge_volume") or 0.0), float(values.get("liquid_content") or 0.0)
    if own <= 0.0 and content <= 0.0:
        return None

    def pull(radii: Array) -> Array:
        # A bridge to the wall takes half of what a grain carries, or less when others came first; its force at touching hardly depends on it.
        volume = 0.5 * content * 4.0 / 3.0 * np.pi * radii**3 if content > 0.0 else own
        return np.asarray(
            capillary_force(
                radii, np.inf, 0.0, volume, float(values["surface_tension"]), float(values["contact_angle"]), model=str(values["capillary_model"])
            )
        )

    return pull


def _wall_pull(grains: GrainFrame, side: Array, vessel: Vessel, bridges: Bridges | None) -> Array:
    """Force (n,) in N of the wall's liquid bridges on each grain, towards the wall.

    A grain that touches the wall has a bridge to it, whose force does not depend on the overlap. One that does not touch feels nothing but
    its bridge, if it has one.
    """
    pull = np.zeros(len(grains.radii))
    if bridges is not None:
        touching = vessel.distance(grains.positions) <= grains.radii
        pull = np.where(touching, 0.0, -np.einsum("na,na->n", side, vessel.inward(grains.positions)))
        pull[touching] = bridges(grains.radii[touching])
    return pull


def _frame_rows(
    grains: GrainFrame, contacts: ContactFrame, vessel: Vessel, gravity: float, edges: Array, sectors: int, bridges: Bridges | None = None
) -> dict[str, Any]:
    place, base = grains.positions, grains.wall_forces["base"]
    side = np.sum([grains.wall_forces[name] for name in vessel.names], axis=0)
    heights, weights, area = place[:, 2], grains.masses * gravity, vessel.area
    inward = vessel.inward(place)
    push, pull = np.einsum("na,na->n", side, inward), _wall_pull(grains, side, vessel, bridges)
    shares = vessel.wall_shares(place, sectors).T

    def in_bands(forces: Array) -> Array:
        return np.stack([np.histogram(heights, bins=edges, weights=forces * share)[0] for share in shares], axis=1)

    lines = [
        (contacts.first, contacts.branch, contacts.forces),
        stress.wall_branches(place, side, place - inward * vessel.distance(place)[:, None]),
        stress.wall_branches(place, base, stress.on_plane(place, 2, 0.0)),
    ]
    field = sum(stress.pair_stress(*line, axis=2, edges=edges, area=area) for line in lines)
    field = field + stress.kinetic_stress(place, grains.velocities, grains.masses, 2, edges, area)
    return {
        "normal": in_bands(push),
        "shear": in_bands(side[:, 2]),
        "adhesion": in_bands(pull),
        "lift": np.stack([stress.mean_load_above(heights, side[:, 2] * share, edges) for share in shares], axis=1),
        "level_lift": np.stack([stress.load_above(heights, side[:, 2] * share, edges) for share in shares], axis=1),
        "weight_above": stress.mean_load_above(heights, weights, edges),
        "level_weight": stress.load_above(heights, weights, edges),
        "net_above": stress.mean_load_above(heights, grains.forces[:, 2], edges),
        "field": field[:, 2, 2],
        "volume": slice_volumes(heights, grains.radii, edges).T @ vessel.volume_shares(place, grains.radii, sectors),
        "base": base[:, 2].sum(),
    }
