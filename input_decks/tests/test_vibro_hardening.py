"""vibro_hardening: impacts that are known are counted and weighed, wrong records fail, and both engines hammer the part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common import vibratory_trough
from dembark.input_decks.common.trough import polygon
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.input_decks.tests.synthetic_bed import PERIOD, PERIODS, trough
from dembark.input_decks.tests.test_vibro_finishing import account
from dembark.input_decks.vibro_hardening.part_impacts import ContactRecord, nearest, read_record
from dembark.postproc.replica import Replica
from dembark.postproc.tests.dumps import grains_text

hardening = module("vibro_hardening")
CORNERS = polygon(0.04, 4, (0.0, 0.0))
STEP, STRIDE, LASTS = 1e-5, 2, 12
RADIUS, SPEED, SLIP = 0.0025, 0.8, 0.3
MASS = 2500.0 * 4.0 / 3.0 * np.pi * RADIUS**3
WINDOW = round(PERIOD / STEP) * PERIODS


def moving() -> Any:
    """A part that moves along z at a constant speed."""
    return SimpleNamespace(displacement=lambda t: np.asarray(t)[:, None] * [0.0, 0.0, 0.1],
                           velocity=lambda t: np.ones((len(t), 1)) * [0.0, 0.0, 0.1])


def record(folder: Path, count: int = 60, lost: int = 0) -> ContactRecord:
    """`count` impacts on the upper side of a square part, one after the other, each of a half sine of force; grains alternate. Of `lost`
    impacts nothing was recorded."""
    top, text = CORNERS[:, 1].max(), []
    for k in range(lost, count):
        begin = (k * WINDOW // count // STRIDE + 3) * STRIDE
        for sample in range(LASTS):
            step = begin + STRIDE * sample
            phase = np.pi * (sample + 0.5) / LASTS
            push = MASS * 2.0 * SPEED / (STRIDE * STEP * np.sum(np.sin(np.pi * (np.arange(LASTS) + 0.5) / LASTS))) * np.sin(phase)
            height = top + 0.1 * step * STEP + RADIUS * (1.0 - 1e-6)
            text.append(grains_text(step, [[0.0, 0.0, height]], [RADIUS], velocities=np.array([[SLIP, 0.0, 0.1 - SPEED * np.cos(phase)]]),
                                    walls={"vessel": np.array([[-0.2 * push, 0.0, push]])}))
    folder.mkdir(exist_ok=True)
    path = folder / "touches.dump"
    path.write_text("".join(text))
    return read_record(path, moving(), CORNERS, stride=STRIDE, time_step=STEP, first=0, periods=PERIODS, period=PERIOD, depth=0.005)


def measured(folder: Path, booked: float = 1.0, lost: int = 0) -> dict[str, Any]:
    folder.mkdir(exist_ok=True)
    run, hits = trough(folder, part=False), record(folder, lost=lost)
    rows = account(dict(run.rows), booked)
    share = rows["time"] / rows["time"][-1]
    whole = 60 * MASS * 2.0 * SPEED
    rows |= {"part_work": 0.0 * share, "part_jx": -0.2 * whole * share, "part_jy": 0.0 * share, "part_jz": whole * share}
    # As heavy as the impacts on the part are strong.
    light = replace(run, rows=rows, weight=whole / (PERIODS * PERIOD))
    replica = Replica(Path(), {"parameters": defaults("vibro_hardening")})
    replica.__dict__["_read"] = {vibratory_trough.read.__wrapped__: light, hardening.contact_record.__wrapped__: hits}
    return judged("vibro_hardening", hardening.measure([replica]))


def points(along: str, *pairs: tuple[float, float], half: float = 0.02) -> list[dict[str, Any]]:
    return [point({along: place}, dict.fromkeys(("stirring", "circulation", "impact_energy"), value), part=half) for place, value in pairs]


def amplitude_study(low: float, high: float, half: float = 0.02) -> dict[str, Any]:
    found = points("motion_amplitude", (0.002, low), (0.005, 0.5 * (low + high)), (0.01, high), half=half)
    return judged("vibro_hardening", hardening.study("amplitude", found, "motion_amplitude"))


def step_study(*values: float) -> dict[str, Any]:
    found = points("time_step_fraction", *((0.11 / 2**k, value) for k, value in enumerate(values)), half=0.005)
    return judged("vibro_hardening", hardening.study("step", found, "time_step_fraction"))


def test_nearest_points_of_a_square() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    places = np.array([[0.5, -1.0], [2.0, 2.0], [0.2, 0.9], [1.5, 0.3]])
    np.testing.assert_allclose(nearest(square, places), [[0.5, 0.0], [1.0, 1.0], [0.2, 1.0], [1.0, 0.3]])


def test_known_impacts_are_counted_and_weighed(tmp_path: Path) -> None:
    hits = record(tmp_path)
    assert hits.begins.sum() == 60 and hits.rate().value == pytest.approx(60 / (PERIODS * PERIOD))
    first = np.cos(0.5 * np.pi / LASTS)
    np.testing.assert_allclose(hits.energies(), 0.5 * MASS * (SPEED * first) ** 2, rtol=1e-6)
    assert hits.energy().value == pytest.approx(0.5 * MASS * (SPEED * first) ** 2)
    np.testing.assert_allclose(hits.impulse(), [-0.2 * 60 * MASS * 2.0 * SPEED, 0.0, 60 * MASS * 2.0 * SPEED], atol=1e-9)
    # Friction of 0.2 of the push, against a slip of SLIP.
    area = 4.0 * 0.04 / np.sqrt(2.0) * 0.005
    assert hits.friction().value == pytest.approx(0.2 * 60 * MASS * 2.0 * SPEED * SLIP / (PERIODS * PERIOD * area), rel=1e-6)


@pytest.mark.parametrize(("low", "high", "half", "verdict"), [
    (1.0, 3.0, 0.02, "pass"), (1.0, 1.0, 0.02, "info"), (1.0, 0.8, 0.02, "fail"), (1.0, 1.2, 0.3, "info")])
def test_hardening_stirs_more_than_finishing(low: float, high: float, half: float, verdict: str) -> None:
    assert amplitude_study(low, high, half)["stirring_gain"]["verdict"] == verdict


SMALL = {"grain_count": 60, "grain_diameter": 0.01, "trough_width": 0.12, "strips": 12, "youngs_modulus": 2e7,
         "motion_amplitude": 0.005, "motion_ramp": 1, "settle_time": 0.05, "periods": 8}


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_grains_hammer_the_part_and_nothing_is_missed(engine: str, simulate: Any) -> None:
    run = simulate("vibro_hardening", engine, SMALL)
    found = judged("vibro_hardening", hardening.measure([run]))
    assert names(found, "pass") == {"energy_balance", "touch_balance"}, found
    assert found["impact_rate"]["value"] > 10.0 and 1e-4 < found["impact_energy"]["value"] < 4.0
    assert found["friction_power"]["value"] > 0.0


def controls_vibro_hardening(folder: Path) -> Iterator[Control]:
    folder.mkdir(exist_ok=True)
    right = measured(folder / "right")
    yield Control("a hundredth of the damping that is not booked", right, measured(folder / "booked", 0.99))
    yield Control("a tenth of the touches lost", right, measured(folder / "lost", lost=6))
    yield Control("a bed that is calmer at 10 mm than at 2 mm", amplitude_study(1.0, 3.0), amplitude_study(1.0, 0.8))
    yield Control("impacts that grow with every halving of the step", step_study(0.01, 0.0101, 0.0102), step_study(0.01, 0.012, 0.014))
