"""drive_power: a block that sticks to the plate is measured as it moves, wrong energies fail, and both engines shake the bed."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from dembark.input_decks.drive_power.drive import LONGEST, spectrum, sticking_block
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc import DumpError
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

drive = module("drive_power")
ROWS, STILL, RAMP, STEADY = 128, 2, 10, 10
CHECKS = {"energy_balance", "power_gap", "dissipation_gap", "power", "flight"}


def shaken(real: float = 2.0, stated: float | None = None, **changes: Any) -> Any:
    """A block of 1 kg on a plate with the acceleration `real` g, `stated` in the run's record; 10 fine steps a row."""
    fine = 10 * ROWS
    p = defaults("drive_power", periods=STEADY, **changes)
    omega, g = 2.0 * math.pi * p["motion_frequency"], p["gravity"]
    top = real * g / omega**2
    step = 1.0 / (p["motion_frequency"] * fine)
    time = np.arange((STILL + RAMP + STEADY) * fine + 1) * step
    moving = np.maximum(time - STILL / p["motion_frequency"], 0.0)
    ramp = np.clip(moving * p["motion_frequency"] / RAMP, 0.0, 1.0)
    grown = top * ramp**3 * (10.0 - 15.0 * ramp + 6.0 * ramp**2)
    plate = grown * np.sin(omega * moving)
    speed = np.gradient(plate, step)
    z, v, force, height, motion = 0.0, 0.0, np.zeros(len(time)), np.zeros(len(time)), np.zeros(len(time))
    for k in range(1, len(time)):
        free = v - g * step
        meets = z + free * step <= plate[k]
        new = (plate[k] - z) / step if meets else free
        force[k] = (new - v) / step + g if meets else 0.0
        v, z = new, z + new * step
        height[k], motion[k] = z, v
    work = cumulative_trapezoid(force * speed, time, initial=0.0)
    kinetic, fallen = 0.5 * motion**2, -g * height
    table: dict[str, Any] = {"step": np.arange(len(time)), "time": time, "kinetic_energy": kinetic, "gravity": fallen, "walls": work,
                             "normal_viscous": kinetic - fallen - work, "plate_fz": force, "plate_work": work, "weight_height": g * height}
    zero = ["first_kinetic", "normal_elastic", "tangential_elastic", "tangential_viscous", "normal_stored", "tangential_stored", "balance",
            "capillary", "liquid_viscous"]
    table |= {name: np.zeros(len(time)) for name in zero} | {"scale": np.full(len(time), 2.0 * work[-1])}
    rows = {name: np.asarray(values[10::10]) for name, values in table.items()}
    grain = SimpleNamespace(step=(STILL + RAMP) * fine, masses=np.ones(1))
    p["motion_gamma"] = real if stated is None else stated
    derived = {"begin": STILL * fine, "period_steps": fine, "held": (STILL + RAMP + STEADY) * fine}
    return SimpleNamespace(parameters=p, derived=derived, times=lambda: rows, grains=lambda: [grain], time_step=step, folder=Path("run"))


def verdicts(run: Any | None = None, **changes: Any) -> dict[str, Any]:
    return judged("drive_power", drive.measure([run or shaken(**changes)]))


def spoiled(**factors: float) -> Any:
    """A right run with some columns of time.csv multiplied."""
    run = shaken()
    rows = run.times()
    for name, factor in factors.items():
        rows[name] = factor * rows[name]
    return run


def test_spectrum_splits_a_signal_into_its_harmonics_and_the_rest() -> None:
    time = np.arange(40 * 16).reshape(40, 16) / 16
    signal = 3.0 + 0.5 * np.sin(2 * np.pi * time + 0.3) + 0.2 * np.cos(4 * np.pi * time) + 0.1 * np.sqrt(2) * np.sin(np.pi * time)
    assert spectrum(signal) == pytest.approx((0.5, 0.2, 0.1), abs=1e-12)


@pytest.mark.parametrize(("acceleration", "flight", "power"), [
    (1.5, 0.568, 0.180), (2.0, 0.742, 0.584), (2.5, 0.857, 0.897), (3.0, 0.950, 0.999)])
def test_the_sticking_block(acceleration: float, flight: float, power: float) -> None:
    block = sticking_block(acceleration)
    assert block is not None
    assert block.flight == pytest.approx(flight, abs=6e-4) and block.power == pytest.approx(power, abs=6e-4)


def test_a_block_leaves_above_g_and_flies_for_a_whole_period_at_most() -> None:
    assert sticking_block(1.0) is None and sticking_block(LONGEST) is None
    low, high = sticking_block(1.0001), sticking_block(LONGEST - 1e-9)
    assert low and low.flight < 0.01 and low.power < 1e-6
    assert high and high.flight == pytest.approx(1.0, abs=1e-4)


def springing(acceleration: float, restitution: float, periods: int = 150) -> float:
    """P / (M g V) of a block on a plate sin(t) that leaves it with `restitution` of the speed at which it landed, from event to event."""
    g, time, leaves, lost, begin = 1.0 / acceleration, math.asin(1.0 / acceleration), 0.0, 0.0, 2.0 * math.pi * 30
    while time < 2.0 * math.pi * periods:
        speed, height = math.cos(time) + leaves, math.sin(time)

        def above(past: Any, speed: float = speed, height: float = height, time: float = time) -> Any:
            return height + speed * past - 0.5 * g * past**2 - np.sin(time + past)

        # What springs up with a small speed is back soon; what is left lying leaves with the cube of the time.
        fine = np.geomspace(0.1 * leaves if leaves else 1e-3, 20.0, 1000)
        landed = int(np.argmax(above(fine) < 0.0))
        past = brentq(above, fine[landed - 1], fine[landed])
        time += past
        meets = math.cos(time) - (speed - g * past)
        lost += 0.5 * (1.0 - restitution**2) * meets**2 if time > begin else 0.0
        leaves, phase = restitution * meets, time % (2.0 * math.pi)
        if leaves < 1e-3:
            leaves, start = 0.0, math.asin(g)
            time += start - phase if phase < start else 0.0 if phase < math.pi - start else 2.0 * math.pi + start - phase
    return lost * acceleration / (time - begin)


@pytest.mark.parametrize("acceleration", [1.5, 2.0, 2.5, 3.0])
def test_a_block_that_hardly_springs_is_one_that_sticks(acceleration: float) -> None:
    block = sticking_block(acceleration)
    assert block and springing(acceleration, 0.005) == pytest.approx(block.power, rel=0.01)


def test_at_3_g_a_block_that_springs_a_little_takes_less_and_at_weaker_shaking_it_does_not() -> None:
    assert springing(1.5, 0.2) == pytest.approx(0.180, rel=0.02) and springing(2.0, 0.2) == pytest.approx(0.584, rel=0.02)
    assert springing(3.0, 0.1) == pytest.approx(0.86, abs=0.03) and springing(3.0, 0.2) == pytest.approx(0.69, abs=0.05)


@pytest.mark.parametrize("acceleration", [1.5, 2.0, 3.0])
def test_a_known_motion_is_measured_as_it_is(acceleration: float) -> None:
    found = verdicts(real=acceleration)
    assert names(found, "pass") == CHECKS
    assert found["power"]["deviation"] == pytest.approx(0.0, abs=0.03) and found["flight"]["deviation"] == pytest.approx(0.0, abs=0.03)
    assert found["acceleration"]["value"] == pytest.approx(acceleration)
    assert 3.0 < found["power_time"]["value"] < RAMP


@pytest.mark.parametrize("factors", [{"kinetic_energy": 1.001}, {"walls": np.nan}])
def test_wrong_energies_fail(factors: dict[str, float]) -> None:
    assert "energy_balance" in names(verdicts(spoiled(**factors)), "fail")


def test_bridges_take_their_part_of_the_energy_and_have_no_block() -> None:
    run = shaken(bridge_volume=8e-11)
    rows = run.times()
    rows |= {"normal_viscous": 0.7 * rows["normal_viscous"], "liquid_viscous": 0.2 * rows["normal_viscous"],
             "capillary": 0.1 * rows["normal_viscous"]}
    found = verdicts(run)
    assert {"energy_balance", "dissipation_gap"} <= names(found, "pass"), found
    assert found["power"]["reference"] is None and found["flight"]["reference"] is None


def test_power_and_dissipation_are_compared_in_the_mean_over_runs() -> None:
    """What a bed holds at the ends of a window scatters from run to run; damping that is missing is missing in all."""
    found = judged("drive_power", drive.measure([shaken(), spoiled(normal_viscous=0.985), shaken(), spoiled(normal_viscous=1.015)]))
    assert "dissipation_gap" not in names(found, "fail") and abs(found["dissipation_gap"]["value"]) < 1e-3
    found = judged("drive_power", drive.measure([spoiled(normal_viscous=0.97 + 0.001 * k) for k in range(4)]))
    assert "dissipation_gap" in names(found, "fail")


def test_a_bed_that_bounces_is_not_compared_with_a_block_that_sticks() -> None:
    assert not {"power", "flight"} & names(verdicts(restitution=0.9), "pass")


def test_rows_that_make_no_periods_are_refused() -> None:
    run = shaken()
    run.derived["period_steps"] += 1
    with pytest.raises(DumpError, match="no rows at full periods"):
        verdicts(run)


def step_study(order: float) -> dict[str, Any]:
    points = [point({"time_step_fraction": step}, {"power_gap": -0.01 * step**order}, None) for step in (0.12, 0.03, 0.06)]
    return judged("drive_power", drive.study("step", points, "time_step_fraction"))


def rise_study(dimensions: int, power: float) -> dict[str, Any]:
    points = [point({"amplitude": amplitude, "dimensions": dimensions},
                    {"speed": amplitude, "rise": amplitude**power, "kinetic_energy": amplitude**2}, part=0.01)
              for amplitude in (0.002, 0.004, 0.008)]
    return judged("drive_power", drive.study("rise", points, "amplitude"))


def count_study(power: float) -> dict[str, Any]:
    points = [point({"grain_count": count}, {"rise": count**power}, part=0.01) for count in (600, 1200, 960)]
    return judged("drive_power", drive.study("rise_count", points, "grain_count"))


def test_the_exponent_of_the_number_of_grains_has_an_interval() -> None:
    found = count_study(-0.5)["rise_exponent_count"]
    low, high = found["interval"]
    assert found["value"] == pytest.approx(0.5) and low < 0.5 < high


def test_the_curve_over_stiffness_has_that_of_the_block() -> None:
    points = [point(defaults("drive_power", youngs_modulus=modulus, motion_gamma=3.0), {"power": 0.7, "flight": 0.8}, 0.1)
              for modulus in (1.4e8, 1.4e7)]
    power, flight = drive.study("stiffness", points, "youngs_modulus").profiles
    assert power["place"] == pytest.approx([7.146, 8.146], abs=1e-3) and power["value"] == pytest.approx([0.7, 0.7])
    assert power["reference"] == pytest.approx([0.9995] * 2, abs=1e-4) and flight["reference"] == pytest.approx([0.950] * 2, abs=1e-3)


SMALL = {"grain_count": 32, "youngs_modulus": 5e6, "motion_frequency": 25.0, "motion_ramp": 1, "settle_time": 0.06, "periods": 8}


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_power_of_the_plate_is_what_the_account_has(engine: str, simulate: Any) -> None:
    run = simulate("drive_power", engine, SMALL)
    measured = drive.measure([run])
    found = judged("drive_power", measured)
    assert {"energy_balance", "power_gap"} <= names(found, "pass"), found
    assert abs(found["power_gap"]["value"]) < 1e-3 and 0.05 < found["power"]["value"] < 1.5
    assert 0.1 < found["flight"]["value"] < 0.95
    assert found["force_power"]["value"] == pytest.approx(found["power"]["value"], rel=1e-3)


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_spheres_in_a_plane_stay_in_it_and_rest_after_the_stop(engine: str, simulate: Any) -> None:
    run = simulate("drive_power", engine, SMALL | {"dimensions": 2, "grain_count": 12, "rest_periods": 6})
    frames = list(run.grains())
    assert all((frame.positions[:, 1] == frames[0].positions[:, 1]).all() for frame in frames)
    found = judged("drive_power", drive.measure([run]))
    assert "compaction" in found and "dissipation_gap" not in found
    # The block that sticks is shaken on and on.
    assert not {"power", "flight"} & (names(found, "pass") | names(found, "fail")) and found["power"]["reference"] is None
    rows = run.times()
    assert rows["kinetic_energy"][-1] < 0.01 * rows["kinetic_energy"][rows["step"] <= run.derived["held"]].max()


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_side_walls_hold_the_grains_and_do_work_that_the_account_has(engine: str, simulate: Any) -> None:
    run = simulate("drive_power", engine, SMALL | {"sides": "walls"})
    found = judged("drive_power", drive.measure([run]))
    assert {"energy_balance", "power_gap"} <= names(found, "pass"), found
    width = run.parameters["cell_width"]
    for frame in run.grains():
        assert (frame.positions[:, :2] > 0.96 * frame.radii[:, None]).all()
        assert (frame.positions[:, :2] < width - 0.96 * frame.radii[:, None]).all()
    # No grain of the periodic cell keeps away from its faces.
    free = simulate("drive_power", engine, SMALL)
    assert any((frame.positions[:, 0] < 0.6 * frame.radii).any() for frame in free.grains())


@pytest.mark.parametrize("profile", ["quick", "standard"])
@pytest.mark.parametrize("variant", sorted(find("drive_power").variants))
def test_every_variant_can_be_set_up_in_every_profile(variant: str, profile: str) -> None:
    """Grains of `quick` are stiff enough for 2 g only, and its window was shorter than what a plate that stops needs."""
    case = find("drive_power")
    assert prepare(case, resolve(case, profile, variant)).packing is not None


def controls_drive_power(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a plate slower than prescribed", right, verdicts(shaken(stated=2.6)))
    yield Control("a fiftieth of the plate's force lost", right, verdicts(spoiled(plate_work=0.98)))
    yield Control("a thirtieth of the damping that is not booked", right, verdicts(spoiled(normal_viscous=0.97)))
    yield Control("a gap of first order", step_study(2.0), step_study(1.0))
    yield Control("a rise with the square of the speed", rise_study(2, 1.4), rise_study(2, 2.0))
    yield Control("a rise with the square of the speed", rise_study(3, 1.0), rise_study(3, 2.0))
    yield Control("a rise that does not depend on the number of grains", count_study(-0.5), count_study(0.0))
