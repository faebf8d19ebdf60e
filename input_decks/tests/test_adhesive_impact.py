"""Adhesive impact: motions by the scheme of the engines, wrong adhesion, and the engines themselves."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.adhesive_impact.setup import RATIOS, sticking_speed
from dembark.input_decks.tests.measuring import Control, Verdicts, defaults, judged, module
from dembark.physics import Body, Contact, FinnieRabinowicz, drop, effective_youngs_modulus

CASE = module("adhesive_impact")
PARAMETERS: dict[str, Any] = defaults("adhesive_impact")


def verdicts(work: float = 1.0, modulus: float = 1.0, pace: float = 1.0) -> Verdicts:
    """Of spheres on a plane with another work of adhesion, modulus or speeds, each times that of the case."""
    p = SimpleNamespace(**PARAMETERS)
    youngs = modulus * effective_youngs_modulus(p.youngs_modulus, p.poisson_ratio, p.youngs_modulus, p.poisson_ratio)
    smooth = FinnieRabinowicz(static_friction=0.0, kinetic_friction=0.0, critical_slip_distance=0.0)
    contact = Contact(effective_youngs_modulus=youngs, effective_shear_modulus=0.3 * youngs, restitution=1.0, friction=smooth,
                      cohesion="jkr", work_of_adhesion=work * p.work_of_adhesion)
    mass, step = p.density * 4.0 / 3.0 * np.pi * p.radius**3, 3.0 * p.time_step
    motions = [drop(contact, Body(radius=p.radius, mass=mass, position=(0.0, 0.0, p.radius * (1.0 + 1e-9)),
                                  velocity=(0.0, 0.0, -pace * ratio * sticking_speed(p))),
                    time_step=step, steps=round(p.duration / step), gravity=(0.0, 0.0, 0.0)) for ratio in RATIOS]
    speeds, heights = (np.array([getattr(one, name)[:, 0, 2] for one in motions]).T for name in ("velocity", "position"))
    forces = np.array([[contact_force.force[2] for contact_force in one.contacts] for one in motions]).T
    return judged("adhesive_impact", CASE.measured(PARAMETERS, speeds, forces, heights))


def controls_adhesive_impact(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("work of adhesion a fifth larger", right, verdicts(work=1.2))
    yield Control("half the modulus", right, verdicts(modulus=0.5))
    yield Control("spheres half as fast", right, verdicts(pace=0.5))


@pytest.mark.parametrize("theory", ["jkr", "dmt"])
@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_an_engine_has_the_closed_forms(engine: str, theory: str, simulate: Any) -> None:
    found = judged("adhesive_impact", CASE.measure([simulate("adhesive_impact", engine, {}, theory)]))
    assert {one["verdict"] for one in found.values()} == {"pass"}, found
