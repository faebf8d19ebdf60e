"""penetration: beds settle without contact forces of another modulus, the public one is as published, and wrong physics is seen."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dembark.input_decks.tests.measuring import Control, Verdicts, defaults, judged, module, names
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

CASE = find("penetration")
penetration = module("penetration")
# A bed of 9.5 mm on the same floor, into which a smaller ball falls at 1.7 m/s: it comes to rest within 34 ms without touching the floor.
SMALL: dict[str, Any] = {
    "grain_count": 800, "box_length": 0.026, "box_width": 0.026, "ball_diameter": 0.01, "ball_height": -0.04, "ball_speed": 1.5,
    "duration": 0.034, "time_step": 4e-6, "fall_time": 0.08, "relax_time": 0.01}
WRONG: dict[str, dict[str, float]] = {
    "half the density of the ball": {"steel_density": 3600.0}, "no friction": {"friction": 0.0, "grain_steel_friction": 0.0}}
# Where three packings of the small bed decide; what scatters by more than the tolerance is open.
SEEN = {"half the density of the ball": {"height_28"}, "no friction": {"height_24", "height_28"}}
FLIGHT = {"height_24", "height_28", "deepest_point", "deepest_time", "height_40", "rebound_speed"}


@pytest.fixture(scope="module")
def finished(simulate: Any) -> Any:
    """Runs on the small bed by (engine, seed, what is wrong), each done once."""
    return cache(lambda engine, seed, wrong="", **changes: simulate("penetration", engine,
                                                                    SMALL | WRONG.get(wrong, {}) | {"seed": seed} | changes))


def packings(finished: Any, wrong: str = "") -> list[Any]:
    return [finished("liggghts", seed, wrong) for seed in (1, 2, 3)]


def begun(seed: int = 1, **changes: Any) -> Any:
    """Centres (n, 3) in m of the grains at the start of a run."""
    packed = deck.prepare(CASE, resolve(CASE, None, None, {"seed": seed, **changes})).packing
    assert packed is not None
    return packed.positions


def test_a_cloud_fills_its_part_of_the_box_without_contacts_and_depends_on_its_seed() -> None:
    places = begun(**SMALL)
    assert not cKDTree(places).query_pairs(0.002)
    low, high = places.min(axis=0) - 0.001, places.max(axis=0) + 0.001
    assert (low >= [-0.013, -0.013, -0.0902431]).all() and (high[:2] <= 0.013).all()
    assert 800 * np.pi / 6.0 * 0.002**3 / (0.026**2 * (high[2] + 0.0902431)) == pytest.approx(0.2, rel=0.01)
    assert np.array_equal(places, begun(**SMALL)) and not np.allclose(places, begun(2, **SMALL))


def test_the_public_bed_is_the_published_one() -> None:
    """25 000 grains at rest: a little above four contacts each, with overlaps of less than a micrometre, up to z = -55.5 mm."""
    places = begun(bed="public")
    pairs = cKDTree(places).query_pairs(0.002, output_type="ndarray")
    overlaps = 0.002 - np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
    assert 2.0 * len(pairs) / 25000 == pytest.approx(4.31, abs=0.005) and 8e-7 < overlaps.max() < 9.1e-7
    walls = np.array([0.048, 0.029])
    assert (np.abs(places[:, :2]) < walls + 1e-6).all() and places[:, 2].min() > -0.0892431 - 1e-6
    assert places[:, 2].max() + 0.001 == pytest.approx(-0.0555, abs=1e-4)


@pytest.mark.parametrize("engine", [pytest.param(one, marks=pytest.mark.full if one == "yade" else ()) for one in CASE.engines])
def test_a_bed_settles_and_the_ball_falls_freely_onto_it(engine: str, finished: Any) -> None:
    run = finished(engine, 1, duration=0.0242)
    (free,) = (one for name, one in judged("penetration", penetration.measure([run])).items() if name == "free_flight")
    assert free["verdict"] == "pass" and 0.0 < free["value"] < 1e-12
    found, frame = penetration.bed(run), run.grains()[0]
    assert 0.5 < found["solid_fraction"] < 0.6 and 0.0085 < found["bed_height"] < 0.0105
    assert np.sqrt((frame.velocities[:-1] ** 2).sum(axis=1).mean()) < 0.01 * SMALL["ball_speed"]
    # With the modulus of the falling grains overlaps would be 14 times larger.
    pairs = cKDTree(frame.positions[:-1]).query_pairs(0.002, output_type="ndarray")
    overlaps = 0.002 - np.linalg.norm(frame.positions[pairs[:, 0]] - frame.positions[pairs[:, 1]], axis=1)
    assert len(pairs) > 1000 and np.median(overlaps) < 2e-7
    # The bed stops the ball.
    rows = run.times()
    assert rows["ball_height"][-1] > SMALL["ball_height"] - 1.5 * 0.0242 - 4.905 * 0.0242**2 + 1e-4


@pytest.mark.full
@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_physics_is_seen(wrong: str, finished: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against the mean of right runs, which stands for the published ones here, and within the tolerances of those."""
    right = [penetration.flight(run.times()["time"], run.times()["ball_height"]) for run in packings(finished)]
    known = {name: [float(np.mean([run[name] for run in right]))] * 2 for name in right[0] if name in CASE.quantities}
    monkeypatch.setattr(penetration, "published", lambda: known)
    monkeypatch.setattr(penetration, "of_packings", lambda: dict.fromkeys(known, 0.0))
    monkeypatch.setattr(penetration, "another", lambda _: "")
    assert not names(judged("penetration", penetration.measure(packings(finished))), "fail")
    assert SEEN[wrong] <= names(judged("penetration", penetration.measure(packings(finished, wrong))), "fail")


def written(heights: list[Any], bed: str = "settled", until: float = 0.045) -> list[Any]:
    """Runs of which each has its heights (m) of the ball, one each millisecond from 1 ms on."""
    places = begun(**SMALL)
    frame = SimpleNamespace(ids=np.arange(1, len(places) + 1), positions=places, radii=np.full(len(places), 0.001))
    times = 1e-3 * np.arange(1, round(1e3 * until) + 1)
    values = resolve(CASE, None, None, {"bed": bed})
    return [SimpleNamespace(parameters=values, derived={"first": 0}, grains=lambda: [frame], times=lambda one=one: {
        "step": np.arange(1, len(times) + 1), "time": times, "ball_height": np.asarray(one)[: len(times)]}) for one in heights]


def test_each_run_of_the_public_bed_passes_and_the_mean_of_the_other_beds_fails() -> None:
    mean, runs = penetration.table("dosta_2024_height.csv")[:, 1], penetration.table("dosta_2024_public.csv")[:, 1:].T
    for run in runs:
        assert not names(judged("penetration", penetration.measure(written([run], "public"))), "fail")
    wrong = names(judged("penetration", penetration.measure(written([mean], "public"))), "fail")
    assert {"public_22", "public_24", "public_26", "public_28", "public_29", "public_40", "public_rebound"} <= wrong


def test_one_packing_decides_nothing_and_a_short_run_measures_what_it_has() -> None:
    found = judged("penetration", penetration.measure(written([penetration.table("dosta_2024_height.csv")[:, 1]], until=0.030)))
    assert found.keys() & FLIGHT == {"height_24", "height_28"} and found["height_28"]["verdict"] == "info"


def test_the_code_that_the_authors_leave_out_and_the_public_bed_do_not_count() -> None:
    known = penetration.published()
    assert len(known["deepest_point"]) == 7
    # The mean of MUSEN with its first packing would be -60.045 mm.
    assert min(known["height_24"]) > -0.06006 and any(value == pytest.approx(-0.0600254) for value in known["height_24"])


def test_the_mean_of_the_codes_is_known_as_well_as_their_packings_are() -> None:
    found = judged("penetration", penetration.measure(written([penetration.table("dosta_2024_height.csv")[:, 1]])))
    halves = {name: 0.5 * float(np.diff(found[name]["reference_interval"])[0]) for name in FLIGHT}
    due = {"height_24": 5.9e-5, "height_28": 1.2e-4, "deepest_point": 1.3e-4, "deepest_time": 2.8e-4, "height_40": 1.11e-3,
           "rebound_speed": 0.109}
    assert halves == {name: pytest.approx(half, rel=0.02) for name, half in due.items()}


@pytest.mark.parametrize("changes", [{"gravity": 1.62}, {"ball_diameter": 0.01}, {"friction": 0.1}, {"box_width": 0.07}])
def test_of_other_problems_no_flight_is_judged(changes: dict[str, float]) -> None:
    assert {name for name, value in penetration.DOSTA.items() if value != CASE.parameters[name].value} == set()
    runs = written([factor * penetration.table("dosta_2024_height.csv")[:, 1] for factor in (1.0 - 1e-5, 1.0, 1.0 + 1e-5)])
    # Three equal times, read each millisecond, are known to nearly half of one.
    found = judged("penetration", penetration.measure(runs))
    assert names(found, "pass") >= FLIGHT - {"deepest_time"} and np.diff(found["deepest_time"]["interval"]) == pytest.approx(0.95e-3)
    for run in runs:
        run.parameters |= changes
    found = judged("penetration", penetration.measure(runs))
    assert {found[name]["reason"] for name in FLIGHT} == {f"not the published problem: another {next(iter(changes))}"}


def test_a_bed_too_low_for_its_window_has_no_solid_fraction() -> None:
    (run,) = written([penetration.table("dosta_2024_height.csv")[:, 1]])
    run.grains()[0].positions = np.array([[0.0, 0.0, run.parameters["floor"] + 0.001]] * 800)
    found = judged("penetration", penetration.measure([run]))["solid_fraction"]
    assert found["value"] is None and "too low" in found["reason"]


TOUCH = 0.021  # s


def ball(bed: str = "settled", *, gravity: float = 1.0, depth: float = 1.0, duration: float = 1.0, rebound: float = 1.0,
         other: bool = False) -> Verdicts:
    """What the case measures of three packings, or of the public one; each number is a factor that is 1 for the published heights."""
    p = defaults("penetration", bed=bed)
    table = penetration.table("dosta_2024_height.csv" if bed == "settled" or other else "dosta_2024_public.csv")
    known = table[:, 1] if bed == "settled" or other else table[:, 1:].mean(axis=1)
    time = np.arange(2e-4, 0.0451, 2e-4)

    def free(at: Any, g: float) -> Any:
        return p["ball_height"] - p["ball_speed"] * at - 0.5 * g * at**2

    after = np.interp(TOUCH + (time - TOUCH) / duration, table[:, 0], known)
    touched = free(TOUCH, p["gravity"])
    after = touched + depth * (after - touched)
    lowest = int(np.argmin(after))
    after[lowest:] = after[lowest] + rebound * (after[lowest:] - after[lowest])
    path = np.where(time < TOUCH, free(time, gravity * p["gravity"]), after)
    up = p["floor"] + 0.03 * (np.arange(p["grain_count"]) + 0.5) / p["grain_count"]
    frame = SimpleNamespace(ids=np.ones(len(up), dtype=int), positions=np.stack([0.0 * up, 0.0 * up, up], axis=1),
                            radii=np.full(len(up), 0.5 * p["grain_diameter"]))

    def written(shift: float) -> Any:
        rows = {"step": 1 + np.arange(len(time)), "time": time, "ball_height": path + shift * (time > TOUCH) * time / TOUCH}
        return SimpleNamespace(parameters=p, derived={"first": int((time < TOUCH).sum())}, grains=lambda: [frame], times=lambda: rows)

    return judged("penetration", penetration.measure([written(shift) for shift in ((-1e-5, 0.0, 1e-5) if bed == "settled" else (0.0,))]))


def controls_penetration(_folder: Path) -> Iterator[Control]:
    right = ball()
    yield Control("gravity off by 15 %", right, ball(gravity=1.15))
    yield Control("a ball that is stopped after seven tenths of the distance", right, ball(depth=0.7))
    yield Control("a bed that takes 1.4 times as long to stop it", right, ball(duration=1.4))
    yield Control("a bed that returns twice the speed", right, ball(rebound=2.0))
    right = ball("public")
    yield Control("another bed than the public one", right, ball("public", other=True))
    yield Control("a public bed that stops the ball after nine tenths of the distance", right, ball("public", depth=0.9))
