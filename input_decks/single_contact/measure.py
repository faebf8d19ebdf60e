"""Single contact: the eight impact tests of Chung and Ooi (2011). An engine is compared with a second implementation of its scheme, with
what is known exactly (Hertz, restitution, the contact law integrated to convergence), with the published curves and, without a verdict,
with theories of other contacts (rigid bodies that slide; partial slip after Mindlin and Deresiewicz)."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from dembark.postproc.measurement import Measurement, Numbers, Replicas, number

from .impact_tests import head_on, mirror_symmetry, oblique, restitutions
from .impacts import Flight, Solutions, impacts, read, sweep
from .published_curves import with_published

PUBLISHED = Path(__file__).with_name("reference") / "chung_ooi_2011.csv"
# What is varied or resolved, and changes no impact.
NUMERICAL = {"points", "sweep_from", "sweep_to", "lead_steps", "duration", "time_step", "frames"}
LABELS = {"published": "Chung and Ooi (2011), DEM", "finite_elements": "Chung and Ooi (2011), finite elements"}


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of the run (there is one)."""
    p = replicas[0].parameters
    found = measured(p, read(replicas[0], impacts(p), p["lead_steps"] * p["time_step"]))
    return with_published(found, PUBLISHED, published_test(p), LABELS)


def published_test(p: Numbers) -> str:
    """The variant that has the impacts of a run with parameters `p`, whatever the run is called; empty when there is none."""
    case = tomllib.loads(Path(__file__).with_name("case.toml").read_text(encoding="utf-8"))
    defaults, variants = {name: one.get("value") for name, one in case["parameters"].items()}, dict[str, dict[str, Any]]()
    for name, own in case["variants"].items():
        variants[name] = variants.get(own.get("like", ""), defaults) | own
    physical = case["parameters"].keys() - NUMERICAL
    return next((name for name, due in variants.items() if all(p[one] == due[one] for one in physical)), "")


def measured(p: Numbers, flight: Flight) -> Measurement:
    """The same from a run with parameters `p` that was read."""
    one = impacts(p)
    known, after = Solutions(one, p["time_step"], p["lead_steps"], p["presliding"] == "partial_slip"), flight.after.numbers(one)
    apart = [np.abs(after[name] - known.scheme[0][name]).max() / max(1.0, np.abs(known.scheme[0][name]).max())
             for name in (("restitution",) if known.in_parts else ("restitution", "slide", "spin"))]
    values = {"scheme_deviation": number(max(apart), 0.0)}
    if flight.momentum_error is not None:
        values["momentum_error"] = number(flight.momentum_error, 0.0)
    if one.slides:
        more, curves = oblique(one, flight, known, p["sweep"], sweep(p))
    elif p["sweep"] == "restitution":
        more, curves = restitutions(one, flight, known)
    else:
        more, curves = (mirror_symmetry if one.spin.any() else head_on)(one, flight, known)
    return Measurement(values | more, curves,
                       [f"{one.duration.min() / p['time_step']:.0f} steps from touch to release in the shortest impact, by Hertz's law."])
