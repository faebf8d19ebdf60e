"""Writes a results folder as large as a profile's, without running anything: verdicts, curves, pictures of many cases in its engines."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from dembark.postproc import pictures
from dembark.postproc.pictures import saved
from dembark.validation import verification
from dembark.validation.judge import result
from dembark.validation.judge.comparison import compare
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.verification.item import Item, exact

CASES = ("silo", "plane_silo", "plug_flow", "gravity_channel", "column_collapse", "debarking_drum", "log_pile", "log_pair", "log_cradle",
         "liquid_exchange", "single_contact")
KINDS = ("identity", "identity", "identity", "theory", "theory", "experiment", "", "identity")


def quantity(number: int, seed: int) -> QuantityRecord:
    """A quantity near its reference; every ninth is open."""
    random = np.random.default_rng([number, seed])
    kind, value = KINDS[number % len(KINDS)], float(1.0 + 0.004 * random.standard_normal())
    reference = 0.0 if kind == "identity" else 1.0
    value = 1e-9 * value if kind == "identity" else value
    unsure = number % 9 == 8
    half = 0.4 if unsure else 0.02 * abs(value)
    return QuantityRecord(
        f"quantity_{number}", value, "info" if unsure else "pass", f"quantity σ_zz number {number} of the packing, over its weight", "kPa",
        (value - half, value + half),
        "5 replicas", reference, None, value - reference, "absolute" if kind == "identity" else "relative", 0.1,
        f"its interval (±{half:.2g}) is wider than the tolerance" if unsure else "", "a detail", "a source", kind, number % 2 == 0,
        control="friction off")


def profile(number: int, seed: int) -> dict[str, object]:
    """A curve with a band, every second with a reference."""
    place = np.linspace(0.0, 10.0, 60)
    value = 1.0 - np.exp(-place / (2.0 + number)) + 0.01 * np.sin(place + seed)
    return {"name": f"curve_{number}", "title": f"Curve {number}", "along": "depth / d", "across": "σ_zz (kPa)",
            "vertical": number % 3 == 0,
            "place": place.tolist(), "value": value.tolist(), "low": (value - 0.02).tolist(), "high": (value + 0.02).tolist(), "note": "",
            **({"reference": (1.0 - np.exp(-place / (2.0 + number))).tolist(), "reference_label": "Janssen"} if number % 2 else {})}


def finished_run(place: Path, folder: Path) -> dict[str, str]:
    """Write the record of a finished run; returns its entry in plan.json."""
    (place / "replica-1").mkdir()
    (place / "replica-1" / "run.json").write_text(json.dumps({"inputs": "a"}))
    return {"folder": str((place / "replica-1").relative_to(folder)), "inputs": "a"}


def write(folder: Path, cases: tuple[str, ...] = CASES, variants: int = 3, quantities: int = 18, profiles: int = 6,
          engines: tuple[str, ...] = ("liggghts", "yade")) -> Path:
    """A results folder with all runs finished; returns it."""
    figure = Figure(figsize=(3.0, 3.0))
    figure.subplots().plot([0.0, 1.0])
    picture = saved(figure)
    runs = []
    for case in cases:
        for variant in [f"variant_{number}" for number in range(variants)]:
            for seed, engine in enumerate(engines):
                place = folder / case / variant / engine
                place.mkdir(parents=True)
                found = tuple(quantity(number, seed + 2 * len(runs)) for number in range(quantities))
                result.write(place / "metrics.json", Result(
                    case, variant, engine, found, folder.name, parameters={"gravity": 9.81}, picture={"cut": True},
                    profiles=tuple(profile(number, seed) for number in range(profiles)), remarks=("A remark.",),
                    references=({"short": "Janssen 1895", "citation": "H. A. Janssen.", "read": "", "statement": ""},),
                    provenance={"replicas": 5, "seeds": [None], "steps": 1000, "time_step": 1e-5, "wall_time": 10.0, "commit": "a" * 40}))
                (place / pictures.PICTURE).write_bytes(picture)
                runs.append(finished_run(place, folder))
            result.write(folder / case / variant / "comparison.json", compare(folder / case / variant))
    (folder / "plan.json").write_text(json.dumps({"profile": folder.name, "runs": runs}))
    verification.write(folder, [Item("mass", "Mass", "Mass is conserved.",
                                     [exact("mass_error", "mass", 0.0, "closed form", "a lost grain")])])
    return folder


def change(path: Path, name: str, **fields: object) -> None:
    """Give a quantity of a `metrics.json` other fields."""
    found = result.read(path)
    assert found.find(name) is not None and not any(isinstance(value, float) and math.isnan(value) for value in fields.values())
    result.write(path, replace(found, quantities=tuple(replace(one, **fields) if one.name == name else one for one in found.quantities)))
