"""Prints what docs/theory/single_impacts.md has of Kharaz et al. (2001): the judged quantities, and the points next to other codes."""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from dembark.validation.judge.result import METRICS, ComparedRecord, Result, read

REFERENCE = Path(__file__).resolve().parents[1] / "input_decks/oblique_impact/reference"
LAWS = ("partial_slip", "linear")
QUANTITIES = {"tangential_restitution": ("e_t", "{:.3f}"), "spin": ("spin (rad/s)", "{:.0f}"),
              "centre_angle": ("rebound angle, centre (°)", "{:.1f}"), "contact_angle": ("rebound angle, point of contact (°)", "{:.1f}")}
VERDICTS = {"pass": "pass", "fail": "**fails**", "info": "open"}


def others(quantity: str, angle: float) -> dict[str, float]:
    """What each other code gives at `angle` (degrees), between its own points."""
    with (REFERENCE / "other_codes.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["quantity"] == quantity]
    found = {}
    for code in dict.fromkeys(row["code"] for row in rows):
        angles, values = np.array([(float(row["angle"]), float(row["value"])) for row in rows if row["code"] == code]).T
        if angles[0] <= angle <= angles[-1]:
            found[code] = float(np.interp(angle, angles, values))
    return found


def main(results: Path) -> None:
    """The tables of the results in `results`, the folder of a profile."""
    studies = {law: read(results / "oblique_impact" / f"study-{law}" / "liggghts" / METRICS) for law in LAWS}
    checks = [one for one in studies[LAWS[0]].quantities if one.tolerance is not None]
    table(("judged", "allowed", *(f"`{law}`" for law in LAWS)), (_judged(one, studies) for one in checks))
    with (REFERENCE / "kharaz_2001.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    table(("quantity", "at", "experiment", *(f"`{law}`" for law in LAWS), "nearest other code"),
          (_point(row["quantity"], float(row["angle"]), studies) for row in rows))


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """In Markdown."""
    cells = tuple(head)
    print(f"\n| {' | '.join(cells)} |", "|" + len(cells) * "---|", sep="\n")
    for row in rows:
        print(f"| {' | '.join(row)} |".replace("| -", "| −"))


def _judged(one: ComparedRecord, studies: dict[str, Result]) -> list[str]:
    digits = next((QUANTITIES[name][1] for name in ("centre_angle", "contact_angle") if one.name.startswith(name)), "{:.3f}")
    found = [same for law in LAWS if (same := studies[law].find(one.name))]
    return [one.label, digits.format(one.tolerance), *(
        f"{digits.format(each.value)} ± {digits.format(math.hypot(each.half or 0.0, _half(each.reference_interval)))}, "
        f"{VERDICTS[each.verdict]}" for each in found)]


def _point(quantity: str, angle: float, studies: dict[str, Result]) -> list[str]:
    label, digits = QUANTITIES[quantity]
    known = [one for law in LAWS if (one := studies[law].find(f"{quantity}_{angle:.0f}"))]
    due, half = known[0].reference or 0.0, _half(known[0].reference_interval)
    near = min(others(quantity, angle).items(), key=lambda entry: abs(entry[1] - due), default=None)
    return [label, f"{angle:.1f}°", f"{digits.format(due)} ± {digits.format(half)}",
            *(f"{digits.format(one.value)} ± {digits.format(one.half)}" for one in known),
            "–" if near is None else f"{digits.format(near[1])}, {near[0]}"]


def _half(interval: tuple[float, float] | None) -> float:
    low, high = interval or (0.0, 0.0)
    return 0.5 * (high - low)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
