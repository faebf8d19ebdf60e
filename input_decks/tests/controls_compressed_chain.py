"""Wrong steps of a chain, and wrong integrators."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.tests.measuring import Control
from dembark.input_decks.tests.test_compressed_chain import chain, spoiled, verdicts
from dembark.physics import integrate_adams


def with_integrator(folder: Path, integrate: Any) -> dict[str, Any]:
    """What is measured with another integrator in the place of Adams'."""
    chain.integrate_adams = integrate
    try:
        return verdicts(folder)
    finally:
        chain.integrate_adams = integrate_adams


def controls(folder: Path) -> Iterator[Control]:
    right, rough = verdicts(folder), verdicts(folder, 0.2)
    yield Control("a step that is a millionth longer than prescribed", right, verdicts(folder, longer=1.0 + 1e-6))
    yield Control("a monitor that reports values a twentieth too large", rough, verdicts(folder, 0.2, told=1.05))
    second = spoiled(lambda step, time: 0.1 * step**2 * time)
    yield Control("an integrator of second order", right, with_integrator(folder, second))
    yield Control("an integrator that damps", right, with_integrator(folder, spoiled(lambda _, time: 1e-3 * time)))
    third = spoiled(lambda step, time: np.where(time == time[-1], step**3, 0.0), late=1e-2)
    yield Control("an integrator of third order at impacts", right, with_integrator(folder, third))
