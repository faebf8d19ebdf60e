"""A third engine, for tests that any number of them will do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from dembark.common.choices import Value
from dembark.validation.engines import DeckNumber, Engine, EngineFacts


class Third(Engine):
    """An optional engine without liquid carried by grains."""

    facts = EngineFacts("third", "The Third", "the third engine", deck="third.txt", version_words=("--version",),
                        version_pattern=r"third (\S+)", colour="#009E73", marker="D", variables=("THIRD",), target="make third",
                        measured_on="nothing", optional=True, capabilities=("bridges",))

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        return source

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        return [str(self.executable)]
