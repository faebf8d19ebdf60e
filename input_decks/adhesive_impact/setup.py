"""Adhesive impact: spheres that touch the plane z = 0 at the same time, each at its speed."""

import math

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, strides
from dembark.physics import effective_youngs_modulus, jkr_loss

# Speeds over that of sticking.
RATIOS = (0.5, 0.8, 1.1, 1.3, 1.6, 2.0, 3.0, 5.0)


def sticking_speed(p: Parameters) -> float:
    """Speed (m/s) at which the kinetic energy is what JKR's hysteresis loses."""
    mass = p.density * 4.0 / 3.0 * math.pi * p.radius**3
    modulus = effective_youngs_modulus(p.youngs_modulus, p.poisson_ratio, p.youngs_modulus, p.poisson_ratio)
    return math.sqrt(2.0 * jkr_loss(p.work_of_adhesion, p.radius, modulus) / mass)


def setup(p: Parameters) -> Setup:
    """Sphere k + 1 has RATIOS[k] times the speed of sticking."""
    speed = sticking_speed(p)
    speeds, zero = speed * np.array(RATIOS), np.zeros(len(RATIOS))
    places = np.column_stack([4.0 * p.radius * np.arange(len(RATIOS)), zero, p.radius + speeds * p.lead_steps * p.time_step])
    box = np.array([(-4.0 * p.radius, places[-1, 0] + 4.0 * p.radius), (-4.0 * p.radius, 4.0 * p.radius),
                    (-p.radius, p.radius + 2.0 * speeds[-1] * p.duration)])
    packing = Packing(box, places, zero + 2.0 * p.radius, zero + p.density, np.ones(len(RATIOS), dtype=np.int64),
                      np.column_stack([zero, zero, -speeds]))
    output = strides(p.duration, p.time_step, max(1, math.ceil(p.duration / p.time_step / 20)))
    return Setup(output["steps"], p.time_step, packing, {**output, "skin": 0.2 * p.radius, "sticking_speed": speed})
