"""The benchmark of coarse graining on a small packing."""

import json

import numpy as np

from benchmarks import fields
from benchmarks.fields import main, packing


def test_packing_has_three_short_contacts_a_grain():
    grains, contacts = packing(5)
    assert len(grains.ids) == 125 and len(contacts.ids) == 375
    length = np.linalg.norm(contacts.branch, axis=1) / 0.005
    assert length.min() > 0.3 and length.max() < 1.8


def test_all_rows_are_measured(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(fields, "CASES", (("gaussian", 1.5), ("heaviside", 2.0)))
    assert main(["--edge", "4", "--cells", "8", "--rounds", "1", "--out", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "fields.json").read_text())
    assert {one["comparison"] for one in found["rows"]} == {"gaussian, 1.5 d", "heaviside, 2 d"}
    assert all(one["wall_median"] > 0.0 for one in found["rows"]) and found["provenance"]["grains"] == 64
    assert "| gaussian, 1.5 d | 1 threads |" in capsys.readouterr().out


def test_wrong_option(capsys):
    assert main(["--edge", "1"]) == 2
    assert capsys.readouterr().err.startswith("dembark: --edge")
