"""Moving walls: held grains in a plate, a bed in a vessel, or a grain above a plate, and the motion of the walls."""

import math

import numpy as np

from dembark.input_decks.common.motion import motion
from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Array, Parameters, Setup, contacts, rectangle
from dembark.physics import WallMotion

# m/s: of the axis of a plate that turns; of a vessel at constant speed.
ALONG, SPEED = (0.3, -0.2, 0.005), (0.4, -0.3, 0.2)
# Of held grains: places (m) along x, and overlap with the plate at rest (m).
PLACES, DEPTH = (-0.01, 0.0, 0.012), 3e-4
# Gap (m) below a grain that bounces.
GAP = 0.01


def setup(p: Parameters) -> Setup:
    """The plate is the plane z = 0; the vessel has a floor there, four walls and no lid."""
    stride = math.ceil(p.run_time / p.run_step / p.frames)
    every = {"held": stride, "bed": max(1, stride // 10), "bounce": 20}[p.scene]
    moving, d = wall_motion(p), p.grain_diameter
    places, speeds = {"held": _held, "bed": _bed, "bounce": _above}[p.scene](p)
    steps = stride * p.frames
    times = np.linspace(0.0, steps * p.run_step, 200)
    reach = float(np.abs(moving.displacement(times)).max())
    half = 0.06 + reach
    box = np.array([(-half, half), (-half, half), (-half, half + 0.05)])
    bodies = Packing(box, places, np.full(len(places), d), np.full(len(places), p.grain_density), np.ones(len(places), np.int64), speeds)
    gravity = pull(p)
    numbers = {"first": stride, "stride": stride, "every": every, **{f"gravity_{axis}": g for axis, g in zip("xyz", gravity, strict=True)}}
    numbers |= {f"along_{axis}": speed for axis, speed in zip("xyz", ALONG, strict=True)} | {"gap": GAP}
    mesh = vessel(d) if p.scene == "bed" else plate(p.panels)
    return Setup(steps, p.run_step, bodies, {**numbers, **contacts(p, skin=0.4)}, {"plate": mesh}, {"motion_words": moving.words})


def wall_motion(p: Parameters) -> WallMotion:
    """What the walls do."""
    if p.turning:
        way = " ".join(map(repr, ALONG))
        return WallMotion(f"rotation point 0.0 0.0 0.0 axis 0 1 0 rate {p.turning!r} uniform velocity {way}")
    if p.scene == "bed":
        speed = SPEED if p.reference_frame == "speed" else (0.0, 0.0, 0.0)
        push = vessel_acceleration(p) if p.reference_frame == "push" else (0.0, 0.0, 0.0)
        return WallMotion("uniform velocity " + " ".join(map(repr, speed)) + " acceleration " + " ".join(map(repr, push)))
    return motion(p)


def vessel_acceleration(p: Parameters) -> tuple[float, float, float]:
    """m/s^2, of the vessel."""
    return p.push_x, -2.0 / 3.0 * p.push_x, 0.5 * p.push_x


def pull(p: Parameters) -> tuple[float, float, float]:
    """m/s^2, on the grains: none on those that are held."""
    if p.scene == "held":
        return 0.0, 0.0, 0.0
    x, y, z = vessel_acceleration(p) if p.reference_frame == "tilt" else (0.0, 0.0, 0.0)
    return -x, -y, -p.gravity - z


def _held(p: Parameters) -> tuple[Array, Array]:
    places = np.array([(x, 0.004 * k, 0.5 * p.grain_diameter - DEPTH) for k, x in enumerate(PLACES)])
    return places, np.zeros_like(places)


def _above(p: Parameters) -> tuple[Array, Array]:
    return np.array([(0.003, 0.001, 0.5 * p.grain_diameter + GAP)]), np.zeros((1, 3))


def _bed(p: Parameters) -> tuple[Array, Array]:
    """Four layers of nine grains each, off their lattice, that fall and collide from the first step on."""
    d, number = p.grain_diameter, np.arange(36)
    lattice = np.column_stack([number % 3, number // 3 % 3, number // 9])
    off = np.column_stack([np.sin(7.0 * number + axis) for axis in range(3)])
    places = d * (lattice * np.array([1.2, 1.2, 1.15]) + [0.9, 0.9, 0.6] + 0.04 * off)
    speeds = np.column_stack([0.15 * np.sin(3.0 * number), 0.15 * np.cos(5.0 * number), np.full(36, -0.25)])
    return places, speeds + (np.array(SPEED) if p.reference_frame == "speed" else 0.0)


def plate(panels: int) -> Array:
    """Triangles (n, 3, 3) in m of a square of 80 mm about the origin."""
    side = 0.08 / panels
    corners = [(-0.04 + side * i, -0.04 + side * j, 0.0) for i in range(panels) for j in range(panels)]
    return np.vstack([rectangle(corner, (side, 0.0, 0.0), (0.0, side, 0.0)) for corner in corners])


def vessel(diameter: float) -> Array:
    """Triangles (n, 3, 3) in m of a floor and four walls, 4.2 diameters wide and 6 high."""
    w, h = 4.2 * diameter, 6.0 * diameter
    x, y, z = (w, 0.0, 0.0), (0.0, w, 0.0), (0.0, 0.0, h)
    origin = (0.0, 0.0, 0.0)
    return np.vstack([rectangle(origin, x, y), rectangle(origin, x, z), rectangle((0.0, w, 0.0), x, z), rectangle(origin, y, z),
                      rectangle((w, 0.0, 0.0), y, z)])
