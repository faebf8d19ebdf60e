"""A silo as measured: forces and stresses over height bands and sectors of the walls, and Janssen's law from them. Cross-section and solid
fraction count the volume up to the wall. K: normal stress of the wall over the mean sigma_zz of the cross-section. mu_mob: shear over
normal stress of the wall. Both are measured in the bulk, without one diameter at base and surface. K mu_mob is shear over sigma_zz, and the
balance of forces has the same shear, so Janssen's law with them holds for any shear proportional to sigma_zz. A prediction is the law with
`contact_ratio`, K of the forces between grains, and the kinetic friction of the wall, where the wall mobilises it. Liquid bridges pull
grains to the wall with a stress a: tau = mu_mob (K sigma + a) leads to the same law with the specific weight rho_b g - 2 mu_mob a / R."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.physics import capillary_force
from dembark.postproc import ContactFrame, GrainFrame, profiles, stress
from dembark.postproc.measurement import Array, Estimate, Replica, block_mean
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.spheres import slice_volumes

from . import janssen
from .silo_geometry import Container, container

Mask = NDArray[np.bool_]
Bridges = Callable[[Array], Array]

# A contact slides when its surfaces pass each other with more than this share of the wall's speed. Between 0.05 and 0.2 the load that
# slides changes by a thirtieth, its friction by a thousandth.
SLIDES = 0.1


@dataclass(frozen=True)
class Column:
    """One replica: arrays over frames, height bands (or the levels between them) and sectors of the walls, in SI units; `friction`: kinetic
    coefficient of the walls. Sectors are equivalent by symmetry and resample the packing: sums over those that are kept are scaled up.
    (frames, bands, sectors): wall forces `normal`, `shear` and `adhesion`, the pull of liquid bridges (N); solid `volume` (m3); contact
    stress towards the walls, `pressing` (Pa). (frames, bands): `lift` of the walls, `weight_above` and `net_above`, the upward force that
    accelerates the grains above (N); vertical contact stress `field` (Pa). (frames, levels, ...): `level_lift`, by sectors too,
    `level_weight`. (frames,): force on the `base` (N). (frames, 3): `rubbing`, normal force of all contacts with the wall in the bulk, and
    normal force and friction of those that slide (N)."""

    edges: Array
    height: float
    vessel: Container
    diameter: float
    gravity: float
    friction: float
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
    pressing: Array
    rubbing: Array
    volume: Array
    base: Array
    force_error: Estimate

    @property
    def middle(self) -> Array:
        """Mid-heights of the bands."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    @property
    def wall_area(self) -> Array:
        """Wall area of each band, 2 / size of its volume."""
        return 2.0 * self.vessel.area / self.vessel.size * np.diff(self.edges)

    @property
    def weight(self) -> float:
        """Specific weight rho_b g, all mass over the volume up to the surface."""
        return self.mass * self.gravity / (self.vessel.area * self.height)

    @property
    def bulk(self) -> Mask:
        """Bands without one diameter above the base, which orders the packing, and one below the surface."""
        return (self.middle > self.diameter) & (self.middle < self.height - self.diameter)

    @property
    def lower(self) -> Mask:
        """Bands of the lower half of them, where the stress is high enough for relative deviations."""
        return self.bulk & (self.middle < 0.5 * self.height)

    @property
    def everything(self) -> tuple[Mask, Mask]:
        """Masks of all frames and all sectors."""
        return np.ones(len(self.base), bool), np.ones(self.shear.shape[2], bool)

    def wall(self, forces: Array, frames: Mask, sectors: Mask) -> Array:
        """Mean wall stress (bands,) in Pa from `forces` on the kept sectors."""
        return self._whole(forces, frames, sectors) / self.wall_area

    def pressure(self, frames: Mask, sectors: Mask) -> Array:
        """Stress (bands,) in Pa of the contacts at the wall: the wall's net normal stress and what bridges add to it."""
        return self.wall(self.normal, frames, sectors) + self.wall(self.adhesion, frames, sectors)

    def balance(self, frames: Mask) -> Array:
        """Mean sigma_zz (bands,) in Pa: weight above minus what the wall carries above, over the cross-section."""
        return (self.weight_above[frames] - self.lift[frames]).mean(axis=0) / self.vessel.area

    def _whole(self, values: Array, frames: Mask, sectors: Mask) -> Array:
        return values[frames][:, :, sectors].sum(axis=2).mean(axis=0) * (len(sectors) / sectors.sum())

    def stress_ratio(self, frames: Mask, sectors: Mask) -> float:
        """K. The balance stress is that of the full column: it is known, and no sector has one of its own."""
        return float(self.wall(self.normal, frames, sectors)[self.bulk].sum() / self.balance(frames)[self.bulk].sum())

    def contact_ratio(self, frames: Mask, sectors: Mask) -> float:
        """K of the contact stress alone, mean over the section: no force that a wall's shear has a part in."""
        return float(self._whole(self.pressing, frames, sectors)[self.bulk].sum() / self.field[frames].mean(axis=0)[self.bulk].sum())

    def adhesive_stress(self, frames: Mask, sectors: Mask) -> float:
        """a: pull of the liquid bridges over the wall's area (Pa); 0 when dry."""
        return float(self.wall(self.adhesion, frames, sectors)[self.bulk].mean())

    def mobilisation(self, frames: Mask, sectors: Mask) -> float:
        """mu_mob."""
        return float(self.wall(self.shear, frames, sectors)[self.bulk].sum() / self.pressure(frames, sectors)[self.bulk].sum())

    def sliding_load(self, frames: Mask, _: Mask | None = None) -> float:
        """Share of the walls' normal force in contacts that slide."""
        every, sliding, _friction = self.rubbing[frames].sum(axis=0)
        return float(sliding / every)

    def sliding_friction(self, frames: Mask, _: Mask | None = None) -> float:
        """Friction over normal force of the contacts that slide; NaN when none does."""
        _every, sliding, friction = self.rubbing[frames].sum(axis=0)
        return float(friction / sliding) if sliding > 0.0 else math.nan

    def hanging_weight(self, frames: Mask, sectors: Mask) -> float:
        """rho_b g - 2 mu_mob a / size (N/m3): the specific weight less what adhesion alone hangs on the wall."""
        return self.weight - 2.0 * self.mobilisation(frames, sectors) * self.adhesive_stress(frames, sectors) / self.vessel.size

    def predicted_length(self, frames: Mask, sectors: Mask) -> float:
        """lambda = size / (2 K mu_mob)."""
        return self.vessel.size / (2.0 * self.stress_ratio(frames, sectors) * self.mobilisation(frames, sectors))

    def _fit_data(self, frames: Mask, sectors: Mask) -> tuple[Array, Array, float]:
        """Depths and balance stress of the levels, the apparent mass above each of them, and the specific weight for a fit."""
        levels = self.edges > 0.5 * self.diameter
        carried = (self.level_weight[frames].mean(axis=0) - self._whole(self.level_lift, frames, sectors)) / self.vessel.area
        return self.height - self.edges[levels], carried[levels], self.hanging_weight(frames, sectors)

    def fitted_length(self, frames: Mask, sectors: Mask) -> float:
        """lambda that fits the balance stress best."""
        depth, measured, weight = self._fit_data(frames, sectors)
        return janssen.fitted_length(depth, measured, 2.0 * self.vessel.size, weight)

    def fitted_pair(self, frames: Mask, sectors: Mask) -> tuple[float, float, float]:
        """(lambda, onset, gain): the two-parameter form and the share of Janssen's squared residuals that it removes."""
        (depth, measured, weight), size = self._fit_data(frames, sectors), self.vessel.size
        starts = [(2.0 * size, min(start * size, 0.8 * self.height)) for start in (0.1, 0.5, 1.0)]
        limits = ((0.01 * size, 100.0 * size), (0.0, 0.9 * self.height))
        pair = janssen.fitted_pair(depth, measured, starts, limits, size, weight)
        return *pair, janssen.gain(depth, measured, self.fitted_length(frames, sectors), pair, weight)

    def predicted_stress(self, depth: Array, frames: Mask, sectors: Mask) -> Array:
        """sigma_zz at `depth` (m) by Janssen's law with the predicted length and what adhesion hangs on the wall."""
        return janssen.stress(depth, self.predicted_length(frames, sectors), self.hanging_weight(frames, sectors))

    def worst_deviation(self, frames: Mask, sectors: Mask) -> float:
        """Largest |predicted / measured - 1| of sigma_zz over the lower half."""
        predicted = self.predicted_stress(self.height - self.middle, frames, sectors)
        return float(np.abs(predicted / self.balance(frames) - 1.0)[self.lower].max())

    def base_share(self, frames: Mask, _: Mask | None = None) -> float:
        """Force on the base over the weight."""
        return float(self.base[frames].mean()) / (self.mass * self.gravity)

    def janssen_base_share(self, friction: float, frames: Mask, sectors: Mask) -> float:
        """The same by Janssen's law with K of the contact stress and the `friction` of the walls."""
        k_mu = self.contact_ratio(frames, sectors) * friction
        hanging = 1.0 - 2.0 * friction * self.adhesive_stress(frames, sectors) / (self.vessel.size * self.weight)
        return hanging * float(janssen.base_share(2.0 * k_mu * self.height / self.vessel.size))

    def fractions(self, frames: Mask, sectors: Mask) -> Array:
        """Solid fraction (bands,)."""
        return self._whole(self.volume, frames, sectors) / (self.vessel.area * np.diff(self.edges))

    def solid_fraction(self, frames: Mask, sectors: Mask) -> float:
        """Of the bulk."""
        return float(self.fractions(frames, sectors)[self.bulk].mean())

    def field_errors(self) -> Array:
        """Relative deviation (frames,) of the contact-stress field from the balance, over the bands below the uppermost two diameters. With
        what accelerates the grains above, the balance holds in each frame, not only in the mean of many."""
        chosen = self.middle < self.height - 2.0 * self.diameter
        total = ((self.weight_above - self.lift + self.net_above) / self.vessel.area)[:, chosen].sum(axis=1)
        return (self.field[:, chosen].sum(axis=1) - total) / total.mean()


@cached_per_replica
def read(replica: Replica) -> Column:
    """Measure one run folder."""
    values = replica.parameters
    silo, diameter, gravity = container(values), float(values["grain_diameter"]), float(values["gravity"])
    outlines = [(frame.step, profiles.surface_height(frame.positions[:, 2], frame.radii, silo.area), frame.masses.sum())
                for frame in replica.grains()]
    height, mass = float(np.mean([row[1] for row in outlines])), float(outlines[-1][2])
    edges = np.linspace(0.0, height, max(4, round(height / diameter)) + 1)
    sectors, bridges = silo.sectors(diameter), wall_bridges(values)

    def of_frame(grains: GrainFrame, contacts: ContactFrame) -> dict[str, Any]:
        return {**_frame_rows(grains, contacts, silo, gravity, edges, sectors, bridges),
                "rubbing": rubbing(grains, silo, float(values["wall_speed"]), (diameter, height - diameter), bridges)}

    rows = [row for _, row in replica.mapped(of_frame)]
    times = replica.times()
    lift = np.sum([times[f"{name}_fz"] for name in (*silo.names, "base")], axis=0)[times["step"] >= outlines[0][0]]
    friction, error = float(replica.derived["wall_kinetic"]), block_mean(lift / (mass * gravity) - 1.0)
    return Column(edges, height, silo, diameter, gravity, friction, mass, force_error=error,
                  **{name: np.array([row[name] for row in rows]) for name in rows[0]})


def wall_bridges(values: Mapping[str, Any]) -> Bridges | None:
    """Force (N) of a liquid bridge between the wall and touching grains of given radii (m); None when the run is dry."""
    own, content = float(values.get("bridge_volume") or 0.0), float(values.get("liquid_content") or 0.0)
    if own <= 0.0 and content <= 0.0:
        return None

    def pull(radii: Array) -> Array:
        # A bridge to the wall takes half of what a grain carries, or less when others came first; its force at touching hardly depends on
        # that.
        volume = 0.5 * content * 4.0 / 3.0 * np.pi * radii**3 if content > 0.0 else own
        return np.asarray(capillary_force(radii, np.inf, 0.0, volume, float(values["surface_tension"]), float(values["contact_angle"]),
                                          model=str(values["capillary_model"])))

    return pull


def wall_pull(grains: GrainFrame, side: Array, silo: Container, bridges: Bridges | None) -> Array:
    """Force (n,) in N of the wall's liquid bridges on each grain, towards the wall; `side` (n, 3): force of the wall on it. A grain that
    touches the wall has a bridge to it, whose force does not depend on the overlap. One that does not touch feels nothing but its bridge,
    if it has one."""
    if bridges is None:
        return np.zeros(len(grains.radii))
    touching = silo.distance(grains.positions) <= grains.radii
    pull = np.where(touching, 0.0, -np.einsum("na,na->n", side, silo.inward(grains.positions)))
    pull[touching] = bridges(grains.radii[touching])
    return pull


def rubbing(grains: GrainFrame, silo: Container, wall_speed: float, between: tuple[float, float], bridges: Bridges | None) -> Array:
    """(3,) in N of the contacts with a wall that rises with `wall_speed` (m/s), at heights `between` (m): the normal force of all, and
    normal force and friction of those that slide, by the velocities of both surfaces and no force."""
    side, place = np.sum([grains.wall_forces[name] for name in silo.names], axis=0), grains.positions
    inward, arm = silo.inward(place), silo.distance(place)
    touching = (arm <= grains.radii) & (place[:, 2] > between[0]) & (place[:, 2] < between[1])
    across = np.einsum("na,na->n", side, inward)
    normal, friction = across + wall_pull(grains, side, silo, bridges), np.linalg.norm(side - across[:, None] * inward, axis=1)
    slip = grains.velocities - np.cross(grains.omegas, inward * arm[:, None]) - [0.0, 0.0, wall_speed]
    slip -= np.einsum("na,na->n", slip, inward)[:, None] * inward
    # Along a wall at rest nothing slides for long.
    slides = touching & (np.linalg.norm(slip, axis=1) > (SLIDES * wall_speed if wall_speed > 0.0 else np.inf))
    return np.array([normal[touching].sum(), normal[slides].sum(), friction[slides].sum()])


def _frame_rows(grains: GrainFrame, contacts: ContactFrame, silo: Container, gravity: float, edges: Array, sectors: int,
                bridges: Bridges | None) -> dict[str, Any]:
    """One frame's rows of the arrays of Column."""
    place, base, area = grains.positions, grains.wall_forces["base"], silo.area
    side = np.sum([grains.wall_forces[name] for name in silo.names], axis=0)
    heights, weights, inward, shares = place[:, 2], grains.masses * gravity, silo.inward(place), silo.wall_shares(place, sectors).T

    def in_bands(forces: Array) -> Array:
        return np.stack([np.histogram(heights, bins=edges, weights=forces * share)[0] for share in shares], axis=1)

    lines = [
        (contacts.first, contacts.branch, contacts.forces),
        stress.wall_branches(place, side, place - inward * silo.distance(place)[:, None]),
        stress.wall_branches(place, base, stress.on_plane(place, 2, 0.0)),
    ]
    first, branch, forces = (np.concatenate(parts) for parts in zip(*lines, strict=True))
    inside = stress.overlap_fractions(first[:, 2], first[:, 2] + branch[:, 2], edges).T / (area * np.diff(edges))[:, None]
    kinetic, diagonal = stress.kinetic_stress(place, grains.velocities, grains.masses, 2, edges, area), -forces * branch
    # Half of a line belongs to where it begins, half to where it ends: one through the axis has no side.
    halves = 0.5 * (silo.wall_shares(first, sectors) + silo.wall_shares(first + branch, sectors))
    return {
        "normal": in_bands(np.einsum("na,na->n", side, inward)),
        "shear": in_bands(side[:, 2]),
        "adhesion": in_bands(wall_pull(grains, side, silo, bridges)),
        "lift": stress.mean_load_above(heights, side[:, 2], edges),
        "level_lift": np.stack([stress.load_above(heights, side[:, 2] * share, edges) for share in shares], axis=1),
        "weight_above": stress.mean_load_above(heights, weights, edges),
        "level_weight": stress.load_above(heights, weights, edges),
        "net_above": stress.mean_load_above(heights, grains.forces[:, 2], edges),
        "field": inside @ diagonal[:, 2] + kinetic[:, 2, 2],
        "pressing": inside @ (silo.pressing(diagonal)[:, None] * halves),
        "volume": slice_volumes(heights, grains.radii, edges).T @ silo.volume_shares(place, grains.radii, sectors),
        "base": base[:, 2].sum(),
    }
