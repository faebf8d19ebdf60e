"""Negative controls: every check has wrong physics that fails it, and passes without it. [controls] of case.toml names them: wrong physics
= the quantities that it fails. A function `controls_<case>(folder)` in one of the test modules yields a `Control` for each name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from dembark.input_decks.tests.measuring import Control, names
from dembark.validation.case.folders import find, load, package_root
from dembark.validation.judge.verdict import declared

# Where controls_<case> is, by case.
MODULES = {case: f"dembark.input_decks.tests.{path.stem}" for path in Path(__file__).parent.glob("test_*.py")
           for case in re.findall(r"^def controls_(\w+)\(", path.read_text(encoding="utf-8"), re.MULTILINE)}
# Cases whose controls take more than 10 s together: by default the first of one.
SLOW = ("plane_silo", "plug_flow", "silo", "single_contact")
CASES = [path.parent.name for path in sorted(package_root().glob("*/case.toml"))]


def controls(case: str, folder: Path) -> Iterator[Control]:
    return getattr(import_module(MODULES[case]), f"controls_{case}")(folder)


@pytest.mark.parametrize("case", CASES)
def test_every_check_names_what_fails_it(case: str) -> None:
    without = [name for name, one in load(package_root() / case / "case.toml").quantities.items()
               if one.tolerance is not None and not one.control]
    assert not without, "these checks are not counted: [controls] names nothing that fails them"


@pytest.mark.parametrize("case", [pytest.param(case, marks=pytest.mark.full if case in SLOW else ()) for case in CASES])
def test_wrong_physics_fails_what_passes_without_it(case: str, tmp_path: Path) -> None:
    found = find(case)
    passed, caught = set[str](), {name: set[str]() for name in found.controls}
    for one in controls(case, tmp_path) if found.controls else ():
        right = names(one.right, "pass")
        caught[one.name] |= {name for name in right & names(one.wrong, "fail") if declared(found, name)[0].name in found.controls[one.name]}
        passed |= right
    for name, quantities in found.controls.items():
        silent = set(quantities) - {declared(found, one)[0].name for one in caught[name]}
        assert not silent, f"{name}: these do not fail, or do not pass without it"
    untouched = passed - set().union(*caught.values())
    assert not untouched, "these passed, and no control that names them fails them"


def test_the_first_wrong_physics_of_a_slow_case_fails(tmp_path: Path) -> None:
    found = find(SLOW[0])
    one = next(iter(controls(SLOW[0], tmp_path)))
    caught = names(one.right, "pass") & names(one.wrong, "fail")
    assert {declared(found, name)[0].name for name in caught} & set(found.controls[one.name])


def test_a_control_that_fails_nothing_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The controls' own control: runs that are not spoilt at all."""
    tame = [Control(one.name, one.right, one.right) for one in controls("log_cradle", tmp_path)]
    monkeypatch.setattr(import_module(MODULES["log_cradle"]), "controls_log_cradle", lambda _: tame)
    with pytest.raises(AssertionError, match="do not fail"):
        test_wrong_physics_fails_what_passes_without_it("log_cradle", tmp_path)
