"""Mixing and segregation in a vibrated vessel, at one phase of each period, at which the bed lies on the floor."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.drive_levels import acceleration
from dembark.input_decks.common.drive_phases import Phases, read_phases
from dembark.input_decks.common.estimates import over_chaotic, values_and_halves
from dembark.input_decks.common.momentum import unexplained_energy
from dembark.input_decks.common.power_law import ordered
from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Curve, Estimate, Measurement, Numbers, Points, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.replica import Array, Replica, cached_per_replica
from dembark.postproc.studies import measured, propagated

from .mixing import SAMPLE, Kinds, cells, lacey_index, lower_half, mixing_rate, rate, samples, segregation, wall_drift

# Labellings at random; phase at which the bed lies on the floor.
LABELLINGS, PHASE = 16, 0


@cached_per_replica
def read(replica: Replica) -> Phases:
    """The frames by their phase."""
    return read_phases((frame.select(frame.types == 1) for frame in replica.grains()), replica.derived["period_steps"], replica.time_step)


def places(run: Phases) -> Array:
    """(periods, grains, 2) in m: x and z at the phase at which the bed lies on the floor."""
    return np.array([frame.positions[:, [0, 2]] for frame in run.at(PHASE)])


def measure(replicas: Replicas) -> Measurement:
    """What the mixture of the run has to show."""
    runs, p = [read(replica) for replica in replicas], replicas[0].parameters
    drift = over_replicas([wall_drift(one, 0.0, p["vessel_width"], p["grain_diameter"]) for one in runs])
    values = {"energy_balance": Value(exact(max(unexplained_energy(replica.times()) for replica in replicas)), exact(0.0)),
              "acceleration": Value(exact(acceleration(p))),
              "wall_drift": Value(drift)}
    if replicas[0].derived["wall_static"] == 0.0:
        values["wall_drift_smooth"] = Value(drift, exact(0.0))
    elif acceleration(p) > 1.0:
        values["wall_drift"] = of_sign(drift, -1)
    tracks = [places(one) for one in runs]
    if p["mixture"] == "equal":
        found, curves = equal(tracks, p["grain_diameter"])
    else:
        found, curves = unequal(tracks, [second_sort(one.frames[0], p) for one in runs], p)
    return Measurement(values | found, curves)


def second_sort(frame: GrainFrame, p: Numbers) -> Kinds:
    """Which grains (n,) are denser than the others or, with one density, larger."""
    if p["density_ratio"] > 1.0:
        densities = frame.masses / (4.0 / 3.0 * math.pi * frame.radii**3)
        return np.asarray(densities > math.sqrt(p["density_ratio"]) * p["grain_density"])
    return np.asarray(frame.radii > 0.25 * p["grain_diameter"] * (1.0 + p["size_ratio"]))


def of_sign(found: Estimate, sign: int) -> Value:
    """`found`, of which the source states the `sign` alone: passes where all of its interval has it, fails where all has the other."""
    if not abs(found.value) > found.half:
        return Value(found, reason="its interval holds 0")
    return Value(found, verdict="pass" if sign * found.value > 0.0 else "fail")


def equal(tracks: list[Array], diameter: float) -> tuple[dict[str, Value], list[Curve]]:
    """Mixing of the halves, and what labels make of the same places."""
    random = np.random.default_rng(0)
    indices = {name: [np.array([lacey_index(lower_half(track[0, :, axis]), sample_numbers(frame, diameter)) for frame in track])
                      for track in tracks] for axis, name in enumerate(("sides", "layers"))}
    separated = [max(abs(lacey_index(lower_half(frame[:, axis]), sample_numbers(frame, diameter))) for axis in (0, 1))
                 for track in tracks for frame in track]
    labels = [lacey_index(random_labels(random, lower_half(frame[:, 0])), sample_numbers(frame, diameter))
              for track in tracks for frame in track for _ in range(20)]
    labelled = [segregation(kinds, frame[:, 1]) for track in tracks
            for kinds in (random_labels(random, lower_half(track[0, :, 1])) for _ in range(LABELLINGS)) for frame in track]
    values = {"index_separated": Value(exact(float(np.mean(separated))), exact(0.0)),
              "index_random": Value(exact(float(np.mean(labels))), exact(1.0)),
              "segregation_labels": Value(exact(float(np.mean(labelled))), exact(0.0))}
    for name, found in indices.items():
        values[f"index_{name}"] = Value(over_chaotic(float(one[-1]) for one in found))
        values[f"mixing_rate_{name}"] = Value(over_replicas([mixing_rate(one) for one in found]))
    return values, [curve(f"index_{name}", f"Mixing of the {name}", "Lacey's index", found) for name, found in indices.items()]


def random_labels(random: np.random.Generator, kinds: Kinds) -> Kinds:
    """As many labels of each kind, at random."""
    return random.permutation(kinds)


def sample_numbers(frame: Array, diameter: float) -> NDArray[np.int64]:
    """Number of the sample (n,) of each of the places `frame` (n, 2): an even number of columns and rows, each with as many grains as the
    others, so that no sample lies in both halves."""
    return samples(frame, tuple(np.quantile(place, np.linspace(0.0, 1.0, 2 * max(1, round((len(edge) - 1) / 2)) + 1))
                                for place, edge in zip(frame.T, cells(frame, SAMPLE * diameter), strict=True)))


def unequal(tracks: list[Array], large: list[Kinds], p: Numbers) -> tuple[dict[str, Value], list[Curve]]:
    """How large and small grains part, or how the single large one rises."""
    if p["mixture"] == "intruder":
        heights = [(track[:, kinds, 1].mean(axis=1) - track[:, :, 1].min(axis=1)) / p["grain_diameter"]
                   for track, kinds in zip(tracks, large, strict=True)]
        tops = [(track[:, :, 1].max(axis=1) - track[:, :, 1].min(axis=1)) / p["grain_diameter"] for track in tracks]
        # The rate is that before the large grain is within two of its diameters of the top.
        there = [np.flatnonzero(one > top - 2.0 * p["size_ratio"]) for one, top in zip(heights, tops, strict=True)]
        rising = [one[: found[0]] if len(found) else one for one, found in zip(heights, there, strict=True)]
        values = {"rise": Value(over_chaotic(float(one[-1] - one[0]) for one in heights)),
                  "rise_rate": Value(over_replicas([rate(one) for one in rising]))}
        if p["density_ratio"] == 1.0:
            values["rise_rate"] = of_sign(values["rise_rate"].estimate, 1)
        return values, [curve("rise", "Height of the large grain", "height over the lowest grain (d)", heights)]
    parted = [np.array([segregation(kinds, frame[:, 1]) for frame in track]) for track, kinds in zip(tracks, large, strict=True)]
    values = {"segregation_start": Value(over_chaotic(float(one[0]) for one in parted)),
              "segregation_end": Value(over_chaotic(float(one[-1]) for one in parted)),
              "segregation_rate": Value(over_replicas([rate(one) for one in parted]))}
    if acceleration(p) > 1.0 and (p["size_ratio"] == 1.0 or p["density_ratio"] == 1.0):
        values["segregation_end"] = of_sign(values["segregation_end"].estimate, 1 if p["density_ratio"] == 1.0 else -1)
    if acceleration(p) < 1.0:
        change = max((float(one[-1] - one[0]) for one in parted), key=abs)
        values["segregation_change"] = Value(exact(change), exact(0.0))
    return values, [curve("segregation", "Segregation", "(z̄ of the second sort − z̄ of the others)/H", parted)]


def curve(name: str, title: str, across: str, series: list[Array]) -> Curve:
    """Series of all runs over the periods."""
    return profile(name, title, "periods", across, np.arange(len(series[0]), dtype=float), series)


SHOWN = {"rise_rate": "speed of the large grain (d/T)", "segregation_end": "segregation at the end"}
# What changes along a study, and whether the source sees it rise or fall.
TRENDS = {"size_ratio": ("rise_rate", 1), "density_ratio": ("segregation_end", -1)}


def study(name: str, points: Points, along: str) -> Measurement:
    """How fast a large grain rises with its size, or how far dense grains end below light ones with their density."""
    points, place = ordered(points, along)
    quantity, sign = TRENDS[along]
    values, halves = values_and_halves([measured(point, quantity) for point in points])
    slope = propagated(lambda numbers: float(np.polyfit(place, numbers, 1)[0]), values, halves)
    listed = ", ".join(f"{value:.3f} ± {half:.3f} at {ratio:g}" for ratio, value, half in zip(place, values, halves, strict=True))
    trend = of_sign(slope, sign)
    if trend.verdict == "pass" and not (np.diff(sign * values) > 0.0).all():
        trend = Value(slope, reason="the means are not in order")
    return Measurement({f"{name}_trend": replace(trend, detail=listed)},
                       [profile(quantity, SHOWN[quantity], along.replace("_", " "), SHOWN[quantity], place, [values], half=halves)])
