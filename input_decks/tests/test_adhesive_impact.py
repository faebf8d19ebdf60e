"""Adhesive impact: what is measured of motions that are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from dembark.input_decks.adhesive_impact.setup import RATIOS, sticking_speed
from dembark.input_decks.tests import measuring
from dembark.physics import Body, Contact, FinnieRabinowicz, drop, effective_youngs_modulus

STICKING = measuring.module("adhesive_impact")
PARAMETERS: dict[str, Any] = measuring.defaults("adhesive_impact")


def verdicts(work: float = 1.0, modulus: float = 1.0, pace: float = 1.0) -> measuring.Verdicts:
    """Of spheres on a plane by the scheme of the engines, with another work of adhesion, modulus or speeds."""
    p = SimpleNamespace(**PARAMETERS)
    youngs = modulus * effective_youngs_modulus(p.youngs_modulus, p.poisson_ratio, p.youngs_modulus, p.poisson_ratio)
    smooth = FinnieRabinowicz(static_friction=0.0, kinetic_friction=0.0, critical_slip_distance=0.0)
    contact = Contact(effective_youngs_modulus=youngs, effective_shear_modulus=0.3 * youngs, restitution=1.0, friction=smooth, cohesion="jkr",
                      work_of_adhesion=work * p.work_of_adhesion)
    mass, step = p.density * 4.0 / 3.0 * np.pi * p.radius**3, 3.0 * p.time_step
    motions = []
    for ratio in RATIOS:
        speed = pace * ratio * sticking_speed(p)
        body = Body(radius=p.radius, mass=mass, position=(0.0, 0.0, p.radius * (1.0 + 1e-9)), velocity=(0.0, 0.0, -speed))
        motions.append(drop(contact, body, time_step=step, steps=round(p.duration / step), gravity=(0.0, 0.0, 0.0)))
    speeds = np.array([np.concatenate([[one.velocity[0, 0, 2]], one.velocity[:, 0, 2]]) for one in motions]).T
    forces = np.array([[contact_force.force[2] for contact_force in one.contacts] for one in motions]).T
    heights = np.array([one.position[:, 0, 2] for one in motions]).T
    return measuring.judged("adhesive_impact", STICKING.measured(PARAMETERS, speeds, forces, heights))


def test_right_physics_passes() -> None:
    found = verdicts()
    assert {one["verdict"] for one in found.values()} == {"pass"}, found
