"""Decks with the numbers of a small run, in a folder of their own and run with the plain command of the engine."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from dembark.common.errors import DembarkError
from dembark.postproc.replica import Replica
from dembark.validation import engines
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import portable, resolve


class Deck:
    """The deck of `case` for an engine, written into `folder` with its defaults, the `variant` and the changed `values`."""

    def __init__(self, case: str, engine: str, folder: Path, values: Mapping[str, Any], variant: str | None = None) -> None:
        try:
            self.engine = engines.find(engine)
        except DembarkError as error:
            pytest.skip(str(error))
        self.folder, self.variant = folder, variant
        folder.mkdir(exist_ok=True)
        found = find(case)
        self.values = portable(resolve(found, None, variant, values))
        self.setup = deck.write(found, engine, self.values, folder)

    def start(self, ranks: int = 1, **words: Any) -> subprocess.Popen[bytes]:
        """The engine at work, with `words` such as resume="yes" behind its command; it writes into `log`."""
        command = self.engine.command(self.folder / self.engine.facts.deck, words, ranks)
        with (self.folder / "log").open("wb") as log:
            return subprocess.Popen(command, cwd=self.folder, env=self.engine.environment(), stdin=subprocess.DEVNULL, stdout=log,
                                    stderr=subprocess.STDOUT)

    def said(self) -> str:
        return (self.folder / "log").read_text(errors="replace")

    def run(self, ranks: int = 1, **words: Any) -> str:
        """To the end; what the engine said."""
        process = self.start(ranks, **words)
        try:
            code = process.wait(300)
        finally:
            process.kill()
        assert code == 0 and "dembark: finished" in self.said(), self.said()[-2000:]
        return self.said()

    def replica(self) -> Replica:
        """What the run has written, with the record that a run of the harness has."""
        facts, numbers = self.engine.facts, {**self.setup.numbers, "steps": self.setup.steps, "time_step": self.setup.time_step}
        return Replica(self.folder, {"engine": facts.name, "variant": self.variant, "parameters": self.values, "derived": numbers,
                                     "time_step": self.setup.time_step, "impact_id_offset": facts.impact_id_offset})


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """YADE, which starts in seconds, is left to --full where a test runs the same in another engine by default."""
    def alone(item: pytest.Function) -> tuple[object, ...]:
        """The test and its parameters but for the engine."""
        return item.path, item.originalname, *((key, repr(one)) for key, one in item.callspec.params.items() if key != "engine")

    runs = [one for one in items if one.path.parent == Path(__file__).parent and isinstance(one, pytest.Function)
            and "engine" in getattr(getattr(one, "callspec", None), "params", ()) and {"decks", "simulate"} & set(one.fixturenames)]
    others = {alone(one) for one in runs if one.callspec.params["engine"] != "yade" and "full" not in one.keywords}
    for one in runs:
        if one.callspec.params["engine"] == "yade" and alone(one) in others:
            one.add_marker(pytest.mark.full)


@pytest.fixture(scope="session")
def decks() -> type[Deck]:
    return Deck


@pytest.fixture(scope="session")
def simulate(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Replica]:
    """Runs a case in an engine, with some parameters changed, in a folder of its own, and reads what came of it."""
    def finished(case: str, engine: str, changes: Mapping[str, Any], variant: str | None = None) -> Replica:
        one = Deck(case, engine, tmp_path_factory.mktemp(f"{case}-{variant}-{engine}"), changes, variant)
        one.run()
        return one.replica()

    return finished
