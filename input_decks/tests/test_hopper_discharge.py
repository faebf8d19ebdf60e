"""hopper_discharge: a known discharge is measured as it is, wrong ones fail, and engines empty a small bin alike."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

hopper = module("hopper_discharge")


def discharge(faster: float = 1.0, left: float = 0.0, late: float = 0.02, **changes: Any) -> Any:
    """A run that follows the published curve, `faster`, `late` (s) after the gate drops, of which the share `left` never leaves."""
    given = defaults("hopper_discharge", **changes)
    count, step, width = 2000, 0.02, given["bin_width"]
    t, y = hopper.published()["first"]
    random = np.random.default_rng(2)
    start = np.column_stack([random.uniform(0.0, width, count), np.zeros(count), random.uniform(0.001, 0.1, count)])

    def frame(k: int) -> Any:
        place = start.copy()
        out = round(count * min(float(np.interp(faster * (k * step - late), t, y)), 1.0 - left))
        place[:out, 2] = -0.1
        return SimpleNamespace(positions=place, radii=np.full(count, 0.00112), masses=np.ones(count), step=1000 + k)

    return SimpleNamespace(parameters=given, time_step=step, grains=lambda: [frame(k) for k in range(115)])


def verdicts(**changes: Any) -> dict[str, Any]:
    return judged("hopper_discharge", hopper.measure([discharge(**changes)]))


def test_the_published_curve_says_what_it_is_quoted_for() -> None:
    due = hopper.datum()
    assert due["rate"].value == pytest.approx(0.818, abs=0.002) and due["rate"].half < 0.01
    assert due["discharged"].value == pytest.approx(0.907, abs=0.002)


def test_the_published_discharge_passes_whenever_its_gate_opens() -> None:
    for late in (0.0, 0.1):
        found = verdicts(late=late)
        assert {"rate", "curve", "discharged"} <= names(found, "pass"), found
        assert "U_input" in found["rate"]["detail"]


@pytest.mark.parametrize("changes", [{"outlet_width": 0.01792}, {"gravity": 1.62}, {"grain_friction": 0.5}, {"wall_friction": 0.0},
                                     {"static_friction": 0.2}, {"restitution": 0.5}, {"grain_density": 1000.0}, {"bridge_volume": 1e-12}])
def test_of_other_bins_no_discharge_is_judged(changes: dict[str, float]) -> None:
    found = verdicts(**changes)
    assert not names(found, "pass") | names(found, "fail")


@pytest.mark.parametrize("variant", ["anand", "friction_low", "friction_high", "stiff", "stiffer", "rolling"])
def test_each_variant_of_the_published_bin_is_judged(variant: str) -> None:
    assert {"rate", "curve", "discharged"} <= names(verdicts(**find("hopper_discharge").variants[variant]), "pass")


def points(exponent: float = 1.5, k: float = 1.5) -> list[dict[str, Any]]:
    """Rates by the law of Beverloo, C = 1."""
    made = []
    for width in (0.01792, 0.025088, 0.03136, 0.04032):
        given = defaults("hopper_discharge", outlet_width=width)
        rate = 1500.0 * np.sqrt(9.81) * 0.03 ** (1.5 - exponent) * (width - k * 0.00224) ** exponent
        made.append(point(given, {"mass_rate": rate, "bulk_density": 1500.0}, part=1e-3, variant="anand"))
    return made


def test_the_law_of_beverloo_is_found() -> None:
    found = judged("hopper_discharge", hopper.study("outlet", points(), "outlet_width"))
    assert {"exponent", "beverloo_k"} <= names(found, "pass"), found
    assert found["beverloo_k"]["value"] == pytest.approx(1.5, abs=1e-9) and found["beverloo_c"]["value"] == pytest.approx(1.0)


def narrow(exponent: float = 1.48) -> list[dict[str, Any]]:
    """Rates that grow as (W/d - 1)^exponent."""
    return [point(defaults("hopper_discharge", outlet_width=width * 0.003, grain_diameter=0.003), {"mass_rate": (width - 1.0) ** exponent},
                  part=0.01) for width in (8.0, 3.0, 4.0, 6.0)]


def test_the_law_of_choi_is_found() -> None:
    study = hopper.study("orifice", narrow(), "outlet_width")
    found = judged("hopper_discharge", study)["orifice_exponent"]
    assert found["verdict"] == "pass" and found["value"] == pytest.approx(1.48)
    assert 0.005 < 0.5 * np.diff(found["interval"])[0] < 0.02
    assert study.profiles[0]["place"] == pytest.approx([2.0, 3.0, 5.0, 7.0])
    np.testing.assert_allclose(study.profiles[0]["value"], study.profiles[0]["reference"])
    # Beverloo's law with k = 1.4 is steeper there.
    widths = np.array([3.0, 4.0, 6.0, 8.0])
    steep = float(np.polyfit(np.log(widths - 1.0), 1.5 * np.log(widths - 1.4), 1)[0])
    assert names(judged("hopper_discharge", hopper.study("orifice", narrow(steep), "outlet_width")), "fail") == {"orifice_exponent"}


def test_narrow_slots_are_those_of_one_bin() -> None:
    case = find("hopper_discharge")
    values = [resolve(case, "standard", f"slot_{width}d") for width in (3, 4, 6, 8)]
    assert [one["outlet_width"] / one["grain_diameter"] for one in values] == pytest.approx([3.0, 4.0, 6.0, 8.0])
    assert all(one["bin_depth"] / one["grain_diameter"] == pytest.approx(8.3) and one["ends"] == "walls" for one in values)
    assert len({(one["bin_width"], one["grain_count"], one["grain_friction"]) for one in values}) == 1


def test_the_study_adds_what_friction_makes_of_it() -> None:
    runs = [{"parameters": defaults("hopper_discharge", grain_friction=friction), "variant": variant,
             "quantities": list(verdicts(faster=faster).values())}
            for friction, faster, variant in ((0.18, 1.02, "friction_low"), (0.2, 1.0, "anand"), (0.22, 0.98, "friction_high"))]
    found = judged("hopper_discharge", hopper.study("friction", runs, "grain_friction"))
    assert 0.5 * np.diff(found["rate"]["interval"])[0] > 0.015 and "U_input = 0.01" in found["rate"]["detail"]


SMALL = {"grain_count": 150, "bin_width": 0.03, "outlet_width": 0.0134, "settle_time": 0.12, "discharge_time": 0.2, "frames": 21,
         "fall": 0.1}


def test_one_length_against_rolling_gives_the_coefficients_of_grains_and_walls() -> None:
    """Coefficients refer to the effective radius, which at a wall is twice that between grains."""
    case = find("hopper_discharge")
    values = resolve(case, None, "rolling")
    numbers = prepare(case, values).numbers
    assert numbers["grain_rolling"] * 0.25 * values["grain_diameter"] == pytest.approx(1e-4)
    assert numbers["wall_rolling"] * 0.5 * values["grain_diameter"] == pytest.approx(1e-4)
    given = prepare(case, resolve(case, None, "rolling", {"rolling_length": 2e-4})).numbers
    assert given["grain_rolling"] == pytest.approx(2.0 * numbers["grain_rolling"])


@pytest.mark.parametrize("engine", find("hopper_discharge").engines)
def test_a_small_bin_stays_shut_and_then_empties_to_its_slopes(engine: str, simulate: Any) -> None:
    one = simulate("hopper_discharge", engine, SMALL)
    run, frames = hopper.read(one), list(one.grains())
    assert run.share[0] == 0.0 and run.height > 0.004 and frames[0].positions[:, 2].min() > 0.001
    assert 0.5 < run.share[-1] < 0.99
    # Those that stay lie at the walls, in two heaps.
    rest = frames[-1].positions[frames[-1].positions[:, 2] > 0.0]
    assert np.mean(np.abs(rest[:, 0] - 0.015) < 0.004) < 0.1
    assert frames[-1].positions[:, 2].min() > -0.1


WALLED = SMALL | {"bin_depth": 0.0075, "ends": "walls"}


@pytest.mark.parametrize("engine", find("hopper_discharge").engines)
def test_front_and_rear_walls_hold_the_grains(engine: str, simulate: Any) -> None:
    one = simulate("hopper_discharge", engine, WALLED | {"discharge_time": 0.04})
    for frame in one.grains():
        # Overlaps of grains of 5 MPa at this speed are below a twentieth of the radius.
        inside = frame.positions[:, 1] - 0.95 * frame.radii, WALLED["bin_depth"] - frame.positions[:, 1] - 0.95 * frame.radii
        assert min(side.min() for side in inside) > 0.0
    # At rest each wall pushes the grains away from itself, and as strongly as the other one.
    rows = one.times()
    rest = (rows["time"] > 0.1) & (rows["time"] < 0.12)
    front, rear = (rows[f"{name}_fy"][rest].mean() for name in ("front", "rear"))
    assert front > 0.0 and front == pytest.approx(-rear, rel=0.1)


def test_the_friction_of_front_and_rear_walls_slows_the_discharge(simulate: Any) -> None:
    """Half of the grains have left later than in a periodic slice that is equal in all else."""
    half = {}
    for ends in ("periodic", "walls"):
        run = hopper.read(simulate("hopper_discharge", "liggghts", WALLED | {"ends": ends, "wall_friction": 0.5}))
        half[ends] = float(np.interp(0.5, run.share, run.times))
    assert half["walls"] > 1.1 * half["periodic"], half


def controls_hopper_discharge(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a discharge an eighth slower", right, verdicts(faster=0.875))
    yield Control("steeper slopes remain", right, verdicts(left=0.2))
    right = judged("hopper_discharge", hopper.study("outlet", points(), "outlet_width"))
    for name, change in {"the discharge rate of a liquid": {"exponent": 1.0},
                         "grains as wide as a third of their diameter": {"k": 0.5}}.items():
        yield Control(name, right, judged("hopper_discharge", hopper.study("outlet", points(**change), "outlet_width")))
    right, liquid = (judged("hopper_discharge", hopper.study("orifice", narrow(one), "outlet_width")) for one in (1.48, 1.0))
    yield Control("the discharge rate of a liquid", right, liquid)
