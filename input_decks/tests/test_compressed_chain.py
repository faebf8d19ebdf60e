"""compressed_chain: an exact motion and exact errors pass, wrong ones fail; the engines swing as their scheme's own solution does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.physics import integrate_adams
from dembark.postproc.tests.packings import frame_of

chain = module("compressed_chain")
SHAPE = np.sin(8.0 * math.pi * np.arange(10) / 9.0)
REFERENCE = {"adams_order", "adams_estimate", "adams_growth", "impact_time", "impact_order_hooke", "impact_order_hertz"}


def verdicts(folder: Path, phase: float = 0.3, *, longer: float = 1.0, reported: float = 1.0) -> dict[str, Any]:
    """Of a run whose steps are `longer` than stated, and whose monitor reports `reported` times the right values."""
    p = defaults("compressed_chain", phase=phase, run_steps=1000)
    turn = 2.0 * math.asin(0.5 * phase * longer)

    def frame(step: int) -> Any:
        places = np.zeros((10, 3))
        places[:, 0] = (p["grain_diameter"] - p["overlap"]) * np.arange(10) + p["amplitude"] * SHAPE * math.cos(turn * step)
        return frame_of(places, 0.0025, {}, step=step)

    missed = p["amplitude"] * math.sqrt(float(np.mean(SHAPE[1:-1] ** 2))) * chain.verlet_errors(phase) * [1.0, 5e3]
    lasts = math.pi * math.sqrt(2.0) * math.sin(4.0 * math.pi / 9.0) / phase
    folder.mkdir(exist_ok=True)
    (folder / "monitor.txt").write_text(" ".join(f"{reported * value:.17g}" for value in (*missed, lasts)))
    run = SimpleNamespace(folder=folder, parameters=p, derived={"angular": 5e3}, grains=lambda: [frame(50 * k) for k in range(1, 21)])
    return judged("compressed_chain", chain.measure([run]))


def spoiled(error: Callable[[float, np.ndarray], np.ndarray], late: float = 0.0) -> Callable[..., Any]:
    """Adams' integrator with states that are off by `error` (step, times), and events that come `late` by that share of a step each."""
    def integrate(derivative: Any, state: Any, end: float, step: float, **words: Any) -> Any:
        run = integrate_adams(derivative, state, end, step, **words)
        events = [one._replace(time=one.time + k * late * step) for k, one in enumerate(run.events)]
        return run._replace(state=run.state + error(step, run.time)[:, None], events=events)
    return integrate


def test_an_exact_run_passes(tmp_path: Path) -> None:
    assert names(verdicts(tmp_path), "pass") == {"phase_error", "contact_steps", *REFERENCE}
    assert names(verdicts(tmp_path, 0.05), "pass") == {"phase_error", "contact_steps", "position_estimate", "velocity_estimate"}


def test_commensurate_steps_would_hide_the_error_of_an_impact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without other lengths of the step the order of Hooke's impact looks like four."""
    monkeypatch.setattr(chain, "GOLDEN", 0.0)
    assert chain.reference()["impact_order_hooke"] > 3.5


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_engines_follow_the_exact_solution_of_their_scheme(engine: str, simulate: Any) -> None:
    run = simulate("compressed_chain", engine, {"run_steps": 4000}, "fine")
    found = judged("compressed_chain", chain.measure([run]))
    assert names(found, "pass") == {"phase_error", "contact_steps", "position_estimate", "velocity_estimate"}, found


def with_integrator(folder: Path, integrate: Any) -> dict[str, Any]:
    """What is measured with another integrator instead of Adams'."""
    chain.integrate_adams = integrate
    try:
        return verdicts(folder)
    finally:
        chain.integrate_adams = integrate_adams


def controls_compressed_chain(folder: Path) -> Iterator[Control]:
    right, rough = verdicts(folder), verdicts(folder, 0.2)
    yield Control("a step that is a millionth longer than prescribed", right, verdicts(folder, longer=1.0 + 1e-6))
    yield Control("a monitor that reports values a twentieth too large", rough, verdicts(folder, 0.2, reported=1.05))
    second = spoiled(lambda step, time: 0.1 * step**2 * time)
    yield Control("an integrator of second order", right, with_integrator(folder, second))
    yield Control("an integrator that damps", right, with_integrator(folder, spoiled(lambda _, time: 1e-3 * time)))
    third = spoiled(lambda step, time: np.where(time == time[-1], step**3, 0.0), late=1e-2)
    yield Control("an integrator of third order at impacts", right, with_integrator(folder, third))
