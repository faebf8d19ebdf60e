"""The last job of a submission, which measures and writes the report."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from dembark.common.lock import Busy
from dembark.validation.runs import job


@pytest.fixture
def tries(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """What happens at each try to measure: "busy" while another submission measures."""
    left = ["busy", "busy", "free"]

    def conclude(*_: object) -> None:
        if left.pop(0) == "busy":
            raise Busy("another process works here")

    monkeypatch.setattr(job, "conclude", conclude)
    monkeypatch.setattr(job, "_LOOK", 0.01)
    (tmp_path / "list").write_text(f"{job.REPORT}\n")
    return left


def test_it_waits_for_another_submission_that_measures(tries: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job, "cancelled_by_signal", threading.Event)
    assert job.main([str(tmp_path), str(tmp_path / "list"), "0"]) == 0
    assert tries == []


def test_its_time_limit_ends_the_wait(tries: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    ended = threading.Event()
    ended.set()
    monkeypatch.setattr(job, "cancelled_by_signal", lambda: ended)
    assert job.main([str(tmp_path), str(tmp_path / "list"), "0"]) != 0
    assert "another process works here" in capsys.readouterr().err and tries == ["busy", "free"]
