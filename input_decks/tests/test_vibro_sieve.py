"""vibro_sieve: passages that are put in are measured as they are, wrong ones fail, and the engines keep the oversize on the screen."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.momentum import unexplained_energy
from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

sieve = module("vibro_sieve")
D, BELOW, COUNT = 0.005, -0.004, 240


def screened(*, rate: float = 0.2, tiring: float = 0.0, through: int = 0, fallen: int = 0, lost: float = 0.0, width: float = 2.0,
             seed: int = 0, **changes: Any) -> Any:
    """A run in which each undersize grain passes at random with a `rate` (1/period), which falls by the part `tiring` from period to
    period; `through`: oversize grains that pass; `fallen`: grains that are below the pan at the end."""
    given = defaults("vibro_sieve", **changes)
    random, oversize = np.random.default_rng(seed), np.arange(COUNT) < 24
    hazard = rate * (1.0 - tiring) ** np.arange(given["periods"])
    periods = np.concatenate([[0.0], np.cumsum(hazard)])
    # When the sum of the rates reaches a number with an exponential distribution; those that never do stay.
    when = np.interp(random.exponential(size=COUNT), periods, np.arange(len(periods)), right=np.inf)
    when[oversize] = np.where(np.arange(24) < through, 5.5, np.inf)
    frames = []
    for step in range(given["periods"] * PHASES + 1):
        places = np.column_stack([np.full(COUNT, 0.2), np.zeros(COUNT), np.where(when <= step / PHASES, -0.07, 0.01)])
        if step == given["periods"] * PHASES:
            places[:fallen, 2] = -1.0
        frames.append(frame_of(places, 0.5 * D * np.where(oversize, given["oversize_ratio"], 1.0), step=10 * step))
    rows = {name: np.zeros(300) for name in ("other", "imposed")} | {"balance": np.full(300, lost), "scale": np.ones(300)}
    return SimpleNamespace(folder="run", parameters=given, derived={"period_steps": 10 * PHASES, "below": BELOW, "width": width},
                           time_step=1e-4, grains=lambda: frames, times=lambda: rows)


def verdicts(packings: int = 5, **changes: Any) -> dict[str, Any]:
    return judged("vibro_sieve", sieve.measure([screened(seed=seed, **changes) for seed in range(packings)]))


def studied(*rates: float, half: float = 0.01, gamma: float = 3.0) -> dict[str, Any]:
    """Slots of three widths with these rates."""
    points = [point(defaults("vibro_sieve", aperture=aperture, motion_gamma=gamma), {"rate": rate}, half)
              for aperture, rate in zip((0.0055, 0.00625, 0.0075), rates, strict=True)]
    return judged("vibro_sieve", sieve.study("aperture", points, "aperture"))


def test_a_rate_is_measured_as_it_is() -> None:
    found = verdicts(10)
    assert found["rate"]["value"] == pytest.approx(0.2, abs=0.02)
    assert found["chance"]["reference"] == pytest.approx(0.125)
    assert names(found, "pass") == {"energy_balance", "oversize_passed", "grains_lost", "order", "chance"}


def test_grains_that_never_pass_have_the_rate_0() -> None:
    assert sieve.rate(np.full(10, 50)) == 0.0 and math.isnan(sieve.rate(np.zeros(10, np.int64)))


def test_a_screen_from_which_all_have_passed_has_no_ratio_and_no_verdict() -> None:
    assert math.isnan(sieve.halves_ratio(np.zeros(10, np.int64)))
    assert verdicts(3, rate=1e3)["order"]["verdict"] == "info"


def test_the_ratio_of_the_halves_is_1_of_an_exponential() -> None:
    left = np.round(1e6 * np.exp(-0.1 * np.arange(60)))
    assert sieve.halves_ratio(left) == pytest.approx(1.0, abs=2e-3)
    # As many in each period: few are left in the later half, which pass at a greater rate.
    assert sieve.halves_ratio(np.arange(60, 9, -1)) > 1.5


def test_one_packing_decides_neither_chance_nor_order() -> None:
    assert names(verdicts(1), "pass") == {"energy_balance", "oversize_passed", "grains_lost"}


def test_a_step_within_its_interval_decides_nothing() -> None:
    assert studied(0.1, 0.2, 0.21, half=0.02)["rate_falls"]["verdict"] == "info"


def test_grains_on_top_of_each_other_are_not_asked_for_one_rate() -> None:
    found = verdicts(10, width=1.0, tiring=0.1)
    # 216 grains of 5 mm, 24 of 11 mm.
    assert found["coverage"]["value"] == pytest.approx(1.344) and found["order"]["verdict"] == "info" and "wait" in found["order"]["reason"]


def test_a_screen_that_never_throws_is_asked_for_no_rate() -> None:
    found = verdicts(10, motion_gamma=0.9) | studied(0.3, 0.2, 0.1, gamma=0.9)
    for name in ("order", "chance", "rate_falls"):
        assert found[name]["verdict"] == "info" and "stay where they lie" in found[name]["reason"], name


def test_flights_longer_than_a_period_leave_the_chance_open() -> None:
    found = verdicts(10, motion_gamma=4.0, rate=0.05)
    assert found["chance"]["verdict"] == "info" and "more than a period" in found["chance"]["reason"]
    assert verdicts(10, motion_gamma=3.2)["chance"]["verdict"] == "pass"


def test_bars_and_slots_have_their_widths() -> None:
    case = find("vibro_sieve")
    values = resolve(case, "quick", "thin")
    made = deck.prepare(case, values)
    bars = made.meshes["screen"].reshape(-1, 6, 3)[..., 0]
    low, high = bars.min(axis=1), bars.max(axis=1)
    assert low[0] == 0.0 and high[-1] == pytest.approx(made.numbers["width"])
    np.testing.assert_allclose(low[1:] - high[:-1], 0.00625)
    np.testing.assert_allclose((high - low)[1:-1], 0.00375)


def test_a_set_up_has_the_grains_that_it_is_asked_for() -> None:
    case = find("vibro_sieve")
    packed = deck.prepare(case, resolve(case, None, "thin")).packing
    assert packed is not None
    assert (packed.diameters > 1.5 * D).sum() == 24 and len(packed.diameters) == COUNT and not packed.positions[:, 1].any()
    apart = np.linalg.norm(packed.positions[:, None] - packed.positions, axis=2) - 0.5 * (packed.diameters[:, None] + packed.diameters)
    assert (apart[~np.eye(len(apart), dtype=bool)] > 0.0).all() and (packed.positions[:, 2] > 0.5 * packed.diameters).all()


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_screen_keeps_the_oversize(engine: str, simulate: Any) -> None:
    """A narrow one; undersize passes, all grains stay in their plane and in the bin, and all work is accounted for."""
    run = simulate("vibro_sieve", engine, {"grain_count": 30, "slots": 6, "oversize_part": 0.3, "aperture": 0.009, "periods": 8,
                                          "drop": 0.05, "settle_time": 0.15})
    assert unexplained_energy(run.times()) < 1e-10
    found = sieve.read(run)
    assert found.through == 0 and found.lost == 0 and found.on[-1] < 21
    for frame in run.grains():
        assert len(frame.ids) == 30 and (frame.positions[:, 1] == 0.0).all()


def controls_vibro_sieve(_folder: Path) -> Iterator[Control]:
    right = verdicts(10) | studied(0.1, 0.2, 0.3)
    yield Control("a billionth of the works that nothing explains", right, verdicts(lost=1e-9))
    yield Control("slots wider than the oversize", right, verdicts(through=1))
    yield Control("a grain that falls through the pan", right, verdicts(fallen=1))
    yield Control("grains that tire", right, verdicts(tiring=0.1))
    yield Control("grains that pass only every other period", right, verdicts(rate=0.5 * -math.log1p(-0.125)))
    yield Control("rates in the reverse order", right, studied(0.3, 0.2, 0.1))
