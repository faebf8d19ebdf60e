"""dropped_container: known rebounds are measured as they are, wrong physics fails, and a free container bounces and bears its grains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc import DumpError

container = module("dropped_container")
G, HEIGHT, RELEASE, LANDING = 9.81, 0.1, 0.05, 4e-4
RATIOS = (0.0, 0.5, 1.0, 1.5, 2.0)


def dropped(restitution: float = 0.7, ratio: float = 0.0, lost: float = 0.0, felt: float = 1.0, **changes: Any) -> Any:
    """A container that is held for 0.05 s, falls from 0.1 m, touches the plate for 0.4 ms and leaves it with `restitution` of its speed;
    its grains do 0.05 J of work on it, of which it feels the part `felt`; `lost`: share of all works that no force explains."""
    p = defaults("dropped_container", mass_ratio=ratio, **changes)
    fall = math.sqrt(2.0 * HEIGHT / G)
    speed = G * fall
    time = np.arange(1, 8001) * 1e-4
    past = time - RELEASE - fall
    up = np.maximum(past - LANDING, 0.0) % max(2.0 * restitution * speed / G, 1e-9)
    height = np.where(past < 0.0, HEIGHT - 0.5 * G * np.maximum(time - RELEASE, 0.0) ** 2, restitution * speed * up - 0.5 * G * up**2)
    rows = {"time": time, "step": np.arange(1, 8001), "height": height, "plate_fz": np.where((past >= 0.0) & (past <= LANDING), 500.0, 0.0),
            "walls": np.linspace(0.0, 0.05, 8000) * (ratio > 0.0), "imposed": np.zeros(8000), "scale": np.ones(8000),
            "balance": np.full(8000, lost)}
    rows["other"] = -felt * rows["walls"]
    return SimpleNamespace(folder="run", parameters=p, derived={"grain_mass": 0.07 * ratio, "release": 500}, times=lambda: rows)


def verdicts(*runs: Any) -> dict[str, Any]:
    return judged("dropped_container", container.measure(runs))


def packings(*rebounds: float, ratio: float = 2.0) -> dict[str, Any]:
    return verdicts(*(dropped(math.sqrt(one), ratio) for one in rebounds))


@settings(deadline=None)
@given(st.floats(0.1, 1.0))
def test_a_known_rebound_is_measured_as_it_is(restitution: float) -> None:
    found = verdicts(dropped(restitution, steel_restitution=restitution))
    assert found["rebound"]["value"] == pytest.approx(restitution**2, abs=1e-3)
    assert names(found, "pass") == {"energy_balance", "empty_rebound"}
    assert found["contact_time"]["value"] == pytest.approx(LANDING, abs=1.1e-4)


def test_the_rebound_is_judged_from_a_ratio_of_two_on() -> None:
    assert packings(1e-3, 2e-3, 1.5e-3)["damped_rebound"]["verdict"] == "pass"
    assert packings(0.02, 0.021, 0.02)["damped_rebound"]["verdict"] == "fail"
    assert packings(1e-3, 1e-2, 5e-3)["damped_rebound"]["verdict"] == "info"
    assert "damped_rebound" not in packings(1e-3, 2e-3, 1.5e-3, ratio=1.5)


def test_a_container_that_never_lands_is_refused() -> None:
    run = dropped()
    run.times()["plate_fz"][:] = 0.0
    with pytest.raises(DumpError, match="does not touch the plate"):
        verdicts(run)


def masses(rebounds: Sequence[float]) -> dict[str, Any]:
    """The study, of rebounds at RATIOS, known to 0.005."""
    points = [point(defaults("dropped_container", mass_ratio=ratio), {"rebound": one}, 0.005)
              for ratio, one in zip(RATIOS, rebounds, strict=True)]
    return judged("dropped_container", container.study("ratio", points[::-1], "mass_ratio"))


def linear(vanishes: float, restitution: float = 0.7) -> list[float]:
    """Rebounds of a container whose speed after the impact falls linearly with the mass of its grains."""
    return [(restitution * max(1.0 - ratio / vanishes, 0.0)) ** 2 for ratio in RATIOS]


@settings(deadline=None)
@given(st.floats(1.1, 3.0), st.floats(0.3, 0.9))
def test_the_ratio_at_which_a_rebound_vanishes_is_found(vanishes: float, restitution: float) -> None:
    assert masses(linear(vanishes, restitution))["vanishing_ratio"]["value"] == pytest.approx(vanishes, rel=1e-9)


def test_the_published_ratio_passes_and_others_fail() -> None:
    assert masses(linear(1.5))["vanishing_ratio"]["verdict"] == "pass"
    assert masses(linear(2.0))["vanishing_ratio"]["verdict"] == masses(linear(1.1))["vanishing_ratio"]["verdict"] == "fail"


SMALL = {"container_radius": 0.0132, "container_mass": 0.02, "drop_height": 0.02, "settle_time": 0.1, "youngs_modulus": 2e7,
         "steel_youngs_modulus": 1e9, "frames": 10}


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_an_empty_container_bounces_with_its_restitution(engine: str, simulate: Any) -> None:
    found = verdicts(simulate("dropped_container", engine, SMALL | {"mass_ratio": 0.0}))
    assert names(found, "pass") == {"energy_balance", "empty_rebound"}
    assert found["rebound"]["value"] == pytest.approx(0.49, abs=0.005)


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_grains_fall_with_their_container_and_take_its_momentum(engine: str, simulate: Any) -> None:
    """Held, it bears their weight and stays; let go, it falls freely, for they are weightless in it; and what all of them lose in momentum
    is the plate's impulse."""
    run = simulate("dropped_container", engine, SMALL | {"mass_ratio": 2.0, "settle_time": 0.3})
    rows, p = run.times(), run.parameters
    held = rows["step"] <= run.derived["release"]
    weight = run.derived["grain_mass"] * p["gravity"]
    assert rows["height"][held] == pytest.approx(p["drop_height"], abs=1e-12)
    assert -rows["vessel_fz"][held][-held.sum() // 10:].mean() == pytest.approx(-weight, rel=0.02)
    falls = ~held & (np.arange(len(held)) < np.argmax(rows["plate_fz"] > 0.0))
    past = rows["time"][falls] - run.derived["release"] * run.time_step
    # Grains that were pressed together push the floor once more.
    assert rows["height"][falls] == pytest.approx(p["drop_height"] - 0.5 * p["gravity"] * past**2, abs=0.05 * p["drop_height"])
    assert (rows["vessel_fz"][falls][len(past) // 2:] < 0.1 * weight).all()
    found = verdicts(run)
    assert {"energy_balance", "reaction_gap"} <= names(found, "pass") and found["rebound"]["value"] < 0.1


def controls_dropped_container(_folder: Path) -> Iterator[Control]:
    empty, none = verdicts(dropped()), packings(1e-3, 2e-3, 1.5e-3)
    yield Control("a billionth of the works that nothing explains", empty, verdicts(dropped(lost=1e-9)))
    yield Control("a container that does not feel a tenth of its grains", none, verdicts(dropped(0.03, 2.0, felt=0.9)))
    yield Control("an empty container that loses a tenth more of its speed", empty, verdicts(dropped(0.63)))
    yield Control("grains that are glued to the container", none, packings(0.48, 0.49, 0.5))
    yield Control("grains that stick where they land", masses(linear(1.5)), masses(linear(1.0)))
