"""water_tank: flows whose answers are known are measured as they are, wrong ones fail, and both engines let the same water flow."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

tank = module("water_tank")
DT, ROWS, G = 1e-3, 200, 9.81
# Particles that are there at the start.
COUNTS = {"still": 200, "floating": 1000, "falling": 300, "cylinder": 400, "slot": 4000, "drifting": 100}
WIDTHS = {"still": 1.0, "floating": 0.6, "falling": 0.15, "cylinder": 4.0, "slot": 0.4, "drifting": 0.6}


def run(scene: str, heavier: float = 1.0, lighter: float = 1.0, slower: float = 1.0, lost: float = 0.0, leaked: int = 0,
        made: float = 0.0, braked: float = 0.0, given: float = 0.1) -> Any:
    """The theory of `scene`, or the experiment: with gravity stronger by the factor `heavier`, water `lighter` by a factor, a fall that
    takes `slower` times as long, a slot `lost` (spacings) narrower, `leaked` particles in the floor, the part `made` of the energy from
    nowhere, momenta that vanish by the part `braked`, a block that gives the part `given` of its momentum to the water."""
    p = defaults("water_tank") | find("water_tank").variants[scene]
    dx, depth, width, count = p["size"] / p["across"], p["water_depth"], WIDTHS[scene], COUNTS[scene]
    steps = round(p["run_time"] / DT)
    every = 2 if scene == "falling" else steps // ROWS
    steps = every * ROWS
    time, zero = DT * every * np.arange(1, ROWS + 1), np.zeros(ROWS)
    d: dict[str, Any] = {"spacing": dx, "depth": depth, "tank_right": width, "tank_top": depth, "thick": 3 * dx, "middle": 0.5 * width,
                         "half": 0.5 * p["size"], "grain_count": count, "steps": steps, "body_count": 200, "body_mass": 0.0, "load": 0.0}
    rows = {"time": time, "kinetic_energy": zero.copy(), "potential_energy": zero, "compression_energy": zero,
            "tank_fx": zero, "tank_fy": zero - heavier * 1000.0 * G * depth * width}
    rows["kinetic_energy"][ROWS // 2:] += made * 0.5 * 1000.0 * G * width * depth**2
    if scene == "floating":
        # The level follows from the draught, and the block's height from both.
        share = 0.8 / lighter + 0.05 * np.exp(-20.0 * time / p["run_time"])
        rows["body_y"] = (count * dx**2 + share * p["size"] ** 2) / width - (share - 0.5) * p["size"]
    if scene == "falling":
        times, heights = np.loadtxt(tank.REFERENCE, delimiter=",", skiprows=1).T
        rows["body_y"] = depth - 0.131 + np.interp(time, slower * times, heights)
    if scene == "cylinder":
        d |= {"body_mass": 1000.0 * 200 * dx**2, "load": 20.0}
        theory = tank.added_mass(np.sqrt(200 / np.pi) * dx, width, depth) * lighter * d["body_mass"]
        rows["body_vx"] = 20.0 / (d["body_mass"] + theory) * (time - 0.5 * p["ramp"])
    if scene == "drifting":
        d |= {"body_mass": 80.0, "body_inertia": 80.0 * p["size"] ** 2 / 6.0, "body_y": 0.5 * depth, "middle": 0.5 * width}
        left = np.linspace(1.0, 1.0 - braked, ROWS) * 80.0 * p["speed"]
        rows |= {"body_vx": np.linspace(1.0, 1.0 - given, ROWS), "momentum_x": left, "momentum_y": 0.5 * left,
                 "angular_momentum": left * (p["size"] / 6.0 + 0.25 * width - 0.5 * depth)}
    # What has flown out: dV/dt = contraction times width times the square root of 2 g (depth - V/width).
    slot = (p["size"] - lost * dx) * 0.6110154703516573 * np.sqrt(2.0 * G)

    def frame(step: int) -> Any:
        places = np.zeros((count, 3))
        places[:, 0], places[:, 1] = 0.5 * width, (np.arange(count) + 0.5) * depth / count
        if scene == "slot":
            now = step * DT
            flown = slot * np.sqrt(depth) * now - 0.25 * slot**2 / width * now**2
            places[:round(flown / dx**2), 1] = -0.5
        pressures = heavier * 1000.0 * G * np.maximum(depth - places[:, 1], 0.0)
        places[:leaked] = [0.1 * width, -dx, 0.0]
        return replace(frame_of(places, 0.5 * dx, step=step), extra={"pressure": pressures})

    frames = [frame(every * ROWS // 40 * k) for k in range(1, 41)]
    return SimpleNamespace(parameters=p, derived=d, time_step=DT, grains=lambda: frames, times=lambda: rows)


def verdicts(scene: str, **changes: Any) -> dict[str, dict[str, Any]]:
    return judged("water_tank", tank.measure([run(scene, **changes)]))


def study(name: str, ratio: float) -> dict[str, dict[str, Any]]:
    """Three spacings, the error at the finest `ratio` times that at the coarsest."""
    quantity, due = {"still": ("pressure_rms", 0.0), "floating": ("displaced_volume", 0.8), "cylinder": ("added_mass", 1.0),
                     "slot": ("slot_error", 0.0)}[name.split("_", maxsplit=1)[0]]
    points = [point({"across": across, "body_density": 800.0, "fluid_density": 1000.0}, {quantity: due - error}, None)
              for across, error in ((4, 0.01), (8, 0.02), (16, 0.01 * ratio))]
    return judged("water_tank", tank.study(name, points, "across"))


def test_theory_passes_and_is_measured_as_it_is() -> None:
    expected = {"still": {"pressure_rms": 0.0, "wall_force": 1.0, "energy_growth": 0.0, "leaked": 0.0},
                "floating": {"displaced_volume": 0.8, "leaked": 0.0}, "falling": {"fall_time": 0.196, "leaked": 0.0},
                "cylinder": {"added_mass": 1.0, "leaked": 0.0},
                "slot": {"slot_width": 0.0, "energy_growth": 0.0, "leaked": 0.0},
                "drifting": {"momentum_error": 0.0, "angular_momentum_error": 0.0, "leaked": 0.0}}
    for scene, values in expected.items():
        found = verdicts(scene)
        assert set(values) <= names(found, "pass"), found
        for name, value in values.items():
            assert found[name]["value"] == pytest.approx(value, abs=0.02 if name == "slot_width" else 2e-3), name


def test_a_block_that_feels_no_water_says_nothing_of_momentum() -> None:
    found = verdicts("drifting", given=0.0)
    assert {found[name]["verdict"] for name in ("momentum_error", "angular_momentum_error")} == {"info"}


def test_the_block_stands_on_the_lattice() -> None:
    """Also where the particles at its sides do not come out even: 35 across the width, 10 across the block."""
    case = find("water_tank")
    numbers = prepare(case, resolve(case, variant="drifting", changes={"across": 10, "tank_width": 0.7})).numbers
    assert round((numbers["middle"] - numbers["half"]) / numbers["spacing"], 9) % 1.0 == 0.0


def test_a_narrow_slot_is_shown_and_not_judged() -> None:
    one = run("slot")
    one.parameters["across"] = 3
    found = judged("water_tank", tank.measure([one]))
    assert "slot_width" not in found and found["slot_error"]["verdict"] == "info"


def test_a_slot_that_is_wide_against_the_tank_is_shown_and_not_judged() -> None:
    one = run("slot")
    one.parameters["size"], one.derived["half"] = 0.08, 0.04
    found = judged("water_tank", tank.measure([one]))["slot_width"]
    assert found["verdict"] == "info" and "up to 0.15" in found["reason"]
    for variant in ("slot", "slot_5", "slot_8"):
        p = resolve(find("water_tank"), variant=variant)
        assert p["size"] <= tank.NARROW * p["tank_width"]


@pytest.mark.parametrize("change", [{"body_density": 1500.0}, {"size": 0.03}, {"tank_width": 0.1}, {"gravity": 1.6}])
def test_another_block_is_not_compared_with_the_one_of_the_experiment(change: dict[str, float]) -> None:
    one = run("falling")
    one.parameters |= change
    found = judged("water_tank", tank.measure([one]))["fall_time"]
    assert found["verdict"] == "info" and "the experiment had" in found["reason"]


def potential(radius: float, width: float, height: float) -> float:
    """Added mass of the cylinder over the water displaced, from Laplace's equation: harmonics r^±n cos n θ, n odd, fitted to the normal
    velocities on the cylinder, cos θ, and on the box, none."""
    orders, angles, part = np.arange(1, 28, 2), (np.arange(200) + 0.5) * np.pi / 400, (np.arange(200) + 0.5) / 400

    def harmonics(z: Any) -> tuple[Any, Any, Any]:
        """Potentials and velocities along x and y (n, harmonics)."""
        z = z[:, None]
        slopes = np.hstack([-orders * (radius / z) ** orders / z, 2.0 * orders * (2.0 * z / height) ** (orders - 1) / height])
        return np.hstack([(radius / z) ** orders, (2.0 * z / height) ** orders]).real, slopes.real, -slopes.imag

    _, u, v = harmonics(radius * np.exp(1j * angles))
    _, side, _ = harmonics(0.5 * width + 1j * height * part)
    _, _, roof = harmonics(width * part + 0.5j * height)
    rows = np.vstack([u * np.cos(angles)[:, None] + v * np.sin(angles)[:, None], side, roof])
    fitted = np.linalg.lstsq(rows, np.concatenate([np.cos(angles), np.zeros(400)]), rcond=None)[0]
    around = 2.0 * np.pi * (np.arange(400) + 0.5) / 400
    on_it, _, _ = harmonics(radius * np.exp(1j * around))
    return float(-2.0 * np.mean(on_it @ fitted * np.cos(around)) / radius)


@pytest.mark.parametrize(("width", "height"), [(4.0, 4.0), (2.4, 2.4), (2.4, 1.6), (1.6, 2.4)])
def test_the_added_mass_in_a_box_is_that_of_laplaces_equation(width: float, height: float) -> None:
    assert tank.added_mass(0.4, width, height) == pytest.approx(potential(0.4, width, height), rel=(0.4 / min(width, height)) ** 6 * 10)
    assert tank.added_mass(1e-3, width, height) == pytest.approx(1.0, abs=1e-5)


SHORT: dict[str, dict[str, float]] = {"still": {"across": 10, "run_time": 0.6}, "floating": {"across": 8, "run_time": 0.8},
                                      "falling": {"run_time": 0.31}, "cylinder": {"across": 8}, "slot": {"across": 3, "run_time": 0.1},
                                      "drifting": {"across": 8}}


@pytest.mark.parametrize("scene", [pytest.param(one, marks=pytest.mark.full if one == "falling" else ()) for one in SHORT])
def test_both_engines_have_the_same_flow(scene: str, simulate: Any) -> None:
    found = {}
    for engine in ("liggghts", "yade"):
        one = simulate("water_tank", engine, SHORT[scene], scene)
        assert {frame.step for frame in one.grains()} == {one.derived["stride"] * k for k in range(1, 41)}
        found[engine] = judged("water_tank", tank.measure([one]))
        assert found[engine]["leaked"]["verdict"] == "pass"
        if scene == "drifting":
            assert found[engine]["momentum_given"]["value"] > 0.05
            assert {"momentum_error", "angular_momentum_error"} <= names(found[engine], "pass"), found[engine]
    for name, one in found["liggghts"].items():
        assert found["yade"][name]["value"] == pytest.approx(one["value"], abs=2e-3), name


def test_walls_of_wide_kernels_are_the_same_in_both_engines(simulate: Any) -> None:
    """A kernel of 2.5 spacings feels five layers; with three the lowest particles sank to 0.28 of a spacing above the floor."""
    lowest = {}
    for engine in ("liggghts", "yade"):
        one = simulate("water_tank", engine, {"across": 10, "run_time": 0.5, "smoothing": 2.5}, "still")
        lowest[engine] = min(float(frame.positions[:, 1].min()) for frame in one.grains()) / one.derived["spacing"]
        assert lowest[engine] > 0.45, lowest
    assert lowest["yade"] == pytest.approx(lowest["liggghts"], abs=1e-3)


def controls_water_tank(_folder: Path) -> Iterator[Control]:
    right = {scene: verdicts(scene) for scene in ("still", "floating", "falling", "cylinder", "slot", "drifting")}
    yield Control("gravity a fiftieth too strong", right["still"], verdicts("still", heavier=1.02))
    for scene in ("floating", "cylinder"):
        yield Control("water a tenth too light", right[scene], verdicts(scene, lighter=0.9))
    yield Control("a block that falls a seventh slower", right["falling"], verdicts("falling", slower=1.15))
    yield Control("walls that keep water half a spacing away", right["slot"], verdicts("slot", lost=1.0))
    yield Control("a block that loses a billionth of its momentum", right["drifting"], verdicts("drifting", braked=1e-9))
    for name in ("still", "still_wide", "still_corrected", "floating", "cylinder", "slot"):
        yield Control("errors that grow with finer particles", study(name, 0.5), study(name, 2.0))
    yield Control("a scheme that makes energy", right["still"], verdicts("still", made=0.05))
    for scene, one in right.items():
        if scene == "drifting":
            # Without walls a particle can be missing, but not leak.
            continue
        yield Control("a particle that leaks out", one, verdicts(scene, leaked=1))
