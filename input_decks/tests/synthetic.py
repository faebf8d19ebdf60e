"""Run folders with known answers: a silo that follows Janssen's law exactly, a channel with an exponential velocity profile."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import stdtrit

from dembark.input_decks.common.momentum import PARTS
from dembark.physics import capillary_force
from dembark.postproc.tests.dumps import BOX, contacts_text, grains_text, write_times

GRAVITY, DIAMETER, DENSITY, WALL_SPEED = 9.81, 0.005, 2500.0, 0.01
# Of a bed at rest and of a flow, which needs more for its means.
FRAMES, FLOW_FRAMES = 20, 40
# From a grain to its neighbour across the channel.
BESIDE = np.array([DIAMETER, 0.0, 0.0])


class Written:
    """The folder of a replica as it is written: frames of the dumps in a `box` with its `flags`, then the rest."""

    def __init__(self, results: Path, case: str, variant: str, engine: str, replica: int, box: Any = BOX, flags: str = "ff ff ff") -> None:
        self.folder = results / case / variant / engine / f"replica-{replica}"
        self.folder.mkdir(parents=True)
        self.names = {"case": case, "variant": variant, "profile": "quick", "engine": engine, "replica": replica, "seed": replica}
        self.space: dict[str, Any] = {"box": box, "flags": flags}
        self.grains: list[str] = []
        self.contacts: list[str] = []

    def frame(self, step: int, place: Any, radii: Any, touching: tuple[Any, Any, Any, Any], **more: Any) -> None:
        """Grains at `place` with `more` as in grains_text, and contacts: (places of the first, of the second, rows of both, forces)."""
        first, second, rows, forces = touching
        self.grains.append(grains_text(int(step), place, radii, **more, **self.space))
        self.contacts.append(contacts_text(int(step), first, second, np.column_stack(rows) + 1, forces, **self.space))

    def finish(self, times: dict[str, Any], parameters: dict[str, Any]) -> Path:
        """The history `times` and the record of a run with `parameters`; returns the engine's folder."""
        (self.folder / "grains.dump").write_text("".join(self.grains))
        (self.folder / "contacts.dump").write_text("".join(self.contacts))
        write_times(self.folder / "time.csv", times)
        friction, seed = parameters["wall_friction"], self.names["seed"]
        provenance = {"commit": "0" * 40, "dirty": False, "versions": {"python": "3.11"}, "flags": {}, "wall_time": 10.0,
                      "particle_steps_per_second": 1e6}
        own = {"grain_diameter": DIAMETER, "gravity": GRAVITY, "grain_density": DENSITY, **parameters, "seed": seed}
        record = {**self.names, "parameters": own,
                  "derived": {"wall_static": friction, "wall_kinetic": friction, "grain_kinetic": 1.0}, "steps": 10000, "time_step": 1e-5,
                  "frames": len(self.grains), "inputs": "", "provenance": provenance}
        (self.folder / "run.json").write_text(json.dumps(record))
        return self.folder.parent


def account(rows: int, lost: float) -> dict[str, np.ndarray]:
    """Columns of an energy account that balances: damping takes 0.3 J, of which the part `lost` is not tallied."""
    rise = np.arange(rows) / (rows - 1.0)
    table = {"first_kinetic": np.zeros(rows), "gravity": rise, "walls": 0.01 * rise}
    table |= dict.fromkeys(PARTS, -0.05 * rise) | {"normal_viscous": -0.3 * rise}
    table["kinetic_energy"] = table["gravity"] + table["walls"] + sum(table[name] for name in PARTS)
    table |= {name: np.zeros(rows) for name in ("other", "imposed", "balance")} | {"scale": 1e-3 + 2.0 * rise}
    return table | {"normal_viscous": (1.0 - lost) * table["normal_viscous"]}


def restated(folder: Path, **changes: float) -> Path:
    """The engine's `folder`, whose records say other parameters than were simulated."""
    for path in folder.glob("replica-*/run.json"):
        record = json.loads(path.read_text())
        path.write_text(json.dumps({**record, "parameters": record["parameters"] | changes}))
    return folder


def silo(results: Path, *, engine: str = "liggghts", replica: int = 1, variant: str = "dry", k: float = 0.8, friction: float = 0.25,
         noise: float = 0.0, seed: int = 0, lost_wall_force: float = 0.0, bridge_volume: float = 0.0, smooth: float = 1.0,
         lost_contacts: int = 0, stated: float | None = None, inner: float = 1.0, heavier: float = 1.0, sticking: float = 0.0) -> Path:
    """Write a replica whose wall and base forces follow Janssen's law; returns the engine's folder. `noise`: relative scatter of the wall
    forces among grains and frames; `lost_wall_force`: share that is missing in time.csv; `bridge_volume` (m3): every grain hangs on the
    wall by a liquid bridge too, whose pull is rubbed like the rest of the pressure; `smooth`: friction of the wall's lower half over that
    of its upper one; `lost_contacts`: how many of the 24 between two layers are missing; `sticking`: share of the grains at the wall that
    move with it. Wrong physics: `stated` is the wall's friction that the run says it had, `inner` the stress across inside over that at the
    wall, `heavier` the gravity that acts over the one it says."""
    random = np.random.default_rng(seed)
    radius, levels, ring = 0.025, 30, 24
    angle = 2.0 * np.pi * np.arange(ring) / ring
    height = DIAMETER * (np.arange(levels) + 0.5)
    off = radius - 0.4999 * DIAMETER
    place = np.array([[off * np.cos(a), off * np.sin(a), z] for z in height for a in angle])
    liquid = {"bridge_volume": bridge_volume, "surface_tension": 0.072, "contact_angle": 0.35, "capillary_model": "exact"}
    pull = float(capillary_force(0.5 * DIAMETER, np.inf, 0.0, bridge_volume, 0.072, 0.35)) if bridge_volume else 0.0
    mass = np.full(len(place), 0.6 * DENSITY * np.pi * radius**2 * DIAMETER / ring)
    length, top = radius / (2.0 * k * friction), levels * DIAMETER
    gravity = heavier * GRAVITY
    weight = mass.sum() * gravity / (np.pi * radius**2 * top)
    weight -= 2.0 * friction * (ring * pull / (2.0 * np.pi * radius * DIAMETER)) / radius
    stress = weight * length * -np.expm1(-(top - place[:, 2]) / length)
    push = k * stress * 2.0 * np.pi * radius * DIAMETER / ring
    outward = place[:, :2] / np.hypot(place[:, 0], place[:, 1])[:, None]
    run, lift, steps = Written(results, "silo", variant, engine, replica), [], 5000 + 100 * np.arange(FRAMES)
    below, above = np.arange(len(place) - ring), np.arange(ring, len(place))
    # Opposite grains press on each other as the wall does on them: every third, for three, as long lines take long to coarse-grain.
    here, there = np.split(np.arange(len(place)).reshape(levels, ring)[:, ::3], 2, axis=1)
    first, second = np.concatenate([above, here.ravel()]), np.concatenate([below, there.ravel()])
    for step in steps:
        own = push * (1.0 + noise * random.standard_normal(len(push)))
        side = np.column_stack([-own[:, None] * outward, np.where(place[:, 2] < 0.5 * top, smooth, 1.0) * friction * (own + pull)])
        carried = np.cumsum((mass * gravity - side[:, 2]).reshape(levels, ring)[::-1], axis=0)[::-1].ravel()
        base = np.zeros_like(side)
        base[:ring, 2] = carried[:ring]
        across = 1.5 * inner * (own[here] + own[there]).ravel()[:, None] * outward[here.ravel()]
        forces = np.concatenate([np.column_stack([np.zeros((len(above), 2)), carried[above]]), np.pad(across, ((0, 0), (0, 1)))])
        held = first % ring >= lost_contacts
        run.frame(step, place, np.full(len(place), 0.5 * DIAMETER),
                  (place[first][held], place[second][held], (first[held], second[held]), forces[held]), masses=mass,
                  velocities=WALL_SPEED * np.outer(np.arange(len(place)) % ring < sticking * ring, [0.0, 0.0, 1.0]),
                  walls={"side": side, "base": base})
        lift.append((side[:, 2].sum(), base[:, 2].sum()))
    side_fz, base_fz = np.array(lift).T
    return run.finish(
        {"step": steps, "time": steps * 1e-5, "kinetic_energy": 0 * side_fz, "side_fz": (1.0 - lost_wall_force) * side_fz,
         "base_fz": base_fz},
        {"cylinder_radius": radius, "wall_friction": friction if stated is None else stated, "grain_count": len(place),
         "wall_speed": WALL_SPEED, **liquid})


def plug_flow(results: Path, *, engine: str = "liggghts", replica: int = 1, variant: str = "smooth", slip: float = 0.4,
              decay: float = 2.0, noise: float = 0.02, seed: int = 0, tilt: float = 0.0, lift: float = 1.0, faster: float = 1.0,
              walk: tuple[float, float] | None = None, gaussian: float = 0.0) -> Path:
    """Write a replica with v / v_core = 1 - slip exp(-distance / (decay d)) and flux v0 rho_b; returns the engine's folder. `tilt`: a
    linear variation of the core's velocity from wall to wall, which a flat core must not have; `lift`: what walls and base carry over the
    weight; `faster`: velocities over those of the displacements. `walk`: streamwise and transverse standard deviation, in d, of the random
    steps from frame to frame in two layers, at a front and a rear wall. They have Student's distribution with 2.5 degrees of freedom, and a
    Gaussian one nearer than `gaussian` d to a side wall."""
    random = np.random.default_rng(seed)
    counts = (20, 5, 30) if walk is None else (20, 2, 40)
    width, depth, speed, step_length = 20 * DIAMETER, counts[1] * DIAMETER, 0.02, 1e-5
    across, along, up = (np.arange(count) + 0.5 for count in counts)
    place = DIAMETER * np.stack(np.meshgrid(across, along, up, indexing="ij"), axis=-1).reshape(-1, 3)
    if walk is not None and any(walk):
        # Evenly spread: grains that leave the columns of a lattice have a mean velocity.
        place[:, 0] = DIAMETER * (0.5 + 19.0 * random.random(len(place)))
    from_wall = np.minimum(place[:, 0], width - place[:, 0]) / DIAMETER
    profile = (1.0 - slip * np.exp(-from_wall / decay)) * (1.0 + tilt * (place[:, 0] / width - 0.5))
    profile *= len(profile) / profile.sum()
    radii = np.full(len(place), 0.5 * DIAMETER)
    mass = DENSITY * 4.0 / 3.0 * np.pi * radii**3
    run = Written(results, "plug_flow", variant, engine, replica, ((-1.0, 1.0), (0.0, depth), (-1.0, 1.0)),
                  "ff pp ff" if walk is None else "ff ff ff")
    steps = 100000 + 2000 * np.arange(FLOW_FRAMES)
    left, right = ((from_wall < 0.6) & (side * (place[:, 0] - 0.5 * width) > 0.0) for side in (-1, 1))
    push, weight = 0.01, mass.sum() * GRAVITY
    neighbour = np.nonzero(place[:, 0] < width - DIAMETER)[0]
    ends = [] if walk is None else ["front", "rear"]
    wandered = np.zeros((len(steps), len(place), 3))
    if walk is not None:
        shape, alike = (len(steps), len(place), 2), (from_wall < gaussian)[:, None]
        sizes = stdtrit(2.5, 0.5 + 0.5 * (np.arange(len(place)) + 0.5) / len(place))
        sizes /= np.sqrt((sizes**2).mean())
        own = random.permuted(np.tile(sizes, (len(steps), 1)), axis=1)[:, :, None] * random.choice([-1.0, 1.0], shape)
        wandered[:, :, (2, 0)] = DIAMETER * np.cumsum(walk * np.where(alike, random.standard_normal(shape), own), axis=0)
    for step, apart in zip(steps, wandered, strict=True):
        now = place - np.array([0.0, 0.0, 1.0]) * (profile * speed * step_length * (step - steps[0]))[:, None] + apart
        walls = {name: np.zeros_like(place) for name in ("left", "right", "base", *ends)}
        walls["left"][left] = [push, 0.0, 0.3 * push]
        walls["right"][right] = [-push, 0.0, 0.3 * push]
        velocity = np.zeros_like(place)
        velocity[:, 2] = -faster * speed * (profile + noise * random.standard_normal(len(place)))
        first, forces = now[neighbour], np.tile([-push, 0.0, 0.0], (len(neighbour), 1))
        run.frame(step, now, radii, (first, first + BESIDE, (neighbour, neighbour), forces), velocities=velocity, masses=mass,
                  walls=walls)
    count = 2000
    rows = np.linspace(1, steps[-1], count).astype(int)
    friction = 0.3 * push * left.sum() * (1.0 + 0.01 * random.standard_normal(count))
    return run.finish(
        {"step": rows, "time": rows * step_length, "kinetic_energy": np.zeros(count), "left_fz": friction, "right_fz": friction,
         "base_fz": lift * weight - 2.0 * friction, **{f"{name}_fz": np.zeros(count) for name in ends}},
        {"channel_width": width, "channel_depth": depth, "base_speed": speed, "settle_time": 0.5, "wall_friction": 0.5,
         "grain_count": len(place)})
