"""Run folders with known answers: a silo that follows Janssen's law exactly, a channel with an exponential velocity profile."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from dembark.physics import capillary_force
from dembark.postproc.tests.dumps import contacts_text, grains_text, write_times

GRAVITY, DIAMETER, DENSITY = 9.81, 0.005, 2500.0
FRAMES = 40


def finish(
    folder: Path, engine: str, replica: int, case: str, variant: str, parameters: dict[str, Any], grains: list[str], contacts: list[str]
) -> None:
    (folder / "grains.dump").write_text("".join(grains))
    (folder / "contacts.dump").write_text("".join(contacts))
    provenance = {"commit": "0" * 40, "dirty": False, "versions": {"python": "3.11"}, "flags": {}, "wall_time": 10.0,
                  "particle_steps_per_second": 1e6}
    friction = parameters["wall_friction"]
    record = {"case": case, "variant": variant, "profile": "quick", "engine": engine, "replica": replica, "seed": replica,
              "parameters": {**parameters, "seed": replica}, "derived": {"wall_static": friction, "wall_kinetic": friction}, "steps": 10000,
              "time_step": 1e-5, "frames": len(grains), "inputs": "", "provenance": provenance}
    (folder / "run.json").write_text(json.dumps(record))


def silo(
    results: Path,
    *,
    engine: str = "liggghts",
    replica: int = 1,
    variant: str = "dry",
    k: float = 0.8,
    friction: float = 0.25,
    noise: float = 0.0,
    seed: int = 0,
    lost_wall_force: float = 0.0,
    bridge_volume: float = 0.0,
) -> Path:
    """Write a replica whose wall and base forces follow Janssen's law; returns the engine's folder.

    `noise`: relative scatter of the wall forces among grains and frames; `lost_wall_force`: share that is missing in time.csv;
    `bridge_volume` (m3): every grain hangs on the wall by a liquid bridge too, whose pull is rubbed like the rest of the pressure.
    """
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
    weight = mass.sum() * GRAVITY / (np.pi * radius**2 * top)
    weight -= 2.0 * friction * (ring * pull / (2.0 * np.pi * radius * DIAMETER)) / radius
    stress = weight * length * -np.expm1(-(top - place[:, 2]) / length)
    push = k * stress * 2.0 * np.pi * radius * DIAMETER / ring
    outward = place[:, :2] / np.hypot(place[:, 0], place[:, 1])[:, None]
    folder = results / "silo" / variant / engine / f"replica-{replica}"
    folder.mkdir(parents=True)
    grains, contacts, lift, steps = [], [], [], 5000 + 100 * np.arange(FRAMES)
    below, above = np.arange(len(place) - ring), np.arange(ring, len(place))
    for step in steps:
        own = push * (1.0 + noise * random.standard_normal(len(push)))
        side = np.column_stack([-own[:, None] * outward, friction * (own + pull)])
        carried = np.cumsum((mass * GRAVITY - side[:, 2]).reshape(levels, ring)[::-1], axis=0)[::-1].ravel()
        base = np.zeros_like(side)
        base[:ring, 2] = carried[:ring]
        grains.append(grains_text(int(step), place, np.full(len(place), 0.5 * DIAMETER), masses=mass, walls={"side": side, "base": base}))
        forces = np.column_stack([np.zeros((len(above), 2)), carried[above]])
        contacts.append(contacts_text(int(step), place[above], place[below], np.column_stack([above, below]) + 1, forces))
        lift.append((side[:, 2].sum(), base[:, 2].sum()))
    side_fz, base_fz = np.array(lift).T
    write_times(
        folder / "time.csv",
        {
            "step": steps,
            "time": steps * 1e-5,
            "kinetic_energy": 0 * side_fz,
            "side_fz": (1.0 - lost_wall_force) * side_fz,
            "base_fz": base_fz,
        },
    )
    parameters = {
        "cylinder_radius": radius,
        "grain_diameter": DIAMETER,
        "gravity": GRAVITY,
        "wall_friction": 0.5,
        "grain_density": DENSITY,
        "grain_count": len(place),
        **liquid,
    }
    finish(folder, engine, replica, "silo", variant, parameters, grains, contacts)
    return folder.parent


def plug_flow(
    results: Path,
    *,
    engine: str = "liggghts",
    replica: int = 1,
    variant: str = "smooth",
    slip: float = 0.4,
    decay: float = 2.0,
    noise: float = 0.02,
    seed: int = 0,
    tilt: float = 0.0,
) -> Path:
    """Write a replica with v / v_core = 1 - slip exp(-distance / (decay d)) and flux v0 rho_b; returns the engine's folder.

    `tilt`: a linear variation of the core's velocity from wall to wall, which a flat core must not have.
    """
    random = np.random.default_rng(seed)
    width, depth, speed, step_length = 20 * DIAMETER, 5 * DIAMETER, 0.02, 1e-5
    across, along, up = (np.arange(count) + 0.5 for count in (20, 5, 30))
    place = DIAMETER * np.stack(np.meshgrid(across, along, up, indexing="ij"), axis=-1).reshape(-1, 3)
    from_wall = np.minimum(place[:, 0], width - place[:, 0]) / DIAMETER
    profile = (1.0 - slip * np.exp(-from_wall / decay)) * (1.0 + tilt * (place[:, 0] / width - 0.5))
    profile *= len(profile) / profile.sum()
    radii = np.full(len(place), 0.5 * DIAMETER)
    mass = DENSITY * 4.0 / 3.0 * np.pi * radii**3
    folder = results / "plug_flow" / variant / engine / f"replica-{replica}"
    folder.mkdir(parents=True)
    steps = 100000 + 5000 * np.arange(FRAMES)
    left, right = ((from_wall < 0.6) & (side * (place[:, 0] - 0.5 * width) > 0.0) for side in (-1, 1))
    push, weight = 0.01, mass.sum() * GRAVITY
    grains, contacts = [], []
    box, flags = ((-1.0, 1.0), (0.0, depth), (-1.0, 1.0)), "ff pp ff"
    neighbour = np.nonzero(place[:, 0] < width - DIAMETER)[0]
    for step in steps:
        now = place - np.array([0.0, 0.0, 1.0]) * (profile * speed * step_length * (step - steps[0]))[:, None] * 0.1
        walls = {name: np.zeros_like(place) for name in ("left", "right", "base")}
        walls["left"][left] = [push, 0.0, 0.3 * push]
        walls["right"][right] = [-push, 0.0, 0.3 * push]
        velocity = np.zeros_like(place)
        velocity[:, 2] = -speed * (profile + noise * random.standard_normal(len(place)))
        grains.append(grains_text(int(step), now, radii, velocities=velocity, masses=mass, walls=walls, box=box, flags=flags))
        first = now[neighbour]
        second = first + np.array([DIAMETER, 0.0, 0.0])
        forces = np.tile([-push, 0.0, 0.0], (len(neighbour), 1))
        contacts.append(contacts_text(int(step), first, second, np.column_stack([neighbour, neighbour]) + 1, forces, box=box, flags=flags))
    count = 2000
    rows = np.linspace(1, steps[-1], count).astype(int)
    friction = 0.3 * push * left.sum() * (1.0 + 0.01 * random.standard_normal(count))
    zero = np.zeros(count)
    write_times(
        folder / "time.csv",
        {
            "step": rows,
            "time": rows * step_length,
            "kinetic_energy": zero,
            "left_fz": friction,
            "right_fz": friction,
            "base_fz": weight - 2.0 * friction,
        },
    )
    parameters = {
        "channel_width": width,
        "channel_depth": depth,
        "grain_diameter": DIAMETER,
        "base_speed": speed,
        "gravity": GRAVITY,
        "grain_density": DENSITY,
        "settle_time": 0.5,
        "wall_friction": 0.5,
        "grain_count": len(place),
    }
    finish(folder, engine, replica, "plug_flow", variant, parameters, grains, contacts)
    return folder.parent
