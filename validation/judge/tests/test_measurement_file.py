"""What is kept of a measurement: fields and maps have files of their own, and without one of them all is measured anew."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from dembark.postproc.measurement import Measurement, number
from dembark.postproc.output.vtkhdf import Surface
from dembark.validation import metrics
from dembark.validation.judge import measurement, measurement_file


def test_fields_and_a_map_are_written_and_missed_when_they_are_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    triangle = Surface(np.eye(3), np.array([[0, 1, 2]]), {"wear": (np.ones(1), "m s-1")})
    found = Measurement({"height": number(2.0)}, fields=xarray.Dataset({"density": ("x", np.ones(2))}), surface=triangle)
    monkeypatch.setattr(measurement, "measure", lambda *_: found)
    run = SimpleNamespace(record={}, folder=tmp_path)
    kept = metrics._measure(tmp_path, None, [run], "as it was")
    assert kept.files == ("fields.nc", "surface.vtkhdf") and kept.found.values["height"].estimate.value == 2.0
    assert all((tmp_path / name).stat().st_size > 100 for name in kept.files)
    assert measurement_file.read(tmp_path, "another") is None
    for name in kept.files:
        assert measurement_file.read(tmp_path, "as it was") is not None
        content = (tmp_path / name).read_bytes()
        (tmp_path / name).unlink()
        assert measurement_file.read(tmp_path, "as it was") is None
        (tmp_path / name).write_bytes(content)
