"""How engines look in reports: names as their makers write them, colours that colour-blind readers can tell apart, markers."""

from __future__ import annotations

from dataclasses import dataclass

from dembark.validation import engines

# Okabe & Ito's palette.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKS = ("o", "s", "D", "^", "v", "P")


@dataclass(frozen=True)
class Look:
    """Title, colour and marker of an engine."""

    title: str
    colour: str
    marker: str


def look(engine: str) -> Look:
    """How `engine` looks in all figures; one that is not known gets one of the spare colours."""
    if engine in engines.names():
        facts = engines.facts(engine)
        return Look(facts.title, facts.colour, facts.marker)
    spare = 2 + sum(engine.encode()) % (len(PALETTE) - 2)
    return Look(engine, PALETTE[spare], MARKS[spare])


def engine_name(engine: str) -> str:
    """As its makers write it."""
    return look(engine).title


def colour(engine: str) -> str:
    """Colour of an engine."""
    return look(engine).colour
