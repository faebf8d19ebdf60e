"""A drum seen along its axis, as a camera in front of a glass end sees it: dark where any grain is in the line of sight, averaged over
time. x runs to the right and y upwards from the axis; the drum turns anticlockwise, so grains are carried up on the right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dembark.postproc.measurement import Array, Estimate
from dembark.postproc.replica import Replica, cached_per_replica
from dembark.postproc.resampling import resampled
from dembark.postproc.statistics import time_blocks

from .drum_profile import Mask

# Pixels across the drum; the part of the radius that is looked at, for the wall's rim hides the rest; half-width of the middle of the
# surface, and ends of its upper and lower part, over the radius.
PIXELS, INSIDE, MIDDLE, PART = 400, 0.93, 0.2, (10.0 / 42.0, 26.0 / 42.0)


@dataclass(frozen=True)
class SideView:
    """One replica: `dark` (frames, x, y), whether a grain is in the line of a pixel, at the places `at` (pixels,) in m along x and y alike;
    `lean` (frames,): x of the centre of all grains in m; `radius` of the drum in m."""

    dark: Mask
    at: Array
    lean: Array
    radius: float

    def surface(self, frames: Mask) -> Array:
        """Heights (pixels,) in m at which the averaged darkness last falls through a half, NaN outside of what is looked at."""
        mean, half = self.dark[frames].mean(axis=0), INSIDE * self.radius
        found = np.full(len(self.at), np.nan)
        for k in np.nonzero(np.abs(self.at) < half)[0]:
            column = mean[k] * (np.hypot(self.at[k], self.at) < half)
            over = np.nonzero(column > 0.5)[0]
            if len(over):
                j = int(over[-1])
                found[k] = self.at[j] + (self.at[j + 1] - self.at[j]) * (column[j] - 0.5) / (column[j] - column[j + 1])
        return found

    def heights(self, frames: Mask, places: Array) -> Array:
        """Heights (m) of the surface at `places` (m) along x."""
        y = self.surface(frames)
        known = np.isfinite(y)
        return np.interp(places, self.at[known], y[known])

    def slope(self, frames: Mask, low: float, high: float) -> float:
        """Degrees, of a line through the surface from `low` to `high` (m)."""
        places = np.linspace(low, high, 101)
        return float(np.degrees(np.arctan(np.polyfit(places, self.heights(frames, places), 1)[0])))

    def angle(self, frames: Mask) -> float:
        """Degrees, of the middle fifth of the surface."""
        return self.slope(frames, -MIDDLE * self.radius, MIDDLE * self.radius)

    def bend(self, frames: Mask) -> float:
        """Degrees by which the upper part of the surface is steeper than the lower one."""
        low, high = (part * self.radius for part in PART)
        return self.slope(frames, low, high) - self.slope(frames, -high, -low)

    def share(self, frames: Mask) -> float:
        """Share of what is looked at that is dark."""
        inside = np.hypot(self.at[:, None], self.at) < INSIDE * self.radius
        return float(self.dark[frames].mean(axis=0)[inside].mean())


@cached_per_replica
def read(replica: Replica) -> SideView:
    """Measure a run; glued grains do not count, they are in the rim."""
    radius = float(replica.parameters["drum_radius"])
    edges = np.linspace(-radius, radius, PIXELS + 1)
    at, width = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
    dark, lean = [], []
    for frame in replica.grains():
        grains = frame.select(frame.types == 1)
        dark.append(shadow(grains.positions[:, :2], grains.radii, at, width))
        lean.append(float(grains.positions[:, 0].mean()))
    return SideView(np.array(dark), at, np.array(lean), radius)


def shadow(places: Array, radii: Array, at: Array, width: float) -> Mask:
    """Whether a disc at one of `places` (n, 2) with its radius of `radii` (n,) covers the middle of a pixel (x, y); all in m."""
    found, reach = np.zeros((len(at), len(at)), bool), int(np.ceil(radii.max() / width)) + 1
    nearest = np.rint((places - at[0]) / width).astype(int)
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            pixel = nearest + np.array([i, j])
            off = at[0] + width * pixel - places
            covered = (np.hypot(*off.T) <= radii) & (pixel >= 0).all(axis=1) & (pixel < len(at)).all(axis=1)
            found[pixel[covered, 0], pixel[covered, 1]] = True
    return found


def estimates(one: SideView, against: tuple[Array, Array] | None) -> dict[str, Estimate]:
    """What is measured of one run, with intervals from blocks of time; `against`: places and heights (m) of a measured surface, from which
    the mean square distance is taken."""
    blocks = time_blocks(one.lean)
    found = {name: resampled(lambda keep, _, measure=measure: measure(keep), blocks)  # type: ignore[misc]
             for name, measure in (("side_angle", one.angle), ("side_bend", one.bend), ("side_dark", one.share))}
    if against is not None:
        places, heights = against

        def distance(keep: Mask, _: Mask) -> float:
            return float(np.sqrt(np.mean((one.heights(keep, places) - heights) ** 2)))

        found["side_distance"] = resampled(distance, blocks)
    return found
