"""Fills a results folder as a complete profile would: a result of every planned run and study, with all declared quantities."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import full_size
import numpy as np
import xarray
from matplotlib.figure import Figure

from dembark.postproc import pictures
from dembark.postproc.measurement import FIELDS_FILE as FILE
from dembark.postproc.measurement import Value
from dembark.postproc.pictures import saved
from dembark.postproc.statistics import Estimate
from dembark.validation import verification
from dembark.validation.case.folders import discover
from dembark.validation.case.model import Case, Declared
from dembark.validation.judge import result, verdict
from dembark.validation.judge.comparison import compare
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.verification.item import Item

# Cases whose measurement leaves fields.
FIELDS = ("silo", "plug_flow", "debarking_drum")
# What a measurement may put in the place of the `*` of a quantity's name.
PARTS = ("1", "2", "3", "4", "5")


def quantities(case: Case, random: np.random.Generator) -> tuple[QuantityRecord, ...]:
    """All that a case declares, near a reference of one; some fail and some are open."""
    named = [(name.replace("*", part), one.label.replace("*", part), one)
             for name, one in case.quantities.items() for part in (PARTS if "*" in name else ("",))]
    return tuple(_record(name, label, one, random) for name, label, one in named)


def _record(name: str, label: str, one: Declared, random: np.random.Generator) -> QuantityRecord:
    tolerance = 1e-3 if one.tolerance == "bound" else one.tolerance
    due, allowed = float(not one.absolute), float(tolerance or 0.0)
    deviation = random.choice([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.8, 1.5]) * allowed * random.choice([-1.0, 1.0])
    # A bound counts as a tolerance here, for it would allow no interval.
    given = replace(one, label=label, tolerance=None if tolerance is None else allowed)
    estimate = Estimate(due + deviation, 0.3 * allowed, "5 replicas")
    return verdict.judged(given, Value(estimate, Estimate(due, 0.0) if one.evidence else None), name)


def fields(case: str) -> xarray.Dataset:
    """Fields of a case as its measurement leaves them, of the same number everywhere."""
    across, up = np.linspace(0.05, 0.95, 8), np.linspace(0.1, 3.9, 20)
    places = {"radius": across, "height": up, "x": across, "z": up, "angle": np.arange(-175.0, 180.0, 10.0), "force": np.logspace(1, 6, 25),
              "log": np.zeros(3), "band": np.zeros(3), "side": np.zeros(2)}
    flow = ("velocity", "shear_rate", "temperature", "solid_fraction")
    names = {
        "silo": {("radius", "height"): ["coverage", "stress_zz", "stress_rr", "stress_zr", "solid_fraction"],
                 ("height",): ["stress_zz_section", "stress_zz_section_half", "janssen", "wall_normal", "wall_shear"],
                 ("band", "radius"): ["k_profile", "k_profile_half"], ("band", "side"): ["band_bounds"]},
        "plug_flow": {("x", "z"): [*flow],
                      ("x",): ["velocity_lagrangian", *(f"{name}_profile{end}" for name in flow for end in ("", "_half"))]},
        "debarking_drum": {("x", "z"): ["impact_power"], ("angle",): ["shell_power", "shell_power_half"],
                           ("angle", "force"): ["shell_peaks"], ("log",): ["log_x", "log_z", "log_radius"]}}[case]
    variables = {name: (axes, np.full([len(places[axis]) for axis in axes], 0.5)) for axes, of_axes in names.items() for name in of_axes}
    if case == "silo":
        variables["band_bounds"] = (("band", "side"), np.array([[0.5, 1.0], [1.5, 2.0], [2.5, 3.0]]))
    used = {axis for axes in names for axis in axes} - {"log", "band", "side"}
    return xarray.Dataset(variables, {axis: places[axis] for axis in used}, {
        "filling_height": 4.0, "vessel_radius": 1.0, "grain_diameter": 0.1, "channel_width": 1.0, "width": 0.1, "frames": 10,
        "replicas": 5, "drum_radius": 1.0, "impact_speed": 0.1, "revolutions": 3, "impacts": 2, "log_length": 1.0})


@cache
def verified() -> list[Item]:
    """The verification of the instruments, which takes some seconds."""
    return verification.items()


def write(folder: Path) -> Path:
    """A results folder of the profile that it is named after, all runs finished; returns it."""
    figure = Figure(figsize=(4.4, 3.3))
    figure.subplots().plot([0.0, 1.0])
    picture, random, runs = saved(figure), np.random.default_rng(3), []
    drawn = {case: fields(case) for case in FIELDS}
    for case in discover().values():
        planned = case.runs.get(folder.name, ())
        engines = {run.variant: run.engines for run in planned}
        studies = {study.folder_name: [name for name in case.engines if all(name in engines.get(one, ()) for one in study.variants)]
                   for study in case.studies.values()}
        for variant, names in (engines | studies).items():
            for number, engine in enumerate(names):
                place = folder / case.name / variant / engine
                place.mkdir(parents=True)
                of_study = variant in studies
                result.write(place / result.METRICS, Result(
                    case.name, variant, engine, quantities(case, random), folder.name, parameters={"gravity": 9.81}, picture=None,
                    profiles=tuple(full_size.profile(one, number) for one in range(4)), references=case.references,
                    provenance={"replicas": 5, "seeds": [1, 2], "steps": 1000, "time_step": 1e-5, "wall_time": 10.0, "commit": "a" * 40}))
                if case.picture and not of_study:
                    (place / pictures.PICTURE).write_bytes(picture)
                if case.name in FIELDS and not of_study:
                    drawn[case.name].to_netcdf(place / FILE, engine="h5netcdf")
                if not of_study:
                    runs.append(full_size.finished_run(place, folder))
            if len(names) > 1:
                result.write(folder / case.name / variant / result.COMPARISON, compare(folder / case.name / variant))
    (folder / "plan.json").write_text(json.dumps({"profile": folder.name, "runs": runs}))
    verification.write(folder, verified())
    return folder
