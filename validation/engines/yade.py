"""YADE, in an overlay of links to the system's YADE and dembark's plugin and Python module."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from dembark.common.choices import Value
from dembark.common.errors import DembarkError

from .base import DECK_NOTE, DeckNumber, Engine, EngineFacts, texts

# Features of YADE's build, and what needs them.
_FEATURES = {"VTK": "VTKRecorder", "QT5": "yade.qt, SnapshotEngine", "GTS": "pack.gtsSurface2Facets", "CGAL": "TesselationWrapper",
             "PFVFLOW": "FlowEngine"}


class Yade(Engine):
    """YADE's Python script with words `key=value`; one process, threads."""

    facts = EngineFacts.read("yade")

    @property
    def prefix(self) -> Path:
        """Folder of the overlay, with `bin` and `lib`."""
        return self.executable.parent.parent

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        """See Engine. The numbers take the place of the line `p = dembark.parameters()`."""
        lines = [f"# {DECK_NOTE}", "p = dembark.parameters("]
        lines += [f"    {name}={number.value!r}," + (f"  # {number.meaning}" if number.meaning else "") for name, number in numbers.items()]
        before, marker, after = source.partition("p = dembark.parameters()\n")
        if not marker:
            raise DembarkError("the deck has no line 'p = dembark.parameters()'", cls.facts.deck, "add it where the numbers belong")
        return before + "\n".join([*lines, ")"]) + "\n" + after

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        """See Engine; DembarkError for more than one rank."""
        self.facts.check_ranks(ranks)
        return [str(self.executable), f"-j{threads}", "-n", "-x", str(deck), *(f"{key}={value}" for key, value in texts(values).items())]

    def environment(self, threads: int = 1) -> dict[str, str]:
        """See Engine; it runs with the system's Python."""
        result = super().environment(threads)
        return result | {"YADE_PREFIX": str(self.prefix), "PATH": "/usr/bin:" + result.get("PATH", "")}

    def own_files(self) -> Iterable[Path]:
        """The program, YADE's libraries and dembark's part of the overlay."""
        # The overlay consists of links to YADE's own files; what is no link, or carries our name, is dembark's.
        return [self.executable, *(path for suffix in ("*.so", "*.py") for path in (self.prefix / "lib").rglob(suffix)
                                   if path.is_file() and (not path.is_symlink() or "dembark" in path.name or path.match("lib*.so")))]

    def missing_parts(self) -> Iterable[str]:
        """See Engine; its start script names the features."""
        script = self.executable.read_text(encoding="utf-8", errors="replace")
        named = re.search(r"(?m)^features,version,debugbuild='([^']*)'", script)
        return [f"{name} ({needed_by})" for name, needed_by in _FEATURES.items() if named and name not in named[1].split()]

    def build_folders(self) -> Iterable[Path]:
        """The plugin is built in `yade` next to the overlay."""
        return [self.prefix.parent / "yade"]
