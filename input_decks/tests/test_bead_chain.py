"""bead_chain: a wave of known speed is measured as it is, and each engine's runs as it must."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc.tests.packings import frame_of

chain = module("bead_chain")
D, K, MASS, COUNT, DT = 0.005, 1.3e5, 1.6e-4, 50, 1e-5


def run(force: float = 0.4, lost: float = 0.0, heavier: float = 1.0) -> Any:
    """A wave that goes from contact to contact with the speed of its force, in spheres `heavier` than stated; by each contact
    it loses the part `lost` of its force."""
    speed = chain.SPEED * D * K ** (1.0 / 3.0) * force ** (1.0 / 6.0) / np.sqrt(heavier * MASS)
    lag, number = D / speed, np.arange(COUNT - 1)

    def frame(k: int) -> Any:
        # Five contacts wide.
        off = (k * 4 * DT - lag * number) / (2.5 * lag)
        push = np.where(np.abs(off) < 1.0, np.cos(0.5 * np.pi * off) ** 6, 0.0) * force * (1.0 - lost) ** number
        places = np.zeros((COUNT, 3))
        places[1:, 0] = np.cumsum(D - (push / K) ** (2.0 / 3.0))
        return frame_of(places, 0.5 * D, {}, step=4 * k)

    frames = [frame(k) for k in range(int(COUNT * lag / (4 * DT)))]
    return SimpleNamespace(parameters=defaults("bead_chain"), derived={"stiffness": K, "mass": MASS}, time_step=DT, grains=lambda: frames)


def verdicts(**changes: Any) -> dict[str, dict[str, Any]]:
    return judged("bead_chain", chain.measure([run(**changes)]))


def study(power: float) -> dict[str, dict[str, Any]]:
    """Waves whose speed grows with this power of their force."""
    points = [point({"hit_speed": force}, {"peak_force": force, "velocity": 8.0 * force**power}) for force in (0.05, 0.4, 2.0)]
    return judged("bead_chain", chain.study("force", points, "hit_speed"))


def test_a_known_wave() -> None:
    found = verdicts()
    assert names(found, "pass") == {"wave_speed", "wave_decay"}
    assert found["peak_force"]["value"] == pytest.approx(0.4, rel=1e-3)
    assert found["wave_speed"]["value"] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_wave_in_an_engine(engine: str, simulate: Any) -> None:
    found = judged("bead_chain", chain.measure([simulate("bead_chain", engine, {"grain_count": 40}, "hit")]))
    assert names(found, "pass") == {"wave_speed", "wave_decay"}, found


def controls_bead_chain(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("spheres a fiftieth too heavy", right, verdicts(heavier=1.02))
    yield Control("a contact that dissipates part of its energy", right, verdicts(lost=1e-3))
    yield Control("a spring of Hooke's law", study(1.0 / 6.0), study(0.0))
