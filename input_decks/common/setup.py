"""Derived numbers of a run, made once for every engine: time step, output steps, friction, liquid."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import SimpleNamespace as Parameters

import numpy as np
from numpy.typing import NDArray

from .packing import Packing, largest

Number = float | int | str
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setup:
    """What a deck needs besides the parameters of its case. `steps` of `time_step` (s); `packing`: the bodies at the start; `numbers`:
    derived values by name, which the decks of all engines use; `meshes`: triangles (n, 3, 3) in m by name, each written as <name>.stl;
    `tables`: rows of numbers by name, for decks alone."""

    steps: int
    time_step: float
    packing: Packing | None = None
    numbers: Mapping[str, Number] = field(default_factory=dict)
    meshes: Mapping[str, Array] = field(default_factory=dict)
    tables: Mapping[str, tuple[Number, ...]] = field(default_factory=dict)


def of_sort(p: Parameters, sort: str) -> Parameters:
    """One of several sorts of grains, under the names that the numbers of equal grains have: what begins with the name of the `sort`."""
    own = {f"grain_{name}": getattr(p, f"{sort}_{name}") for name in ("count", "diameter", "density")}
    elastic = {name: getattr(p, f"{sort}_{name}") for name in ("youngs_modulus", "poisson_ratio")}
    return Parameters(**{**vars(p), **own, **elastic, "grain_diameter_spread": 0.0})


def rayleigh_time(p: Parameters) -> float:
    """Rayleigh time (s) of the smallest grain: pi R sqrt(rho / G) / (0.1631 nu + 0.8766)."""
    radius = 0.5 * p.grain_diameter * (1.0 - p.grain_diameter_spread)
    shear_modulus = p.youngs_modulus / (2.0 * (1.0 + p.poisson_ratio))
    return math.pi * radius * math.sqrt(p.grain_density / shear_modulus) / (0.1631 * p.poisson_ratio + 0.8766)


def time_step(p: Parameters) -> float:
    """The fraction `time_step_fraction` of the Rayleigh time (s)."""
    return p.time_step_fraction * rayleigh_time(p)


def window(start: int, stride: int, frames: int, rows: int = 1000) -> dict[str, int]:
    """Output steps: `frames` dumps every `stride` steps, the first a stride after step `start`, and about `rows` rows of the history."""
    steps = start + stride * frames
    return {"first": start + stride, "stride": stride, "steps": steps, "every": max(1, steps // rows)}


def rows_and_frames(step: float, settling: float, duration: float, frames: int) -> dict[str, int]:
    """Output steps after `settling` (s), in steps of `step` (s): `frames` dumps over `duration` (s), the first at its beginning, and 20
    rows of time.csv from one to the next."""
    every = math.ceil(duration / step / (20 * (frames - 1)))
    first, stride = every * max(1, math.ceil(settling / step / every)), 20 * every
    return {"first": first, "stride": stride, "every": every, "steps": first + stride * (frames - 1)}


def strides(duration: float, time_step: float, count: int) -> dict[str, int]:
    """Output steps: `count` equal strides that cover `duration` (s), or a little more, in steps of `time_step` (s)."""
    stride = math.ceil(duration / time_step / count)
    return {"stride": stride, "steps": stride * count}


def friction(p: Parameters) -> dict[str, Number]:
    """Static and kinetic coefficients of grains and walls; `static_friction` and `kinetic_friction` replace all where they are set."""
    grain, wall = (p.grain_friction, p.wall_friction) if p.static_friction is None else (p.static_friction, p.static_friction)
    kinetic = [mu * p.kinetic_friction_ratio if p.kinetic_friction is None else p.kinetic_friction for mu in (grain, wall)]
    return {"grain_static": grain, "wall_static": wall, "grain_kinetic": kinetic[0], "wall_kinetic": kinetic[1]}


def rolling(p: Parameters) -> dict[str, Number]:
    """Coefficients of rolling resistance of grains and walls; none where the case has no such parameters."""
    if not hasattr(p, "rolling_resistance"):
        return {}
    wall = p.rolling_friction if p.wall_rolling_friction is None else p.wall_rolling_friction
    return {"grain_rolling": p.rolling_friction, "wall_rolling": wall}


def liquid(p: Parameters) -> dict[str, Number]:
    """Whether there are bridges (`wet`) of liquid that grains carry (`carried`), and `reach` (m), which no bridge of a wall exceeds: walls
    look for grains within the skin only. Rupture is near (1 + angle/2) volume^(1/3); the largest grain may own twice its initial liquid."""
    content = getattr(p, "liquid_content", 0.0)
    volume = content * math.pi / 6.0 * largest(p) ** 3 if content > 0.0 else p.bridge_volume
    return {"wet": int(volume > 0.0), "carried": int(content > 0.0), "reach": 1.3 * (1.0 + 0.5 * p.contact_angle) * volume ** (1.0 / 3.0)}


def contacts(p: Parameters, skin: float = 0.1) -> dict[str, Number]:
    """What the contacts of a deck need: friction, rolling resistance, liquid, and the neighbour search's skin: `skin` mean diameters beyond
    all bridges."""
    wet = liquid(p)
    return {**friction(p), **rolling(p), **wet, "skin": skin * p.grain_diameter + wet["reach"]}


def rectangle(corner: Sequence[float], first: Sequence[float], second: Sequence[float]) -> Array:
    """Two triangles (2, 3, 3) in m of the parallelogram at `corner` with the sides `first` and `second`; their normal is first x second."""
    a, u, v = (np.asarray(x, float) for x in (corner, first, second))
    return np.array([[a, a + u, a + u + v], [a, a + u + v, a + v]])


def strip(corner: Sequence[float], along: Sequence[float], depth: float) -> Array:
    """Triangles (n, 3, 3) in m of the rectangle at `corner` with the side `along` and the `depth` of a period along y. In panels no longer
    than the period is deep, for LIGGGHTS cannot place elements that are much larger than the period."""
    panels = max(1, math.ceil(float(np.linalg.norm(along)) / depth))
    side = [length / panels for length in along]
    corners = ([x + length * k for x, length in zip(corner, side, strict=True)] for k in range(panels))
    return np.vstack([rectangle(start, (0.0, depth, 0.0), side) for start in corners])


def revolved(line: list[tuple[float, float]], sides: int, height: float) -> Array:
    """Triangles (n, 3, 3) in m of a polygon of `sides`, one corner at y = 0, along a `line` of radii and heights (m), which is cut into
    rings no higher than `height` (m): large triangles are near many grains."""
    rings = []
    for (r, z), (r2, z2) in pairwise(line):
        parts = math.ceil((z2 - z) / height)
        rings += [(r + (r2 - r) * k / parts, z + (z2 - z) * k / parts) for k in range(parts)]
    angle = 2.0 * math.pi * np.arange(sides + 1) / sides
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    circle[-1] = circle[0]
    points = np.array([np.column_stack((r * circle, np.full(len(circle), z))) for r, z in [*rings, line[-1]]])
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    return np.concatenate([np.stack(corners, axis=2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))])
