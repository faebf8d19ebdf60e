"""Ranks, borders that move, deleted grains and restarts leave friction and bridges as they are."""

import re

import numpy as np
import pytest
from rig.liggghts_driver import read_dump, run_deck
from rig.packing import packing
from rig.scenarios import Material

BED = Material(static_friction=0.5, kinetic_friction=0.4, interface_shear_strength=1e5, bridge_volume=2e-10)
GRID = "processors 2 1 1\n"
HISTORY = ("compute hold all pair/gran/local id history\ndump contacts all local {every} contacts.dump " +
           " ".join(f"c_hold[{k}]" for k in range(1, 11)) + "\n")


def bed(run_command, *, ranks=1, every=500, histories=True, **words):
    text = packing(BED, run_command, every=every, **words)
    text = text.replace("thermo 1000", (HISTORY.format(every=every) if histories else "") + "thermo 1000")
    return text.replace(GRID, GRID if ranks == 2 else "processors 2 2 1\n" if ranks == 4 else "")


def contacts(folder, name="contacts.dump"):
    """For each frame a table by pair of grains: volume, reach, displacement (sign of the pair in order), slip, energy."""
    frames = []
    for table in read_dump(folder / name)[1]:
        rows = {}
        for row in np.atleast_2d(table):
            if len(row) == 0:
                continue
            i, j = int(row[0]), int(row[1])
            sign = 1.0 if i < j else -1.0
            rows[min(i, j), max(i, j)] = np.concatenate([row[3:5], sign * row[5:8], row[8:10]])
        frames.append(rows)
    return frames


def assert_same_contacts(one, other, tolerance):
    """Pairs that hold anything have the same of it; values relative to the largest of their kind."""
    for a, b in zip(one, other, strict=True):
        held = {pair for rows in (a, b) for pair, row in rows.items() if row.any()}
        assert all(pair in a and pair in b for pair in held)
        if held:
            x, y = (np.array([rows[pair] for pair in sorted(held)]) for rows in (a, b))
            scale = np.abs(x).max(axis=0) + 1e-300
            assert (np.abs(x - y).max(axis=0) / scale).max() < tolerance


def last(folder):
    return read_dump(folder / "grains.dump")[1][-1]


def assert_same_grains(a, b, tolerance):
    assert (a[:, 0] == b[:, 0]).all()
    for k in (1, 4, 7, 10, 13):
        assert np.abs(a[:, k : k + 3] - b[:, k : k + 3]).max() < tolerance * np.abs(a[:, k : k + 3]).max()


def run(folder, text, ranks=1, name="case.in"):
    done = run_deck(folder, text, ranks=ranks, name=name)
    assert done.code == 0 and not done.error, done.error or done.output[-1500:]
    return done


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    folder = tmp_path_factory.mktemp("serial")
    run(folder, bed("run 3000"))
    rows = contacts(folder)[-1].values()
    assert any(row[0] > 0.0 and row[5] > 0.0 for row in rows) or any(row[6] > 0.0 for row in rows)
    return folder


def change(text, old, new):
    assert old in text
    return text.replace(old, new)


# What must not matter: number of ranks, how the box is cut and where it ends, when lists are built.
HARMLESS = {
    "2 ranks": (2, lambda text: text),
    "4 ranks": (4, lambda text: text),
    "2 ranks, cut across the height": (2, lambda text: change(text, GRID, "processors 1 1 2\n")),
    "shrink-wrapped top": (2, lambda text: change(text, "boundary p p f", "boundary p p m")),
    "shrink-wrapped, cut across the height": (
        2, lambda text: change(change(text, "boundary p p f", "boundary p p s"), GRID, "processors 1 1 2\n")),
    "lists in every step": (1, lambda text: change(text, "neigh_modify delay 0", "neigh_modify every 1 delay 0 check no")),
    "sorted often": (1, lambda text: change(text, "atom_modify map array", "atom_modify map array sort 50 0.0")),
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.full) if name in ("4 ranks", "shrink-wrapped top") else name
                                  for name in HARMLESS])
def test_what_must_not_matter(serial, tmp_path, name):
    ranks, edit = HARMLESS[name]
    text = edit(bed("run 3000", ranks=ranks))
    run(tmp_path, text, ranks)
    assert_same_grains(last(serial), last(tmp_path), 1e-9)
    assert_same_contacts(contacts(serial), contacts(tmp_path), 1e-8)


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.full), 2])
def test_grains_deleted_beside_bridges(tmp_path, ranks):
    """Bridges to a deleted grain are gone, those of the others unharmed, whatever is on the other rank."""
    cut = "group gone id 5 22 37\nrun 2000\ndelete_atoms group gone compress no\nrun 100"
    run(tmp_path, bed(cut, ranks=ranks, every=100), ranks)
    frames = contacts(tmp_path)
    steps = read_dump(tmp_path / "contacts.dump")[0]
    before, after = frames[list(steps).index(2000)], frames[-1]
    assert any({5, 22, 37} & set(pair) for pair, row in before.items() if row[0] > 0.0)
    assert not any({5, 22, 37} & set(pair) for pair in after)
    kept = {pair for pair, row in before.items() if row[0] > 0.0 and not {5, 22, 37} & set(pair)}
    assert len({pair for pair in kept if pair in after and after[pair][0] == before[pair][0]}) > 0.8 * len(kept) > 3
    assert len(last(tmp_path)) == 61


@pytest.mark.parametrize("ranks", [pytest.param(1, marks=pytest.mark.full), 2])
def test_grains_created_between_runs_leave_the_others_as_they_are(tmp_path, ranks):
    """Contacts across borders keep their histories: in stock LIGGGHTS a new atom takes the place of the ghost that held one."""
    new = "create_atoms 1 single 0.003 0.003 0.05 units box\nset group all vz 0.0\nset atom 65 diameter 0.005 density 2500\n"
    for name, between in (("with", new), ("without", "set group all vz 0.0\n")):
        run(tmp_path / name, bed(f"run 2000\n{between}run 500", ranks=ranks), ranks)
    assert_same_grains(last(tmp_path / "without"), last(tmp_path / "with")[:64], 1e-12)
    assert_same_contacts(contacts(tmp_path / "without"), contacts(tmp_path / "with"), 1e-12)


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.full), 10])
def test_grains_that_grow_are_as_large_across_a_border(tmp_path, every):
    """Copies have the new radius in the same step, so that ranks and periods do not matter."""
    grow = f"variable width equal 0.0045+5e-7*step\nfix grow all adapt {every} atom diameter v_width\n"
    for ranks in (1, 2):
        run(tmp_path / str(ranks), bed(f"{grow}run 1500", ranks=ranks), ranks)
    assert_same_grains(last(tmp_path / "1"), last(tmp_path / "2"), 1e-9)
    assert_same_contacts(contacts(tmp_path / "1"), contacts(tmp_path / "2"), 1e-8)


@pytest.mark.parametrize("ranks", [*(pytest.param((n, n), marks=pytest.mark.full) for n in (1, 2)), (1, 2), (2, 1)])
def test_restart_keeps_every_value(tmp_path, ranks):
    """read_restart, also on another number of ranks: what the pairs held at the last build of the lists comes back to the bit."""
    first, second = ranks
    run(tmp_path, bed("run 2000\nwrite_restart bed.restart\nrun 0", ranks=first), first)
    run(tmp_path, bed("run 0", ranks=second, create="read_restart bed.restart", state="").replace("contacts.dump", "again.dump"), second,
        "again.in")
    before, after = contacts(tmp_path)[-1], contacts(tmp_path, "again.dump")[0]
    held = {pair for pair, row in before.items() if row.any()}
    assert len(held) > 10 and held == {pair for pair, row in after.items() if row.any()}
    for pair in held:
        assert (before[pair] == after[pair]).all(), pair


@pytest.mark.full
def test_statistics_do_not_depend_on_the_ranks(tmp_path):
    """500 grains fall into a bed: kinetic energy and number of bridges on the way agree within what two packings differ."""
    create = re.sub(r"create_atoms.*\n?", "", packing(BED, "run 1").split("neighbor")[0].split("processors 2 1 1\n")[1])
    atoms = [f"create_atoms 1 single {0.003 + 0.006 * i} {0.003 + 0.006 * j} {0.003 + 0.006 * k} units box"
             for k in range(20) for i in range(5) for j in range(5)]
    create = create.replace("0 0.024 0 0.024 -0.001 0.06", "0 0.03 0 0.03 -0.001 0.13") + "\n".join(atoms)
    found = {}
    for name, ranks, seed in (("one", 1, 91), ("two", 2, 91), ("other", 1, 89)):
        text = bed("run 6000", ranks=ranks, every=3000, create=create).replace("sin(91*id)", f"sin({seed}*id)")
        run(tmp_path / name, text, ranks)
        frame, held = last(tmp_path / name), contacts(tmp_path / name)[-1]
        energy = (frame[:, 4:7] ** 2).sum(axis=1)
        found[name] = np.array([energy.mean(), sum(row[0] > 0.0 for row in held.values()) / 500, frame[:, 3].mean()])
    interval = np.maximum(3.0 * np.abs(found["other"] - found["one"]), 0.03 * np.abs(found["one"]))
    assert (np.abs(found["two"] - found["one"]) < interval).all(), found


@pytest.mark.parametrize(("ranks", "given", "told"), [(1, None, ["self"]), (1, "self,tcp", ["self,tcp"]), (2, None, [])])
def test_only_a_process_alone_leaves_out_the_networks(tmp_path, monkeypatch, ranks, given, told) -> None:
    if given:
        monkeypatch.setenv("OMPI_MCA_btl", given)
    done = run_deck(tmp_path, 'shell "printenv OMPI_MCA_btl > told"\n', ranks=ranks)
    assert done.code == 0, done.error
    assert (tmp_path / "told").read_text().split() == told
