"""What a build of YADE lacks is said before a script fails for it."""

from pathlib import Path

import pytest

from dembark.validation import doctor, engines
from dembark.validation.case import folders
from dembark.validation.engines.yade import Yade


@pytest.mark.parametrize(("features", "lacking"), [
    (" LOGGER OPENMP", ("VTK (VTKRecorder)", "QT5 (yade.qt, SnapshotEngine)", "GTS (pack.", "CGAL", "PFVFLOW (FlowEngine)")),
    (" LOGGER VTK OPENMP GTS QT5 CGAL PFVFLOW", ())])
def test_parts_that_a_build_lacks_are_named_by_the_doctor(features: str, lacking: tuple[str, ...], tmp_path: Path,
                                                          monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "yade"
    program.write_text(f"#!/bin/sh\nexec echo 'Yade version: 1'\nfeatures,version,debugbuild='{features}'.split(' '),'1',' '\n")
    program.chmod(0o755)
    monkeypatch.setenv("DEMBARK_YADE", str(program))
    monkeypatch.setenv("DEMBARK_TOLD_BY_YADE", "")
    monkeypatch.setattr(engines, "ENGINES", (Yade,))
    # A case that is loaded here has decks for YADE alone.
    for cache in (engines.find, folders.load):
        cache.cache_clear()
    try:
        found = [one for one in doctor.examine() if one.what == "parts of YADE"]
    finally:
        for cache in (engines.find, folders.load):
            cache.cache_clear()
    assert len(found) == bool(lacking)
    for one in found:
        assert not one.required and one.found is None and all(part in one.advice for part in (*lacking, "YADE_PREFIX", "make yade-plugin"))
