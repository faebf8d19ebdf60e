"""mixing_drum: published curves pass, wrong ones fail, the drum is a closed polygon, and engines fill and turn a small one alike."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.validation.case.deck import prepare, write
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import portable, resolve

CASE = find("mixing_drum")
mixing = module("mixing_drum")


def turned(slower: float = 1.0, wrong: float = 0.0, stick: float = 0.0, shift: float = 0.0, softer: float = 1.0, outside: int = 0,
           end: float = 5.0, **changes: Any) -> Any:
    """A run with the mean numbers of both codes and the centres of one, `slower` by this factor; the part `wrong` of the grains in a zone
    is counted in none, `stick` small grains stay in zone 2, centres are off by `shift` (m), grains overlap by 0.3 % or are `softer` by a
    factor, `outside` are beyond the wall."""
    p = defaults("mixing_drum", **changes)
    times = np.arange(1, round(100 * end) + 1) * 0.01
    codes, paths = mixing.published(), mixing.centres()
    rows = {"time": times}
    for sort, start in (("small", 15047), ("large", 3963)):
        for zone in mixing.ZONES:
            mean = np.mean([codes[code][f"{sort}_{zone}"] for code in mixing.CODES], axis=0)
            first = start if zone == "zone2" else 0
            curve = CubicSpline(np.append(0.0, codes["musen"]["time"]), np.append(first, mean))(times / slower)
            rows[f"{sort}_{zone}"] = (1.0 - wrong) * curve + stick * (sort == "small")
        for axis in "xz":
            name = f"{sort}_{axis}"
            rows[name] = CubicSpline(paths["time"], paths[name])(np.minimum(times / slower, 4.9)) + shift
    # Chains of four small grains.
    places = np.zeros((100, 3))
    places[:, 0] = np.arange(100) % 4 * 0.002 * (1.0 - 0.003 * softer ** (2.0 / 3.0))
    places[:, 1] = np.arange(100) // 4 * 0.0021 - 0.025
    places[:outside, 0] = 1.01 * p["drum_radius"]
    frame = SimpleNamespace(positions=places, radii=np.full(100, 0.001))
    return SimpleNamespace(parameters=p, times=lambda: rows, grains=lambda: iter([frame]))


def verdicts(**changes: Any) -> dict[str, Any]:
    return judged("mixing_drum", mixing.measure([turned(**changes)]))


def test_the_published_curves_say_what_they_are_quoted_for() -> None:
    codes = {code: mixing.turning_points(rows) for code, rows in mixing.published().items()}
    assert [codes["musen"][name][1].value for name in mixing.TURNING] == pytest.approx(
        [23412, 1, 17180, 912, 12518, 3232, 3061], abs=0.6)
    assert [codes["liggghts"][name][0].value for name in mixing.TURNING] == pytest.approx(
        [0.637, 1.566, 2.480, 3.386, 4.394, 1.751, 3.333], abs=6e-4)
    assert mixing.extremes(mixing.centres()) == pytest.approx({
        "small_x_least": -0.0198, "small_x_most": 0.0685, "small_z_least": -0.0778, "small_z_most": -0.0182, "large_x_most": 0.0517,
        "large_z_most": -0.0332}, abs=6e-5)


def test_a_run_like_the_published_ones_passes() -> None:
    found = verdicts()
    checked = {name for name, one in CASE.quantities.items() if one.tolerance is not None}
    assert names(found, "pass") == checked, {name: one["verdict"] for name, one in found.items()}


def test_a_short_run_is_compared_as_far_as_it_goes() -> None:
    found = verdicts(end=2.0)
    assert {"small_peak_1", "small_trough_1_time", "rms_early", "early_numbers"} <= names(found, "pass")
    assert not {"small_peak_2", "large_peak_1", "rms_late", "small_x_most"} & set(found)


def test_another_drum_is_not_compared() -> None:
    found = verdicts(small_friction=0.4)
    assert found["small_peak_1"]["reference"] is None and "rms_early" not in found
    assert verdicts(softening=100.0)["small_peak_1"]["reference"] is not None


def test_a_turning_point_is_the_vertex_of_a_parabola() -> None:
    times = np.arange(1, 501) * 0.01
    rows = {"time": times, "small_zone2": 900.0 - 4e3 * (times - 0.64) ** 2}
    assert mixing.turning_point(rows, "small_peak_1") == pytest.approx((0.64, 900.0), abs=1e-9)
    # No peak lies in a window through which the numbers only fall.
    rows["small_zone2"] = -times
    assert math.isnan(mixing.turning_point(rows, "small_peak_1")[0])


def test_overlaps_are_over_the_smaller_diameter() -> None:
    frame = SimpleNamespace(positions=np.array([[0.0, 0, 0], [0.00297, 0, 0], [0.01, 0, 0]]), radii=np.array([0.001, 0.002, 0.002]))
    assert mixing.overlaps(frame) == pytest.approx([0.015])


def test_the_drum_is_a_closed_polygon_with_a_corner_at_each_end_of_the_x_axis() -> None:
    made = prepare(CASE, resolve(CASE))
    corners = made.meshes["drum"][:-4].reshape(-1, 3)
    assert np.hypot(corners[:, 0], corners[:, 2]) == pytest.approx(0.1, abs=1e-12) and np.abs(corners[:, 1]).max() == 0.03
    assert {-0.1, 0.1} <= set(np.round(corners[np.abs(corners[:, 2]) < 1e-12, 0], 12))
    ends = made.meshes["drum"][-4:].reshape(-1, 3)
    assert sorted(set(ends[:, 1])) == [-0.03, 0.03] and np.abs(ends[:, [0, 2]]).min() > 0.1


def test_the_time_step_is_that_of_the_source_and_rows_are_due_at_hundredths_of_a_second() -> None:
    made = prepare(CASE, resolve(CASE))
    assert made.time_step == pytest.approx(8e-7, rel=0.01) and made.numbers["every"] * made.time_step == pytest.approx(0.01, rel=1e-12)
    assert made.numbers["small_modulus"] == 1e9 and made.numbers["large_soft_modulus"] == 5e6
    soft = prepare(CASE, resolve(CASE, "standard"))
    assert soft.numbers["small_modulus"] == 1e7 and soft.steps * soft.time_step == pytest.approx(5.0)


def test_small_grains_begin_above_large_ones_without_contacts() -> None:
    made = prepare(CASE, resolve(CASE))
    assert made.packing is not None
    places, sizes, types = made.packing.positions, made.packing.diameters, made.packing.types
    assert (types == 1).sum() == 30000 and (types == 3).sum() == 8000 and made.packing.type_count == 3
    assert set(zip(types, sizes, made.packing.densities, strict=True)) == {(1, 0.002, 2500.0), (3, 0.004, 2000.0)}
    assert places[types == 1, 2].min() > places[types == 3, 2].max()
    frame = SimpleNamespace(positions=places, radii=0.5 * sizes)
    assert len(mixing.overlaps(frame)) == 0
    assert (np.hypot(places[:, 0], places[:, 2]) + 0.5 * sizes).max() < 0.1 * math.cos(math.pi / 100)
    assert (np.abs(places[:, 1]) + 0.5 * sizes).max() < 0.03


SMALL = {"small_count": 400, "large_count": 100, "drum_radius": 0.03, "drum_width": 0.016, "sides": 40, "drum_speed": 6.0, "softening": 100,
         "time_step_fraction": 0.2, "settle_time": 0.02, "relax_time": 0.01, "duration": 0.3, "frames": 5}


@pytest.mark.parametrize("engine", CASE.engines)
def test_a_small_drum_is_filled_in_layers_and_carries_them_up(engine: str, simulate: Any) -> None:
    one = simulate("mixing_drum", engine, SMALL)
    rows, frames = one.times(), list(one.grains())
    assert rows["time"] == pytest.approx(0.01 * np.arange(1, 31)) and [frame.step for frame in frames[:2]] == [
        one.derived["first"], one.derived["first"] + one.derived["stride"]]
    assert mixing.leaked(one) == 0 and np.concatenate([mixing.overlaps(frame) for frame in frames]).max() < 0.1
    small, large = (frames[0].types == kind for kind in (1, 3))
    assert small.sum() == 400 and large.sum() == 100 and set(frames[0].radii[small]) == {0.001} and set(frames[0].radii[large]) == {0.002}
    # At rest, but for the first hundredth of a second, and in layers.
    height = frames[0].positions[:, 2]
    assert np.median(np.abs(frames[0].velocities)) < 0.1 and height[small].mean() - height[large].mean() > 0.004
    # What the history has is what the frames have.
    places = frames[0].positions[large]
    assert rows["large_zone2"][0] == ((places[:, 0] < 0.0) & (places[:, 2] < 0.0)).sum()
    assert [rows[f"large_{axis}"][0] for axis in "xyz"] == pytest.approx(places.mean(axis=0), abs=1e-8)
    # The wall at positive x moves up, and takes the grains there; then they slide back.
    assert abs(rows["large_x"][0]) < 0.002 and rows["large_x"].max() > 0.005 and rows["small_zone1"].max() > 20


@pytest.mark.parametrize("engine", CASE.engines)
def test_a_drum_that_was_stopped_resumes_exactly(engine: str, decks: Any, tmp_path: Path) -> None:
    one = decks("mixing_drum", engine, tmp_path / engine, SMALL | {"duration": 0.05})
    one.run(restart_every=1000)
    before = {name: (one.folder / name).read_bytes() for name in ("time.csv", "grains.dump")}
    assert re.search(r"dembark: resumed at step \d+ exactly", one.run(restart_every=1000, resume="yes"))
    assert {name: (one.folder / name).read_bytes() for name in before} == before


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_the_friction_of_the_filling_ends_with_it(engine: str, tmp_path: Path) -> None:
    write(CASE, engine, portable(resolve(CASE, None, "loose")), tmp_path)
    filling, turning = (tmp_path / f"{engine}.in").read_text(encoding="utf-8").split("\nlabel ")
    assert "${filling_friction}" in filling and "${small_large_friction}" not in filling
    assert "${small_large_friction}" in turning and "${filling_friction}" not in turning


def controls_mixing_drum(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a drum that turns 6 % too slowly", right, verdicts(slower=1.06))
    yield Control("a tenth of the grains in the wrong zone", right, verdicts(wrong=0.1))
    yield Control("small grains that stick to the drum", right, verdicts(stick=800.0))
    yield Control("a bed that lies 3 mm higher and farther", right, verdicts(shift=0.003))
    yield Control("grains thirty times softer", right, verdicts(softer=30.0))
    yield Control("a grain in the wall", right, verdicts(outside=1))
