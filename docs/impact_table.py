"""Prints the table of docs/single_impacts.md, which has the commands: Kharaz et al. (2001) beside this project and other codes."""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import numpy as np

from dembark.validation.judge.result import METRICS, ComparedRecord, read

REFERENCE = Path(__file__).resolve().parents[1] / "input_decks/oblique_impact/reference"
QUANTITIES = {"tangential_restitution": ("e_t", "{:.3f}"), "spin": ("spin (rad/s)", "{:.0f}"),
              "centre_angle": ("rebound angle, centre (°)", "{:.1f}"), "contact_angle": ("rebound angle, point of contact (°)", "{:.1f}")}


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
    """The table of the results in `results`, the folder of a profile."""
    of_engine, linear = ([read(path) for path in sorted((results / "oblique_impact" / f"study-{study}").glob(f"*/{METRICS}"))]
                         for study in ("partial_slip", "linear"))
    head = ("quantity", "at", "experiment", "LIGGGHTS", "YADE", "E ± U_val", "E ± U_val, `linear`", "allowed", "nearest other code")
    print(f"| {' | '.join(head)} |", "|" + len(head) * "---|", sep="\n")
    with (REFERENCE / "kharaz_2001.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        quantity, angle = row["quantity"], float(row["angle"])
        label, digits = QUANTITIES[quantity]
        known = [one for each in of_engine if (one := each.find(f"{quantity}_{angle:.0f}"))]
        due = float(row["value"])
        near = min(others(quantity, angle).items(), key=lambda entry: abs(entry[1] - due), default=None)
        one, datum_half = known[0], _half(known[0].reference_interval)
        allowed = None if one.tolerance is None else one.tolerance * (due if one.deviation_kind == "relative" else 1.0)
        cells = [label, f"{angle:.1f}°", f"{digits.format(due)} ± {digits.format(datum_half)}",
                 *(f"{digits.format(each.value)} ± {digits.format(each.half)}" for each in known),
                 *(_error(each, due, datum_half, digits) for each in (one, linear[0].find(one.name)) if each), "–" if allowed is None else digits.format(allowed),
                 "–" if near is None else f"{digits.format(near[1])}, {near[0]}"]
        print(f"| {' | '.join(cells)} |".replace("| -", "| −").replace("**-", "**−"))


def _error(one: ComparedRecord, due: float, datum_half: float, digits: str) -> str:
    """E ± U_val, bold where the check fails."""
    shown = f"{digits.format((one.value or 0.0) - due)} ± {digits.format(math.hypot(one.half or 0.0, datum_half))}"
    return f"**{shown}**" if one.verdict == "fail" else shown


def _half(interval: tuple[float, float] | None) -> float:
    low, high = interval or (0.0, 0.0)
    return 0.5 * (high - low)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
