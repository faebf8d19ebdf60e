"""Wrong physics in an impact of two logs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from dembark.input_decks.common.log_run import LogRun
from dembark.input_decks.tests.measuring import Control, judged
from dembark.input_decks.tests.test_log_measures import log_pair, of_pair, pair_run, unsolved


def off_centre() -> LogRun:
    """An impact with an offset, its velocities those of the exact motion."""
    run = pair_run()
    p = run.parameters | {"offset": 0.1}
    moved = run.velocities.copy()
    moved[:, :, :2] = log_pair.pair(p).motion(run.times, p["lead_time"]).velocities
    return replace(run, parameters=p, velocities=moved)


def orders(theta: float) -> list[dict]:
    """Points of the study by the scheme with `theta`."""
    runs = [pair_run(theta=theta, time_step=step) for step in (3.104558833061282e-5, 6.209117666122564e-5, 1.2418235332245128e-4)]
    return [{"parameters": run.parameters, "quantities": list(of_pair(run).values())} for run in runs]


def controls(_folder: Path) -> Iterator[Control]:
    run = pair_run()
    right, p, history = of_pair(run), run.parameters, dict(run.history)
    softer = pair_run(stiffness_1=0.5 * p["stiffness_1"], stiffness_2=0.5 * p["stiffness_2"])
    yield Control("springs half as stiff", right, of_pair(replace(softer, parameters=p)))
    yield Control("log 1 a tenth faster", right, of_pair(replace(pair_run(velocity_1=1.1 * p["velocity_1"]), parameters=p)))
    yield Control("the dissipation of θ = 1 where θ = ½ was set",
                  of_pair(pair_run(theta=0.5)), of_pair(replace(run, parameters=p | {"theta": 0.5})))
    oblique = off_centre()
    along, rubbed = np.array([1.0, -1.0])[:, None], oblique.velocities.copy()
    # The direction across the line of centres at touch: the logs' smooth skins hold each other back along it by a hundredth.
    motion = log_pair.pair(oblique.parameters).motion(run.times, p["lead_time"])
    rubbed[-1, :, :2] += 0.01 * along * np.array([-motion.normal[1], motion.normal[0]])
    yield Control("friction between smooth logs", of_pair(oblique), of_pair(replace(oblique, velocities=rubbed)))
    pushed = run.velocities.copy()
    pushed[-1, 1] += [0.0, 1e-9, 0.0]
    yield Control("an external push", right, of_pair(replace(run, velocities=pushed)))
    lossy = history | {"dissipated_energy": history["dissipated_energy"] * (1.0 - 1e-6)}
    yield Control("a millionth of the dissipation missing from the account", right, of_pair(replace(run, history=lossy)))
    short = run.impacts * np.where(np.arange(11) == 5, 0.99, 1.0)
    yield Control("an impulse recorded a hundredth too small", right, of_pair(replace(run, impacts=short)))
    yield Control("a step that is not solved", right, of_pair(unsolved(run)))
    first, second = orders(1.0), [point | {"parameters": point["parameters"] | {"theta": 1.0}} for point in orders(0.5)]
    yield Control("a scheme of the other order",
                  *(judged("log_pair", log_pair.study("any", points, "time_step")) for points in (first, second)))
