"""fix capillary/liquid: no liquid is made or lost while grains meet, part, change ranks and leave, and runs go on with their books."""


import numpy as np
import pytest
from lammps_bed import WET, bed
from rig.lammps_driver import run_deck

LIQUID = "fix liquid all capillary/liquid content 0.005 wall floor 1e-9 0.1 0.3"
WATCH = 'fix books all ave/time 50 1 50 {} file books.txt format " %.17g"'.format(" ".join(f"f_liquid[{k}]" for k in range(1, 9)))


def deck(run: str, *, liquid: str = LIQUID, **words: str) -> str:
    text = bed(f"{liquid}\n{WATCH}\n{run}", material=WET, **words)
    return text.replace("surface_tension 0.072", "surface_tension 0.072 carried_liquid on").replace("bridge_volume 2e-10", "")


def books(folder, text, ranks=1):
    """Rows of step; liquid of grains, of bridges, of walls, lost; bridges; added, held, held less expected."""
    done = run_deck(folder, text, ranks=ranks)
    assert done.code == 0 and not done.error, done.error or done.output[-1500:]
    return np.loadtxt(folder / "books.txt")


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    return books(tmp_path_factory.mktemp("serial"), deck("run 2000"))


def test_nothing_is_made_or_lost(serial):
    held = serial[:, 1:4].sum(axis=1)
    assert np.abs(held - held[0]).max() < 1e-13 * held[0] and (serial[:, 4] == 0.0).all()
    assert np.abs(serial[:, 8]).max() < 1e-13 * held[0]
    # Bridges form and break, and the floor gets a part of those that break.
    assert serial[-1, 5] > 10 and (np.diff(serial[:, 5]) < 0.0).any() and np.ptp(serial[:, 3]) > 0.0


@pytest.mark.parametrize(("ranks", "head"), [(2, "processors 2 1 1"), (1, "atom_modify sort 100 0.005")])
def test_books_do_not_depend_on_ranks_and_order(serial, tmp_path, ranks, head):
    found = books(tmp_path, deck("run 1000", head=head), ranks)
    np.testing.assert_allclose(found[:, 1:6], serial[: len(found), 1:6], rtol=1e-6)


@pytest.mark.parametrize("account", ["", "fix account all energy/account\n"], ids=["", "with an account"])
def test_packs_keep_the_same_books_as_single_contacts(serial, tmp_path, monkeypatch, account):
    monkeypatch.setenv("DEMBARK_LANES", "1")
    found = books(tmp_path, deck(f"{account}run 1000"))
    np.testing.assert_allclose(found[:, 1:6], serial[: len(found), 1:6], rtol=1e-6)


def test_a_restart_goes_on_with_the_books(serial, tmp_path):
    books(tmp_path, deck("run 1000\nwrite_restart state"))
    found = books(tmp_path, deck("run 50", create="read_restart state", state=""))
    before = serial[serial[:, 0] == 1000][0]
    np.testing.assert_allclose(found[0, 1:8], before[1:8], rtol=1e-12)


def test_liquid_of_grains_that_leave_is_lost(tmp_path):
    found = books(tmp_path, deck("run 1000\ngroup gone id 1:10\ndelete_atoms group gone compress no\nrun 500"))
    total = found[:, 1:4].sum(axis=1)
    assert found[-1, 4] > 0.05 * total[0]
    assert np.abs(total + found[:, 4] - total[0]).max() < 1e-12 * total[0]


@pytest.mark.parametrize(("old", "new", "words"), [
    (LIQUID, "", ("carried_liquid on needs the liquid: fix ID all capillary/liquid",)),
    ("carried_liquid on", "", ("have no bridge_volume",)),
    ("carried_liquid on", "bridge_volume", ("'bridge_volume' is unknown", "carried_liquid")),
    ("content 0.005", "contents 0.005", ("fix liquid capillary/liquid", "there are content, volume, share")),
    ("content 0.005", "content 0.005 share half 1", ("share must be followed by cap or fraction",)),
    ("wall floor", "wall flour", ("there is no fix wall/dembark flour",)),
    ("liquid all", "liquid some", ("Could not find fix group",)),
])
def test_one_line_says_what_is_wrong(tmp_path, old, new, words):
    text = deck("run 10").replace(WATCH, "")
    assert old in text
    done = run_deck(tmp_path, text.replace(old, new))
    assert done.code != 0
    for word in words:
        assert word in done.error, done.error or done.output[-1500:]
