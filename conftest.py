"""Options that select long tests, and what all tests share."""

# Before pytest takes the folder packaging/ for this library.
import packaging.version  # noqa: F401
import pytest


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
