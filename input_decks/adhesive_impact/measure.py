"""Adhesive impact: which spheres stick, with what speed the others leave, and the largest attraction."""

import math

import numpy as np

from dembark.physics import dmt_pull_off, effective_youngs_modulus, jkr_pull_off, jkr_rupture_distance
from dembark.postproc.measurement import Array, Measurement, Numbers, Replicas, number

from .setup import RATIOS


def measure(replicas: Replicas) -> Measurement:
    """Values of the run (there is one)."""
    replica = replicas[0]
    frames = list(replica.grains())
    order = [np.argsort(frame.ids) for frame in frames]
    speeds = np.array([frame.velocities[place, 2] for frame, place in zip(frames, order, strict=True)])
    forces = np.array([frame.forces[place, 2] for frame, place in zip(frames, order, strict=True)])
    heights = np.array([frame.positions[place, 2] for frame, place in zip(frames, order, strict=True)])
    return measured(replica.parameters, speeds, forces, heights)


def measured(p: Numbers, speeds: Array, forces: Array, heights: Array) -> Measurement:
    """The same from the velocities (m/s), forces (N) and heights (m) of the spheres, (frames, spheres)."""
    jkr = p["cohesion"] == "jkr"
    modulus = effective_youngs_modulus(p["youngs_modulus"], p["poisson_ratio"], p["youngs_modulus"], p["poisson_ratio"])
    # A sphere that sticks swings within the gap of rupture.
    left = heights[-1] > p["radius"] + 2.0 * jkr_rupture_distance(p["work_of_adhesion"], p["radius"], modulus)
    values = {"stuck": number(float((~left).sum()), float(sum(ratio < 1.0 for ratio in RATIOS)) if jkr else 0.0)}
    for ratio, before, after, gone in zip(RATIOS, speeds[0], speeds[-1], left, strict=True):
        if not jkr or ratio > 1.0:
            values[f"restitution_{ratio:g}"] = number(after / -before if gone else 0.0, math.sqrt(1.0 - ratio**-2) if jkr else 1.0)
    pull_off = (jkr_pull_off if jkr else dmt_pull_off)(p["work_of_adhesion"], p["radius"])
    values["pull_off"] = number(-float(forces[:, 2].min()), float(pull_off))
    return Measurement(values)
