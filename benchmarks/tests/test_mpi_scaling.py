"""Beds and drums that are repeated, the scaling tables, and what ranks of real engines account for."""

import json
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks import mpi_scaling
from benchmarks.beds import HERE, Bed
from benchmarks.mpi_scaling import HEADS, Point, bed_of, cells, fitted, main, parsed, planned, predicted, read_grains, tiled, write_grains
from benchmarks.scaling_model import Network
from dembark.common.errors import DembarkError
from dembark.validation.engines import find

SIDE, LAYERS = 10, 4


@pytest.fixture
def lattice(tmp_path, monkeypatch) -> Bed:
    """A layer of grains on a square lattice instead of the settled bed."""
    place = 0.005 * (np.stack(np.meshgrid(*map(np.arange, (SIDE, SIDE, LAYERS)), indexing="ij"), -1).reshape(-1, 3) + 0.5)
    grains = pd.DataFrame(place * (1.0, 1.0, 0.999), columns=list("xyz")).assign(diameter=0.005)
    bed = Bed(tmp_path / "bed.data", width=0.05)
    write_grains(bed.path, np.array([[0, 0.05], [0, 0.05], [-0.005, 0.1]]), grains)
    monkeypatch.setattr(mpi_scaling, "settled_bed", lambda count, base: bed)
    monkeypatch.setattr(mpi_scaling, "TILE", len(grains))
    monkeypatch.setattr(mpi_scaling, "SLICE", len(grains))
    return bed


@pytest.mark.parametrize("times", [(1, 1, 1), (3, 2, 1), (1, 1, 4)])
def test_a_tiled_bed_holds_every_grain_at_each_place(tmp_path, times):
    box, rows = np.array([[0.0, 0.1], [0.0, 0.2], [0.0, 0.5]]), pd.DataFrame(
        {"diameter": 0.005, "x": [0.02, 0.07], "y": [0.03, 0.01], "z": [0.0025, 0.0074], "vx": [1.0, -1.0]} | dict.fromkeys(
            ("vy", "vz", "wx", "wy", "wz"), 0.5))
    write_grains(tmp_path / "bed.data", *tiled(box, rows, times))
    wide, found = read_grains(tmp_path / "bed.data")
    np.testing.assert_allclose(wide[:, 1], box[:, 1] * times)
    assert len(found) == 2 * np.prod(times)
    places = found[list("xyz")].to_numpy()
    assert ((places >= 0) & (places <= wide[:, 1])).all() and len(np.unique(places.round(9), axis=0)) == len(found)
    for old, new in zip(np.tile(rows[list("xyz")], (len(found) // 2, 1)), places, strict=True):
        np.testing.assert_allclose(np.remainder(new - old + 1e-9, box[:, 1]), 1e-9, atol=1e-12)
    assert (found["vx"] == np.tile([1.0, -1.0], len(found) // 2)).all()


def test_samples_of_earlier_runs_give_the_same_tables(modelled, tmp_path, capsys):
    rows = samples(0.01, 1)
    names = [Point(row.scene, row.engine, row.grains, row.cores, row.steps).name for row in rows.itertuples()]
    rows = rows.assign(subject=names, rate=1e6)
    for name, part in (("a", rows[rows["grains"] < 10**6]), ("b", rows[rows["grains"] == 10**6])):
        (tmp_path / f"{name}.json").write_text(json.dumps({"rows": part.to_dict("records")}))
    paths = [str(tmp_path / f"{name}.json") for name in "ab"]
    assert main(["--samples", *paths, "--out", str(tmp_path / "both"), "--predict", "1e7", "--there", "64"]) == 0
    _, row = modelled(0.01, 1)
    page = (tmp_path / "both/mpi_scaling.md").read_text()
    assert f"| {' | '.join(row)} |" in page and page.count("| 1e+07 | 64 |") == 1


def test_only_beds_of_complete_tiles(lattice):
    bed = bed_of("bed", 6 * SIDE**2 * LAYERS)
    box, grains = read_grains(bed.path)
    assert len(grains) == 6 * SIDE**2 * LAYERS
    np.testing.assert_allclose(box[:2, 1], [0.15, 0.1])
    for count in (1, SIDE**2 * LAYERS + 1):
        with pytest.raises(DembarkError, match="give a multiple of 400"):
            bed_of("bed", count)


def test_speed_up_is_over_one_core():
    points = [Point("bed", "yade", 1000, 1, 100), Point("bed", "yade", 1000, 4, 100), Point("drum", "yade", 1000, 2, 10)]
    rates = {points[0].name: [1e6, 5e5, 2.5e5], points[1].name: [5e5], points[2].name: [5e3]}
    rows = pd.DataFrame([{"subject": name, "rate": rate} for name, found in rates.items() for rate in found])
    table = [dict(zip(HEADS, row, strict=True)) for row in cells(points, rows)]
    assert [row["speed-up"] for row in table] == ["1.00", "4.00", ""]
    assert table[0]["least-greatest"] == "2.5e+05-1e+06" and table[0]["1e6 steps take"] == "33 min 20 s"


def test_samples_are_about_the_same_work_and_more_ranks_than_cores_are_counted(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1})
    points = planned(parsed("--engine liggghts --engine yade --grains 1e4 1e5 --ranks 1 2 8 --work 1e6".split()))
    assert {point.grains * point.steps for point in points if point.engine == "liggghts" and point.cores < 8} == {10**6}
    assert {point.steps for point in points if point.cores == 8} == {0}
    assert {(point.scene, point.cores) for point in points if point.engine == "yade"} == {("bed", 1), ("bed", 2)}


def test_commands_of_the_page_are_understood():
    page = (HERE.parent / "docs/how-to/scaling.md").read_text(encoding="utf-8").replace("\\\n", "")
    lines = [line for line in page.splitlines() if line.startswith(".venv/bin/python -m benchmarks.mpi_scaling")]
    assert len(lines) == 4
    for line in lines:
        parsed(shlex.split(line)[3:])


@pytest.mark.parametrize("words", [["--ranks", "0"], ["--rounds", "0"], ["--grains", "-5"], ["--grains", "1234", "--ranks", "1"]])
def test_a_mistake_gets_one_line(words, capsys):
    assert main(words) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("dembark: --")


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_ranks_account_for_grains_halo_messages_and_memory(lattice, engine):
    """Of the lattice in known numbers: two ranks hold half of the grains each; their halo is one plane of the lattice on each side."""
    try:
        find(engine)
    except DembarkError as error:
        pytest.skip(str(error))
    own, found = SIDE**2 * LAYERS, {}
    for ranks in (1, 2):
        found[ranks] = Point("bed", engine, 4 * own, ranks, 20).sample(20, {"grid": f"{ranks} 1 1"}, wall_clock=False)
    one, two = found[1], found[2]
    # Both sides of the border between the ranks, and of the periodic one.
    sent = 2 * 2 * SIDE * LAYERS
    assert one["own"] == 4 * own and two["own"] == two["most"] == 2 * own
    # Borders lie between planes of the lattice, and copies are made over 1.2 diameters: one plane on each side.
    assert one["halo"] == (2 * SIDE + 2) ** 2 * LAYERS - 4 * own and two["halo"] == (SIDE + 2) * (2 * SIDE + 2) * LAYERS - 2 * own
    assert one["messages"] == 0.0
    # Position, velocity and spin, in a message to either side; a few more in the set-up of the two runs.
    assert 2.0 <= two["messages"] < 3.0
    assert 72 * sent <= two["bytes"] < 1.4 * 72 * sent
    assert 1e7 < one["program"] < one["resident"] < 1e9 and one["loop"] > 0.0


def test_fix_balance_moves_the_border_between_ranks(lattice):
    """All grains are in the lower half of this box."""
    try:
        find("lammps")
    except DembarkError as error:
        pytest.skip(str(error))
    point = Point("bed", "lammps", SIDE**2 * LAYERS, 2, 200)
    words = {"grid": "1 1 2", "balance": "10 1.05 shift z 10 1.02"}
    even, uneven = (point.sample(10, {**words, "balanced": on}, wall_clock=False) for on in (1, 0))
    assert uneven["most"] == SIDE**2 * LAYERS and even["most"] <= 0.75 * SIDE**2 * LAYERS
    assert even["own"] == uneven["own"]


def samples(noise: float, seed: int) -> pd.DataFrame:
    """Made-up samples of a bed 20 grains high: 200 ns a grain, 50 ns a copy, 20 us a step, 1 kB a grain or copy; of known scatter."""
    scatter, rows = np.random.default_rng(seed), []
    for grains in (10**4, 10**5, 10**6):
        for cores in (1, 2, 2, 16):
            own = grains / cores
            halo = own * ((1.0 + 2.0 / (own / 400.0) ** 0.5) ** 2 - 1.0)
            grain, halves, held = 1.0 + noise * scatter.standard_normal(3)
            comm = (50e-9 * halo + 20e-6) * halves
            rows.append({"scene": "bed", "engine": "lammps", "grains": grains, "cores": cores, "steps": 0 if cores > 2 else 100,
                         "loop": 100 * (200e-9 * own * grain + comm), "comm": 100 * comm, "own": own, "most": own, "halo": halo,
                         "program": 3e7, "resident": 3e7 + 2e6 + 4.0 * grains + 1e3 * (own + halo) * held,
                         "messages": 0.0 if cores == 1 else 2.0, "bytes": 0.0 if cores == 1 else 72.0 * halo})
    return pd.DataFrame(rows)


@pytest.fixture
def modelled(monkeypatch):
    """The model of made-up samples with relative errors `noise`, and its row of the table."""
    monkeypatch.setattr(mpi_scaling, "bed_of", lambda scene, grains: Bed(Path("bed.data")))
    # A piece as wide as the range of 6 mm has 400 grains.
    width = 0.006 * (mpi_scaling.SLICE / 400.0) ** 0.5
    monkeypatch.setattr(mpi_scaling, "read_grains", lambda path: (np.array([[0.0, width], [0.0, width], [0.0, 1.0]]), None))

    def made(noise: float = 0.0, seed: int = 1):
        models, [row] = fitted(samples(noise, seed))
        return models["bed", "lammps"], row

    return made


def test_the_model_finds_the_numbers_that_made_the_samples(modelled):
    model, row = modelled()
    for found, true in ((model.own.at(1.0), 200e-9), (model.halo.at(1.0, 0.0), 50e-9), (model.halo.at(0.0, 1.0), 20e-6),
                        (model.memory.at(1.0, 0.0), 1e3), (model.memory.at(0.0, 1.0), 2e6)):
        assert found.value == pytest.approx(true, rel=1e-6) and found.half < 1e-6 * true
    assert (model.messages, model.message, model.directions) == (2.0, 72.0, 2)
    assert model.copies(40000.0) == pytest.approx(40000 * ((1 + 2 / 10) ** 2 - 1))
    assert set(row[-5:]) <= {"+0.0 %", "-0.0 %"}


def test_intervals_hold_the_true_numbers_and_other_samples_as_often_as_they_say(modelled):
    held, random = [], np.random.default_rng(7)
    for seed in range(300):
        model, _ = modelled(0.03, seed)
        grain, halves, memory = 1.0 + 0.03 * random.standard_normal(3)
        # A rank whose time is nearly all its own grains': the two scatters are independent, and the sum of squares covers both.
        held.append([abs(found.value - true) < found.half for found, true in (
            (model.own.at(1.0), 200e-9), (model.halo.at(1.0, 0.0), 50e-9), (model.halo.at(0.0, 1.0), 20e-6),
            (model.memory.at(1.0, 0.0), 1e3), (model.resident(1e5, 1e4, 1e7), 3e7 + 4e7 + 2e6 + 1.1e8 * memory),
            (model.step(1e5, 1e3), 200e-9 * 1e5 * grain + (50e-9 * 1e3 + 20e-6) * halves))])
    shares = np.mean(held, axis=0)
    assert (shares > 0.9).all() and (shares < 0.99).all(), shares


def test_a_prediction_adds_latency_and_bandwidth(modelled):
    model, _ = modelled()
    network = Network(latency=1e-5, bandwidth=1e8)
    halo = model.copies(1e4)
    assert model.between_nodes(halo, 256, network) == pytest.approx((2 * 2 + 2 * 8) * 1e-5 + 72 * halo / 1e8)
    # An imbalance makes all wait for the fullest rank.
    assert model.step(1e4, halo, 1.5).value - model.step(1e4, halo).value == pytest.approx(0.5 * 200e-9 * 1e4)
    rows = predicted(dict.fromkeys([("bed", "lammps"), ("drum", "lammps")], model), [2560000, 1e7], [16, 256], network)
    assert [row[0] for row in rows] == 4 * ["bed"] + 4 * ["drum"]
    row = rows[1]
    seconds = 200e-9 * 1e4 + 50e-9 * halo + 20e-6 + model.between_nodes(halo, 256, network)
    assert row[2:4] == ["2.56e+06", "256"] and float(row[6].split()[0]) == pytest.approx(1e3 * seconds, rel=1e-2)
    assert float(row[8]) == pytest.approx(200e-9 * 1e4 / seconds, abs=0.01)
