"""What holds for the declarations of all cases."""

from __future__ import annotations

from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation.case.folders import load, package_root
from dembark.validation.case.model import Case

CASES = [load(path) for path in sorted(package_root().glob("*/case.toml"))]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_largest_profile_is_not_left_at_the_numbers_of_a_trial(case: Case) -> None:
    if case.runs.get("full") and case.profiles["standard"]:
        assert case.profiles["full"], "what [profiles] standard changes, full changes as well, or it is the smaller one"


def test_lines_of_declarations_have_140_columns() -> None:
    files = [*package_root().glob("*/case.toml"), package_root() / "common" / "groups.toml"]
    assert not [f"{path}:{number}" for path in files
                for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1) if len(line) > 140]


def own(folder: Path, variants: str) -> Case:
    folder.mkdir()
    (folder / "liggghts.in").write_text("# A deck.\n")
    (folder / "case.toml").write_text(f"""
[case]
title = "Mine"
[parameters]
a = {{ value = 1.0, doc = "one" }}
b = {{ value = 2.0, doc = "two" }}
[variants]
{variants}
""")
    return load(folder / "case.toml")


def test_a_variant_like_another_has_all_of_it_and_its_own_changes(tmp_path: Path) -> None:
    case = own(tmp_path / "mine", 'first = { a = 3.0, b = 4.0 }\nsecond = { like = "first", b = 5.0 }\n'
                                  'third = { like = "second", a = 6.0 }')
    assert case.variants["second"] == {"a": 3.0, "b": 5.0} and case.variants["third"] == {"a": 6.0, "b": 5.0}


def test_a_variant_is_like_an_earlier_one(tmp_path: Path) -> None:
    with pytest.raises(DembarkError, match="later"):
        own(tmp_path / "mine", 'first = { like = "later" }\nlater = {}')
