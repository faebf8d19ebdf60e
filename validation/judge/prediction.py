"""Runs at draws of a posterior: their intervals are those of a prediction, and what they were fitted to is no evidence.

ASME V&V 20: E = S - D is judged within U_val, U_val² = U_input² + U_D². Here U_input comes from the scatter of the members, whose fitted
parameters are draws of the posterior and whose packings differ: what is uncertain in the inputs is in no mean over packings.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import Estimate, student
from dembark.postproc.studies import compared
from dembark.validation.case.model import Case

from .result import QuantityRecord

# Numbers of a run that do not make it another experiment, whatever its variant is.
_CHANCE = {"seed", "replicas"}
_MEASURED = ("experiment", "code")
SAMPLED = "a point of the sample of a calibration"


def over_members(case: Case, found: Measurement, members: Sequence[Measurement]) -> Measurement:
    """`found`, measured of all runs, with the values of the single `members` and the interval in which one more member lies."""
    values = {name: _value(case, name, value, [one.values[name] for one in members if name in one.values], len(members))
              for name, value in found.values.items()}
    return replace(found, values=values, profiles=[_curve(one, members) for one in found.profiles])


def half_width(values: Sequence[float]) -> float:
    """Of the 95 % interval of one more value like these, Student's; infinite for a single one."""
    count = len(values)
    return student(count - 1) * float(np.std(values, ddof=1)) * math.sqrt(1.0 + 1.0 / count) if count > 1 else math.inf


def _value(case: Case, name: str, value: Value, members: Sequence[Value], count: int) -> Value:
    if len(members) < count:
        return replace(value, reason=value.reason or f"{count - len(members)} of {count} members have no such value")
    if value.bound is not None:
        return replace(value, bound=None, reason="its bound holds for one set of parameters")
    own = [one.estimate.value for one in members]
    mean, half = float(np.mean(own)), half_width(own)
    basis = f"prediction from {count} draws of the posterior"
    reference = value.reference
    if reference is None or all(one.reference and one.reference.value == reference.value for one in members):
        detail = compared(mean, reference, input=half).text if reference and math.isfinite(half) else ""
        return replace(value, estimate=Estimate(mean, half, basis, tuple(own)), half=None,
                       detail="; ".join(filter(None, (value.detail, detail))))
    # A reference that follows from the fitted parameters, too: what counts is the scatter of the deviation.
    datum = float(np.mean([one.reference.value for one in members if one.reference]))
    declared = case.declared(name)
    scale = 1.0 if declared is None or declared[0].absolute else datum
    differences = [(one.estimate.value - one.reference.value) / scale for one in members if one.reference]
    return replace(value, estimate=Estimate(mean, half, basis, tuple(own)), reference=replace(reference, value=datum),
                   half=math.hypot(half_width(differences), reference.half / abs(scale)))


def _curve(curve: Mapping[str, Any], members: Sequence[Measurement]) -> Mapping[str, Any]:
    own = [one for member in members for one in member.profiles if one["name"] == curve["name"]]
    if len(own) < 2 or any(one["place"] != curve["place"] for one in own):
        # Its band would be that of the mean.
        return {key: value for key, value in curve.items() if key not in ("low", "high", "band")}
    table = np.array([one["value"] for one in own], float)
    mean, half = table.mean(axis=0), np.array([half_width(list(column)) for column in table.T])
    return {**curve, **{key: [float(one) if math.isfinite(one) else None for one in row]
                        for key, row in (("value", mean), ("low", mean - half), ("high", mean + half))},
            "band": f"95 % prediction from {len(own)} draws of the posterior"}


def marked(records: Iterable[QuantityRecord], case: str, variant: str, fitted: Mapping[str, Any],
           parameters: Mapping[str, Any]) -> list[QuantityRecord]:
    """The `records` of a run of `case` with `parameters`, those `calibrated` whose references were `fitted` (the record's facts).

    Fitted is a target whose reference here is within its standard uncertainty of it. Where that holds for all targets that have a
    reference, or the run is of the variant or has the conditions of the calibration, it is the fitted experiment: then every quantity of
    a source of the targets is calibrated, and after a fit to a curve, whose source is not known, all that is compared with an experiment
    or another code.
    """
    records = list(records)
    if case != fitted["case"]:
        return records
    targets = fitted["targets"]
    near = {one.name: abs(one.reference - targets[one.name]["value"]) <= targets[one.name]["uncertainty"]
            for one in records if one.reference is not None and "value" in targets.get(one.name, {})}
    # Step, stiffness or number of frames of a run of the variant make it no other experiment; what else was changed is not evidence either.
    same = variant == fitted.get("variant") or all(parameters.get(name) == value for name, value in fitted["conditions"].items()
                                               if name not in _CHANCE)
    again = same or (bool(near) and all(near.values()))
    curves, sources = any("at" in one for one in targets.values()), {one.source for one in records if one.name in targets}

    def why(one: QuantityRecord) -> str:
        if one.reference is None or not (near.get(one.name) or again):
            return ""
        if one.name in near:
            return "fitted: a target of the calibration"
        data = one.evidence in _MEASURED and (curves or one.source in sources)
        return "of the experiment that was fitted" if data else ""

    found = [replace(one, calibrated=why(one)) for one in records]
    # Points all over the ranges disagree: that is what they are for.
    return [replace(one, verdict="info", reason=SAMPLED) if one.calibrated and fitted.get("sampled") else one for one in found]
