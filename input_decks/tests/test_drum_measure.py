"""What is measured of a drum is what was put into the files, and what is wrong in them fails."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.debarking_drum.debarked import force_bound
from dembark.input_decks.debarking_drum.drum_impacts import Drum, _along_shell, estimates, read
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.postproc import DumpError
from dembark.postproc.impacts import COLUMNS
from dembark.postproc.replica import Replica
from dembark.postproc.resampling import Array
from dembark.postproc.tests.dumps import grains_text, write_times
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

drum = module("debarking_drum")
LOGS, TURNS, RUN_IN, SPEED = 40, 4, 1, 1.2
POWER = 1000.0
PERIOD, ROWS = 2.0 * np.pi / SPEED, 200


def parameters(**changes: Any) -> dict[str, Any]:
    return defaults("debarking_drum", log_count=LOGS, revolutions=TURNS, run_in=RUN_IN, drum_speed=SPEED, filling=0.3) | changes


def derived(**changes: Any) -> dict[str, Any]:
    return deck.derived(deck.prepare(find("debarking_drum"), parameters(**changes)))


def replica(folder: Path, *, seed: int = 0, certificate: float = 1e-15, leak: float = 0.0, lift: float = 1.0,
            stored: float = 0.0, hits: int = 300, speed: float = 0.5, scale: float = 1.0, **changes: float) -> Replica:
    """A drum that takes POWER and loses it, but for a share `leak` that vanishes; in every quarter `hits` impacts of at least 0.1 m/s.
    `stored` (J): growth of the kinetic energy over the run; there are a third as many slow contacts, with huge forces."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(seed)
    numbers = derived(**changes) | {"every": 10}
    rows = ROWS * (TURNS + RUN_IN)
    row, count = PERIOD / ROWS, np.arange(1, rows + 1)
    lost = POWER * (1.0 - leak) * row * count
    kinetic = 50.0 + stored * count / rows
    weight = numbers["load_weight"]
    write_times(folder / "time.csv", {
        "step": count * 10, "time": count * row, "kinetic_energy": kinetic, "shell_fx": 0.0 * count, "shell_fy": 0.0 * count,
        "shell_fz": lift * weight + random.normal(0.0, 0.001 * weight, rows), "potential_energy": 0.0 * count,
        "elastic_energy": 0.0 * count,
        "dissipated_energy": lost - (kinetic - 50.0), "torque": np.full(rows, POWER / SPEED), "contacts": 60 + 0 * count,
        "active": 50 + 0 * count,
        "begun": 5 * count, "impulse_sum": 7.0 * count, "pivots": 20 * count, "certificate": np.full(rows, certificate),
        "peak_force": 1e4 + 0.0 * count})
    quarters = 4 * (TURNS + RUN_IN)
    begin = (np.arange(quarters).repeat(hits) + random.random(quarters * hits)) * PERIOD / 4.0
    slow = begin[::3]
    time = np.concatenate([begin, slow])
    approach = np.concatenate([np.full(len(begin), speed), np.full(len(slow), 0.05)])
    peak = np.concatenate([scale * 1000.0 * np.exp(random.normal(0.0, 1.0, len(begin))), np.full(len(slow), 1e6)])
    radius = numbers["inner_radius"]
    angle = np.radians(random.uniform(0.0, 90.0, len(time)))
    partner = np.where(random.random(len(time)) < 0.25, -1, 3)
    none = 0.0 * time
    table = np.column_stack([np.ones(len(time)), partner, time, np.full(len(time), 0.005), peak, np.ones(len(time)), approach,
                             np.ones(len(time)), -radius * np.sin(angle), none, -radius * np.cos(angle), np.full(len(time), 0.5), none,
                             none, np.ones(len(time)), random.uniform(-9.0, 9.0, len(time)), none])
    np.savetxt(folder / "impacts.txt", table, fmt=["%d", "%d", *["%.12g"] * 15], header=" ".join(COLUMNS))
    radii, place = np.full(LOGS, 0.09), np.column_stack([np.arange(LOGS), 0.0 * np.arange(LOGS), 0.0 * np.arange(LOGS)])
    (folder / "grains.dump").write_text(grains_text(0, place, radii, masses=np.full(LOGS, 20.0)))
    return Replica(folder, {"parameters": parameters(**changes), "derived": numbers, "time_step": PERIOD / (10 * ROWS)})


@pytest.fixture(autouse=True)
def _no_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    """The files here hold no logs to draw."""
    monkeypatch.setattr(drum, "fields", lambda _: None)


def measured(*replicas: Replica) -> dict[str, dict[str, Any]]:
    return judged("debarking_drum", drum.measure(replicas))


def test_what_was_put_in_is_measured(tmp_path: Path) -> None:
    found = measured(replica(tmp_path))
    assert found["impacts_per_revolution"]["value"] == pytest.approx(4 * 300)
    assert found["impacts_per_log"]["value"] == pytest.approx(4 * 300 / LOGS)
    assert found["peak_force_mean"]["value"] == pytest.approx(1000.0 * np.exp(0.5), rel=0.05)
    assert found["peak_force_p99"]["value"] == pytest.approx(1000.0 * np.exp(2.326), rel=0.15)
    low, high = found["peak_force_mean"]["interval"]
    assert low < 1000.0 * np.exp(0.5) < high and high - low < 300.0
    assert found["impulse_sum"]["value"] == pytest.approx(7.0 * 200)
    assert found["dissipated_energy"]["value"] == pytest.approx(POWER * PERIOD)
    assert found["pivots_per_step"]["value"] == pytest.approx(2.0)
    assert found["shell_share"]["value"] == pytest.approx(0.25, abs=0.03)
    numbers = derived()
    assert found["torque_arm"]["value"] == pytest.approx(POWER / SPEED / (numbers["load_weight"] * numbers["inner_radius"]))
    assert names(found, "pass") == {"certificate_max", "energy_balance_error", "power_ratio", "lift_over_weight", "peak_force_over_bound"}
    assert "debarking_degree" not in found


def test_energy_that_is_stored_is_not_missing(tmp_path: Path) -> None:
    found = measured(replica(tmp_path, stored=2000.0))
    assert found["energy_balance_error"]["value"] < 1e-9
    assert found["power_ratio"]["value"] > 1.05


def test_worst_replica_counts(tmp_path: Path) -> None:
    found = measured(*(replica(tmp_path / str(k), seed=k, certificate=value) for k, value in enumerate((1e-15, 3e-9, 1e-15))))
    assert found["certificate_max"]["value"] == 3e-9
    assert found["certificate_max"]["verdict"] == "fail"
    assert "3 replicas" in found["peak_force_mean"]["basis"]


def test_histogram_holds_every_impact(tmp_path: Path) -> None:
    by_name = {one["name"]: one for one in drum.measure([replica(tmp_path)]).profiles}
    forces, angles = by_name["peak_forces"], by_name["impacts_at_angle"]
    assert np.sum(forces["value"]) * np.diff(forces["place"])[0] == pytest.approx(4 * 300 / LOGS, rel=0.01)
    assert np.sum(angles["value"]) == pytest.approx(4 * 300 / LOGS)
    inside = [value for place, value in zip(angles["place"], angles["value"], strict=True) if 0.0 < place < 90.0]
    assert np.sum(inside) == pytest.approx(np.sum(angles["value"]))
    exceeded = [value for value in by_name["peak_forces_exceeded"]["value"] if value is not None]
    assert np.all(np.diff(exceeded) <= 0.0)
    assert 10.0 ** exceeded[0] == pytest.approx(4 * 300 / LOGS, rel=0.02)


def test_time_that_is_missing_is_refused(tmp_path: Path) -> None:
    one = replica(tmp_path)
    lines = (tmp_path / "time.csv").read_text().splitlines(keepends=True)
    (tmp_path / "time.csv").write_text("".join(lines[:-7]))
    with pytest.raises(DumpError, match="993 rows instead of 1000"):
        drum.measure([one])


@pytest.mark.parametrize(("changes", "logs", "radius"), [
    ({"log_count": 100, "log_diameter_min": 0.2, "log_diameter_max": 0.2, "filling": 0.25}, 100, 2.0),
    ({"drum_radius": 2.0, "log_diameter_min": 0.2, "log_diameter_max": 0.2, "filling": 0.25}, 100, 2.0),
    ({"drum_radius": 2.0, "log_diameter_min": 0.2, "log_diameter_max": 0.2, "filling": 0.125}, 50, 2.0)])
def test_geometry(changes: dict[str, float], logs: int, radius: float) -> None:
    found = derived(**changes)
    assert (found["logs"], found["inner_radius"]) == (logs, pytest.approx(radius))
    # All logs of 0.2 m are 1 m long, of 850 kg/m3.
    assert found["load_weight"] == pytest.approx(logs * 850.0 * np.pi * 0.1**2 * 9.81)


def test_study_finds_the_exponent(tmp_path: Path) -> None:
    points = []
    for k, speed in enumerate((2.0, 0.5, 1.0)):
        found = measured(replica(tmp_path / str(k), seed=7, scale=speed**1.5))
        points.append({"parameters": {"drum_speed": speed}, "quantities": list(found.values())})
    studied = drum.study("speed", points, "drum_speed")
    by_name = judged("debarking_drum", studied)
    assert by_name["peak_force_mean_exponent"]["value"] == pytest.approx(1.5)
    assert by_name["impacts_per_log_exponent"]["value"] == pytest.approx(0.0, abs=1e-9)
    low, high = by_name["peak_force_mean_exponent"]["interval"]
    assert low < 1.5 < high
    assert studied.profiles[0]["place"] == [0.5, 1.0, 2.0]


SPRUCE = {"bark_force": 1000.0, "wood_force": 2718.281828, "cleared_width": 0.002}


def test_outcome_of_debarking_is_that_of_the_forces(tmp_path: Path) -> None:
    """Peaks are lognormal about 1000 N, and a quarter of the impacts are on the shell; all are of log 1, the rest with log 3."""
    replicas = [replica(tmp_path / str(k), seed=k, **SPRUCE) for k in range(3)]
    found, curves = measured(*replicas), {one["name"]: one for one in drum.measure(replicas).profiles}
    impacts = 4 * 300 * 1.75 / LOGS
    assert found["useful_impacts"]["value"] == pytest.approx(impacts * 0.3413, rel=0.05)
    assert found["damaging_impacts"]["value"] == pytest.approx(impacts * 0.1587, rel=0.05)
    assert found["damaging_share"]["value"] == pytest.approx(0.1587 / 0.5, abs=0.02)
    assert "3 replicas" in found["debarking_degree"]["basis"]
    # Two of the forty logs are hit, one of them at all sides.
    assert 0.02 < found["debarking_degree"]["value"] < 2.0 / LOGS
    assert found["debarking_time"]["value"] is None or found["debarking_time"]["value"] > 1e6
    assert curves["debarking"]["value"][0] == 0.0
    assert curves["debarking"]["value"][-1] == pytest.approx(100.0 * found["debarking_degree"]["value"])
    assert np.sum(curves["effective_around"]["value"]) == pytest.approx(12.0)


def test_forces_without_each_other_are_refused() -> None:
    for given in ({"bark_force": 1e3}, {"wood_force": 1e3}, {"cleared_width": 1e-3}):
        with pytest.raises(DembarkError, match="bark_force and wood_force belong together"):
            derived(**given)
    with pytest.raises(DembarkError, match="is not below the one that damages wood"):
        resolve(find("debarking_drum"), changes={"bark_force": 2e3, "wood_force": 1e3})


def test_bound_is_the_energy_of_a_fall() -> None:
    given = parameters(drum_speed=0.0 + 1e-9, log_density=1000.0, log_diameter_max=0.2)
    mass, fall = 1000.0 * np.pi * 0.01, 2.0 * 1.5
    assert force_bound(given, 1.5) == pytest.approx(np.sqrt(2.0 * given["log_stiffness"] * mass * given["gravity"] * fall))


def with_impacts(one: Drum, angle: Array, loss: Array) -> Drum:
    """`one` with impacts at `angle` (degrees) that lose `loss` (J), every other on the shell, half as much as all that is lost."""
    count, turn = len(angle), np.radians(angle)
    return replace(one, quarter=np.arange(count) % one.quarters, place=-np.column_stack([np.sin(turn), np.cos(turn)]), loss=loss,
                   peak=np.full(count, 1e3), shell=np.arange(count) % 2 == 0, lost=np.full(len(one.lost), 2.0 * loss.sum() / len(one.lost)))


def test_shares_of_the_loss_and_its_direction(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    found = estimates(with_impacts(read(replica(tmp_path)), 60.0 + random.normal(0.0, 5.0, 4000), np.ones(4000)))
    assert found["impact_loss_share"].value == pytest.approx(0.5)
    assert found["shell_loss_share"].value == pytest.approx(0.5)
    assert found["shell_power_angle"].value == pytest.approx(60.0, abs=0.5)


def test_power_along_the_shell_adds_up_to_what_is_lost_there(tmp_path: Path) -> None:
    one = with_impacts(read(replica(tmp_path)), np.linspace(-179.0, 179.0, 400), np.linspace(0.0, 2.0, 400))
    patch, duration = 0.3, one.revolutions * one.period
    total = sum(cell.value for cell in _along_shell(one, patch)) * patch * duration
    assert total == pytest.approx(one.loss[one.shell].sum(), rel=1e-12)


def controls_debarking_drum(folder: Path) -> Iterator[Control]:
    # The files here hold no logs to draw.
    with patch.object(drum, "fields", lambda _: None):
        right = measured(replica(folder / "right"))
        for name, change in {"a step that is not solved": {"certificate": 2e-10}, "a hundredth of the energy that vanishes": {"leak": 0.01},
                             "a drum with a twelfth too much power": {"leak": 0.08}, "gravity 3 % too weak": {"lift": 0.97},
                             "forces thirty times too high": {"scale": 30.0}}.items():
            yield Control(name, right, measured(replica(folder / name, **change)))
