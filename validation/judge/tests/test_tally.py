"""What is counted as passed, failed, open and information, and how that is said."""

import json
from pathlib import Path

from dembark.validation.judge import result
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.judge.tally import of_folder, tally

QUANTITIES = (
    QuantityRecord("a", 1.0, "pass", tolerance=0.1, evidence="identity", control="friction off"),
    QuantityRecord("b", 1.0, "fail", tolerance=0.1, evidence="identity"),
    QuantityRecord("c", 1.0, "info", tolerance=0.1, evidence="theory", reason="too short"),
    QuantityRecord("d", 1.0, "info", reason="for orientation"),
    QuantityRecord("e", 1.0, "fail"),
)


def test_each_quantity_is_counted_once() -> None:
    found = tally(QUANTITIES)
    assert (found.passed, found.failed, found.open, found.information) == (1, 2, 1, 1)
    assert found.sentence == "1 of 4 checks passed, 2 FAILED, 1 open"
    assert {kind: (one.passed, one.failed, one.open) for kind, one in found.by_evidence.items()} == {
        "theory": (0, 0, 1), "identity": (1, 1, 0), "": (0, 1, 0)}
    assert found.sentences[0] == "theory (laws and exact solutions): 0 of 1 check passed, none failed, 1 open"
    assert tally(()).sentence == "no checks"


def test_a_pass_without_a_negative_control_is_not_counted() -> None:
    without = QuantityRecord("f", 1.0, "pass", tolerance=0.1, evidence="identity")
    found = tally((*QUANTITIES, without))
    assert without.standing == "uncontrolled" and (found.passed, found.checks, found.uncontrolled) == (1, 4, 1)
    assert found.sentence == "1 of 4 checks passed, 2 FAILED, 1 open; 1 without a negative control not counted"
    assert tally((without,)).sentence == "no checks; 1 without a negative control not counted"


def test_a_folder_with_what_cannot_be_read(tmp_path: Path) -> None:
    for name in ("yade", "liggghts"):
        (tmp_path / "silo/dry" / name).mkdir(parents=True)
    result.write(tmp_path / "silo/dry/yade/metrics.json", Result("silo", "dry", "yade", QUANTITIES))
    (tmp_path / "silo/dry/liggghts/metrics.json").write_text("[]")
    (tmp_path / "verification.json").write_text(json.dumps({"items": [{"quantities": [result.as_json(QUANTITIES[1])]}]}))
    found = of_folder(tmp_path)
    assert (found.passed, found.failed) == (1, 3) and len(found.unread) == 1
    assert found.sentences[-1].startswith("not counted: ")
