"""Single contact: spheres of two materials side by side, each before a partner of its own, and the materials by type."""

import math

import numpy as np

from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Parameters, Setup, strides


def setup(p: Parameters) -> Setup:
    """Bodies 1 ... points are of material A, then those of B, then the partners in the same order; the point of touch is the origin of z.
    Types: A, one for each restitution coefficient; B likewise; the partners of A; those of B. Nothing leaves the box on the way."""
    output, lead = strides(p.duration, p.time_step, p.frames - 1), p.lead_steps * p.time_step
    # What is swept is linear in the number of a sphere among those of its material.
    values = [p.sweep_from + (p.sweep_to - p.sweep_from) * k / max(p.points - 1, 1) for k in range(p.points)]
    restitutions = values if p.sweep == "restitution" else [p.restitution]
    levels, larger = len(restitutions), max(1.0, p.size_ratio)
    spacing = 4.0 * p.radius * larger
    bodies, partners = [], []
    for m in (0, 1):
        for k, value in enumerate(values):
            angle = math.radians(value) if p.sweep in ("direction", "slide", "spin") else 0.0
            normal = p.speed * math.cos(angle) if p.sweep == "direction" else p.speed
            slide = p.speed * {"direction": math.sin(angle), "slide": math.tan(angle)}.get(p.sweep, 0.0)
            spin = p.speed * math.tan(angle) / p.radius if p.sweep == "spin" else 0.0
            x, z = (m * p.points + k) * spacing, p.radius + normal * lead
            bodies.append((m * levels + min(k, levels - 1) + 1, p.radius, (x, 0, z), (0, slide, -normal), (spin, 0, 0)))
            if p.partner == "mirror":
                partners.append((2 * levels + m + 1, p.radius, (x, 0, -z), (0, -slide, normal), (-spin, 0, 0)))
            elif p.partner == "rest":
                partners.append((2 * levels + m + 1, p.radius * p.size_ratio, (x, 0, -p.radius * p.size_ratio), (0, 0, 0), (0, 0, 0)))
    types, radii, *motion = (np.array(column) for column in zip(*bodies, *partners, strict=True))

    denser = p.density_ratio if p.partner == "rest" else 1.0
    densities = _by_type(levels, p.density_a, p.density_b, denser)
    # No tangent is above 100.
    far = 8.0 * p.radius * larger + 101.0 * p.speed * (output["steps"] * p.time_step + 2.0 * lead)
    box = np.array([(-spacing, (len(types) + 1) * spacing), (-far, far), (-far, far)])
    positions, velocities, spins = (np.asarray(column, float) for column in motion)
    packing = Packing(box, positions, 2.0 * radii, np.array(densities)[types - 1], types, velocities, spins, len(densities))
    return Setup(output["steps"], p.time_step, packing, {**output, "skin": 0.2 * p.radius}, tables={
        "densities": densities, "restitutions": tuple(restitutions),
        "youngs_moduli": _by_type(levels, p.youngs_modulus_a, p.youngs_modulus_b, p.stiffness_ratio),
        "poisson_ratios": _by_type(levels, p.poisson_ratio_a, p.poisson_ratio_b, 1.0)})


def _by_type(levels: int, a: float, b: float, of_partner: float) -> tuple[float, ...]:
    """A number of each type: `a` or `b`, times `of_partner` for partners."""
    return (a,) * levels + (b,) * levels + (a * of_partner, b * of_partner)
