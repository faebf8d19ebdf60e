"""A result comes back as it was written; one that is incomplete, or of another version, gives one line."""

import json
from pathlib import Path

import pytest

from dembark.common.errors import RunError
from dembark.postproc.measurement import Value
from dembark.postproc.statistics import Estimate
from dembark.validation.case.model import Declared
from dembark.validation.judge import result
from dembark.validation.judge.result import ComparedRecord, Comparison, QuantityRecord, Result
from dembark.validation.judge.verdict import judged

RECORD = judged(Declared("mass", "mass", "kg", "identity", 0.05), Value(Estimate(1.02, 0.01, "3 replicas"), Estimate(1.0, 0.0)))
RESULT = Result("silo", "dry", "yade", (RECORD,), "quick", parameters={"gravity": 9.81}, profiles=({"name": "stress", "place": [0.0]},),
                remarks=("note",), provenance={"commit": "a"}, inputs=("f00",))


def test_a_result_comes_back_as_it_was_written(tmp_path: Path) -> None:
    result.write(tmp_path / "metrics.json", RESULT)
    assert result.read(tmp_path / "metrics.json") == RESULT
    content = json.loads((tmp_path / "metrics.json").read_text())
    assert content["quantities"][0]["evidence"] == "identity" and content["quantities"][0]["interval"] == [1.01, 1.03]
    assert "agreement" not in content["quantities"][0] and "title" not in content


def test_a_comparison_comes_back_as_it_was_written(tmp_path: Path) -> None:
    both = Comparison("silo", "dry", ("liggghts", "yade"),
                      (ComparedRecord("mass", 1.0, "pass", engine="yade", reference_engine="liggghts"),))
    result.write(tmp_path / "comparison.json", both)
    content = json.loads((tmp_path / "comparison.json").read_text())
    assert result.from_json(content, Comparison) == both and both.quantities[0].evidence == "code"


def test_keys_of_another_version_are_named_in_one_remark() -> None:
    content = result.as_json(RESULT)
    content["colour"] = "red"
    content["quantities"] = [one | {"mood": "glad"} for one in content["quantities"] * 2]
    found = result.from_json(content, Result)
    *kept, note = found.remarks
    assert kept == ["note"] and "colour, mood" in note and "\n" not in note and found.quantities == (RECORD, RECORD)


@pytest.mark.parametrize("key", ["case", "engine", "quantities"])
def test_a_result_without_what_all_have_is_refused(key: str) -> None:
    content = {name: value for name, value in result.as_json(RESULT).items() if name != key}
    with pytest.raises(RunError, match=f"metrics.json has no {key}, "):
        result.from_json(content, Result, "metrics.json")


@pytest.mark.parametrize("change", [{"verdict": "passed"}, {"evidence": "belief"}])
def test_words_that_do_not_exist_are_refused(change: dict[str, str]) -> None:
    with pytest.raises(RunError, match="quantity 'mass'"):
        QuantityRecord(**{"name": "mass", "value": 1.0, "verdict": "pass"} | change)


def test_unreadable_results_of_a_folder_are_named(tmp_path: Path) -> None:
    for place, text in (("silo/dry/yade/metrics.json", json.dumps(result.as_json(RESULT))), ("silo/wet/yade/metrics.json", "{"),
                        ("silo/dry/comparison.json", "{}")):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).write_text(text)
    found, compared, problems = result.results(tmp_path)
    assert found == [RESULT] and not compared
    assert len(problems) == 2 and "comparison.json has no case" in problems[0] and "wet" in problems[1]
    assert all("\n" not in line for line in problems)


def test_a_relative_deviation_from_zero_is_no_pass() -> None:
    record = judged(Declared("drift", "drift", tolerance=0.1), Value(Estimate(0.0, 0.0), Estimate(0.0, 0.0)))
    assert record.verdict == "fail" and record.deviation is None
