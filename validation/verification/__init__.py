"""Verification: instruments of the harness, and solvers, on problems whose answer is known exactly, apart from any engine.

Each item is a function without arguments that computes an `Item` in a second or two; a new one is added to `ITEMS`. The workflow writes
them all to `verification.json`, which the report includes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dembark.common.files import read_json, write_json
from dembark.validation.judge.inputs import KEY
from dembark.validation.judge.result import QuantityRecord, from_json
from dembark.validation.judge.tally import VERIFICATION as FILE

from . import fields_balance, fields_exact, fields_rings, sph_flows
from .item import Curve, Item, Panel

ITEMS: tuple[Callable[[], Item], ...] = (
    fields_exact.conservation,
    fields_exact.threads,
    fields_balance.balance,
    fields_balance.wall_forces,
    fields_exact.lattice,
    fields_exact.shear,
    fields_rings.rings,
    sph_flows.still_water,
    sph_flows.added_mass,
    sph_flows.floating,
)


def items() -> list[Item]:
    """All items, computed; some seconds."""
    return [compute() for compute in ITEMS]


def write(results: Path, found: list[Item] | None = None, inputs_hash: str = "") -> None:
    """Compute all items, unless they are `found` already, and write them to `verification.json` in a results folder, with the hash of the
    code that computed them."""
    write_json(results / FILE, {"items": [asdict(item) for item in (items() if found is None else found)], KEY: inputs_hash})


def read(results: Path) -> list[Item]:
    """The items in the `verification.json` of a results folder; none when there is no such file."""
    return [_item(one) for one in (read_json(results / FILE) or {}).get("items", [])]


def _item(content: dict[str, Any]) -> Item:
    panels = [Panel(**panel | {"curves": [Curve(**curve) for curve in panel["curves"]]}) for panel in content["panels"]]
    return Item(**content | {"quantities": [from_json(one, QuantityRecord, FILE) for one in content["quantities"]], "panels": panels})
