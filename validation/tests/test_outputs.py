"""What the decks of a case write: read from the case file, and every file of a run complete or refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import check_impacts
from dembark.postproc.impacts import COLUMNS
from dembark.validation.case import folders, model
from dembark.validation.runs import outcome

HEADER = f"# impacts that have ended\n# {' '.join(COLUMNS)}\n"
ROW = "1 -1 0.5 1e-3 1.2e4 6 2 0.1 0 0.1 0 0.01 0 1 0 0.3 0\n"


def with_outputs(decks: Path, words: str) -> model.Case:
    path = decks / "box" / "case.toml"
    path.write_text(path.read_text().replace('source = ["nobody"]', f'source = ["nobody"]\noutputs = {words}', 1))
    folders.load.cache_clear()
    return folders.find("box")


def test_a_case_that_says_nothing_writes_the_standard_files(decks: Path) -> None:
    folders.load.cache_clear()
    assert folders.find("box").outputs == ("grains", "contacts", "times")


def test_a_case_names_what_it_writes(decks: Path) -> None:
    assert with_outputs(decks, '["times", "impacts"]').outputs == ("times", "impacts")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ('["times", "impact"]', "did you mean impacts"),
        ("[]", "give one or more of"),
        ('["times", "times"]', "each once"),
        ('"times"', "wrong type"),
    ],
)
def test_a_wrong_list_is_refused(decks: Path, words: str, message: str) -> None:
    with pytest.raises(DembarkError, match=message):
        with_outputs(decks, words)


def test_impacts_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "impacts.txt"
    for count in range(3):
        path.write_text(HEADER + count * ROW)
        assert check_impacts(path) == count


@given(rows=st.integers(1, 4), data=st.data())
def test_a_cut_record_is_noticed(tmp_path_factory: pytest.TempPathFactory, rows: int, data: st.DataObject) -> None:
    path, whole = tmp_path_factory.mktemp("d") / "impacts.txt", HEADER + rows * ROW
    cut = data.draw(st.integers(0, len(whole) - 1))
    path.write_text(whole[:cut])
    try:
        count = check_impacts(path)
    except RunError as error:
        told = str(error)
    else:
        # Cut exactly after a line it looks like a shorter record.
        assert whole[:cut] == HEADER + count * ROW or whole[:cut].count("\n") == 1
        return
    assert "impacts.txt" in told


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "wrote no impacts.txt"),
        (ROW, "header"),
        (HEADER + ROW.replace("0.5", "nan"), "line 1"),
        (HEADER + ROW + ROW[:-4] + "\n", "line 2"),
    ],
)
def test_bad_records_are_refused(tmp_path: Path, text: str | None, message: str) -> None:
    path = tmp_path / "impacts.txt"
    if text is not None:
        path.write_text(text)
    with pytest.raises(RunError, match=message):
        check_impacts(path)


def write_run(folder: Path, frames: int = 2) -> None:
    head = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF {}\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: {} a\n1\n"
    (folder / "grains.dump").write_text("".join(head.format(k, "ATOMS", "ATOMS") for k in range(frames)))
    (folder / "contacts.dump").write_text("".join(head.format(k, "ENTRIES", "ENTRIES") for k in range(frames)))
    (folder / "time.csv").write_text("step,time,kinetic_energy\n1,1e-3,0\n")
    (folder / "impacts.txt").write_text(HEADER + ROW)


def test_only_what_is_asked_for_is_looked_at(tmp_path: Path) -> None:
    write_run(tmp_path)
    everything = tuple(model.OUTPUTS)
    assert outcome.check_output(tmp_path, everything, 2) == 2
    for name, file in model.OUTPUTS.items():
        (tmp_path / file).rename(tmp_path / "aside")
        with pytest.raises(RunError, match=f"no {file}"):
            outcome.check_output(tmp_path, everything, 2)
        rest = tuple(other for other in everything if other != name)
        assert outcome.check_output(tmp_path, rest, 2) == 2
        (tmp_path / "aside").rename(tmp_path / file)
    assert outcome.check_output(tmp_path, ("times", "impacts"), 2) == 0
    with pytest.raises(RunError, match="2 frames instead of 3"):
        outcome.check_output(tmp_path, ("contacts",), 3)
