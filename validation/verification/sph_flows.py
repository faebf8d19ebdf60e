"""Flows of the SPH solver against hydrostatics and potential theory, without any engine."""

from __future__ import annotations

import numpy as np

from dembark.physics.sph import SphFluid, lattice, tank_walls

from .item import Array, Curve, Item, Panel, check

GRAVITY = 9.81
HYDROSTATICS = "hydrostatics"


def still_water() -> Item:
    """Pressure in a tank at rest, and the force on its walls, over the second second."""
    depth, width, dx = 0.5, 1.0, 0.025
    points = lattice([0, 0], [width, depth], dx)
    water = SphFluid(points, spacing=dx, sound_speed=20.0 * np.sqrt(GRAVITY * depth), gravity=[0, -GRAVITY],
                     pressure=1000.0 * GRAVITY * (depth - points[:, 1]))
    wall = water.add_wall(tank_walls([0, 0], [width, depth + 4 * dx], dx))
    water.run(1.0)
    squares, forces = [], []
    for _ in range(50):
        water.run(0.02)
        due = 1000.0 * GRAVITY * (depth - water.positions[:, 1])
        squares.append(np.mean((water.pressures - due) ** 2))
        forces.append(wall.force[1])
    scale = 1000.0 * GRAVITY * depth
    heights, pressures = water.positions[:, 1], np.maximum(water.pressures, 1.0) / scale
    bottom = np.argsort(heights)
    return Item(
        "still_water",
        "SPH: water at rest",
        f"A tank {width:g} m wide is filled {depth:g} m deep, {round(depth / dx)} particles, and left at rest for two seconds. The "
        "pressure of the particles must correspond to their depth, and the walls must carry the weight.",
        [check("pressure_rms", "pressure: rms deviation from ρ g depth, over ρ g H", np.sqrt(np.mean(squares)) / scale, 0.0, 0.01,
                   evidence="theory", source=HYDROSTATICS, why="a fifth of the pressure of one layer of particles",
                   control="gravity a fiftieth too strong"),
         check("wall_force", "mean force on the walls over the weight", -np.mean(forces) / (scale * width), 1.0, 0.01,
                   absolute=False, evidence="theory", source=HYDROSTATICS, why="as for the pressure",
                   control="gravity a fiftieth too strong")],
        [Panel("Pressure after 2 s", "height (m)", "p / (ρ g H)", [
            Curve("particles", heights[bottom], pressures[bottom]),
            Curve("ρ g depth", [0.0, 0.98 * depth], [1.0, 0.02], theory=True)], linear=True)],
    )


def _annulus(inner: float, outer: float, dx: float) -> tuple[Array, Array, Array]:
    """Points of a lattice in a disc, in the ring around it, and in a wall around that."""
    edge = np.ceil((outer + 4 * dx) / dx) * dx
    points = lattice([-edge, -edge], [edge, edge], dx)
    r = np.linalg.norm(points, axis=1)
    return points[r < inner], points[(r >= inner) & (r < outer)], points[(r >= outer) & (r < outer + 4 * dx)]


def added_mass() -> Item:
    """Impulse on a cylinder that is accelerated from rest within a larger one."""
    dx, acceleration, duration, ramp, count = 0.05, 0.02, 0.8, 0.3, 160
    disc, ring, around = _annulus(0.4, 1.2, dx)
    water = SphFluid(ring, spacing=dx, sound_speed=20.0, tension=True, alpha=0.0)
    water.add_wall(around)
    body = water.add_wall(disc)
    forces = []
    for k in range(count):
        part = np.sin(0.5 * np.pi * min(k * duration / count / ramp, 1.0)) ** 2
        body.set_motion(body.velocity, acceleration=[part * acceleration, 0])
        water.run(duration / count)
        forces.append(-body.force[0] / acceleration)
    # Radii of the circles with the areas of the lattices.
    a, b = np.sqrt(len(disc) * dx**2 / np.pi), np.sqrt((len(disc) + len(ring)) * dx**2 / np.pi)
    due = 1000.0 * np.pi * a**2 * (b**2 + a**2) / (b**2 - a**2)
    times = duration / count * np.arange(1, count + 1)
    found = np.array(forces)
    return Item(
        "added_mass",
        "SPH: added mass of a cylinder",
        f"A cylinder of radius {a:.3f} m, {2 * a / dx:.0f} particles across, is accelerated by {acceleration:g} m/s² from rest within "
        f"water that fills a larger one of {b:.3f} m. Potential theory gives the added mass ρ π a² (b² + a²)/(b² − a²) "
        "per metre (Lamb, Hydrodynamics, 6th ed. 1932, art. 69). No model adds it here: it follows from the acceleration of the "
        f"wall particles, which enters their pressure. The acceleration is ramped over {ramp:g} s to avoid sound waves; the mean "
        "force after that is compared. By then the cylinder has moved a tenth of a spacing: later the lattice of the water resists shear.",
        [check("added_mass_ratio", "added mass over that of theory", found[times > ramp].mean() / due, 1.0, 0.05, absolute=False,
                evidence="theory",
                   source="Lamb 1932, art. 69", why="steps of the lattice on both circles", control="water a tenth too light")],
        [Panel("Force", "time (s)", "force over acceleration (kg/m)", [
            Curve("particles", times.tolist(), np.maximum(found, 1.0)),
            Curve("theory", [duration / count, duration], [due, due], theory=True)], linear=True)],
    )


def floating() -> Item:
    """Draught of a block that floats, upright, in a tank."""
    side, dx, ratio = 0.2, 0.0125, 0.8
    width, depth = 0.6, 0.25
    # Afloat from the beginning, a tenth of its side too high.
    low = np.round((depth - (ratio - 0.1) * side) / dx) * dx
    block = lattice([0.2, low], [0.4, low + side], dx)
    points = lattice([0, 0], [width, depth], dx)
    inside = (points[:, 0] > 0.2) & (points[:, 0] < 0.4) & (points[:, 1] > low)
    points = points[~inside]
    water = SphFluid(points, spacing=dx, sound_speed=35.0, gravity=[0, -GRAVITY], alpha=0.1,
                     pressure=1000.0 * GRAVITY * (depth - points[:, 1]))
    water.add_wall(tank_walls([0, 0], [width, depth + 0.15], dx))
    body = water.add_body(block, mass=ratio * 1000.0 * side**2, inertia=np.inf, centre=[0.3, low + side / 2])
    heights = []
    for _ in range(70):
        water.run(0.02)
        heights.append(body.position[1])
    bottom = np.array(heights) - side / 2
    # The level follows from the volumes: level * width = water + draught * side.
    volume = len(points) * dx**2
    draught = (volume - width * bottom) / (width - side)
    share = draught / side
    return Item(
        "floating",
        "SPH: floating block",
        f"A block of {side:g} m side and {ratio:g} times the density of water is released, upright and without rotation, a tenth of "
        "its side above its floating position. Its mean draught in the second 0.7 s follows from its height and the volume of water.",
        [check("displaced_volume", "displaced over total volume", float(np.mean(share[35:])), ratio, 0.02,
                   evidence="theory", source="Archimedes", why="a third of a layer of particles on 16", control="water a tenth too light")],
        [Panel("Draught", "time (s)", "displaced over total volume", [
            Curve("block", (0.02 * np.arange(1, 71)).tolist(), share.tolist()),
            Curve("Archimedes", [0.02, 1.4], [ratio, ratio], theory=True)], linear=True)],
    )
