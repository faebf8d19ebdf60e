"""The engines: one module each, found by name.

To add an engine:
1. write `validation/engines/<name>.py` with a class that derives from Engine (base.py) and says its program and command, and what is known
   of it into facts.toml, with what it is capable of;
2. add the class to ENGINES below, where it shall stand in lists and tables;
3. add its deck, with the file name from its facts, to the cases that it shall run, and its name to `engines` in their case.toml.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache

from dembark.common.choices import pick
from dembark.common.errors import DembarkError

from .base import CAPABILITIES, DeckNumber, Engine, EngineFacts, RigidBody, call, end_with_parent, mpi_launcher
from .lammps import Lammps
from .liggghts import Liggghts
from .yade import Yade

__all__ = ["CAPABILITIES", "ENGINES", "DeckNumber", "Engine", "EngineFacts", "RigidBody", "absent", "call", "end_with_parent",
           "engine_class", "facts", "find", "mpi_launcher", "names", "titles"]

ENGINES: tuple[type[Engine], ...] = (Liggghts, Yade, Lammps)


def names() -> tuple[str, ...]:
    """Names of the registered engines, in their order."""
    return tuple(engine.facts.name for engine in ENGINES)


def facts(name: str) -> EngineFacts:
    """What is known of the engine called `name` even where it is not installed; DembarkError with near matches for an unknown one."""
    return engine_class(name).facts


@cache
def find(name: str) -> Engine:
    """The engine called `name`, asked for its version; DembarkError when it is unknown or, with what to do, not installed."""
    return engine_class(name).find()


def absent(wanted: Iterable[str]) -> dict[str, str]:
    """The optional ones of the engines `wanted` that are not on this machine, and why each cannot be used."""
    found: dict[str, str] = {}
    for name in dict.fromkeys(wanted):
        if facts(name).optional:
            try:
                find(name)
            except DembarkError as error:
                found[name] = str(error)
    return found


def titles(joint: str, which: Callable[[EngineFacts], bool] = lambda _: True) -> str:
    """Titles for a sentence, of the engines for which `which` holds, with `joint` before the last: `A, B and C`."""
    found = [engine.facts.title for engine in ENGINES if which(engine.facts)]
    return f" {joint} ".join([", ".join(found[:-1]), found[-1]]) if len(found) > 1 else "".join(found)


def engine_class(name: str) -> type[Engine]:
    """The class of the engine called `name`; DembarkError with near matches for an unknown one."""
    pick(name, names(), "engine", "")
    return next(engine for engine in ENGINES if engine.facts.name == name)
