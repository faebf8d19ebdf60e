"""Verification: instruments of the harness on problems whose answer is known exactly, apart from any engine.

A chapter of the report. Each item is a function without arguments that computes an `Item` in a second or two; a new one is added to
`ITEMS`.
"""

from __future__ import annotations

from collections.abc import Callable

from dembark.validation.verification import fields_balance, fields_exact, fields_rings
from dembark.validation.verification.item import Item

ITEMS: tuple[Callable[[], Item], ...] = (
    fields_exact.conservation,
    fields_exact.threads,
    fields_balance.balance,
    fields_balance.wall_forces,
    fields_exact.lattice,
    fields_exact.shear,
    fields_rings.rings,
)


def items() -> list[Item]:
    """All items, computed."""
    return [compute() for compute in ITEMS]
