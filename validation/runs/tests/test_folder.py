"""The folder of a campaign keeps what its jobs need to find the same engines and cases."""

from __future__ import annotations

from pathlib import Path

import pytest

from dembark.validation.runs import folder


@pytest.mark.parametrize("launcher", ["", "srun --mpi=pmix"])
def test_jobs_get_full_paths_and_other_words_as_they_are(launcher: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lmp").touch()
    monkeypatch.setenv("DEMBARK_LIGGGHTS", "lmp")
    monkeypatch.setenv("DEMBARK_MPIRUN", launcher)
    found = folder.environment()
    assert found["DEMBARK_LIGGGHTS"] == str(tmp_path / "lmp")
    assert found["DEMBARK_MPIRUN"] == launcher
