"""What the page on campaigns shows in Python works on results, and it names every campaign that ships."""

from __future__ import annotations

from pathlib import Path

import pytest
from blocks import FENCE, ROOT

from dembark.validation.campaigns.spec import shipped_campaigns
from dembark.validation.judge.result import QuantityRecord, Result, write

PAGE = (ROOT / "docs/how-to/campaigns.md").read_text(encoding="utf-8")


def test_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for friction, value in ((0.4, 0.6), (0.2, 0.8)):
        place = tmp_path / f"results/campaigns/silo-small/silo/dry_wall_friction={friction}/liggghts"
        place.mkdir(parents=True)
        found = [QuantityRecord(name, value, "fail", interval=(value - 0.1, value + 0.1))
                 for name in ("apparent_mass_ratio", "stress_ratio_k")]
        write(place / "metrics.json", Result("silo", place.parent.name, "liggghts", tuple(found), parameters={"wall_friction": friction}))
    monkeypatch.chdir(tmp_path)
    (text,) = [text for head, text in FENCE.findall(PAGE) if head == "py"]
    known: dict[str, object] = {}
    exec(text, known)
    assert list(known["share"]["parameters.wall_friction"]) == [0.2, 0.4] and list(known["share"]["value"]) == [0.8, 0.6]


def test_every_campaign_is_named() -> None:
    for name in shipped_campaigns():
        assert f"`{name}`" in PAGE or f"`{name.removesuffix('-full')}-standard`, `-full`" in PAGE
