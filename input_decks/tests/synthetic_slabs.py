"""Run folders with known answers: a plane silo by Janssen's law, a gravity-driven channel with an exponential profile."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dembark.input_decks.tests.synthetic import BESIDE, DENSITY, DIAMETER, FLOW_FRAMES, FRAMES, GRAVITY, WALL_SPEED, Written

STEP = 1e-5


def plane_silo(results: Path, *, replica: int = 1, k: float = 0.7, friction: float = 0.2, noise: float = 0.0, seed: int = 0,
               tilt: float = 0.0, smooth: float = 1.0, lost_contacts: int = 0, lost_wall_force: float = 0.0,
               stated: float | None = None, inner: float = 1.0) -> Path:
    """Write a replica whose walls and base follow Janssen's law with lambda = W / (2 k friction); returns the engine's folder. `tilt`: the
    left wall carries 1 + tilt, the right one 1 - tilt of its share, which the mean over both does not show; `smooth`, `lost_contacts`,
    `lost_wall_force`, `stated` and `inner`: as of the silo."""
    random = np.random.default_rng(seed)
    across, along, levels = 10, 6, 40
    width, depth, top = across * DIAMETER, along * DIAMETER, levels * DIAMETER
    up, x, y = np.meshgrid(*((np.arange(count) + 0.5) * DIAMETER for count in (levels, across, along)), indexing="ij")
    place = np.column_stack([x.ravel(), y.ravel(), up.ravel()])
    layer = across * along
    mass = np.full(len(place), 0.6 * DENSITY * width * depth * DIAMETER / layer)
    length, weight = width / (2.0 * k * friction), mass.sum() * GRAVITY / (width * depth * top)
    stress = weight * length * -np.expm1(-(top - place[:, 2]) / length)
    side = {name: np.isclose(place[:, 0], where) for name, where in (("left", 0.5 * DIAMETER), ("right", width - 0.5 * DIAMETER))}
    run = Written(results, "plane_silo", "dry", "liggghts", replica, ((-1.0, 1.0), (0.0, depth), (-1.0, 10.0)), "ff pp ff")
    above, below = np.arange(layer, len(place)), np.arange(len(place) - layer)
    # Rows of grains from wall to wall carry what the walls press with.
    row = np.nonzero(place[:, 0] < width - DIAMETER)[0]
    first, second = np.concatenate([above, row]), np.concatenate([below, row + along])
    across_force = np.column_stack([-inner * k * stress[row] * DIAMETER**2, np.zeros((len(row), 2))])
    steps, lift = 5000 + 100 * np.arange(FRAMES), []
    for step in steps:
        walls = {}
        for name, sign in (("left", 1.0), ("right", -1.0)):
            push = np.where(side[name], k * stress * DIAMETER**2 * (1.0 + sign * tilt), 0.0)
            push *= 1.0 + noise * random.standard_normal(len(place))
            rubbed = np.where(place[:, 2] < 0.5 * top, smooth, 1.0) * push
            walls[name] = np.column_stack([sign * push, np.zeros(len(place)), friction * rubbed])
        held = walls["left"][:, 2] + walls["right"][:, 2]
        # Each layer's load, evenly on its grains: the sum above a level is what the levels below carry.
        carried = np.repeat(np.cumsum((mass * GRAVITY - held).reshape(levels, layer).sum(axis=1)[::-1])[::-1] / layer, layer)
        base = np.zeros_like(place)
        base[:layer, 2] = carried[:layer]
        forces = np.concatenate([np.column_stack([np.zeros((len(above), 2)), carried[above]]), across_force])
        kept = first % layer >= lost_contacts
        run.frame(step, place, np.full(len(place), 0.5 * DIAMETER),
                  (place[first][kept], place[second][kept], (first[kept], second[kept]), forces[kept]), masses=mass,
                  walls={**walls, "base": base})
        lift.append([wall[:, 2].sum() for wall in (walls["left"], walls["right"], base)])
    table = dict(zip(("left_fz", "right_fz", "base_fz"), np.array(lift).T, strict=True))
    table["left_fz"] = (1.0 - lost_wall_force) * table["left_fz"]
    return run.finish({"step": steps, "time": steps * STEP, "kinetic_energy": 0.0 * steps, **table},
                      {"silo_width": width, "slab_depth": depth, "wall_speed": WALL_SPEED,
                       "wall_friction": friction if stated is None else stated})


def gravity_channel(results: Path, *, cells: int = 20, variant: str = "w20", replica: int = 1, greatest: float = 3.0, slip: float = 2.0,
                    decay: float = 1.5, noise: float = 0.02, friction: float = 1.0, acceleration: float = 0.0, drift: float = 0.0,
                    swing: float = 0.2, seed: int = 0) -> Path:
    """Write a replica with u = u_max - (u_max - u_slip) exp(-(distance - d/2) / (decay d)), velocities over sqrt(g W), W = `cells` d.
    `friction`: mean friction of the walls over the weight; `acceleration` (over g): that of the flow; `drift`: relative growth of the
    kinetic energy over the window; `swing`: standard deviation of the friction's rows over its mean. Returns the engine's folder."""
    random = np.random.default_rng(seed)
    width, depth, length = cells * DIAMETER, 5 * DIAMETER, 5 * DIAMETER
    scale = np.sqrt(GRAVITY * width)
    x, y, z = np.meshgrid(*((np.arange(count) + 0.5) * DIAMETER for count in (cells, 5, 5)), indexing="ij")
    place = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    from_wall = np.minimum(place[:, 0], width - place[:, 0]) / DIAMETER
    fall = scale * (greatest - (greatest - slip) * np.exp(-(from_wall - 0.5) / decay))
    radii = np.full(len(place), 0.5 * DIAMETER)
    mass = DENSITY * 4.0 / 3.0 * np.pi * radii**3
    weight = mass.sum() * GRAVITY
    steps = 100000 + 2000 * np.arange(FLOW_FRAMES)
    # The period does not begin at zero: its middle stays when it shrinks.
    run = Written(results, "gravity_channel", variant, "liggghts", replica, ((-1.0, 1.0), (0.0, depth), (0.02, 0.02 + length)), "ff pp pp")
    sides = {"left": from_wall < 0.6, "right": from_wall < 0.6}
    sides["left"] &= place[:, 0] < 0.5 * width
    sides["right"] &= place[:, 0] > 0.5 * width
    push = 0.5 * weight / 0.3 / sides["left"].sum()
    neighbour = np.nonzero(place[:, 0] < width - DIAMETER)[0]
    for step in steps:
        elapsed = (step - steps[0]) * STEP
        speed = fall + acceleration * GRAVITY * elapsed
        low = place[:, 2] - (fall * elapsed + 0.5 * acceleration * GRAVITY * elapsed**2)
        images = np.column_stack([np.zeros((len(place), 2)), np.floor(low / length)])
        now = np.column_stack([place[:, :2], 0.02 + low - images[:, 2] * length])
        walls = {name: np.zeros_like(place) for name in sides}
        for name, sign in (("left", 1.0), ("right", -1.0)):
            walls[name][sides[name]] = [sign * push, 0.0, 0.3 * push]
        velocity = np.zeros_like(place)
        velocity[:, 2] = -speed + noise * scale * random.standard_normal(len(place))
        velocity[:, 2] -= velocity[:, 2].mean() + speed.mean()
        first, forces = now[neighbour], np.tile([-push, 0.0, 0.0], (len(neighbour), 1))
        run.frame(step, now, radii, (first, first + BESIDE, (neighbour, neighbour), forces), velocities=velocity, masses=mass,
                  walls=walls, images=images)
    rows = np.arange(20, steps[-1] + 1, 20)
    held = 0.5 * weight * (friction - acceleration) * (1.0 + swing * random.standard_normal(len(rows)))
    energy = 1.0 + 0.02 * random.standard_normal(len(rows)) + drift * np.linspace(-1.0, 1.0, len(rows)).clip(0.0)
    return run.finish({"step": rows, "time": rows * STEP, "kinetic_energy": energy, "left_fz": held, "right_fz": held},
                      {"channel_width": width, "channel_depth": depth, "wall_friction": 0.5})
