"""Options that select long tests, and what all tests share."""

import os
import sys
from importlib import import_module
from pathlib import Path

# Ranks of LAMMPS and threads that wait sleep instead of taking the processors from the other tests; by default they ask without rest.
# OpenBLAS, which cannot do so, has one thread; it reads this when numpy is imported.
os.environ |= {"OMP_WAIT_POLICY": "passive", "OPENBLAS_NUM_THREADS": "1", "MPIR_CVAR_CH4_PROGRESS_THROTTLE": "1",
               "MPIR_CVAR_CH4_PROGRESS_THROTTLE_NO_PROGRESS_COUNT": "10"}

# Before pytest takes the folder packaging/ for this library.
import packaging.version  # noqa: F401
import pytest

# pytest imports a test module by its path, and first the packages above it, with names that lack "dembark.": these are no second copies.
_ROOT = Path(__file__).parent
for _package in ("common", "input_decks", "postproc", "validation"):
    for _tests in sorted(_ROOT.glob(f"{_package}/**/tests")):
        _name = ".".join(_tests.parent.relative_to(_ROOT).parts)
        sys.modules.setdefault(_name, import_module(f"dembark.{_name}"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--full", action="store_true", help="also run the tests marked full")
    parser.addoption("--slow", action="store_true", help="also run the tests marked slow")


@pytest.fixture(autouse=True)
def _width_is_our_own(monkeypatch: pytest.MonkeyPatch) -> None:
    # The workers of pytest-xdist have a COLUMNS of their own, which is no user's wish.
    monkeypatch.delenv("COLUMNS", raising=False)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for marker in ("full", "slow"):
        if not config.getoption(f"--{marker}"):
            skip = pytest.mark.skip(reason=f"{marker}; run with --{marker}")
            for item in items:
                if marker in item.keywords:
                    item.add_marker(skip)
