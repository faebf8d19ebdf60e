"""What holds for the declarations of all cases."""

from __future__ import annotations

import pytest

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
