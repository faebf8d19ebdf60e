"""What is measured of column_collapse in runs with known energies and a known deposit, right and spoiled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.momentum import BRIDGED_PARTS
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, point
from dembark.postproc import DumpError
from dembark.postproc.replica import Replica
from dembark.postproc.tests.dumps import grains_text, write_times

column_collapse = module("column_collapse")
D = 0.005
OPENING, ROWS, EVERY = 100, 500, 20
# Of the potential energy lost in the collapse, 0.01 J.
SHARES = {"normal_viscous": 0.25, "tangential_viscous": 0.1, "liquid_viscous": 0.15, "capillary": 0.05, "walls": 0.02}
FALLEN = 0.01
Rows = dict[str, Any]


def rows() -> Rows:
    """Energies (J): 0.05 fall in the rain and are lost by normal damping, 0.01 in the collapse. The last row has 4 % of it in motion; the
    springs hold 0.2 mJ (normal) and 0.1 mJ (tangential) since the opening, and friction takes the rest."""
    step = np.arange(1, ROWS + 1) * EVERY
    rain = np.minimum(np.arange(1, ROWS + 1) / OPENING, 1.0)
    fall = np.maximum(np.arange(1, ROWS + 1) - OPENING, 0.0) / (ROWS - OPENING)
    table: Rows = {"step": step, "time": step * 1e-5, "kinetic_energy": FALLEN * 0.04 * fall, "first_kinetic": np.full(ROWS, 1e-6)}
    table["gravity"] = 0.05 * rain + FALLEN * fall
    table["normal_stored"], table["tangential_stored"] = 2e-4 * fall, 1e-4 * fall
    table |= {name: -share * FALLEN * fall for name, share in SHARES.items()}
    table["normal_viscous"] = table["normal_viscous"] - 0.05 * rain - 1e-6
    table["step_error"] = -1e-5 * fall
    table["normal_elastic"] = table["step_error"] - table["normal_stored"]
    others = sum(table[name] for name in ("gravity", "walls", "first_kinetic", *BRIDGED_PARTS) if name != "tangential_elastic")
    table["tangential_elastic"] = table["kinetic_energy"] - others
    table |= {"other": np.zeros(ROWS), "imposed": np.zeros(ROWS), "balance": np.zeros(ROWS), "potential_energy": 0.1 - table["gravity"]}
    table["scale"] = 1e-6 + sum(np.abs(table[name]) for name in ("gravity", "walls", *BRIDGED_PARTS))
    table["weight_height"] = table["potential_energy"] + 1e-9 * fall
    return table


def replica(folder: Path, spoil: Callable[[Rows], None] = lambda _: None, *, first: int = OPENING * EVERY, wet: bool = True) -> Replica:
    """A column of 8 x 16 grains that ends as a layer of 32 x 4, 4 W long."""
    table = rows()
    spoil(table)
    folder.mkdir(exist_ok=True)
    write_times(folder / "time.csv", table)

    def block(columns: int, layers: int) -> np.ndarray:
        return np.array([((i + 0.5) * D, 0.0, (k + 0.5) * D) for i in range(columns) for k in range(layers)])

    radii = np.full(128, 0.5 * D)
    (folder / "grains.dump").write_text(grains_text(first, block(8, 16), radii) + grains_text(ROWS * EVERY, block(32, 4), radii))
    parameters = defaults("column_collapse", bridge_volume=8e-11 if wet else 0.0)
    return Replica(folder, {"parameters": parameters, "time_step": 1e-5, "engine": "liggghts"})


def found(*replicas: Replica) -> dict[str, dict[str, Any]]:
    measured = column_collapse.measure(replicas)
    assert measured.remarks and len({curve["name"] for curve in measured.profiles}) == len(measured.profiles)
    return judged("column_collapse", measured)


def test_right_energies_pass(tmp_path: Path) -> None:
    measured = found(replica(tmp_path))
    assert {name: one["verdict"] for name, one in measured.items() if one["tolerance"] is not None} == dict.fromkeys(
        ("energy_balance", "potential_error", "dissipation_sign"), "pass")
    shares = {name.removesuffix("_share"): one["value"] for name, one in measured.items() if name.endswith("_share")}
    expected = {name: share for name, share in SHARES.items() if name != "walls"} | {"gate": 0.02, "kinetic": 0.04, "held": 0.03}
    expected["friction"] = 1.0 - sum(expected.values()) - 1e-3
    assert shares == pytest.approx(expected, abs=1e-9)
    assert measured["step_error"]["value"] == pytest.approx(1e-3, rel=1e-9)
    assert measured["height_error"]["value"] == pytest.approx(1e-9 / (rows()["gravity"][-1] - rows()["gravity"][0]), rel=1e-3)
    assert measured["aspect_ratio"]["value"] == pytest.approx(2.0)
    assert measured["run_out"]["value"] == pytest.approx(31.5 / 8 - 1.0) and measured["run_out"]["reference"] is None
    assert measured["final_height"]["value"] == pytest.approx(0.5)
    # A block of 32 x 4 grains.
    assert measured["mean_run_out"]["value"] == pytest.approx(3.0) and measured["mean_height"]["value"] == pytest.approx(0.5)


def spoiled(**changes: Callable[[np.ndarray], np.ndarray]) -> Callable[[Rows], None]:
    def spoil(table: Rows) -> None:
        for name, change in changes.items():
            table[name] = change(table[name])
    return spoil


def bump(size: float) -> Callable[[np.ndarray], np.ndarray]:
    """`size` (J) more in the rows around the middle; 0.12 J are turned over in all."""
    return lambda values: values + size * (np.abs(np.arange(ROWS) - 250) < 50)


@pytest.mark.parametrize(("name", "spoil"), [
    ("energy_balance", spoiled(kinetic_energy=bump(1e-10))),
    ("energy_balance", spoiled(balance=bump(1e-10))),
    # Energy that no known force gave, though the account itself has booked it as another's.
    ("energy_balance", spoiled(kinetic_energy=bump(1e-10), other=bump(1e-10))),
    ("energy_balance", spoiled(kinetic_energy=bump(1e-10), imposed=bump(1e-10))),
    ("potential_error", spoiled(potential_energy=bump(1e-10))),
    # The balance is kept; a row loses 4e-6 J in the liquid.
    ("dissipation_sign", spoiled(liquid_viscous=bump(5e-6), tangential_elastic=bump(-5e-6))),
    ("dissipation_sign", spoiled(tangential_viscous=np.negative)),
])
def test_spoiled_energies_fail(tmp_path: Path, name: str, spoil: Callable[[Rows], None]) -> None:
    assert found(replica(tmp_path, spoil))[name]["verdict"] == "fail"


def test_numbers_that_are_none_fail(tmp_path: Path) -> None:
    for name in ("energy_balance", "potential_error"):
        column = "kinetic_energy" if name == "energy_balance" else "gravity"
        assert found(replica(tmp_path / name, spoiled(**{column: lambda x: x * np.nan})))[name]["verdict"] == "fail"


def test_worst_run_counts_and_three_give_intervals(tmp_path: Path) -> None:
    runs = [replica(tmp_path / str(k), wet=False) for k in range(2)]
    bad = replica(tmp_path / "bad", spoiled(kinetic_energy=lambda x: 1.01 * x + 1e-5), wet=False)
    measured = found(*runs, bad)
    assert measured["energy_balance"]["verdict"] == "fail" and measured["energy_balance"]["value"] > 1e-6
    assert measured["kinetic_share"]["interval"] and not found(*runs)["kinetic_share"]["interval"]
    assert "capillary_share" not in measured


def test_frames_without_a_row_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DumpError, match="no row at step 2001"):
        found(replica(tmp_path, first=2001))


def test_a_column_that_still_rains_is_not_compared(tmp_path: Path) -> None:
    def moving(energy: float) -> Callable[[np.ndarray], np.ndarray]:
        """This energy (J) more until the gate has moved for ten rows."""
        return lambda values: values + energy * (np.arange(ROWS) < OPENING + 10)

    settled, raining = (found(replica(tmp_path / str(part), spoiled(kinetic_energy=moving(part * FALLEN),
                                                                    tangential_elastic=moving(part * FALLEN)))) for part in (0.005, 0.05))
    for name in ("aspect_ratio", "friction_share", "mean_run_out", "mean_height"):
        assert settled[name]["compared"] and not settled[name]["reason"]
        assert not raining[name]["compared"] and "raise settle_time" in raining[name]["reason"]
    # The account balances in any state.
    assert raining["energy_balance"]["verdict"] == "pass"


def test_published_laws_where_they_hold() -> None:
    assert column_collapse.run_out_law(1.0) == pytest.approx(1.2) and column_collapse.run_out_law(8.0) == pytest.approx(7.6)
    assert column_collapse.run_out_law(2.0) is None
    assert column_collapse.height_law(1.0) is None and column_collapse.height_law(32.0) == pytest.approx(4.0)


def test_a_high_column_has_the_experiments_as_reference_and_no_verdict(tmp_path: Path) -> None:
    """Half as wide it is four times as high."""
    one = replica(tmp_path)
    narrow = Replica(one.folder, {**one.record, "parameters": defaults("column_collapse", bridge_volume=8e-11, column_width=0.02)})
    measured = found(narrow)
    assert measured["aspect_ratio"]["value"] == pytest.approx(4.0)
    assert measured["run_out"]["reference"] == pytest.approx(1.9 * 4.0 ** (2 / 3))
    assert measured["final_height"]["reference"] == pytest.approx(4.0**0.4)
    assert {(measured[name]["verdict"], measured[name]["source"]) for name in ("run_out", "final_height")} == {("info", "Lube et al. 2005")}
    assert "not rolling spheres" in measured["run_out"]["reason"]


def points(order: float, spread: float) -> list[dict[str, Any]]:
    return [point({"time_step_fraction": step}, {"step_error": 3e-2 * step**order}, part=spread) for step in (0.2, 0.05, 0.1)]


@pytest.mark.parametrize(("order", "spread", "verdict"),
                         [(2.0, 0.05, "pass"), (1.0, 0.05, "fail"), (1.7, 0.05, "fail"), (2.0, 0.5, "info")])
def test_order_of_the_step_error(order: float, spread: float, verdict: str) -> None:
    measured = column_collapse.study("step", points(order, spread), "time_step_fraction")
    one, (curve,) = judged("column_collapse", measured)["order_step_error"], measured.profiles
    assert one["value"] == pytest.approx(order) and one["verdict"] == verdict
    # Two ends of a straight line in logarithms, log 4 apart.
    assert one["interval"][1] - order == pytest.approx(np.sqrt(2.0) * spread / np.log(4.0))
    assert curve["place"] == sorted(curve["place"])


def controls_column_collapse(folder: Path) -> Iterator[Control]:
    right = found(replica(folder / "right"))
    for name, spoil in {
            "a hundredth of the damping missing from the account": spoiled(normal_viscous=lambda work: 0.99 * work),
            "gravity doubled in the potential energy": spoiled(potential_energy=lambda energy: 2.0 * energy),
            "damping that adds energy": spoiled(tangential_viscous=np.negative)}.items():
        yield Control(name, right, found(replica(folder / name, spoil)))
    yield Control("a step error of first order", *(judged("column_collapse", column_collapse.study("step", points(order, 0.05),
                                                                                              "time_step_fraction"))
                                                    for order in (2.0, 1.0)))
