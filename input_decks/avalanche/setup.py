"""Avalanche: a slope that ends on a flat, grains above a gate, an obstacle; or a bed on an endless chute, or a single grain."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, contacts, rectangle, rows_and_frames, time_step

# Unit vectors along the flat, or a chute, and along its normal.
LEVEL = (np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def setup(p: Parameters) -> Setup:
    """The toe of the slope is the origin, x points down the slope and along the flat. On a chute gravity is tilted instead of the floor.
    The gate begins to move at the first frame; 20 rows of time.csv between two frames. Bodies: grains, then the glued ones of the floor, of
    the gate and of the obstacle."""
    step, d = time_step(p), p.grain_diameter
    output = rows_and_frames(step, p.settle_time, p.flow_time, p.frames)
    chute, slab = p.bed_height > 0, p.slab_depth > 0
    depth = p.slab_depth * d
    sites, speeds = (_bed(p) if chute else (_release(p), lambda _: np.empty(0)))
    floor = _floor(p) if p.floor == "grains" else np.empty((0, 3))
    gate = np.empty((0, 3)) if chute else _upright(p, -p.gate_place, p.gate_height, _slope(p))
    obstacle = np.empty((0, 3)) if chute else _upright(p, p.obstacle_place, p.obstacle_height, LEVEL)
    glued = np.vstack([floor, gate, obstacle])
    along, up = _slope(p)
    lift = 3.0 * packing.largest(p)
    # The gate runs ahead of the grains, and then up along itself, out of their way.
    ahead, rise = min(20.0, 0.5 * p.gate_place) * d, (p.gate_height + 5.0) * d * (len(gate) > 0)
    turned = output["first"] + math.ceil(ahead / (p.gate_speed * step))
    if chute:
        box = [(0.0, p.chute_length * d), (0.0, depth), (-lift, float(sites[:, 2].max()) + 10.0 * d)]
    else:
        top = -p.slope_length * d * along
        highest = max(top[2], float(sites[:, 2].max()), float((gate @ [0.0, 0.0, 1.0]).max(initial=0.0)) + rise * up[2]) + lift
        box = [(top[0] - lift, p.flat_length * d + lift), (0.0, depth), (-lift, highest)]
    if not slab:
        box[1] = (-lift, lift)
    bodies = _single(p, sites, box) if p.grain_count == 1 else packing.grains(p, sites, box)
    if not slab:
        bodies = replace(bodies, positions=bodies.positions * np.array([1.0, 0.0, 1.0]))
    if p.start_speed > 0:
        own = speeds(bodies.positions[:, 2]) if chute else np.full(len(bodies.positions), p.start_speed)
        bodies = replace(bodies, velocities=np.pad(own[:, None], ((0, len(glued)), (0, 2))))
    bodies = bodies.joined(glued, d, p.grain_density, 2)
    numbers = {"grain_count": p.grain_count, **output,
               "turned": turned, "opened": turned + math.ceil(rise / (p.gate_speed * step)), "ahead_x": p.gate_speed * along[0],
               "ahead_z": p.gate_speed * along[2], "rise_x": p.gate_speed * up[0], "rise_z": p.gate_speed * up[2], "chute": int(chute),
               "slab": int(slab), "gravity_x": p.gravity * math.sin(p.slope_angle) * chute,
               "gravity_z": -p.gravity * (math.cos(p.slope_angle) if chute else 1.0), "back": -p.slope_length * d * along[0],
               "end": p.flat_length * d, "floor_count": len(floor), "gate_count": len(gate), "obstacle_count": len(obstacle)}
    meshes = {"ground": _strips(p)} if p.floor == "strips" else {}
    return Setup(output["steps"], step, bodies, {**numbers, **contacts(p, skin=0.2)}, meshes)


def _slope(p: Parameters) -> tuple[Array, Array]:
    """Unit vectors down the slope and along its normal."""
    sine, cosine = math.sin(p.slope_angle), math.cos(p.slope_angle)
    return np.array([cosine, 0.0, -sine]), np.array([sine, 0.0, cosine])


def _across(p: Parameters, spacing: float) -> Array:
    """Places (n,) in m along y, about `spacing` (in d) apart; 0 alone in a monolayer."""
    count = int(p.slab_depth / spacing)
    return p.slab_depth * p.grain_diameter * (np.arange(count) + 0.5) / count if count else np.zeros(1)


def _grid(along: Array, across: Array, up: Array, axes: tuple[Array, Array]) -> Array:
    """Places (n, 3) in m at all combinations of distances (m) along the two `axes` and along y, the last fastest."""
    k, i, j = np.meshgrid(up, along, across, indexing="ij")
    return i.reshape(-1, 1) * axes[0] + k.reshape(-1, 1) * axes[1] + j.reshape(-1, 1) * np.array([0.0, 1.0, 0.0])


def _release(p: Parameters) -> Array:
    """Sites in a block on the slope above the gate; or that of a single grain, which lies on the strips, on the flat if it has a speed."""
    d, cell, axes = p.grain_diameter, 1.15 * packing.largest(p), _slope(p)
    foot = -p.gate_place * d
    if p.grain_count == 1 and p.start_speed > 0:
        return np.array([[10.0 * d, 0.0, 0.5 * d - _overlap(p, 1.0)]])
    if p.grain_count == 1:
        return _grid(np.array([foot]), np.zeros(1), np.array([0.5 * d - _overlap(p, math.cos(p.slope_angle))]), axes)
    across = _across(p, 1.15 * packing.largest(p) / d)
    room = (p.slope_length - p.gate_place - 4.0) * d
    length = max(1, min(int(room / cell), math.ceil(1.5 * math.sqrt(p.grain_count / len(across)))))
    layers = math.ceil(1.3 * p.grain_count / (length * len(across)))
    return _grid(foot - d - cell * (np.arange(length) + 0.5), across, cell * (np.arange(layers) + 0.8), axes)


def _overlap(p: Parameters, share: float) -> float:
    """m, with which a grain carries this share of its weight on a wall of its own material: 4/3 E* sqrt(R) overlap^(3/2), Hertz."""
    radius, modulus = 0.5 * p.grain_diameter, 0.5 * p.youngs_modulus / (1.0 - p.poisson_ratio**2)
    weight = 4.0 / 3.0 * math.pi * radius**3 * p.grain_density * p.gravity
    return (0.75 * share * weight / (modulus * math.sqrt(radius))) ** (2.0 / 3.0)


def _single(p: Parameters, sites: Array, box: object) -> packing.Packing:
    return packing.Packing(np.asarray(box, float), sites, np.array([p.grain_diameter]), np.array([p.grain_density]), np.ones(1, np.int64))


def _bed(p: Parameters) -> tuple[Array, Callable[[Array], Array]]:
    """Sites above the chute's floor, and the speed (m/s) with which a grain begins at a height: it grows with that, in the mean it is
    `start_speed`."""
    d, least = p.grain_diameter, 1.15 * packing.largest(p)
    across, count = _across(p, least / d), int(p.chute_length * d / least)
    along = p.chute_length * d * (np.arange(count) + 0.5) / count
    layers = math.ceil(1.3 * p.grain_count / (count * len(across)))
    sites = _grid(along, across, least * (np.arange(layers) + 0.8), LEVEL)
    return sites, lambda height: 2.0 * p.start_speed * height / (layers * least)


def _floor(p: Parameters) -> Array:
    """The floor's glued grains: `floor_spacing` apart, their tops up to d/10 off the surface at random."""
    d, gap = p.grain_diameter, p.floor_spacing
    across = _across(p, gap)
    if p.bed_height > 0:
        count = round(p.chute_length / gap)
        places = _grid(p.chute_length * d * (np.arange(count) + 0.5) / count, across, np.zeros(1), LEVEL)
        return places + _rough(p, len(places))[:, None] * LEVEL[1]
    down = _grid(-gap * d * (np.arange(int(p.slope_length / gap)) + 0.5)[::-1], across, np.zeros(1), _slope(p))
    flat = _grid(gap * d * (np.arange(int(p.flat_length / gap)) + 0.5), across, np.zeros(1), LEVEL)
    normals = np.vstack([np.tile(_slope(p)[1], (len(down), 1)), np.tile(LEVEL[1], (len(flat), 1))])
    return np.vstack([down, flat]) + _rough(p, len(normals))[:, None] * normals


def _rough(p: Parameters, count: int) -> Array:
    """m, of the glued grains' centres along the floor's normal."""
    return p.grain_diameter * (0.2 * (packing.uniform(p.grain_count + np.arange(1, count + 1), p.seed, 2) - 0.5) - 0.5)


def _upright(p: Parameters, place: float, height: float, axes: tuple[Array, Array]) -> Array:
    """Glued grains side by side in a row upright on the floor, off the strips; place and height over the diameter."""
    d = p.grain_diameter
    return _grid(np.array([place * d]), _across(p, 1.0), d * (np.arange(math.ceil(height)) + 0.52), axes)


def _strips(p: Parameters) -> Array:
    """Triangles (n, 3, 3) in m of slope and flat, in panels of about 10 d."""
    d, (along, _) = p.grain_diameter, _slope(p)
    half, panels = 2.0 * d, []
    for start, length, way in ((-p.slope_length * d * along, p.slope_length, along), (np.zeros(3), p.flat_length, LEVEL[0])):
        count = math.ceil(0.1 * length)
        side = length * d / count * way
        panels += [rectangle(start + side * k - np.array([0.0, half, 0.0]), side, (0.0, 2.0 * half, 0.0)) for k in range(count)]
    return np.vstack(panels)
