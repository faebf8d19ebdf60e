"""What is counted as passed, failed, open and information, and how that is said."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from dembark.postproc.measurement import Value
from dembark.postproc.statistics import Estimate
from dembark.validation.case.model import Declared
from dembark.validation.judge import result
from dembark.validation.judge.comparison import pair
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.judge.tally import of_folder, tally
from dembark.validation.judge.verdict import judge, judged

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


def test_a_family_counts_once_and_stands_as_its_worst_member() -> None:
    one = QuantityRecord("angle", 1.0, "pass", tolerance=0.1, evidence="experiment", control="friction off", family="heap: angle",
                         chance=0.03)
    failed, undecided = replace(one, verdict="fail"), replace(one, verdict="info")
    other = replace(one, family="heap: height", chance=None)
    assert tally((one, one, one)).sentence == "1 of 1 check passed, none failed"
    assert tally((one, undecided, one, other)).sentence == "1 of 2 checks passed, none failed, 1 open"
    found = tally((one, undecided, failed, other))
    assert (found.passed, found.failed, found.open, found.members, found.random) == (1, 1, 0, 4, 1)
    assert found.by_chance == pytest.approx(0.09) and found.sentences[1] == ("families: 4 judged values make 2 checks: "
                                                                             "values that measure the same thing count once")
    # Neither a shown value nor a pass that nothing is known to fail makes a family pass or fail.
    assert tally((replace(one, verdict="info", tolerance=None), one)).passed == 1
    assert tally((replace(one, control=""), failed)).failed == 1


def test_a_pass_without_a_negative_control_is_not_counted() -> None:
    without = QuantityRecord("f", 1.0, "pass", tolerance=0.1, evidence="identity")
    found = tally((*QUANTITIES, without))
    assert without.standing == "uncontrolled" and (found.passed, found.checks, found.uncontrolled) == (1, 4, 1)
    assert found.sentence == "1 of 4 checks passed, 2 FAILED, 1 open; 1 without a negative control not counted"
    assert tally((without,)).sentence == "no checks; 1 without a negative control not counted"


def test_checks_that_rest_on_intervals_are_counted_with_what_chance_does_to_them() -> None:
    declared = Declared("q", "q", evidence="theory", tolerance=0.1)
    halves = (0.0, 0.1, 0.05, 0.3)
    found = [judged(declared, Value(Estimate(1.0, half, "5 replicas"), Estimate(1.0, 0.0))) for half in halves]
    assert [one.verdict for one in found] == ["pass", "pass", "pass", "info"]
    # Student's interval over five packings: one in twenty is beyond it, 0.5 % are beyond twice of it. One wider than allowed fails when
    # all of it is beyond that: 2 % are.
    assert [one.chance for one in found] == [None, pytest.approx(0.05), pytest.approx(0.00516, rel=0.01), pytest.approx(0.0208, rel=0.01)]
    counted = tally([*found, QuantityRecord("d", 1.0, "info", chance=0.5)])
    assert counted.random == 3 and counted.by_chance == pytest.approx(0.0759, rel=0.01)
    assert counted.sentences[-1] == ("chance: 3 of the checks rest on intervals; "
                                     "if every model held exactly, at most 0.08 failures would be expected")
    assert not any("chance" in line for line in tally(QUANTITIES).sentences)


@pytest.mark.parametrize(("deviation", "half", "verdict"), [
    (0.05, 0.04, "pass"), (0.05, 0.06, "info"), (0.15, 0.06, "fail"), (0.15, 0.2, "info"), (0.05, 0.2, "info"), (-0.32, 0.2, "fail"),
    (0.0, math.inf, "info"), (5.0, math.inf, "info"), (math.nan, 0.1, "fail")])
def test_a_wide_interval_leaves_a_check_open_unless_all_of_it_is_beyond(deviation: float, half: float, verdict: str) -> None:
    assert judge(deviation, half, 0.1)[0] == verdict


def test_the_comparisons_of_a_page_fail_by_chance_in_one_of_a_hundred_pages() -> None:
    one = QuantityRecord("q", 1.0, "info", interval=(0.99, 1.01), basis="5 replicas")
    assert sum(pair(one, one, "liggghts", "yade", 20).chance or 0.0 for _ in range(20)) == pytest.approx(0.01)


def test_a_folder_with_what_cannot_be_read(tmp_path: Path) -> None:
    for name in ("yade", "liggghts"):
        (tmp_path / "silo/dry" / name).mkdir(parents=True)
    result.write(tmp_path / "silo/dry/yade/metrics.json", Result("silo", "dry", "yade", QUANTITIES))
    (tmp_path / "silo/dry/liggghts/metrics.json").write_text("[]")
    (tmp_path / "verification.json").write_text(json.dumps({"items": [{"quantities": [result.as_json(QUANTITIES[1])]}]}))
    found = of_folder(tmp_path)
    assert (found.passed, found.failed) == (1, 3) and len(found.unread) == 1
    assert found.sentences[-1].startswith("not counted: ")
