"""vibro_conveyor: the block from event to event has its limits, wrong transport fails, and the engines convey as the block does."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.drive_power.drive import sticking_block
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.input_decks.vibro_conveyor.block import TURN, conveyed
from dembark.input_decks.vibro_conveyor.setup import plate_motion
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import portable, resolve

conveyor = module("vibro_conveyor")
ANGLE = math.pi / 6


def stepped(throw: float, angle: float, friction: float, steps: int = 4000, skip: int = 20, periods: int = 10) -> tuple[float, float]:
    """Speed and share of flight of a block in small steps of the phase, without restitution: a solution of another kind."""
    c, h = 1.0 / math.tan(angle), TURN / steps
    x = v = z = w = x0 = flown = 0.0
    v = throw * c
    for k in range((skip + periods) * steps):
        if k == skip * steps:
            x0, flown = x, 0.0
        phase = h * (k + 1)
        plate, rise = throw * math.sin(phase), (math.sin(phase) - math.sin(phase - h)) * throw / h
        w -= h
        if z + w * h <= plate:
            slip = v - throw * c * math.cos(phase)
            v -= math.copysign(min(abs(slip), friction * (rise - w)), slip)
            z, w = plate, rise
        else:
            z, flown = z + w * h, flown + h
        x += v * h
    return (x - x0) / (TURN * periods), flown / (TURN * periods)


@pytest.mark.parametrize("throw", [0.3, 0.8, 1.2, 2.0, 3.0])
def test_the_block_is_that_of_small_steps(throw: float) -> None:
    found, (speed, flight) = conveyed(throw, ANGLE, 0.3, skip=20, periods=10), stepped(throw, ANGLE, 0.3)
    assert found.speed == pytest.approx(speed, abs=3e-3 * throw)
    assert found.flight == pytest.approx(flight, abs=2e-3)


def test_below_the_limit_of_sliding_a_block_stays() -> None:
    """It slides where G c |sin| exceeds mu (1 - G sin): forwards from G = mu / (c + mu) on."""
    c, mu = 1.0 / math.tan(ANGLE), 0.3
    limit = mu / (c + mu)
    assert conveyed(0.99 * limit, ANGLE, mu).speed == pytest.approx(0.0, abs=1e-9)
    assert conveyed(1.05 * limit, ANGLE, mu).speed > 1e-6


@pytest.mark.parametrize("throw", [1.5, 2.0, 3.0])
def test_a_block_that_cannot_slide_is_thrown_as_the_closed_form_says(throw: float) -> None:
    """It flies with the horizontal speed G c cos(start) of the plate, which goes to and fro meanwhile."""
    block, start = sticking_block(throw), math.asin(1.0 / throw)
    assert block is not None
    lasts = TURN * block.flight
    due = throw / math.tan(ANGLE) * (lasts * math.cos(start) - math.sin(start + lasts) + math.sin(start)) / TURN
    found = conveyed(throw, ANGLE, 1e6)
    assert found.flight == pytest.approx(block.flight, abs=1e-6)
    assert found.speed == pytest.approx(due, rel=1e-5)


def test_a_plate_that_shakes_up_and_down_conveys_nothing() -> None:
    assert conveyed(2.0, 0.5 * math.pi - 1e-12, 0.3).speed == pytest.approx(0.0, abs=1e-9)


def test_both_components_of_the_motion_are_in_phase() -> None:
    p = SimpleNamespace(**(defaults("vibro_conveyor") | {"motion_gamma": 2.0}))
    moving = plate_motion(p, 0.0)
    times = 1.0 + np.linspace(0.0, 1.0 / p.motion_frequency, 201)
    place, acceleration = moving.displacement(times), moving.acceleration(times)
    assert np.abs(acceleration[:, 2]).max() == pytest.approx(2.0 * p.gravity, rel=1e-3)
    assert place[:, 0] * math.tan(p.throw_angle) == pytest.approx(place[:, 2], abs=1e-15)


def parameters(variant: str) -> dict[str, Any]:
    return defaults("vibro_conveyor") | dict(portable(resolve(find("vibro_conveyor"), None, variant, {})))


def run(variant: str = "throws", speed: float | None = None, booked: float = 1.0, wet: float = 0.0, **changes: Any) -> Any:
    """A body that travels with this speed (m/s; that of the block if it is not given) and an account of which a part is booked; liquid does
    the part `wet` of the work."""
    p = parameters(variant) | changes
    period = 1.0 / p["motion_frequency"]
    own = conveyor.expected(p) * conveyor.plate_speed(p) if speed is None else speed
    frames = [frame_of([[own * k * period / 8, 0.0, 0.0025]], 0.0025, step=100 * k) for k in range(8 * p["periods"] + 1)]
    table: dict[str, Any] = {name: np.zeros(9) for name in (
        "first_kinetic", "normal_elastic", "tangential_elastic", "tangential_viscous", "walls", "gravity", "balance")}
    table |= {"step": 100 * np.arange(9), "kinetic_energy": np.full(9, 1.0), "normal_viscous": np.full(9, booked - wet),
              "capillary": np.full(9, 0.7 * wet), "liquid_viscous": np.full(9, 0.3 * wet), "scale": np.full(9, 2.0),
              "plate_fz": np.array([0.0, 1.0] * 4 + [1.0])}
    return SimpleNamespace(parameters=p, derived={}, time_step=period / 800, grains=lambda: frames, times=lambda: table, folder=Path("run"))


def verdicts(variant: str = "throws", **changes: Any) -> Any:
    return judged("vibro_conveyor", conveyor.measure([run(variant, **changes)]))


def studied(friction: float = 1.0, sign: float = 1.0) -> Any:
    """Blocks with so many times the friction, on a plate that shakes towards `sign`."""
    points = []
    for variant in ("slides", "g15", "throws"):
        p = parameters(variant)
        found = conveyor.expected(p | {"static_friction": friction * p["static_friction"]})
        points.append(point(p, {"transport_speed": sign * found}, None))
    return judged("vibro_conveyor", conveyor.study("throw", points, "motion_gamma"))


@pytest.mark.parametrize(("throw", "restitution"), [(2.0, 0.5), (3.0, 0.3), (1.5, 0.7)])
def test_a_block_that_bounces_irregularly_has_no_expected_speed(throw: float, restitution: float) -> None:
    changes = {"motion_gamma": throw, "restitution": restitution}
    found = verdicts(**changes)["transport_speed"]
    assert found["verdict"] == "info" and "differ by" in found["reason"]
    points = [point(parameters(variant) | {"restitution": restitution}, {"transport_speed": 0.3}, None)
              for variant in ("g15", "throws", "g3")]
    assert judged("vibro_conveyor", conveyor.study("throw", points, "motion_gamma"))["speed_rise"]["verdict"] == "info"


@pytest.mark.parametrize("variant", ["slides", "g04", "g11", "g15", "throws", "g25", "g3"])
def test_the_blocks_of_the_study_repeat_themselves(variant: str) -> None:
    assert not conveyor.irregular(parameters(variant))


def test_the_work_of_bridges_is_in_the_balance() -> None:
    assert "energy_balance" in names(verdicts(wet=0.3, bridge_volume=8e-11), "pass")


def test_the_right_transport_passes() -> None:
    assert names(verdicts(), "pass") == {"energy_balance", "transport_speed"}
    assert names(verdicts("rolls", speed=0.0), "pass") == {"energy_balance", "rest_speed"}
    assert names(verdicts("rests", speed=0.0), "pass") == {"energy_balance", "rest_speed"}
    assert names(studied(), "pass") == {"speed_rise"}


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
@pytest.mark.parametrize("variant", ["throws", "slides"])
def test_engines_convey_as_mechanics_says(engine: str, variant: str, simulate: Any) -> None:
    found = judged("vibro_conveyor", conveyor.measure([simulate("vibro_conveyor", engine, {"periods": 8, "run_in": 6}, variant)]))
    assert len(names(found, "pass")) == 2, found


def test_a_ball_of_stiff_material_rolls_without_creeping(simulate: Any) -> None:
    """A softer one creeps: by 0.0018 of the plate's speed at 20 MPa, in proportion to its overlap."""
    found = judged("vibro_conveyor", conveyor.measure([simulate(
        "vibro_conveyor", "liggghts", {"periods": 8, "run_in": 0}, "rolls")]))
    assert names(found, "pass") == {"energy_balance", "rest_speed"}, found


def controls_vibro_conveyor(_folder: Path) -> Iterator[Control]:
    p = parameters("slides")
    scale, right = conveyor.plate_speed(p), verdicts("slides") | studied()
    strong = conveyor.expected(p | {"static_friction": 1.5 * p["static_friction"]})
    yield Control("a hundredth of the damping that is not tallied", right, verdicts("slides", booked=0.99))
    yield Control("friction half as strong again", right, verdicts("slides", speed=strong * scale) | studied(1.5))
    yield Control("a plate that shakes the other way", right,
                  verdicts("slides", speed=-conveyor.expected(p) * scale) | studied(sign=-1.0))
    yield Control("a ball that slides", verdicts("rolls", speed=0.0), verdicts("rolls", speed=0.05 * scale))
