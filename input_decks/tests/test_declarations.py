"""What the cases declare to measure, to judge and to run is what it was: a change of these tables is meant, and seen.

After one that is meant: python -m dembark.input_decks.tests.test_declarations
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import pytest

from dembark.validation.case.folders import load, package_root
from dembark.validation.case.model import Case
from dembark.validation.case.resolve import resolve

HERE = Path(__file__).parent
FIELDS = ("unit", "evidence", "tolerance", "absolute", "agreement", "compared", "family", "why", "source")


def _cases() -> list[Case]:
    return [load(path) for path in sorted(package_root().glob("*/case.toml"))]


def quantities() -> list[tuple[str, ...]]:
    """All quantities with what a verdict depends on."""
    return [("case", "quantity", *FIELDS),
            *((case.name, name, *(str(getattr(one, field)) for field in FIELDS))
              for case in _cases() for name, one in case.quantities.items())]


def runs() -> list[tuple[str, ...]]:
    """All runs of all profiles with their replicas, and the variants that no profile runs."""
    found = [("case", "profile", "variant", "engine", "replicas")]
    for case in _cases():
        for profile, planned in case.runs.items():
            found += [(case.name, profile, run.variant, engine,
                       str(run.replicas.get(engine, resolve(case, profile, run.variant).get("replicas", 1))))
                      for run in planned for engine in run.engines]
        found += [(case.name, "", name, "", "") for name in case.variants
                  if not any(run.variant == name for planned in case.runs.values() for run in planned)]
    return found


TABLES = {"quantities.csv": quantities, "runs.csv": runs}


def text(rows: Iterable[tuple[str, ...]]) -> str:
    """The rows as a CSV file."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


@pytest.mark.parametrize("name", TABLES)
def test_the_cases_declare_what_they_did(name: str) -> None:
    before, now = (HERE / name).read_text(encoding="utf-8").splitlines(), text(TABLES[name]()).splitlines()
    assert not set(before) ^ set(now), "these rows are new or gone; see the head of this file"
    assert before == now


@pytest.mark.parametrize("case", _cases(), ids=lambda case: case.name)
def test_the_largest_profile_is_not_left_at_the_numbers_of_a_trial(case: Case) -> None:
    if case.runs.get("full") and case.profiles["standard"]:
        assert case.profiles["full"], "what [profiles] standard changes, full changes as well, or it is the smaller one"


if __name__ == "__main__":
    for table, rows in TABLES.items():
        (HERE / table).write_text(text(rows()), encoding="utf-8")
