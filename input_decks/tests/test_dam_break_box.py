"""dam_break_box: the pressure of still water at a wall, marks of known traces, the record of the experiment, and a column that breaks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.input_decks.common.water_run import pressure
from dembark.input_decks.dam_break_box import plane
from dembark.input_decks.dam_break_box.sensors import GAUGES
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.postproc import GrainsDump, read_times
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

dam = module("dam_break_box")
DRY, WALL = 0.2, (0.003, 0.015, 0.03, 0.08)
WEIGHT = 9810.0
SPACING = 0.55 / 20


def still(depth: float, dx: float) -> tuple[Any, Any]:
    """Places (n, 3) and pressures (n,) of water at rest behind a wall at x = 0 with a floor at z = 0."""
    axes = np.arange(-6, 0) + 0.5, np.arange(-6, 6) + 0.5, np.arange(round(depth / dx)) + 0.5
    places = dx * np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")], axis=1)
    return places, WEIGHT * (depth - places[:, 2])


def shown(point: Any, places: Any, pressures: Any, h: float = 0.026) -> float:
    """By a sensor at the `point` of that wall."""
    room = dam.full(point, h, 0.02, lambda at: (at[:, 0] > 0.0) | (at[:, 2] < 0.0))
    return float(dam.pressure_at(point, places, pressures, h, WEIGHT, room))


@given(z=st.floats(0.0, 0.2), y=st.floats(-0.01, 0.01), h=st.floats(1.3, 2.0))
def test_still_water_has_the_pressure_of_its_depth_wherever_the_sensor_is(z: float, y: float, h: float) -> None:
    places, pressures = still(0.3, 0.02)
    assert shown((0.0, y, z), places, pressures, h * 0.02) == pytest.approx(WEIGHT * (0.3 - z), rel=0.01)


def test_a_sensor_above_the_water_or_far_from_it_shows_nothing() -> None:
    places, pressures = still(0.1, 0.02)
    assert shown((0.0, 0.0, 0.12), places, pressures) == 0.0
    assert shown((0.2, 0.0, 0.05), places, pressures) == 0.0
    assert shown((0.0, 0.0, 0.0), np.zeros((0, 3)), np.zeros(0)) == 0.0


def test_sparse_water_presses_in_proportion() -> None:
    """Of each four particles one is left, under the same pressure: its force on the wall is a quarter."""
    places, _ = still(0.3, 0.02)
    kept = np.random.default_rng(1).random(len(places)) < 0.25
    found = [shown((0.0, y, z), places[kept], np.full(kept.sum(), 1e4)) for y in (-0.02, 0.0, 0.02) for z in np.arange(0.1, 0.2, 0.01)]
    assert np.mean(found) == pytest.approx(0.25e4, rel=0.25)


@given(start=st.floats(0.3, 1.0), rise=st.floats(0.05, 0.5), height=st.floats(0.1, 1e4))
def test_marks_of_a_triangle_are_its_own(start: float, rise: float, height: float) -> None:
    """It rises from `start` in `rise`, and falls in twice that time."""
    times = np.linspace(0.0, 3.0, 30001)
    trace = height * np.interp(times, [start, start + rise, start + 3.0 * rise], [0.0, 1.0, 0.0])
    arrival, peak, impulse = dam.marks(times, trace, (0.2, 2.8))
    assert arrival == pytest.approx(start + 0.25 * rise, abs=1e-3)
    assert peak == pytest.approx(height, rel=3e-3)
    assert impulse == pytest.approx(1.5 * rise * height, rel=1e-3)
    # None of a window that ends after the trace, half of one that ends at the peak.
    assert math.isnan(dam.marks(times, trace, (0.2, 3.1))[2])
    assert dam.marks(times, trace, (start, start + rise))[2] == pytest.approx(0.5 * rise * height, rel=1e-2)


@given(length=st.floats(0.01, 0.5), slope=st.floats(-5.0, 5.0))
def test_the_mean_of_a_straight_line_is_the_line_and_a_step_becomes_a_ramp(length: float, slope: float) -> None:
    # Times of no even distance.
    times = np.linspace(0.0, 1.7, 700) ** 2
    line, inner = 3.0 + slope * times, (times > 0.5 * length) & (times < times[-1] - 0.5 * length)
    np.testing.assert_allclose(dam.smoothed(times, line, length)[inner], line[inner], rtol=1e-9, atol=1e-9)
    step = dam.smoothed(times, (times > 1.0).astype(float), length)
    np.testing.assert_allclose(step[inner], np.clip((times - 1.0) / length + 0.5, 0.0, 1.0)[inner], atol=0.01 / length)


def test_the_record_of_the_experiment_has_its_published_numbers() -> None:
    """First impact at P1 at 0.395 s, 11.27 kPa high, 2.88 kPa s from 0.4 to 1.0 s; a level of 0.55 m at first."""
    times, found = dam.published("pressures.csv")
    assert len(found) == 8 and abs(np.median(found["P1"][times < DRY])) < 1e-9
    arrival, peak, impulse = dam.marks(times, found["P1"], dam.BOX_WINDOW)
    assert (arrival, peak, impulse) == (pytest.approx(0.395, abs=1e-3), pytest.approx(11.27e3, rel=1e-3), pytest.approx(2.88e3, rel=3e-3))
    times, found = dam.published("levels.csv")
    assert found["H4"][0] == pytest.approx(0.55, abs=5e-3)
    # One gauge after the other gets wet, the one behind the box at last.
    wet = [times[np.flatnonzero(found[name] > 0.02)[0]] for name in ("H3", "H2", "H1")]
    assert wet == pytest.approx([0.22, 0.37, 0.92], abs=0.011)


def run(late: float = 1.0, weak: float = 1.0, high: float = 0.0, leaked: int = 0, boxed: int = 0, made: float = 0.0) -> Any:
    """The experiment itself, `late` by a factor in time, its pressures `weak`, its levels too `high` (m); particles below the floor or in
    the box; the part `made` of the energy comes from nowhere."""
    p = defaults("dam_break_box", resolution=20)
    places = np.full((1000, 3), 0.5 * SPACING)
    places[:, 0] = -places[:, 0]
    places[:leaked, 2] = -SPACING
    places[:boxed] = p["distance"] + 0.08, 0.0, 0.08
    frames = [frame_of(places, 0.5 * SPACING, {}, step=step) for step in (100, 200)]
    derived = {"spacing": SPACING, "grain_count": 1000, "column": 1.2375, "tank_end": 1.98, "side": 0.495, "box_x": 0.165, "box_y": 0.4125,
               "box_z": 0.165, "tank_top": 0.99, "thick": 0.0825}
    rows = {name: np.ones(10) for name in ("kinetic_energy", "potential_energy", "compression_energy")}
    rows["kinetic_energy"][5:] += made * 0.5 * WEIGHT * derived["column"] * 2.0 * derived["side"] * p["column_depth"] ** 2
    times, pressures = dam.published("pressures.csv")
    level_times, levels = dam.published("levels.csv")
    return SimpleNamespace(parameters=p, derived=derived, time_step=1e-4, grains=lambda: frames, times=lambda: rows,
                           traces=(late * times, {name: weak * one for name, one in pressures.items()}),
                           levels=(level_times, {name: one + high for name, one in levels.items()}))


def verdicts(**changes: Any) -> dict[str, dict[str, Any]]:
    """Of a single run."""
    with patch.object(dam, "traces", lambda one: one.traces), patch.object(dam, "levels", lambda one: one.levels):
        return judged("dam_break_box", dam.measure([run(**changes)]))


def study(**changes: Any) -> dict[str, dict[str, Any]]:
    """Of three spacings that agree."""
    found = list(verdicts(**changes).values())
    points = [{"parameters": defaults("dam_break_box", resolution=number), "quantities": found} for number in (10, 14, 20)]
    return judged("dam_break_box", dam.study("spacing", points, "resolution"))


CHECKED = {"arrival_P1", "impulse_P1", *(f"level_error_{name}" for name in GAUGES)}


def test_the_experiment_itself_passes() -> None:
    found = study()
    assert names(found, "pass") == CHECKED, found
    assert found["peak_P1"]["deviation"] == pytest.approx(0.0, abs=1e-9)
    # A single spacing is not judged by the experiment.
    assert names(verdicts(), "pass") == {"energy_growth", "leaked"}


def test_what_the_record_misses_its_own_volume_by_is_uncertainty_of_the_data() -> None:
    """13 mm of water at P1 instead of 1.3 mm would be 3 % of its impulse: 0.013 m ρ g times 0.6 s of 2.88 kPa s."""
    known, p = dam.due(defaults("dam_break_box")), defaults("dam_break_box")
    time, pressure = dam.units(p)
    assert known["impulse_P1"].half * pressure * time == pytest.approx(1.3e-3 * 9810.0 * 0.6)
    assert known["impulse_P1"].half / known["impulse_P1"].value == pytest.approx(0.003, abs=5e-4)
    assert known["impulse_P3"].half / known["impulse_P3"].value == pytest.approx(0.029, abs=1e-3)
    assert all(0.008 < known[f"level_error_{name}"].half < 0.04 for name in GAUGES)
    assert "U_D = 0.0" in study()["impulse_P1"]["detail"]


def test_spacings_that_disagree_decide_nothing() -> None:
    found = [list(verdicts(weak=weak).values()) for weak in (1.3, 0.8, 1.0)]
    points = [{"parameters": defaults("dam_break_box", resolution=number), "quantities": one}
              for number, one in zip((10, 14, 20), found, strict=True)]
    one = judged("dam_break_box", dam.study("spacing", points, "resolution"))["impulse_P1"]
    assert one["verdict"] == "info" and one["interval"][1] - one["value"] > 0.15 * one["value"]


def test_a_particle_in_the_box_has_leaked() -> None:
    assert verdicts(boxed=3)["leaked"]["value"] == 3.0


STILL = {"scene": "wall", "resolution": 10, "column_length": 0.3, "column_depth": 0.3, "tank_length": 0.3, "tank_height": 0.36,
         "run_time": 0.3, "frames": 2, "rows": 60}


def test_sensors_that_a_small_box_would_not_carry_are_left_out() -> None:
    assert set(dam.sensors("box", 1.0, 0.161, 0.161)) == {f"P{k}" for k in range(1, 9)}
    assert set(dam.sensors("box", 1.0, 0.11, 0.08)) == {"P1", "P2", "P3", "P5", "P6"}


@pytest.mark.parametrize("resolution", [5, 10, 14, 20, 28])
def test_the_top_of_the_box_keeps_its_height_at_any_spacing(resolution: int) -> None:
    """P4 is 20 mm below it."""
    case = find("dam_break_box")
    numbers = prepare(case, resolve(case, None, None, {"resolution": resolution})).numbers
    top, foot, spacing = (float(numbers[name]) for name in ("box_z", "box_foot", "spacing"))
    assert top == 0.161 and abs(foot) <= 0.5 * spacing
    assert (top - foot) / spacing == pytest.approx(round((top - foot) / spacing))


def test_sensors_show_still_water_in_an_engine(simulate: Any) -> None:
    """A tank that its column fills: ρ g times the depth of each sensor, within a fifth of a layer of particles."""
    one = simulate("dam_break_box", "liggghts", STILL)
    times, found = dam.traces(one)
    for height, trace in zip(WALL, found.values(), strict=True):
        assert trace[times > 0.1].mean() == pytest.approx(WEIGHT * (0.3 - height), abs=0.02 * WEIGHT * 0.3), height


def test_a_column_breaks_against_a_box_in_an_engine(simulate: Any) -> None:
    """Half the size, so that it lasts 1/√2 of the time."""
    half = {name: 0.5 * one for name, one in defaults("dam_break_box").items() if name.startswith(("column", "tank", "box", "distance"))}
    one = simulate("dam_break_box", "liggghts", half | {"resolution": 7, "run_time": 0.4, "frames": 2, "rows": 400})
    found = judged("dam_break_box", dam.measure([one]))
    assert {"energy_growth", "leaked"} <= names(found, "pass"), found
    assert 1.5 < found["arrival_P1"]["value"] < 2.3 and found["peak_P1"]["value"] > 0.5
    # A gauge before the box: dry, then wet.
    level = dam.levels(one)[1]["H3"]
    assert level[0] == 0.0 and 0.02 < level[-1] < 0.2


def test_engines_write_the_same_rows_and_frames(decks: Any, tmp_path: Path) -> None:
    """Energies, forces and levels, and the water near the sensors, until it has met the box."""
    runs = []
    for engine in ("liggghts", "yade"):
        runs.append(decks("dam_break_box", engine, tmp_path / engine, {"resolution": 5, "run_time": 0.45, "frames": 2, "rows": 20}))
        runs[-1].run()
    one, other = (read_times(run.folder / "time.csv") for run in runs)
    assert list(one) == list(other)
    for name in one:
        np.testing.assert_allclose(one[name], other[name], rtol=1e-5, atol=1e-6 * max(1.0, np.abs(one[name]).max()), err_msg=name)
    near = [[frame for frame in GrainsDump(run.folder / "near.dump") if frame.step] for run in runs]
    assert [frame.step for frame in near[0]] == [frame.step for frame in near[1]] == one["step"].tolist()
    assert [len(frame.ids) for frame in near[0]] == [len(frame.ids) for frame in near[1]] and len(near[0][-1].ids) > 0
    for frame, again in zip(*near, strict=True):
        if len(frame.ids):
            order, same = (np.lexsort(part.positions.T.round(6)) for part in (frame, again))
            np.testing.assert_allclose(frame.positions[order], again.positions[same], atol=1e-6)
            np.testing.assert_allclose(pressure(frame)[order], pressure(again)[same], atol=1.0)


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_a_run_that_goes_on_has_the_same_rows_and_frames(engine: str, decks: Any, tmp_path: Path) -> None:
    """Also those of the water at the sensors, whose region a resumed run of LIGGGHTS makes anew."""
    one = decks("dam_break_box", engine, tmp_path, {"resolution": 5, "run_time": 0.04, "frames": 2, "rows": 20})
    one.run(restart_every=10)
    files = [tmp_path / name for name in ("time.csv", "near.dump", "grains.dump")]
    complete = [path.read_bytes() for path in files]
    # The older one of two states.
    states = {int(path.name.split(".")[1]) for path in tmp_path.glob("state.*") if path.suffix != ".crc"}
    assert len(states) == 2 and max(states) <= one.setup.steps
    for path in tmp_path.glob(f"state.{max(states)}.*"):
        path.unlink()
    one.run(restart_every=10, resume="yes")
    assert [path.read_bytes() for path in files] == complete


def controls_dam_break_box(_folder: Path) -> Iterator[Control]:
    right, of_spacings = verdicts(), study()
    yield Control("a scheme that makes energy", right, verdicts(made=0.05))
    yield Control("a particle that leaks out", right, verdicts(leaked=1))
    yield Control("a particle that leaks out", right, verdicts(boxed=1))
    yield Control("water that arrives a tenth late", of_spacings, study(late=1.1))
    yield Control("a sensor that shows three quarters of the pressure", of_spacings, study(weak=0.75))
    yield Control("levels a sixth of the largest too high", of_spacings, study(high=0.1))


def test_theory_of_the_face_is_kirchhoffs_in_deep_water_and_keeps_momentum() -> None:
    """A plate in a stream without surface: y/b = (s + ½ (s √(1 − s²) + asin s))/(1 + π/4) where u/U = (1 − √(1 − s²))/s."""
    s = np.linspace(0.05, 0.99, 20)
    heights = (s + 0.5 * (s * np.sqrt(1.0 - s**2) + np.arcsin(s))) / (1.0 + 0.25 * math.pi)
    assert np.interp(heights, *plane.turned(100.0, 1.0)[1:]) == pytest.approx(1.0 - ((1.0 - np.sqrt(1.0 - s**2)) / s) ** 2, abs=5e-3)
    for depth in (0.3, 1.0, 10.0):
        angle, place, slow = plane.turned(depth, 1.0)
        assert 0.5 * np.trapezoid(slow, place) == pytest.approx(depth * (1.0 - math.cos(angle)), rel=1e-3)


def test_pressures_on_the_face_in_the_plane_are_those_of_theory_away_from_the_edge() -> None:
    found, depth = plane.simulated(20)
    theory = plane.expected(found[0], depth)
    assert theory[0] == pytest.approx(found[0], rel=1e-12)
    assert found[1] == pytest.approx(theory[1], rel=0.12) and found[3] < 0.9 * theory[3]
