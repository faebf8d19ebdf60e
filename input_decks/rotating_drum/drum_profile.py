"""Grains in a turning drum as measured: the free surface, and the speed along it on its normal through the axis. The axis of the drum is z,
gravity points along -y, and the drum turns anticlockwise. s runs up the surface, n along its normal from the axis outwards; speeds along s
are positive where grains go with the drum, and negative in the layer that flows back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from dembark.postproc.measurement import Estimate
from dembark.postproc.replica import Array, Replica, cached_per_replica
from dembark.postproc.resampling import resampled
from dembark.postproc.spheres import slice_volumes, volume
from dembark.postproc.statistics import block_mean, time_blocks

Mask = NDArray[np.bool_]
# Half-width along s of what counts as the middle of the chord, and depth of what counts as the surface, in diameters.
HALF_WINDOW, SKIN = 2.0, 1.5


@dataclass(frozen=True)
class DrumFlow:
    """One replica: `solid` (m3) and `flow` = sum V u (m4/s), (frames, cells along n); `edges` (cells + 1,) in m; `plane` (frames, x, y):
    m3 of grains whose centre is in each square cell of the cross-section, `cell` (m) wide; `angle` (rad) of the mean surface; `overhead`
    (frames,): see the case; `radius` and `diameter` in m, `depth`: length along the axis (m), `speed`: rad/s."""

    edges: Array
    solid: Array
    flow: Array
    plane: Array
    cell: float
    angle: float
    overhead: Array
    radius: float
    diameter: float
    depth: float
    speed: float

    @property
    def middle(self) -> Array:
        """Centres of the cells along n."""
        return 0.5 * (self.edges[1:] + self.edges[:-1])

    def velocity(self, frames: Mask) -> Array:
        """Mean speed along the surface (cells,), NaN where there never was a grain."""
        solid, flow = self.solid[frames].sum(axis=0), self.flow[frames].sum(axis=0)
        return np.divide(flow, solid, out=np.full(len(solid), np.nan), where=solid > 0.0)

    def fraction(self, frames: Mask) -> Array:
        """Solid fraction (cells,)."""
        return self.solid[frames].mean(axis=0) / (np.diff(self.edges) * 2.0 * HALF_WINDOW * self.diameter * self.depth)

    def surface(self, frames: Mask) -> float:
        """n (m) at which the solid fraction falls through half of that of the bed."""
        return _fall(self.middle, self.fraction(frames))

    def turn(self, frames: Mask) -> float:
        """n (m) below the surface at which the speed changes its sign; NaN when nothing flows back."""
        u, below = self.velocity(frames), self.middle < self.surface(frames)
        back = np.nonzero(below & (u < 0.0))[0]
        if not len(back):
            return float("nan")
        k = int(back[-1])
        while k > 0 and u[k] < 0.0:
            k -= 1
        n = self.middle
        return float(n[k] + (n[k + 1] - n[k]) * u[k] / (u[k] - u[k + 1])) if np.isfinite(u[k]) and u[k] >= 0.0 else float("nan")

    def surface_speed(self, frames: Mask) -> float:
        """Mean speed (m/s) down the surface of what is within SKIN diameters of it."""
        top = self.surface(frames)
        near = (self.middle < top) & (self.middle > top - SKIN * self.diameter)
        return float(-self.flow[frames][:, near].sum() / self.solid[frames][:, near].sum())

    def layer_depth(self, frames: Mask) -> float:
        """m, from the surface to the change of sign."""
        return self.surface(frames) - self.turn(frames)

    def layer_shape(self, frames: Mask) -> float:
        """Mean height of the layer's flux over the depth of the layer."""
        return layer_flux(self.middle, -self.velocity(frames), self.turn(frames), self.surface(frames))[1]

    def flux_balance(self, frames: Mask) -> float:
        """Net flux through the normal over that of the grains that are carried up."""
        flow = self.flow[frames].sum(axis=0)
        return float(flow.sum() / flow[flow > 0.0].sum())

    def solid_body(self, frames: Mask) -> float:
        """Speed over that of rigid rotation in the half below the layer that is nearer to the wall, two diameters off that."""
        n = self.middle
        carried = (n < 0.5 * (self.turn(frames) - self.radius)) & (n > -self.radius + 2.0 * self.diameter)
        solid = self.solid[frames][:, carried].sum(axis=0)
        return float(self.flow[frames][:, carried].sum() / (solid * -n[carried] * self.speed).sum()) if carried.any() else float("nan")

    def surface_angle(self, frames: Mask) -> float:
        """Degrees."""
        return float(np.degrees(surface_line(self.plane[frames].mean(axis=0), self.cell, self.radius, self.diameter)))


def _fall(place: Array, fraction: Array) -> float:
    """Where `fraction`, from below, last falls through half of its median over the places that hold grains."""
    half = 0.5 * float(np.median(fraction[fraction > 0.5 * fraction.max()]))
    k = int(np.nonzero(fraction > half)[0][-1])
    if k + 1 == len(place):
        return float(place[-1])
    return float(place[k] + (place[k + 1] - place[k]) * (fraction[k] - half) / (fraction[k] - fraction[k + 1]))


def layer_flux(place: Array, speed: Array, turn: float, surface: float) -> tuple[float, float]:
    """Flux (m2/s) of the `speed` (down the surface) over `place` (ascending) from `turn`, where it is 0, to `surface`; and the mean height
    of that flux above `turn` over the depth of the layer: 1/2 of a plug, 2/3 of a linear profile. NaN without a place in between."""
    inside = (place > turn) & (place <= surface) & np.isfinite(speed)
    if not inside.any():
        return float("nan"), float("nan")
    part = np.linspace(0.0, 1.0, 2001)
    fine = np.interp(turn + part * (surface - turn), [turn, *place[inside]], [0.0, *speed[inside]])
    mean = float(np.trapezoid(fine, part))
    return mean * (surface - turn), float(np.trapezoid(fine * part, part)) / mean


def surface_line(plane: Array, cell: float, radius: float, diameter: float) -> float:
    """Angle (rad) of the line through the free surface within half a radius of the normal through the axis. `plane` (x, y): volume of
    grains in square cells of width `cell` (m) about the axis, smoothed over a diameter. The surface is at half of the bed's fraction on
    each of several normals, which turn with the line until both are perpendicular."""
    smooth, angle, middle = gaussian_filter(plane, 0.5 * diameter / cell), 0.0, 0.5 * (np.array(plane.shape) - 1.0)
    along, up = np.linspace(-0.5 * radius, 0.5 * radius, 25), np.linspace(-radius, radius, round(4.0 * radius / diameter))
    x, y = np.meshgrid((np.arange(plane.shape[0]) - middle[0]) * cell, (np.arange(plane.shape[1]) - middle[1]) * cell, indexing="ij")
    # The mean angle is near that at which the centre of mass lies off the plumb line.
    angle = float(np.arctan2((plane * x).sum(), -(plane * y).sum()))
    for _ in range(20):
        s, n = np.meshgrid(along, up, indexing="ij")
        places = np.stack([s * np.cos(angle) - n * np.sin(angle), s * np.sin(angle) + n * np.cos(angle)]) / cell + middle[:, None, None]
        tops = np.array([_fall(up, row) for row in map_coordinates(smooth, places, order=1)])
        turned = float(np.arctan(np.polyfit(along, tops, 1)[0]))
        angle += turned
        if abs(turned) < 1e-4:
            break
    return angle


@cached_per_replica
def read(replica: Replica) -> DrumFlow:
    """Measure a run; glued grains do not count."""
    given = replica.parameters
    radius, diameter, depth = (float(given[name]) for name in ("drum_radius", "grain_diameter", "drum_depth"))
    frames = [grains.select(grains.types == 1) for grains in replica.grains()]
    cell = 0.5 * diameter
    half = np.ceil(radius / cell) + 2.0
    rim = (np.arange(-half, half + 1.0)) * cell
    plane = np.array([np.histogram2d(one.positions[:, 0], one.positions[:, 1], bins=(rim, rim), weights=volume(one.radii))[0]
                      for one in frames])
    angle = surface_line(plane.mean(axis=0), cell, radius, diameter)
    along, normal = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    edges = np.linspace(-radius, radius, round(4.0 * radius / diameter) + 1)
    window = np.array([-HALF_WINDOW, HALF_WINDOW]) * diameter
    rows: dict[str, list[Any]] = {"solid": [], "flow": [], "overhead": []}
    for one in frames:
        place, speed = one.positions[:, :2], one.velocities[:, :2] @ along
        rows["overhead"].append(6.0 * np.mean(np.abs(np.arctan2(place[:, 0], place[:, 1])) < np.pi / 6.0))
        near = np.abs(place @ along) < window[1] + one.radii
        place, speed, radii = place[near], speed[near], one.radii[near]
        part = slice_volumes(place @ along, radii, window) / volume(radii)[:, None]
        parts = slice_volumes(place @ normal, radii, edges) * part
        rows["solid"].append(parts.sum(axis=0))
        rows["flow"].append(parts.T @ speed)
    return DrumFlow(edges=edges, plane=plane, cell=cell, angle=angle, radius=radius, diameter=diameter, depth=depth,
                   speed=float(given["drum_speed"]), **{name: np.array(values) for name, values in rows.items()})


def estimates(one: DrumFlow, names: Sequence[str]) -> dict[str, Estimate]:
    """What is measured of one run, by the `names` of methods of DrumFlow; intervals from time blocks of the speed at the surface."""
    near = one.solid * (one.flow < 0.0)
    blocks = time_blocks((one.flow * (near > 0.0)).sum(axis=1) / np.maximum(near.sum(axis=1), 1e-300))
    found = {name: resampled(lambda keep, _, name=name: float(getattr(one, name)(keep)), blocks) for name in names}  # type: ignore[misc]
    return {**found, "overhead": block_mean(one.overhead)}
