"""YADE, in an overlay of links to the system's YADE beside dembark's plugin and Python module."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.validation.engines.base import DECK_NOTE, DeckNumber, Engine, EngineFacts, built, is_program, named_program, texts


class Yade(Engine):
    """YADE's Python script with words `key=value`; one process, threads."""

    facts = EngineFacts(
        name="yade",
        title="YADE",
        program="YADE with dembark's laws",
        deck="yade.py",
        variables=("DEMBARK_YADE",),
        version_words=("--version",),
        version_pattern=r"[Yy]ade version:?\s*(\S+)",
        by_hand="dembark yade -n -x yade.py",
        restart_suffix="yade.gz",
        restart_words=("dembark.run(",),
        impact_id_offset=1,
        # Okabe & Ito's palette, which colour-blind readers can tell apart.
        colour="#D55E00",
        marker="s",
        threads=True,
        interactive=True,
        relative_cost=10,
        restart_rate=1e5,
        # About the mean of the cases with grains.
        typical_rate=3e5,
        # From `make validate` (profile quick, one run a core), except plane_silo, gravity_channel and single_contact, which are of single
        # small runs beside other work. Small runs of logs are mostly the engine's start; each step of many logs costs more than in
        # proportion.
        measured_on="Intel Xeon (2 virtual cores), 2026-11-21, YADE 2025.2.0",
        rates={"silo": 4.1e5, "plug_flow": 4.3e5, "plane_silo": 1.9e5, "gravity_channel": 1.6e5, "debarking_drum": 4.2e5,
               "log_pile": 4.2e5, "log_cradle": 1.1e5, "log_pair": 9.0e3, "single_contact": 1.2e4},
    )

    @classmethod
    def locate(cls) -> Path:
        """DEMBARK_YADE (folder or executable), else the overlay that was built here."""
        named = os.environ.get("DEMBARK_YADE")
        if named:
            place = Path(named)
            return named_program(place / "bin/yade" if place.is_dir() else place, "DEMBARK_YADE")
        overlay = built("yade-overlay")
        if overlay and is_program(overlay / "bin/yade"):
            return overlay / "bin/yade"
        raise DembarkError("YADE with dembark's laws not found", f"no {overlay or 'build/yade-overlay'}",
                           "build it with 'make yade-plugin' or set DEMBARK_YADE to its folder or executable")

    @property
    def prefix(self) -> Path:
        """Folder of the overlay, with `bin` and `lib`."""
        return self.executable.parent.parent

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        """See Engine. The numbers take the place of the line `p = dembark.parameters()`."""
        lines = [f"# {DECK_NOTE}", "from types import SimpleNamespace", "", "p = SimpleNamespace("]
        lines += [f"    {name}={number.value!r}," + (f"  # {number.meaning}" if number.meaning else "") for name, number in numbers.items()]
        before, marker, after = source.partition("p = dembark.parameters()\n")
        if not marker:
            raise DembarkError("the deck has no line 'p = dembark.parameters()'", cls.facts.deck, "add it where the numbers are to stand")
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
        """The program and dembark's part of the overlay."""
        # The overlay consists of links to YADE's own files; what is no link, or carries our name, is dembark's.
        return [self.executable, *(path for suffix in ("*.so", "*.py") for path in (self.prefix / "lib").rglob(suffix)
                                   if path.is_file() and (not path.is_symlink() or "dembark" in path.name))]

    def build_folders(self) -> Iterable[Path]:
        """The plugin is built in `yade` beside the overlay."""
        return [self.prefix.parent / "yade"]
