"""conical_silo: walls are closed, published curves pass, wrong ones fail, and engines empty a small silo alike."""

from __future__ import annotations

import math
import re
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

CASE = find("conical_silo")
silo = module("conical_silo")
NARROW = {name: one for name, one in resolve(CASE, None, "narrow").items() if name in ("grain_count", "barrel_radius", "lip_radius")}


def emptied(faster: float = 1.0, slows: float = 0.04, stay: int = 0, outside: int = 0, vanish: int = 0, **changes: Any) -> Any:
    """A run with the rate that the codes have in mean (or that of Beverloo in other silos), times `faster`, which falls by the part `slows`
    over the window; `stay` grains remain, `outside` are beyond the wall, `vanish` are removed at once."""
    p = defaults("conical_silo", **changes)
    count, published = p["grain_count"], silo.is_published(p)
    start = 0.0 if published else 0.02
    rate = faster * (24600.0 if published else 1500.0 / 8.378e-5 * 0.58 * math.sqrt(9.81) * silo.opening(p) ** 2.5)
    times = np.arange(1, 1301) * (5.2 / 1300 if published else 1.4 * count / rate / 1300)
    span = 3.0 if published else 0.85 * count / rate
    gone = rate * (times - start - 0.5 * slows * np.maximum(times - start, 0.0) ** 2 / span)
    remaining = np.maximum(count - np.floor(np.maximum.accumulate(np.clip(gone, 0.0, count))), stay)
    present = np.interp(times - 0.05, times, remaining, left=float(count)) - vanish * (times > 0.1)
    grains = np.column_stack([np.zeros(1000), np.zeros(1000), np.linspace(0.001, 0.12, 1000)])
    grains[:outside, 0] = 1.01 * p["barrel_radius"]
    frame, rows = SimpleNamespace(positions=grains, masses=np.ones(1000)), {"time": times, "remaining": remaining, "present": present}
    run = SimpleNamespace(parameters=p, times=lambda: rows, grains=lambda: iter([frame]))
    frame.masses *= 1500.0 / silo.bulk_density(run)
    return run


def verdicts(**changes: Any) -> dict[str, Any]:
    return judged("conical_silo", silo.measure([emptied(**changes)]))


def test_the_published_curves_say_what_they_are_quoted_for() -> None:
    codes = silo.published()
    assert [codes[code].rate().value for code in silo.SLOPES] == pytest.approx([24245.2, 24501.5, 24391.8], abs=0.1)
    assert codes["musen"].when(1000) == pytest.approx(4.187, abs=0.002) and codes["peclet_hertz"].at(2.0) == 50878
    assert all(0.955 < code.late_over_early().value < 0.963 for code in codes.values())


def test_a_run_like_the_published_ones_passes() -> None:
    found = verdicts()
    assert {"rate", "late_over_early", "left_1", "left_2", "left_3", "last_percent", "leaked", "unaccounted"} <= names(found, "pass"), found
    assert found["rate"]["reference"] == pytest.approx(24380.0, abs=1.0) and "steadiness" not in found


def test_another_silo_or_material_is_not_compared_with_it() -> None:
    for changes in ({"lip_radius": 0.02}, {"friction": 0.4}, {"sides": 8}, NARROW):
        assert verdicts(**changes)["rate"]["reference"] is None
    assert verdicts(softening=100.0)["rate"]["reference"] is not None


def test_the_walls_are_a_closed_polygon_with_its_corners_on_the_radius() -> None:
    made = prepare(CASE, resolve(CASE))
    corners = made.meshes["shell"].reshape(-1, 3)
    radius, height = np.hypot(corners[:, 0], corners[:, 1]), corners[:, 2]
    assert radius == pytest.approx(np.minimum(0.1, 0.03 + height), abs=1e-12) and height.min() == 0.0
    # Each edge belongs to two triangles, but for those of the lip and of the upper end.
    number = np.unique(corners, axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.vstack([number[:, [0, 1]], number[:, [1, 2]], number[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 1).sum() == 200


def test_grains_begin_without_contacts_inside_of_the_walls() -> None:
    made = prepare(CASE, resolve(CASE, None, "narrow"))
    assert made.packing is not None
    places, d = made.packing.positions, 0.004
    radius = np.hypot(places[:, 0], places[:, 1])
    assert (radius < 0.04 * math.cos(math.pi / 40) - 0.5 * d).all() and places[:, 2].min() > 0.5 * d
    assert (((0.02 + places[:, 2]) * math.cos(math.pi / 40) - radius) / math.sqrt(2.0) > 0.5 * d).all()
    assert len(places) == 2500


def test_a_softened_modulus_makes_the_step_longer_and_nothing_else() -> None:
    hard, soft = (prepare(CASE, resolve(CASE, None, None, {"softening": value})) for value in (1.0, 100.0))
    assert soft.time_step == pytest.approx(10.0 * hard.time_step) and hard.time_step == pytest.approx(1.5e-6, rel=0.02)
    assert soft.numbers["modulus"] == 1e7 and soft.steps * soft.time_step == pytest.approx(hard.steps * hard.time_step, rel=0.01)


def test_the_rate_of_the_narrow_silo_gives_the_constant_and_exponent_of_beverloo() -> None:
    found = verdicts(**NARROW, slows=0.0)
    assert found["steadiness"]["verdict"] == "pass" and found["steadiness"]["value"] == pytest.approx(1.0, abs=0.02)
    assert found["beverloo_c"]["value"] == pytest.approx(0.58, rel=0.01)
    assert judged("conical_silo", silo.study("outlet", points(), "lip_radius"))["exponent"]["value"] == pytest.approx(2.5)


def points(exponent: float = 2.5) -> list[dict[str, Any]]:
    """Rates that grow with this power."""
    silos = [defaults("conical_silo", lip_radius=radius) for radius in (0.012, 0.016, 0.02)]
    return [point(p, {"rate": 1e3 * (silo.opening(p) / silo.opening(silos[0])) ** exponent}, part=0.01, variant="") for p in silos]


def softened(soft: float = 1.0) -> dict[str, Any]:
    """The verdict of the study of stiffness, when the softest grains flow `soft` times as fast."""
    runs = [point(defaults("conical_silo", softening=value), {"rate": 7000.0 * part}, part=0.005, variant="")
            for value, part in ((1.0, 1.0), (10.0, 1.0), (100.0, soft))]
    return judged("conical_silo", silo.study("stiffness", runs, "softening"))


SMALL = {"grain_count": 600, "barrel_radius": 0.026, "lip_radius": 0.015, "sides": 30, "softening": 200, "time_step_fraction": 0.2,
         "settle_time": 0.05}


@pytest.mark.parametrize("engine", CASE.engines)
def test_a_small_silo_stays_shut_and_then_empties(engine: str, simulate: Any) -> None:
    one = simulate("conical_silo", engine, SMALL)
    run, rows = silo.read(one), one.times()
    assert rows["remaining"][0] == 600 and run.left[-1] < 12 and (np.diff(run.left) <= 0).all()
    assert silo.leaked(one) == 0 and silo.unaccounted(one) == 0.0
    # From rest, and dense.
    first = next(iter(one.grains()))
    assert np.median(np.abs(first.velocities)) < 9.81 * rows["time"][0] and 1300.0 < silo.bulk_density(one) < 1600.0
    # At the end of the run few grains are still falling below the lip.
    assert rows["present"][-1] < 200 and run.rate().value == pytest.approx(2900.0, rel=0.2)


@pytest.mark.parametrize("engine", CASE.engines)
def test_hard_grains_lie_as_softened_ones_do(engine: str, simulate: Any) -> None:
    """They settle softly. By their overlaps, two hundred times the modulus at once threw them up."""
    soft, hard = (next(iter(simulate("conical_silo", engine, SMALL | {"softening": value, "duration": 0.02}).grains()))
                  for value in (200.0, 1.0))
    assert hard.positions[:, 2].mean() == pytest.approx(soft.positions[:, 2].mean(), rel=0.01)
    assert np.abs(hard.positions - soft.positions).max() < 0.001


@pytest.mark.parametrize("engine", CASE.engines)
def test_a_run_that_has_lost_grains_resumes_exactly(engine: str, decks: Any, tmp_path: Path) -> None:
    one = decks("conical_silo", engine, tmp_path / engine, SMALL | {"grain_count": 200})
    one.run(restart_every=1000)
    before = {name: (one.folder / name).read_bytes() for name in ("time.csv", "grains.dump")}
    assert one.replica().times()["present"][-1] < 200
    assert re.search(r"dembark: resumed at step \d+ exactly", one.run(restart_every=1000, resume="yes"))
    assert {name: (one.folder / name).read_bytes() for name in before} == before


def controls_conical_silo(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("an outlet 2 mm narrower", right, verdicts(faster=(0.0524 / 0.0544) ** 2.5))
    yield Control("a silo that slows down by a tenth", right, verdicts(slows=0.15))
    right = verdicts(**NARROW)
    yield Control("a silo that slows down by a third", right, verdicts(**NARROW, slows=0.5))
    yield Control("a rate a third higher", right, verdicts(**NARROW, faster=4.0 / 3.0))
    yield Control("a cone that holds grains", right, verdicts(**NARROW, stay=50))
    yield Control("a grain in the wall", right, verdicts(**NARROW, outside=1))
    yield Control("grains that vanish above the lip", right, verdicts(**NARROW, vanish=100))
    outlet = judged("conical_silo", silo.study("outlet", points(), "lip_radius"))
    yield Control("the rate of a liquid", outlet, judged("conical_silo", silo.study("outlet", points(2.0), "lip_radius")))
    yield Control("grains that are too soft", softened(), softened(1.05))
