"""vibrated_layer: waves that are known are measured as they are, wrong ones fail; both engines move the plate from level to level."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.drive_levels import levels
from dembark.input_decks.common.momentum import unexplained_energy
from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.input_decks.vibrated_layer.layer import read
from dembark.postproc import DumpError
from dembark.postproc.statistics import Estimate

layer = module("vibrated_layer")
D, STRIDE, STILL = 0.005, 10, 4
# A frequency (Hz) at which the plate reaches 3 sqrt(g d) at 2.5 g.
FAST = 5.0


def shaken(height: Callable[[float], float] = lambda _: 0.5, *, part: float = 0.5, waves: int = 4, noise: float = 0.05, lost: float = 0.0,
           work: float = 0.0, lasting: Callable[[float], bool] = lambda _: True, **changes: Any) -> Any:
    """A run with a standing wave of the amplitude `height(gamma)` (d), `waves` on the length, at `part` of the frequency of the drive; two
    layers of grains are enough for its surface. `lost`: share of all works that no force explains; `work` (J) of the plate in a period;
    `lasting(gamma)`: whether waves stay, or
    come anew, elsewhere, in each window of eight periods."""
    given = defaults("vibrated_layer", **{"periods": 16, "level_ramp": 2, "run_in": 0, "motion_ramp": 2} | changes)
    random, length = np.random.default_rng(7), given["layer_length"]
    place = np.array([((i + 0.5) * D, (j + 0.5) * D) for i in range(round(length / D)) for j in range(round(given["layer_depth"] / D))])
    ones, ids = np.ones(2 * len(place)), np.arange(1, 2 * len(place) + 1)
    planned = levels(given)

    def frame(number: int) -> Any:
        past = number / PHASES - STILL
        gamma = next((one.gamma for one in reversed(planned) if past >= one.start), planned[0].gamma)
        shift = 0.0 if lasting(gamma) else 2.4 * math.floor((number - STILL * PHASES) / (8 * PHASES))
        wave = np.cos(2.0 * np.pi * waves * place[:, 0] / length + shift) * math.cos(2.0 * np.pi * part * past)
        cell = np.floor(place[:, 0] / (2.0 * D)).astype(int)
        top = D * (4.0 + height(gamma) * wave + noise * random.standard_normal(cell.max() + 1)[cell])
        positions = np.column_stack([np.tile(place, (2, 1)), np.concatenate([top, top - D])])
        one = SimpleNamespace(step=STRIDE * number, positions=positions, radii=0.5 * D * ones, masses=ones, types=ones, ids=ids, where="")
        one.select = lambda _: one
        return one

    frames = [frame(k) for k in range((STILL + planned[0].start) * PHASES, (STILL + planned[-1].start + given["periods"]) * PHASES + 1)]
    count = frames[-1].step // STRIDE + 1
    rows = {name: np.zeros(count) for name in ("other", "imposed")} | {"balance": np.full(count, lost), "scale": np.ones(count)}
    rows |= {"step": STRIDE * np.arange(count), "walls": work * np.arange(count) / PHASES}
    derived = {"period_steps": STRIDE * PHASES, "rest_periods": STILL, "plate_speed": 0.3}
    return SimpleNamespace(folder="run", parameters=given, derived=derived, time_step=1e-4, grains=lambda: frames, times=lambda: rows)


def verdicts(*args: Any, **changes: Any) -> dict[str, Any]:
    return judged("vibrated_layer", layer.measure([shaken(*args, **changes)]))


def test_waves_are_measured_as_they_are() -> None:
    found = verdicts(noise=0.0, motion_frequency=FAST)
    assert {"strongest_frequency", "energy_balance"} == names(found, "pass") and not names(found, "fail")
    assert found["wave_amplitude"]["value"] == pytest.approx(0.5, rel=0.05)
    assert found["wavelength"]["value"] == pytest.approx(12.5) and found["wavelength_over_height"]["value"] == pytest.approx(2.5)
    assert found["coherence"]["value"] == pytest.approx(1.0)
    assert found["wavelength_over_height"]["verdict"] == "info"
    assert "flat_peak" not in found


def test_power_and_height_of_a_layer() -> None:
    """Grains of 1 kg in two layers, 3.5 d high on average, take 2 J in a period."""
    found = verdicts(noise=0.0, work=2.0, motion_frequency=FAST)
    weight = 2 * 50 * 4 * 9.81
    speed = 3.0 * 9.81 / (2.0 * math.pi * FAST)
    assert found["power"]["value"] == pytest.approx(2.0 * FAST / (weight * speed)) and found["height"]["value"] == pytest.approx(3.5)
    assert "power" not in sweep(2.5)


def test_a_layer_needs_rows_at_the_ends_of_its_periods() -> None:
    run = shaken()
    rows = run.times()
    run.times = lambda: rows | {"step": rows["step"] + 1}
    with pytest.raises(DumpError, match="no rows at the ends of the periods"):
        layer.measure([run])


def panel(waves: int, part: float) -> dict[str, Any]:
    """Panel b of Bizon et al. (1998), five stripes on 100 d that repeat after two periods."""
    return verdicts(waves=waves, part=part, layer_height=5.42, layer_length=100.0 * D, motion_frequency=0.44 / math.sqrt(5.42 * D / 9.81))


def test_waves_of_a_published_layer_are_compared_with_its_own() -> None:
    assert {"published_period", "published_waves"} <= names(panel(5, 0.5), "pass")
    assert "published_period" not in verdicts()


def test_a_flat_layer_has_noise_alone() -> None:
    found = verdicts(lambda _: 0.0, noise=0.1, motion_gamma=1.5)
    assert {"flat_peak", "energy_balance"} == names(found, "pass") and "wavelength" not in found
    assert found["flat_peak"]["value"] == pytest.approx(1.0, abs=0.5)


def sweep(critical: float, **changes: Any) -> dict[str, Any]:
    """Levels of the acceleration beyond `critical` g with waves whose square grows with what is beyond."""
    given = {"motion_gamma": 1.8, "last_gamma": 3.2, "levels": 8, "noise": 0.05, "motion_frequency": FAST, "periods": 24}
    return verdicts(lambda gamma: 0.6 * math.sqrt(max(gamma - critical, 0.0)), **given | changes)


def test_the_onset_is_where_the_power_comes_from_zero() -> None:
    found = sweep(2.5)
    assert found["onset"]["value"] == pytest.approx(2.5, abs=0.05) and found["onset"]["reference"] is None
    assert "onset_back" not in found and "wavelength" not in found


def test_the_onset_of_order_is_between_waves_that_come_and_go_and_waves_that_stay() -> None:
    """Disordered waves begin at 2 g, and stay from 2.5 g on: the one is judged, the other not."""
    found = sweep(2.0, lasting=lambda gamma: gamma > 2.5)
    assert found["onset"]["value"] == pytest.approx(2.0, abs=0.1)
    assert found["order_onset"]["value"] == pytest.approx(2.5) and found["order_onset"]["verdict"] == "pass"
    assert found["order_onset"]["interval"] == pytest.approx([2.4, 2.6])


@pytest.mark.parametrize("last", [2.5, 3.0])
def test_a_bracket_that_all_runs_share_is_no_narrower_for_their_number(last: float) -> None:
    runs = [SimpleNamespace(onset=lambda **_: Estimate(2.0, 0.1), order_onset=lambda at=at: Estimate(at, 0.25))
            for at in [2.5] * 9 + [last]]
    assert layer.of_sweep(runs, defaults("vibrated_layer", motion_frequency=FAST))["order_onset"].estimate.half >= 0.25


def test_waves_of_a_slow_plate_have_no_verdict() -> None:
    """At 14 Hz the plate reaches 1.3 sqrt(g d) at 2.5 g."""
    order, strongest = sweep(2.5, motion_frequency=14.0)["order_onset"], verdicts()["strongest_frequency"]
    assert order["verdict"] == strongest["verdict"] == "info"
    assert "1.3 √(g d)" in order["reason"] and "1.5 √(g d)" in strongest["reason"]


def test_a_sweep_without_waves_is_open() -> None:
    found = sweep(5.0, periods=8)
    assert found["onset"]["verdict"] == "info" and "too few" in found["onset"]["reason"]
    assert found["order_onset"]["verdict"] == "info" and "not ordered at the highest" in found["order_onset"]["reason"]


@pytest.mark.parametrize("ends", [(1.8, 3.2), (3.2, 1.8)])
def test_both_ways_have_onsets_of_their_own(ends: tuple[float, float]) -> None:
    found = sweep(2.45, back="yes", periods=8, motion_gamma=ends[0], last_gamma=ends[1])
    assert found["onset"]["value"] == pytest.approx(2.45, abs=0.1) and found["onset_back"]["value"] == pytest.approx(2.45, abs=0.1)


@pytest.mark.parametrize("change", [{"spins": "blocked"}, {"floor": "strips"}, {"bridge_volume": 8e-11}, {"grain_friction": 0.0}])
def test_of_changed_layers_the_onset_is_not_judged(change: dict[str, Any]) -> None:
    assert sweep(2.5, **change)["order_onset"]["reference"] is None


@pytest.mark.parametrize("change", [{"motion_second_amplitude": 1e-3}, {"spins": "blocked"}, {"static_friction": 0.0}])
def test_of_changed_layers_neither_waves_nor_a_flat_surface_are_asked(change: dict[str, Any]) -> None:
    waves = verdicts(part=1.0, motion_frequency=FAST, **change)["strongest_frequency"]
    flat = verdicts(lambda _: 0.3, noise=0.1, motion_gamma=1.5, **change)["flat_peak"]
    assert waves["verdict"] == flat["verdict"] == "info" and "one frequency" in waves["reason"] and waves["tolerance"] is None


def study(name: str, along: str, **found: tuple[float, dict[str, Any]]) -> dict[str, Any]:
    """The study `name` of results by variant: (value of its quantity, parameters)."""
    quantity = "onset" if name == "changes" else "wavelength"
    points = [point(defaults("vibrated_layer", **changes), dict.fromkeys((quantity, "mean_wavelength"), value), 0.05, variant=variant)
              for variant, (value, changes) in found.items()]
    return judged("vibrated_layer", layer.study(name, points, along))


def dispersion(*found: float) -> dict[str, Any]:
    return study("frequency", "motion_frequency", **{f"f{k}": (one, {"motion_frequency": 4.0 + 0.75 * k}) for k, one in enumerate(found)})


def test_wavelengths_fall_with_the_frequency() -> None:
    assert dispersion(20.0, 16.7, 14.3, 11.1, 10.0)["wavelength_trend"]["value"] == pytest.approx(-1.0)
    assert dispersion(16.7, 20.0, 14.3, 11.1, 10.0)["wavelength_trend"]["value"] == pytest.approx(-0.9)
    assert dispersion(10.0, 11.1, 14.3, 16.7, 20.0)["wavelength_trend"]["value"] == pytest.approx(1.0)


def lengths(*found: float) -> dict[str, Any]:
    return study("length", "layer_length", **{f"l{k}": (one, {"layer_length": 0.25 + 0.125 * k}) for k, one in enumerate(found)})


def shifts(**shift: float) -> dict[str, Any]:
    variants = ("sweep", *layer.CHANGES)
    return study("changes", "spins", **{one: (2.5 + shift.get(one, 0.0), {}) for one in variants})


def test_shifts_beyond_their_interval_are_seen() -> None:
    joint = 0.05 * math.sqrt(2.0)
    found = shifts(sweep_smooth=-0.2, sweep_wet=1.25 * joint, sweep_two=-1.25 * joint)  # of five: not beyond 1.31 of it
    assert found["shifts_seen"]["value"] == 1 and found["shifts_seen"]["verdict"] == "pass"
    assert found["onset_shift_no_friction"]["value"] == pytest.approx(-0.2) and "no friction" in found["shifts_seen"]["detail"]
    assert shifts()["shifts_seen"]["verdict"] == "fail"


def test_layers_without_an_onset_are_left_out() -> None:
    found = shifts(sweep_smooth=-0.2, sweep_wet=math.nan)
    assert "onset_shift_wet" not in found and found["shifts_seen"]["value"] == 1
    assert not shifts(sweep=math.nan)


def test_the_levels_of_a_run() -> None:
    p = defaults("vibrated_layer", motion_gamma=2.0, last_gamma=3.0, levels=3, back="yes", motion_ramp=9.5, level_ramp=4, run_in=6,
                 periods=16)
    assert [(one.gamma, one.start) for one in levels(p)] == [(2.0, 16), (2.5, 42), (3.0, 68), (2.5, 94), (2.0, 120)]


def test_a_window_that_is_not_whole_is_refused() -> None:
    from dembark.postproc import DumpError
    one = shaken()
    frames = one.grains()
    one.grains = lambda: frames[:-20]
    with pytest.raises(DumpError, match="does not hold the 16 periods"):
        read(one)


SMALL = {"layer_length": 0.06, "layer_depth": 0.015, "layer_height": 3.0, "motion_frequency": 25.0, "settle_time": 0.06, "motion_ramp": 2,
         "run_in": 0, "level_ramp": 2, "periods": 8, "last_gamma": 2.0, "levels": 2, "motion_gamma": 1.5}


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_plate_goes_from_level_to_level(engine: str, simulate: Any) -> None:
    """Its amplitude is that of each level, no grain falls through it, and all work is accounted for."""
    run = simulate("vibrated_layer", engine, SMALL)
    rows, found = run.times(), read(run)
    for level in found.levels:
        begin, end = ((run.derived["rest_periods"] + level.start + past) / 25.0 for past in (0, 8))
        inside = (rows["time"] > begin) & (rows["time"] < end)
        expected = level.gamma * 9.81 / (2.0 * math.pi * 25.0) ** 2
        assert rows["motion_z"][inside].max() == pytest.approx(expected, rel=1e-3), level
    assert unexplained_energy(rows) < 1e-10 and rows["walls"][-1] > 0.0
    last = list(run.grains())[-1]
    assert len(last.ids) > 50
    assert last.positions[:, 2].min() > rows["motion_z"][-1]


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_blocked_grains_do_not_turn(engine: str, simulate: Any) -> None:
    run = simulate("vibrated_layer", engine, SMALL | {"spins": "blocked", "levels": 1, "last_gamma": None})
    assert all((frame.omegas == 0.0).all() for frame in run.grains()) and unexplained_energy(run.times()) < 1e-10


def test_a_floor_of_strips_is_refused_where_facets_have_no_periods(decks: Any, tmp_path: Path) -> None:
    refused = decks("vibrated_layer", "yade", tmp_path / "strips", SMALL | {"floor": "strips"})
    assert refused.start().wait(60) != 0 and "floor 'strips': facets have no periods here" in refused.said()


def controls_vibrated_layer(_folder: Path) -> Iterator[Control]:
    waves = verdicts(motion_frequency=FAST)
    yield Control("a billionth of the works that nothing explains", waves, verdicts(lost=1e-9, motion_frequency=FAST))
    yield Control("waves on a layer that should be flat", verdicts(lambda _: 0.0, noise=0.1, motion_gamma=1.5),
                  verdicts(lambda _: 0.3, noise=0.1, motion_gamma=1.5))
    yield Control("a surface that answers each stroke alike", waves, verdicts(part=1.0, motion_frequency=FAST))
    yield Control("ordered waves that begin at twice the acceleration of free fall", sweep(2.5), sweep(2.0))
    yield Control("waves twice as long, at another part of the frequency, than published", panel(5, 0.5), panel(2, 0.25))
    yield Control("one wave on any length", lengths(12.5, 12.5, 14.3), lengths(12.5, 18.75, 25.0))
    yield Control("changes that change nothing", shifts(sweep_smooth=-0.2), shifts())
