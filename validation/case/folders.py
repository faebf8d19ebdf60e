"""Where cases are: the folder that ships, and the user's own."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError

from .model import Case

# Folders of the user's own cases, as in PATH; `dembark --cases FOLDER` adds to it.
VARIABLE = "DEMBARK_CASES"
# A folder that replaces the cases that ship.
INSTEAD = "DEMBARK_DECKS"


def package_root() -> Path:
    """Folder of the cases that ship, and of what cases share."""
    from dembark import input_decks

    return Path(next(iter(input_decks.__path__))).resolve()


def shipped_root() -> Path:
    """Folder of the cases that ship, or the one that DEMBARK_DECKS names in its place."""
    named = os.environ.get(INSTEAD)
    if named and not Path(named).is_dir():
        raise DembarkError(f"{INSTEAD}={named} is not a folder", "", "set it to the folder that holds the case folders")
    return Path(named).resolve() if named else package_root()


def own_roots() -> list[Path]:
    """Folders of the user's own cases; DembarkError for one that is not there."""
    named = [Path(text) for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text]
    for root in named:
        if not root.is_dir():
            raise DembarkError(f"{root} is not a folder", f"in {VARIABLE} or --cases", "name the folder that holds your case folders")
        if (root / "case.toml").is_file():
            raise DembarkError(f"{root} is a case itself", f"in {VARIABLE} or --cases",
                               f"name the folder above it, {root.resolve().parent}")
    return [root.resolve() for root in named]


def add_own_root(root: Path) -> None:
    """Look for cases in `root` too, in this process and those that it starts."""
    named = [text for text in os.environ.get(VARIABLE, "").split(os.pathsep) if text]
    os.environ[VARIABLE] = os.pathsep.join(dict.fromkeys([*named, str(root.resolve())]))


def variables() -> dict[str, str]:
    """The environment variables that say where cases are, as they stand, with absolute paths: those that are set."""
    named = {VARIABLE: os.pathsep.join(map(str, own_roots())), INSTEAD: str(shipped_root()) if os.environ.get(INSTEAD) else ""}
    return {name: value for name, value in named.items() if value}


def files() -> Iterator[Path]:
    """The case.toml of all cases, own ones last; DembarkError when two cases have one name."""
    seen: dict[str, Path] = {}
    for root in (shipped_root(), *own_roots()):
        for path in sorted(root.glob("*/case.toml")):
            if path.parent.name in seen:
                raise DembarkError(f"two cases are called {path.parent.name}", f"{seen[path.parent.name]} and {path}", "rename yours")
            seen[path.parent.name] = path
            yield path


def discover() -> dict[str, Case]:
    """All cases by name; raises DembarkError at the first case.toml with a mistake."""
    return {path.parent.name: load(path) for path in files()}


def find(name: str) -> Case:
    """The case called `name`; only its own file is read, so a mistake in another case does not matter."""
    known = {path.parent.name: path for path in files()}
    require_known(name, known)
    return load(known[name])


def require_known(name: str, known: Iterable[str], where: str = "") -> None:
    """DembarkError unless `name` is one of the `known` cases: near matches, and how own cases are found where no folder is given."""
    names = list(known)
    if name not in names:
        near = nearest(name, names)
        near = near if near.endswith("?") else "'dembark cases' lists all."
        raise DembarkError(f"unknown case {name!r}", where,
                           near if own_roots() else f"{near} A case of your own: dembark --cases FOLDER ..., or {VARIABLE}=FOLDER")


@cache
def load(path: Path) -> Case:
    """Read and check one case.toml; raises DembarkError saying what is wrong in which table."""
    # The reader finds the groups of parameters by this module.
    from .reader import CaseReader
    from .tables import load_toml

    return CaseReader(path).case(load_toml(path))
