"""shear_cell: stresses that are known are measured as they are, wrong ones fail; plates of the real decks balance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.physics import capillary_force
from dembark.validation.case.deck import derived, prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

shear_cell = module("shear_cell")
D, AREA, COLUMNS, LAYERS = 0.001, 4e-5, 40, 12
# Steps of the first load, and before it.
LOAD_STEPS, START = 6000, 500
WET = 6.25e-13
BRIDGE = float(capillary_force(0.5 * D, 0.5 * D, 0.0, WET, 0.072, 0.35))


def sheared(*, slope: float = 0.388, cut: float = 0.0, carried: float = 1.0, lost: float = 0.0, noise: float = 1e-3, seed: int = 0,
            **changes: Any) -> Any:
    """A run with the yield locus `cut` (Pa) + `slope` σ: columns of touching grains between two plates. `carried`: share of the load that
    the grains carry; `lost`: share of the shear stress of the lower plate that is not written."""
    p, random = defaults("shear_cell", **{"strain": 1.0, "run_in": 0.5} | changes), np.random.default_rng(seed)
    steps = START + 3 * LOAD_STEPS
    rows = np.arange(20, steps + 1, 20)
    load = p["normal_stress"] * 2.0 ** np.clip((rows - START - 1) // LOAD_STEPS, 0, 2)
    shear = (cut + slope * load) * (1.0 + noise * random.standard_normal(len(rows)))
    times = {"step": rows, "time": rows * 1e-5, "lower_fx": -(1.0 - lost) * shear * AREA, "upper_fx": shear * AREA,
             "lower_fz": carried * load * AREA, "upper_fz": -load * AREA}
    height = D * np.arange(LAYERS)
    z = np.concatenate([np.tile(height[1:-1], COLUMNS), np.full(COLUMNS, height[0]), np.full(COLUMNS, height[-1])])
    grains = SimpleNamespace(types=np.repeat([1, 2], [(LAYERS - 2) * COLUMNS, 2 * COLUMNS]), ids=np.arange(1, len(z) + 1),
                             positions=np.column_stack([np.zeros((len(z), 2)), z]), radii=np.full(len(z), 0.5 * D))
    free = np.arange((LAYERS - 2) * COLUMNS).reshape(COLUMNS, -1)
    chain = np.column_stack([free.size + np.arange(COLUMNS), free, free.size + COLUMNS + np.arange(COLUMNS)])
    first, second = chain[:, :-1].ravel(), chain[:, 1:].ravel()
    frames = []
    for step in range(START + 600, steps + 1, 600):
        push = carried * p["normal_stress"] * 2.0 ** ((step - START - 1) // LOAD_STEPS) * AREA / COLUMNS
        contacts = SimpleNamespace(first=grains.positions[first], branch=grains.positions[second] - grains.positions[first],
                                   forces=np.tile([0.0, 0.0, -push], (len(first), 1)), ids=np.column_stack([first, second]) + 1)
        frames.append((SimpleNamespace(**vars(grains), step=step), contacts))
    speed = 0.01 * math.sqrt(p["normal_stress"] / p["grain_density"]) * height[-1] / D
    return SimpleNamespace(parameters=p, time_step=1e-5, times=lambda: times, grains=lambda: [frame for frame, _ in frames],
                           paired_frames=lambda: iter(frames), derived={"area": AREA, "steps": steps, "load_steps": LOAD_STEPS,
                                                                        "shear_speed": speed, "grain_static": p["grain_friction"]})


def verdicts(**changes: Any) -> dict[str, dict[str, Any]]:
    return judged("shear_cell", shear_cell.measure([sheared(**changes)]))


def effective(**changes: Any) -> dict[str, dict[str, Any]]:
    """A wet layer whose bridges act like a load: those of the columns, a third of their stress along z."""
    return verdicts(**{"cut": 0.388 * COLUMNS * BRIDGE / AREA / 3.0, "bridge_volume": WET} | changes)


def controls_shear_cell(_: Path) -> Iterator[Control]:
    yield Control("friction off", verdicts(), verdicts(slope=0.11))
    yield Control("cohesion of 10 % of the normal stress", verdicts(), verdicts(cut=117.0))
    yield Control("bridges half as strong", effective(), effective(cut=0.5 * 0.388 * COLUMNS * BRIDGE / AREA / 3.0))
    yield Control("a twentieth of the load lost", verdicts(), verdicts(carried=0.95))
    yield Control("a twentieth of the friction of a plate lost", verdicts(), verdicts(lost=0.05))


def test_a_known_locus_is_found() -> None:
    found = verdicts(slope=0.4, cut=20.0)
    assert found["internal_friction"]["value"] == pytest.approx(0.4, abs=1e-3)
    assert found["friction_angle"]["value"] == pytest.approx(math.degrees(math.atan(0.4)), abs=0.05)
    assert found["cohesion"]["value"] == pytest.approx(20.0, abs=0.5) and found["cohesion"]["reference"] is None
    assert found["inertial_number"]["value"] == pytest.approx(0.01) and found["coordination"]["value"] == pytest.approx(2.0)


def test_beads_flow_with_the_published_friction() -> None:
    assert shear_cell.bead_friction(1e-9) == pytest.approx(0.383)
    assert shear_cell.bead_friction(0.279) == pytest.approx(0.513)
    # 0.3861 and 3.1 Pa by hand from the three stresses at I = 0.01, weighted by their relative errors.
    normal = np.array([500.0, 1000.0, 2000.0])
    stresses = normal * [shear_cell.bead_friction(0.01 / math.sqrt(factor)) for factor in (1, 2, 4)]
    cut, slope = shear_cell.line(normal)
    assert cut @ stresses == pytest.approx(3.0, abs=0.2) and slope @ stresses == pytest.approx(0.386, abs=5e-4)


def test_the_line_goes_through_stresses_on_a_line() -> None:
    normal = np.array([300.0, 1000.0, 5000.0])
    cut, slope = shear_cell.line(normal)
    assert cut @ (40.0 + 0.3 * normal) == pytest.approx(40.0) and slope @ (40.0 + 0.3 * normal) == pytest.approx(0.3)


def test_bridges_and_grains_without_friction_are_not_compared_with_beads() -> None:
    assert effective()["internal_friction"]["reason"] == "liquid bridges"
    assert "without friction" in verdicts(grain_friction=0.0)["internal_friction"]["reason"]
    assert "cohesion_ratio" not in effective() and names(effective(), "fail") == set()


@pytest.mark.parametrize("variant", ["dry", "wet"])
def test_the_plate_moves_at_the_inertial_number_and_the_window_holds_the_strain(variant: str) -> None:
    case = find("shear_cell")
    p = resolve(case, "quick", variant)
    made = prepare(case, p)
    numbers, upper = derived(made), made.packing.velocities[:, 0] > 0.0
    assert upper.sum() == numbers["upper_last"] - numbers["upper_first"] + 1 and (made.packing.types[upper] == 2).all()
    height = made.packing.volume / (0.6 * numbers["area"])
    speed = float(made.packing.velocities[upper, 0].max())
    assert speed * D / height * math.sqrt(2500.0 / 500.0) == pytest.approx(p["inertial_number"], rel=0.3)
    strain = speed * numbers["load_steps"] * made.time_step / height
    assert strain == pytest.approx(p["run_in"] + p["strain"], rel=0.3)


TINY = {"grain_count": 120, "cell_length": 0.005, "cell_width": 0.004, "inertial_number": 0.05, "run_in": 0.2, "strain": 0.4}


@pytest.mark.parametrize(("engine", "variant"), [
    ("liggghts", "wet"), *(pytest.param(engine, "dry", marks=pytest.mark.full) for engine in ("lammps", "yade"))])
def test_the_forces_on_the_plates_balance(engine: str, variant: str, simulate: Any) -> None:
    """The upper plate carries the load and moves with its speed; what it gives to the grains reaches the lower one."""
    run = simulate("shear_cell", engine, TINY | ({"bridge_volume": WET} if variant == "wet" else {}))
    found = judged("shear_cell", shear_cell.measure([run]))
    # In a short and fast run, in which the plate still moves up and down.
    assert abs(found["normal_balance_error"]["value"]) < 0.04 and abs(found["shear_balance_error"]["value"]) < 0.04
    assert abs(found["contact_stress_error"]["value"]) < 0.1 and 0.25 < found["internal_friction"]["value"] < 0.55
    assert found["cohesion"]["value"] > (20.0 if variant == "wet" else -60.0)
    frames = run.grains()
    upper = np.isin(frames[0].ids, np.arange(run.derived["upper_first"], run.derived["upper_last"] + 1))
    way = (frames[-1].positions - frames[0].positions)[upper]
    lasts = (frames[-1].step - frames[0].step) * run.time_step
    np.testing.assert_allclose(way[:, 0], run.derived["shear_speed"] * lasts, rtol=1e-3)
    np.testing.assert_allclose(way[:, 1:], way[:1, 1:] * np.ones((upper.sum(), 1)), atol=1e-9)


@pytest.mark.full
def test_a_plate_keeps_its_load_when_states_are_saved(decks: Any, tmp_path: Path) -> None:
    """YADE forgets permanent forces when it loads a scene, which it does after each state."""
    one = decks("shear_cell", "yade", tmp_path, TINY)
    one.run(restart_every=1700)
    rows = np.genfromtxt(tmp_path / "time.csv", delimiter=",", names=True)
    load = 4.0 * 500.0 * TINY["cell_length"] * TINY["cell_width"]
    assert rows["lower_fz"][-len(rows) // 6:].mean() == pytest.approx(load, rel=0.05)
