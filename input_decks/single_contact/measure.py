"""Single contact: the eight impact tests of Chung and Ooi (2011).

Each engine is held against four things: the same scheme written down again, from which it may differ by round-off; what is known exactly
(Hertz; the restitution coefficient that was asked for; the contact law, integrated until the step does not matter); the curves
that they published; and, for information, theories of another contact (rigid bodies that slide throughout; partial slip after Mindlin and
Deresiewicz).
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dembark.physics.exact.impacts import Impacts
from dembark.postproc.instruments.impact_tests import head_on, mirrored, oblique, restitutions
from dembark.postproc.instruments.impacts import Flight, Solutions, read
from dembark.postproc.instruments.logs import number
from dembark.postproc.instruments.published_curves import beside_published
from dembark.postproc.measurement import Measurement
from dembark.postproc.replica import Array, Replica

PUBLISHED = Path(__file__).with_name("reference") / "chung_ooi_2011.csv"
LABELS = {"published": "Chung and Ooi (2011), DEM", "finite_elements": "Chung and Ooi (2011), finite elements"}


def sweep(p: Mapping[str, Any]) -> Array:
    """What is swept, for the spheres of material A, then for those of B."""
    return np.tile(p["sweep_from"] + (p["sweep_to"] - p["sweep_from"]) * np.arange(p["points"]) / max(p["points"] - 1, 1), 2)


def impacts(p: Mapping[str, Any]) -> Impacts:
    """The impacts of a run with parameters `p`, from these alone, so that the set-up of the decks is checked, too."""
    full, value, kind = np.ones(2 * p["points"]), sweep(p), p["sweep"]
    angle = np.radians(value) if kind in ("direction", "slide", "spin") else 0.0 * full
    youngs, poisson, density = (np.repeat([p[f"{name}_a"], p[f"{name}_b"]], p["points"])
                                for name in ("youngs_modulus", "poisson_ratio", "density"))
    # Sphere and partner share Poisson's ratio.
    softness = (1.0 + 1.0 / p["stiffness_ratio"]) / youngs
    mirror, rest = p["partner"] == "mirror", p["partner"] == "rest"
    larger, denser = (p["size_ratio"], p["density_ratio"]) if rest else (1.0, 1.0) if mirror else (math.inf, 1.0)
    mass = 4.0 / 3.0 * math.pi * p["radius"] ** 3 * density
    normal = -p["speed"] * (np.cos(angle) if kind == "direction" else full)
    slide = p["speed"] * {"direction": np.sin(angle), "slide": np.tan(angle)}.get(kind, 0.0 * full)
    spin = p["speed"] * np.tan(angle) / p["radius"] if kind == "spin" else 0.0 * full
    moving = np.array([[1.0], [-1.0 if mirror else 0.0]])
    return Impacts(1.0 / ((1.0 - poisson**2) * softness), 1.0 / (2.0 * (2.0 - poisson) * (1.0 + poisson) * softness),
                   value if kind == "restitution" else p["restitution"] * full, p["friction"] * full,
                   np.array([p["radius"] * full, larger * p["radius"] * full]), np.array([mass, larger**3 * denser * mass]),
                   moving * slide, moving * normal, moving * spin)


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Values and curves of the run (there is one)."""
    p = replicas[0].parameters
    found = measured(p, read(replicas[0], impacts(p), p["lead_steps"] * p["time_step"]))
    return beside_published(found, PUBLISHED, replicas[0].record["variant"], LABELS)


def measured(p: Mapping[str, Any], flight: Flight) -> Measurement:
    """The same from a run with parameters `p` that was read."""
    one = impacts(p)
    known, after = Solutions(one, p["time_step"], p["lead_steps"]), flight.after.numbers(one)
    apart = [np.abs(after[name] - known.scheme[0][name]).max() / max(1.0, np.abs(known.scheme[0][name]).max())
             for name in ("restitution", "slide", "spin")]
    values = {"scheme_deviation": number(max(apart), 0.0)}
    if flight.momentum_error is not None:
        values["momentum_error"] = number(flight.momentum_error, 0.0)
    if one.slides:
        more, curves = oblique(one, flight, known, p["sweep"], sweep(p))
    elif p["sweep"] == "restitution":
        more, curves = restitutions(one, flight, known)
    else:
        more, curves = (mirrored if one.spin.any() else head_on)(one, flight, known)
    return Measurement(values | more, curves,
                       [f"{one.duration.min() / p['time_step']:.0f} steps from touch to release in the shortest impact, after Hertz."])
