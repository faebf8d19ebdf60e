"""LIGGGHTS, in the program liggghts-dembark: LIGGGHTS-PUBLIC with dembark's styles."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2

from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.validation.engines.base import (
    DECK_NOTE,
    DeckNumber,
    Engine,
    EngineFacts,
    built,
    end_with_parent,
    is_program,
    mpi_launcher,
    named_program,
    texts,
)

_PROGRAM = "liggghts-dembark"


class Liggghts(Engine):
    """LIGGGHTS's input script with `-var key value`; MPI ranks, no threads."""

    facts = EngineFacts(
        name="liggghts",
        title="LIGGGHTS",
        program="LIGGGHTS with dembark's styles",
        deck="liggghts.in",
        variables=("DEMBARK_LIGGGHTS",),
        version_words=("-in", "/dev/null", "-log", "none"),
        version_pattern=r"\(Version (?:LIGGGHTS-PUBLIC )?([^\s,)]+)",
        by_hand="liggghts-dembark -in liggghts.in",
        restart_suffix="restart",
        restart_words=("restart_every", '"run.in"'),
        # A restart file of its own, when it is told to stop.
        leftovers=("restart_forced_liggghts_*.data",),
        stop_message="SIGINT/SIGTERM caught",
        # Okabe & Ito's palette, which colour-blind readers can tell apart.
        colour="#0072B2",
        marker="o",
        ranks=True,
        relative_cost=1,
        restart_rate=1e6,
        # About the mean of the cases with grains.
        typical_rate=2e6,
        # From `make validate` (profile quick, one run a core), except plane_silo, gravity_channel and single_contact, which are of single
        # small runs beside other work. Small runs of logs are mostly the engine's start; each step of many logs costs more than in
        # proportion.
        measured_on="Intel Xeon (2 virtual cores), 2026-11-21, LIGGGHTS-PUBLIC 3.8.0",
        rates={"silo": 3.3e6, "plug_flow": 2.4e6, "plane_silo": 1.4e6, "gravity_channel": 1.1e6, "debarking_drum": 7.4e5,
               "log_pile": 7.5e5, "log_cradle": 2.7e5, "log_pair": 3.0e4, "single_contact": 9.0e4},
    )

    @classmethod
    def locate(cls) -> Path:
        """DEMBARK_LIGGGHTS, else the one that was built here, else the one on PATH."""
        named = os.environ.get("DEMBARK_LIGGGHTS")
        if named:
            return named_program(Path(named), "DEMBARK_LIGGGHTS")
        here = built(f"bin/{_PROGRAM}")
        if here and is_program(here):
            return here
        on_path = shutil.which(_PROGRAM)
        if on_path:
            return Path(on_path)
        raise DembarkError(f"{_PROGRAM} not found", f"neither {here or 'in a build folder'} nor on PATH",
                           "build it with 'make liggghts' or set DEMBARK_LIGGGHTS to the executable")

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        """See Engine. The source is a Jinja template with << >> around expressions, for ${ } and { } have a meaning in decks."""
        environment = jinja2.Environment(loader=jinja2.FileSystemLoader([str(folder) for folder in folders]),
                                         undefined=jinja2.StrictUndefined,
                                         variable_start_string="<<", variable_end_string=">>", trim_blocks=True, lstrip_blocks=True,
                                         keep_trailing_newline=True, autoescape=False)
        # Tables are for the template; a variable holds one number.
        given = texts({name: number.value for name, number in numbers.items() if not isinstance(number.value, tuple)})
        width = max((len(name) for name in given), default=0)
        lines = [f"variable {name:{width}} index {text}" + (f" # {numbers[name].meaning}" if numbers[name].meaning else "")
                 for name, text in given.items()]
        body = environment.from_string(source).render({name: number.value for name, number in numbers.items()})
        # The opening comment of the source stays on top.
        top = re.match(r"(?:#.*\n)*", source)
        head = top.group() if top else ""
        return head + "\n".join([f"# {DECK_NOTE}", *lines]) + "\n\n" + body[len(head):].lstrip("\n")

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        """See Engine; one process is started without the MPI launcher."""
        # Ranks would outlive a launcher that is killed, and go on writing.
        launcher = [*mpi_launcher(ranks), *end_with_parent("KILL")] if ranks > 1 else []
        variables = (word for key, value in texts(values).items() for word in ("-var", key, value))
        return [*launcher, str(self.executable), "-in", str(deck), "-log", "none", *variables]
