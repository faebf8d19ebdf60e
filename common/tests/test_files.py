"""Output of engines is complete or refused; results are replaced completely or not at all."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import check_times, count_frames, disk_error, move_into_place, read_json, retire, sweep, write_json


def dump(frames: int, atoms: int) -> bytes:
    head = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS id x\n"
    return "".join(head.format(10 * k, atoms) + "".join(f"{i} 0.5\n" for i in range(atoms)) for k in range(frames)).encode()


@given(frames=st.integers(1, 4), atoms=st.integers(0, 5), data=st.data())
def test_a_dump_cut_anywhere_is_noticed(tmp_path_factory: pytest.TempPathFactory, frames: int, atoms: int, data: st.DataObject) -> None:
    path = tmp_path_factory.mktemp("d") / "grains.dump"
    whole = dump(frames, atoms)
    path.write_bytes(whole)
    assert count_frames(path, "ATOMS") == frames
    cut = data.draw(st.integers(0, len(whole) - 1))
    path.write_bytes(whole[:cut])
    try:
        found = count_frames(path, "ATOMS")
    except RunError as error:
        said = str(error)
    else:
        # Cut exactly between two frames the file looks like a shorter one; how many frames there must be is not the file's to know.
        assert found * len(dump(1, atoms)) == pytest.approx(cut, abs=3 * frames)
        assert whole[cut:].startswith(b"ITEM: TIMESTEP")
        return
    assert "grains.dump" in said


@given(data=st.data())
def test_a_line_missing_in_the_middle_is_noticed(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    lines = dump(3, 4).splitlines(keepends=True)
    gone = data.draw(st.integers(0, len(lines) - 1))
    path = tmp_path_factory.mktemp("d") / "grains.dump"
    path.write_bytes(b"".join(lines[:gone] + lines[gone + 1:]))
    with pytest.raises(RunError):
        count_frames(path, "ATOMS")


def test_missing_and_empty_dumps_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"no grains\.dump"):
        count_frames(tmp_path / "grains.dump", "ATOMS")
    (tmp_path / "grains.dump").touch()
    with pytest.raises(RunError, match=r"no grains\.dump"):
        count_frames(tmp_path / "grains.dump", "ATOMS")


@pytest.mark.parametrize(("text", "word"), [
    ("", "no rows"), ("step,time,kinetic_energy\n", "no rows"), ("a,b,c\n1,2,3\n", "no header"),
    ("step,time,kinetic_energy\n1,2,3\n2,3", "truncated"), ("step,time,kinetic_energy\n1,2,3", "truncated"),
    ("step,time,kinetic_energy\n1,2,-nan\n", "unstable"), ("step,time,kinetic_energy\n1,2,inf\n", "unstable"),
    ("step,time,kinetic_energy\n1,2,\0\n", "unstable")])
def test_times_that_cannot_be_used_are_refused(tmp_path: Path, text: str, word: str) -> None:
    (tmp_path / "time.csv").write_text(text)
    with pytest.raises(RunError, match=word):
        check_times(tmp_path / "time.csv")


def test_json_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    write_json(path, {"a": 1})
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(path, {"a": float("nan")})
    assert read_json(path) == {"a": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_regular_file_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(DembarkError, match="pipe is no regular file"):
        write_json(tmp_path / "pipe", {})
    assert (tmp_path / "pipe").is_fifo()


def test_writing_to_a_full_disk_says_so() -> None:
    with Path("/dev/full").open("wb", buffering=0) as full, pytest.raises(OSError, match="No space left") as caught:
        full.write(b"x")
    assert "disk is full" in str(disk_error(caught.value, Path("there")))


def test_writing_to_a_read_only_disk_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """There, nothing can be removed either, not even what is not there."""
    def refuse(*_args: object, **_more: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    for name in ("write_bytes", "unlink"):
        monkeypatch.setattr(Path, name, refuse)
    with pytest.raises(RunError, match=r"cannot write .*run\.json, Read-only file system"):
        write_json(tmp_path / "run.json", {})


def test_folder_is_replaced_as_a_whole(tmp_path: Path) -> None:
    target = tmp_path / "replica-1"
    target.mkdir()
    (target / "old").touch()
    work = tmp_path / ".replica-1.work"
    work.mkdir()
    (work / "new").touch()
    assert (target / "old").exists()
    move_into_place(work, target)
    assert list(target.iterdir()) == [target / "new"]
    assert list(tmp_path.iterdir()) == [target]


def test_a_result_set_aside_by_a_killed_process_comes_back(tmp_path: Path) -> None:
    old = tmp_path / ".replica-1.old"
    old.mkdir()
    (old / "run.json").write_text(json.dumps({"inputs": "x"}))
    sweep(tmp_path / "replica-1")
    assert read_json(tmp_path / "replica-1" / "run.json") == {"inputs": "x"}


def test_retired_results_are_kept_aside(tmp_path: Path) -> None:
    for content in ("1", "2"):
        (tmp_path / "metrics.json").write_text(content)
        retire(tmp_path / "metrics.json")
    assert (tmp_path / "superseded" / "metrics.json").read_text() == "2"
    assert not (tmp_path / "metrics.json").exists()
