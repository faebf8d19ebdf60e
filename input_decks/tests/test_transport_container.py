"""transport_container: known forces are measured as they are, wrong ones fail, and a small container keeps its momentum."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, Verdicts, defaults, judged, module, names, point
from dembark.input_decks.tests.synthetic import account
from dembark.input_decks.transport_container.measure import ring_period, slid, tops
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case.folders import find

container = module("transport_container")
D, G, DT, EVERY, ROWS, FIRST = 0.005, 9.81, 1e-4, 10, 600, 100
# Beds differ from each other more than a bed from itself.
BEDS = np.array([0.8, 0.9, 1.0, 1.1, 1.2])


def history(factor: float, duration: float, acceleration: float, mass: float, missed: float, lost: float) -> dict[str, np.ndarray]:
    """Rows of a bed that takes `factor` times the force of a rigid one, of which the left wall has 0.7, and then rings with a period of
    20 ms; the part `missed` of the left wall's impulse is not counted, the part `lost` of the damping not tallied."""
    step = EVERY * np.arange(1.0, ROWS + 1.0)
    time = DT * (step - EVERY * FIRST)
    pulse = np.where((time > 0.0) & (time < duration), np.sin(math.pi * time / duration), 0.0) * acceleration * mass
    ring = np.where(time >= duration, 0.05 * acceleration * mass * np.sin(2.0 * math.pi * (time - duration) / 0.02), 0.0)
    force = factor * pulse + ring
    table = {"step": step, "time": DT * step} | account(ROWS, lost)
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * DT * EVERY * (force[1:] + force[:-1]))])
    mean = np.concatenate([[0.0], 0.5 * (force[1:] + force[:-1])])
    # The mean over a row's steps such that the impulse is that of the trapezoidal rule.
    mean[1:] += 0.5 * np.diff(force) / EVERY
    table |= {"momentum_x": impulse, "vessel_fx": force, "vessel_mx": mean}
    for name, share in (("left", 0.7 * (1.0 - missed)), ("right", 0.1), ("base", 0.2)):
        table[f"{name}_jx"] = share * impulse
    return table


def run(factor: float = 1.1, *, missed: float = 0.0, lost: float = 0.0, slides_at: float = 0.0, **changes: Any) -> Any:
    """A run of 200 grains; on a ramp, and where it is tilted, the surface slides from the slope `slides_at` of effective gravity on."""
    p = defaults("transport_container", settle_time=FIRST * EVERY * DT, **changes)
    places = np.array([(D * (i + 0.5), 0.0, D * (k + 0.5)) for i in range(40) for k in range(5)])
    length, first, mass = 40.0 * D, FIRST * EVERY, 200.0
    derived = {"first": first, "length": length}
    given = SimpleNamespace(parameters=p, derived=derived, time_step=DT)
    way = container.moving(given)

    def frames() -> list[Any]:
        made = []
        for k in range(51):
            step = first + 100 * k
            time = DT * step
            turn, moved = float(np.asarray(way.angle(time))), np.asarray(way.displacement(time))
            slope = abs(math.tan(turn)) if p["motion"] == "rotation" else abs(float(np.asarray(way.acceleration(time))[0])) / G
            own = places - np.array([0.5 * length, 0.0, 0.0])
            own[:, 0] += np.where(own[:, 2] > 4.0 * D, 5.0 * D * max(0.0, slope - slides_at) / 0.1, 0.0) * (slides_at > 0.0)
            sine, cosine = math.sin(turn), math.cos(turn)
            there = np.column_stack([own[:, 0] * cosine + own[:, 2] * sine, own[:, 1], own[:, 2] * cosine - own[:, 0] * sine])
            push = np.zeros((200, 3))
            push[:5, 0] = 1.0
            made.append(frame_of(there + moved + np.array([0.5 * length, 0.0, 0.0]), 0.5 * D, {"vessel": push}, step=step))
        return made

    rows = history(factor, p["motion_duration"], p["motion_acceleration"], mass, missed, lost)
    return SimpleNamespace(parameters=p, derived=derived, time_step=DT, times=lambda: rows, grains=frames)


def verdicts(**changes: Any) -> Verdicts:
    return judged("transport_container", container.measure([run(**changes)]))


def study(name: str, along: str, changes: list[dict[str, Any]], quantities: dict[str, list[float]]) -> Verdicts:
    """What the study makes of quantities known within 1 %."""
    given = [point(defaults("transport_container") | changed, {key: values[k] for key, values in quantities.items()}, part=0.01, profiles=[
        {"name": "slide_slopes", "value": (values[k] * BEDS * (1.0 + 1e-3 * k * BEDS)).tolist()} for key, values in quantities.items()
        if key == "slide_slope"])
        for k, changed in enumerate(changes)]
    return judged("transport_container", container.study(name, given, along))


def pulses(slow: float) -> Verdicts:
    """Pulses of 5 ms to 1 s of a bed that rings with 1 √(d/g), the longest of which takes `slow` times the rigid force."""
    return study("pulse", "motion_duration", [{"motion_duration": one} for one in (0.005, 0.02, 0.08, 1.0)],
                 {"amplification": [0.4, 1.3, 1.5, slow], "ring_period": [1.0, 1.0, 1.0, 1.0]})


def onset(ramp: float) -> Verdicts:
    """What the variants of the study make of a bed that slides at the slope `ramp` when it is accelerated, and at 0.4 when it is tilted."""
    case = find("transport_container")
    variants = case.studies["onset"].variants
    return study("onset", case.studies["onset"].along, [dict(case.variants[one]) for one in variants],
                 {"slide_slope": [ramp if one == "ramp" else 0.4 for one in variants]})


def test_known_forces_are_measured_as_they_are() -> None:
    found = verdicts(factor=1.25)
    assert names(found, "pass") == {"energy_balance", "impulse_error"}
    value = {name: one["value"] for name, one in found.items()}
    assert value["amplification"] == pytest.approx(1.25, rel=2e-3) and value["rear_share"] == pytest.approx(0.7 * 1.25, rel=2e-3)
    assert value["ring_period"] * math.sqrt(D / G) == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize("motion", [{"motion_shape": "rising", "motion_acceleration": -7.848, "motion_duration": 0.5},
                                    {"motion": "rotation", "motion_direction": "y", "motion_rate": 1.2}])
def test_the_slope_at_which_the_surface_slides(motion: dict[str, Any]) -> None:
    # Half a diameter after the slope has grown by 0.01.
    assert verdicts(slides_at=0.3, **motion)["slide_slope"]["value"] == pytest.approx(0.31, abs=0.004)
    assert verdicts(slides_at=5.0, **motion)["slide_slope"]["value"] is None


@pytest.mark.parametrize("motion", [{}, {"motion": "rotation", "motion_direction": "y", "motion_rate": 1.2}])
def test_the_pressure_on_a_wall_is_that_of_its_grains_in_its_own_frame(motion: dict[str, Any]) -> None:
    """The five lowest grains at the left wall are pushed along x; those that lie on the base, by friction as well."""
    one = run(**motion)
    way, frames = container.moving(one), one.grains()
    one.grains = lambda: frames
    for frame in frames:
        turn = float(np.asarray(way.angle(frame.step * DT)))
        push = frame.wall_forces["vessel"]
        push[:] = 0.0
        # Column by column, five high: the first stands at the wall, and all grains on the base feel friction.
        push[:5], push[::5] = [2.0 * math.cos(turn), 0.0, -2.0 * math.sin(turn)], [7.0 * math.cos(turn), 0.0, -7.0 * math.sin(turn)]
    shown = next(one for one in container.measure([one]).profiles if one["name"] == "pressure_left")
    assert shown["vertical"] and (shown["along"], shown["across"]) == ("z / d", "Pa")
    np.testing.assert_allclose(np.asarray(shown["value"]) * D**2, [0.0, 2.0, 2.0, 2.0, 2.0, *[0.0] * (len(shown["value"]) - 5)], atol=1e-9)


def test_the_period_of_a_ring_that_dies() -> None:
    t = 1e-3 * np.arange(300)
    assert ring_period(t, np.exp(-5.0 * t) * np.sin(2.0 * np.pi * t / 0.021) + 0.3) == pytest.approx(0.021, rel=0.01)


def test_the_surface_and_how_far_it_slides() -> None:
    places = np.array([(i + 0.5, k + 0.5) for i in range(4) for k in range(3)])
    surface = tops(places, 1.0, 1.0, 4.0)
    assert surface.tolist() == [5, 8, 11]
    assert slid([places, places + np.array([0.25, 0.0])], surface).tolist() == [0.0, 0.25]


SMALL = {"container_length": 12.0, "bed_height": 4.0, "settle_time": 0.2, "run_time": 0.15, "frames": 11}


@pytest.mark.parametrize(("engine", "variant"), [
    ("liggghts", "pulse_20"), ("liggghts", "repeated"), ("liggghts", "ramp"), ("liggghts", "tilt"), ("yade", "repeated"), ("yade", "tilt"),
    ("lammps", "pulse_20"), ("lammps", "tilt")])
def test_a_small_container(engine: str, variant: str, simulate: Any) -> None:
    one = simulate("transport_container", engine, SMALL, variant)
    found = judged("transport_container", container.measure([one]))
    assert names(found, "pass") == {"energy_balance", "impulse_error"} and not names(found, "fail"), found
    frame, way = one.grains()[-1], container.moving(one)
    time = one.time_step * frame.step
    # The grains stay in the container, in one plane.
    assert np.abs(frame.positions[:, 1]).max() < 1e-12 * D
    assert np.abs(frame.positions[:, 0].mean() - float(np.asarray(way.displacement(time))[0]) - 6.0 * D) < 2.0 * D
    assert frame.positions[:, 2].min() > -8.0 * D


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_a_deep_bed_does_not_buckle_out_of_its_plane(engine: str, simulate: Any) -> None:
    """Round-off across the layer would grow from contact to contact, until grains leave the box."""
    one = simulate("transport_container", engine, {"container_length": 12.0, "bed_height": 15.0, "settle_time": 0.5, "run_time": 0.1,
                                                   "frames": 11}, "tilt")
    frame = one.grains()[-1]
    assert len(frame.ids) == one.derived["grain_count"] and np.abs(frame.positions[:, 1]).max() < 1e-12 * D


def controls_transport_container(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a hundredth of the damping that is not tallied", right, verdicts(lost=0.01))
    yield Control("a wall's contact that is not counted", right, verdicts(missed=0.01))
    yield Control("a bed that resonates with a slow pulse", pulses(1.0), pulses(1.2))
    yield Control("a bed that begins to slide at half the slope", onset(0.4), onset(0.2))
