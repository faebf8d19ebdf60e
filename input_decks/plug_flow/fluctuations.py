"""Fluctuations of the grains next to a front and a rear wall, as cameras see them: displacements over an interval, about the mean flow.

A camera does not measure velocities but displacements between two frames. In slow flow these depend on how far the flow has gone, not on
the time, so intervals are travels of the core in diameters. The sources' intervals are not known: what is judged is measured over all
INTERVALS.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from dembark.common.errors import RunError
from dembark.postproc.measurement import Array, Curve, Estimate, over_replicas, profile
from dembark.postproc.resampling import resampled
from dembark.postproc.tracks import Displacements, growth

from .channel import Channel, Mask

# Travels of the core between two frames, in d. Fluctuations are about a tenth of them: of less a camera sees hardly a pixel, and after more
# it mistakes a grain for its neighbour.
INTERVALS = (0.05, 0.1, 0.2, 0.5)
SHOWN = 0.2  # that of profiles, and of values without a verdict
DIFFUSIVE = (1.0, 2.0)  # travels, in d, between which the slope of the mean square displacements is that of diffusion
LAYER = 3.0  # width of the layer at each side wall, in d
TAIL = (1.5, 3.0, 6.0)  # displacements over their local standard deviation

Measure = Callable[["Seen"], float]


@dataclass(frozen=True)
class Seen(Displacements):
    """Displacements streamwise and transverse, about the mean flow, over d; `place` (k,): distance from the left wall
    over d; `width` of the channel in d."""

    place: Array
    width: float

    def among(self, which: Mask) -> Seen:
        """Those that `which` (k,) marks."""
        return Seen(self.moves[which], self.start[which], self.place[which], self.width)

    @property
    def core(self) -> Seen:
        """Those in the middle half."""
        return self.among(np.abs(self.place - 0.5 * self.width) < 0.25 * self.width)

    @property
    def layer(self) -> Seen:
        """Those in the layers at the side walls."""
        return self.among(np.minimum(self.place, self.width - self.place) < LAYER)

    def local_squares(self) -> tuple[Array, Array]:
        """The same (cells, 2) of cells one diameter wide, NaN where there are none; and the cell (k,) of each."""
        count = round(self.width)
        cell = np.clip((self.place / self.width * count).astype(int), 0, count - 1)
        sums = np.stack([np.bincount(cell, self.moves[:, axis] ** 2, count) for axis in (0, 1)], axis=1)
        number = np.bincount(cell, minlength=count)[:, None]
        return np.divide(sums, number, out=np.full_like(sums, np.nan), where=number > 0), cell

    def scaled(self) -> Seen:
        """Displacements over their local standard deviation: what varies across the channel widens no distribution."""
        squares, cell = self.local_squares()
        return Seen(self.moves / np.sqrt(squares[cell]), self.start, self.place, self.width)


def anisotropy(seen: Seen) -> float:
    """Streamwise over transverse standard deviation."""
    streamwise, transverse = seen.squares
    return float(np.sqrt(streamwise / transverse))


def distribution_difference(seen: Seen) -> float:
    """Largest difference between the cumulative distributions of the scaled displacements of core and layer; the larger one of both
    components."""
    scaled = seen.scaled()
    core, layer = scaled.core.moves, scaled.layer.moves
    return max(_distance(one, other) for one, other in zip(core.T, layer.T, strict=True))


def _distance(one: Array, other: Array) -> float:
    every = np.concatenate([one, other])
    shares = [np.searchsorted(np.sort(values), every, side="right") / len(values) for values in (one, other)]
    return float(np.abs(shares[0] - shares[1]).max())


def beyond(seen: Seen, limits: Sequence[float] | Array) -> Array:
    """Share (n,) of the scaled displacements of either component that exceed each of the `limits`."""
    ordered = np.sort(np.abs(seen.scaled().moves).ravel())
    return 1.0 - np.searchsorted(ordered, np.asarray(limits), side="right") / len(ordered)


def tail_growth(seen: Seen) -> float:
    """Slope of the logarithm of the share beyond s against log s, in the upper half of TAIL over that in the lower half: 1 of a power
    law, 2 of an exponential, 3.6 of a Gaussian distribution; at most 10, also where nothing is beyond the last limit."""
    with np.errstate(divide="ignore"):
        shares = np.log(beyond(seen, TAIL))
    return min(10.0, float((shares[1] - shares[2]) / (shares[0] - shares[1])))


@dataclass(frozen=True)
class Motion:
    """Paths of one replica, steady part: `moved` (frames, grains, 2), streamwise and transverse displacement since the first frame less
    that of the mean flow along the path, over d; `place` (frames, grains): x over d; `visible` (frames, grains): next to the front or rear
    wall, in the measuring window; `width` of the channel over d; `stride`: travel of the plate from frame to frame over d."""

    moved: Array
    place: Array
    visible: Mask
    width: float
    stride: float

    @classmethod
    def of(cls, one: Channel) -> Motion:
        """That of a Channel whose y ends at walls; its mean flow is that of the visible grains, linear between cells half a d wide."""
        d, middle = one.diameter, 0.5 * (one.track[1:] + one.track[:-1])
        step = np.diff(one.track, axis=0)[:, :, (2, 0)] * (-1.0 / d, 1.0 / d)
        seen = _visible(one, middle)
        cell = np.clip(np.searchsorted(one.edges, middle[:, :, 0]) - 1, 0, len(one.middle) - 1)[seen]
        count = np.bincount(cell, minlength=len(one.middle))
        filled = count > 0.01 * count.max()
        followed = (middle[:, :, 0], *np.moveaxis(step, 2, 0))
        mean = [np.bincount(cell, values[seen], len(count))[filled] / count[filled] for values in followed]
        flow = np.stack([np.interp(middle[:, :, 0], mean[0], values) for values in mean[1:]], axis=2)
        moved = np.concatenate([np.zeros_like(step[:1]), np.cumsum(step - flow, axis=0)])
        return cls(moved, one.track[:, :, 0] / d, _visible(one, one.track), one.width / d, one.speed * (one.clock[1] - one.clock[0]) / d)

    def seen(self, interval: float) -> Seen:
        """Displacements over a travel (d) of the plate, as many frames as come next to it, of grains visible before and after. RunError
        when the steady part is shorter."""
        lag = max(1, round(interval / self.stride))
        if lag >= len(self.moved):
            raise RunError("the run is too short to be measured", f"its steady part covers less than {interval:g} d of the plate's travel",
                           "use more travel")
        both = self.visible[lag:] & self.visible[:-lag]
        place = 0.5 * (self.place[lag:] + self.place[:-lag])
        return Seen((self.moved[lag:] - self.moved[:-lag])[both], np.nonzero(both)[0], place[both], self.width)

    def measured(self, get: Measure, interval: float) -> Estimate:
        """`get` of the displacements over the `interval`, with the interval of what varies in time."""
        seen = self.seen(interval)
        return resampled(lambda keep, _: get(seen.among(keep[seen.start])), seen.blocks())

    def diffusion(self) -> Estimate:
        """log10 of the streamwise over the transverse self-diffusion coefficient, from the growth of the mean squares."""
        near, far = (self.seen(interval) for interval in DIFFUSIVE)
        earlier = near.until(int(far.start.max()))  # of the same time

        def ratio(keep: Mask, _: Mask) -> float:
            more = growth(earlier, far, keep)
            return float(np.log10(more[0] / more[1])) if (more > 0.0).all() else np.nan

        return resampled(ratio, far.blocks())


def _visible(one: Channel, places: Array) -> Mask:
    """Which grains (frames, grains) at `places` (frames, grains, 3) are within a diameter of the front or rear wall, in the window."""
    near = np.minimum(places[:, :, 1], one.depth - places[:, :, 1]) < one.diameter
    return near & (places[:, :, 2] > one.levels[0]) & (places[:, :, 2] < one.levels[-1])


def envelope(parts: Sequence[Estimate]) -> Estimate:
    """One estimate whose interval holds those of all `parts`, each of another displacement interval."""
    low, high = min(one.interval[0] for one in parts), max(one.interval[1] for one in parts)
    # From three packings on more of them hardly make it narrower.
    basis = f"displacement intervals, {parts[0].basis}" if parts[0].samples else f"{parts[0].basis}, all displacement intervals"
    return Estimate(0.5 * (low + high), 0.5 * (high - low), basis)


def estimates(motions: Sequence[Motion]) -> dict[str, Estimate]:
    """All that is measured of the fluctuations, over the replicas."""
    def at(get: Measure, interval: float) -> Estimate:
        return over_replicas([one.measured(get, interval) for one in motions])

    judged: dict[str, Measure] = {"anisotropy": anisotropy, "distribution_difference": distribution_difference, "tail_growth": tail_growth}
    shown: dict[str, Measure] = {
        "anisotropy_core": lambda seen: anisotropy(seen.core),
        "anisotropy_layer": lambda seen: anisotropy(seen.layer),
        "core_variance": lambda seen: float(seen.core.squares.sum() / seen.layer.squares.sum()),
        "transverse_rise": lambda seen: float(np.sqrt(seen.layer.squares[1] / seen.core.squares[1])),
    }
    return {
        **{name: envelope([at(get, interval) for interval in INTERVALS]) for name, get in judged.items()},
        **{name: at(get, SHOWN) for name, get in shown.items()},
        "diffusion_ratio": over_replicas([one.diffusion() for one in motions]),
    }


def profiles(motions: Sequence[Motion]) -> list[Curve]:
    """Across the channel: fluctuations of both components; against the interval: their ratio; and the share of large ones."""
    local: list[Array] = [np.sqrt(one.seen(SHOWN).local_squares()[0]) for one in motions]
    place, along = np.arange(float(len(local[0]))) + 0.5, "distance from the left wall x / d"
    travels = (*INTERVALS, *DIFFUSIVE)
    limits = np.linspace(0.5, 8.0, 31)
    shares = [beyond(one.seen(SHOWN), limits) for one in motions]
    with np.errstate(divide="ignore"):
        tails = [np.log10(share) for share in shares]
    return [
        *(profile(f"fluctuation_{name}", f"Fluctuation, {name}", along, f"standard deviation over {SHOWN:g} d of travel, in d", place,
                  [values[:, axis] for values in local]) for axis, name in enumerate(("streamwise", "transverse"))),
        profile("anisotropy_interval", "Streamwise over transverse fluctuation", "travel of the core in the interval, in d", "ratio",
                np.array(travels), [np.array([anisotropy(one.seen(travel)) for travel in travels]) for one in motions]),
        profile("tail", "Large displacements", "displacement over its local standard deviation", "log₁₀ of the share beyond", limits, tails,
                reference=np.log10(2.0 * ndtr(-limits)), reference_label="Gaussian"),
    ]
