"""What engines with input scripts in LAMMPS's manner share: how a deck follows from its template, and the words that run it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path

import jinja2

from dembark.common.choices import Value

from .base import DECK_NOTE, DeckNumber, Engine, end_with_parent, texts

# Above the numbers that no command reads.
UNREAD_NOTE = "No command below reads these: they are worked into the commands and the numbers above, and a change here does nothing."


@cache
def _environment(folders: tuple[str, ...]) -> jinja2.Environment:
    """That of the templates in `folders`, each of which is compiled once until its file changes."""
    return jinja2.Environment(loader=jinja2.FileSystemLoader(folders), undefined=jinja2.StrictUndefined, variable_start_string="<<",
                              variable_end_string=">>", comment_start_string="{*", comment_end_string="*}", trim_blocks=True,
                              lstrip_blocks=True, keep_trailing_newline=True, autoescape=False)


class InputScript(Engine):
    """An engine whose deck is a list of commands, with `-var key value` on its command line; MPI ranks, no threads."""

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        """See Engine. The source is a Jinja template with << >> around expressions, for ${ } and { } have a meaning in decks."""
        environment = _environment(tuple(map(str, folders)))
        # Tables are for the template; a variable holds one number.
        given = texts({name: number.value for name, number in numbers.items() if not isinstance(number.value, tuple)})
        body = environment.from_string(source).render({"engine": cls.facts.name} | {name: number.value for name, number in numbers.items()})
        # Strings, not `index`: -var of a number that others were computed from would change it alone, or nothing at all. So both engines
        # refuse it, also of one that only the template reads.
        width, read = max((len(name) for name in given), default=0), _read(body, given)
        lines = [f"variable {name:{width}} string {given[name]}" + (f" # {numbers[name].meaning}" if numbers[name].meaning else "")
                 for name in sorted(given, key=lambda name: name not in read)]
        if len(read) < len(given):
            lines.insert(len(read), f"# {UNREAD_NOTE}")
        # The opening comment of the source stays on top.
        top = re.match(r"(?:#.*\n)*", source)
        head = top.group() if top else ""
        return head + "\n".join([f"# {DECK_NOTE}", *lines]) + "\n\n" + body[len(head):].lstrip("\n")

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        """See Engine; one process is started without the MPI launcher."""
        # Ranks would outlive a launcher that is killed, and go on writing.
        launcher = [*self.launcher(ranks), *end_with_parent("KILL")] if ranks > 1 else []
        variables = (word for key, value in texts(values).items() for word in ("-var", key, value))
        return [*launcher, str(self.executable), "-in", str(deck), "-log", "none", *variables]


def _read(body: str, names: Iterable[str]) -> set[str]:
    """Those of `names` whose variable a list of commands reads; all where the engine reads more files."""
    code = "\n".join(line.partition("#")[0] for line in body.splitlines())
    if re.search(r"^\s*(include\s|jump\s+(?!SELF\b))", code, re.MULTILINE):
        return set(names)
    return {name for name in names if re.search(rf"\${{{name}}}|\bv_{name}\b", code)}


def row(numbers: Iterable[float]) -> str:
    """Numbers of a line, with all their digits."""
    return " ".join(repr(float(number)) for number in numbers)
