"""Vibratory hardening: impacts on a part, wear, power and noise; what the amplitude makes of circulation and fluctuation."""

import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

from dembark.input_decks.common import vibratory_trough
from dembark.input_decks.common.estimates import divided, over_chaotic, ratio
from dembark.input_decks.common.momentum import CONTACT_PARTS, imbalance
from dembark.input_decks.common.motion import motion
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.physics import WallMotion, effective_youngs_modulus
from dembark.postproc.measurement import Array, Estimate, Measurement, Numbers, Points, Replica, Replicas, Value, exact, over_replicas
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.studies import measured
from dembark.postproc.walls import MeshWall
from dembark.postproc.wear import removed_volume

from .part_impacts import ContactRecord, force_histogram, histogram, lone_impacts, mean_pressures, read_record, surface_map
from .part_noise import Noise, octave_curves
from .throws import angles

WALLS = ("trough", "part")


@cached_per_replica
def contact_record(replica: Replica) -> ContactRecord:
    """The record of the grains on the part."""
    p, derived = replica.parameters, replica.derived
    period = int(derived["period_steps"])
    moving = WallMotion("uniform velocity 0 0 0")
    if p["part_held"] == "clamped":
        moving = motion(SimpleNamespace(**p), start=int(derived["begin"]) * replica.time_step)
    return read_record(replica.folder / "touches.dump", moving, part_wall(replica), stride=int(derived["sample"]),
                       time_step=replica.time_step, first=int(derived["first"]), periods=p["periods"],
                       period=period * replica.time_step, depth=p["grain_diameter"])


@cached_per_replica
def part_wall(replica: Replica) -> MeshWall:
    """The part where it is at rest."""
    return MeshWall.from_stl("part", replica.folder / "part.stl")


def own_modulus(p: Numbers) -> float:
    """E* (Pa) of a grain on the part in the run."""
    return effective_youngs_modulus(*[p["youngs_modulus"], p["poisson_ratio"]] * 2)


def true_modulus(p: Numbers) -> float:
    """E* (Pa) of what grains and part are made of."""
    return effective_youngs_modulus(p["grain_material_modulus"], p["poisson_ratio"], p["part_material_modulus"], p["poisson_ratio"])


def volumes(one: ContactRecord, p: Numbers) -> Array:
    """Volume (impacts,) in m^3 that each impact removes, by Finnie."""
    return removed_volume(one.masses[one.begins], *one.paths(), p["flow_pressure"])


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all replicas of a series."""
    p = replicas[0].parameters
    if p["thrown_speed"] is not None:
        return thrown([contact_record(one) for one in replicas], p)
    runs, records = [vibratory_trough.read(one) for one in replicas], [contact_record(one) for one in replicas]
    drive = 2.0 * math.pi * p["motion_frequency"]
    mass = p["grain_density"] * math.pi / 6.0 * p["grain_diameter"] ** 3
    unit = 0.5 * mass * runs[0].speed**2
    worn = [volumes(one, p) for one in records]
    shadows = [one.shadows(true_modulus(p), p["restitution"]) for one in records]
    forces = [peaks for peaks, _ in shadows]
    surface = surface_map(part_wall(replicas[0]), records, forces, worn, p["grain_diameter"])
    wear = surface.values["wear"][0]

    def over(found: list[Estimate], scale: float = 1.0) -> Value:
        return Value(divided(over_replicas(found), scale))

    def of_run(number: Callable[[vibratory_trough.Trough], float]) -> Value:
        return Value(over_chaotic(number(one) for one in runs))

    noise = [Noise(one, one.shadows(own_modulus(p), p["restitution"]), pulses) for one, pulses in zip(records, shadows, strict=True)]
    values = {
        "energy_balance": Value(exact(np.max([imbalance(one.rows, CONTACT_PARTS) for one in runs])), exact(0.0)),
        "touch_balance": Value(exact(max(impulse_gap(*pair) for pair in zip(runs, records, strict=True))), exact(0.0)),
        "impact_rate": over([one.rate() for one in records]), "impact_energy": over([one.energy() for one in records], unit),
        "friction_power": over([one.friction() for one in records]), "circulation": over([one.turning() for one in runs], drive),
        "power": over([one.power(*WALLS) for one in runs]), "noise": of_run(lambda one: one.noise("trough")),
        "stirring": over([one.fluctuation_ratio() for one in runs]), "agitation": over([one.agitation() for one in runs]),
        "wear_rate": over([one.rate(own) for one, own in zip(records, worn, strict=True)], records[0].area),
        "wear_of_an_impact": Value(over_chaotic(float(own.mean()) for own in worn)),
        "wear_peak": Value(over_chaotic([float(wear.max() / np.average(wear, weights=surface.areas))])),
        "peak_force": Value(over_chaotic(float(own.mean()) for own in forces)),
        "peak_force_99": Value(over_chaotic(float(np.quantile(own, 0.99)) for own in forces)),
        "dents": Value(over_chaotic(
            float((mean_pressures(own, one.radii[one.begins], true_modulus(p)) > p["flow_pressure"]).mean())
            for one, own in zip(records, forces, strict=True))),
        "lone_impact": Value(over_chaotic(lone_impact(one, p) for one in records), exact(1.0)),
        "octave_sum": Value(exact(max(abs(one.unexplained) for one in noise)), exact(0.0)),
        "pulse_noise": Value(over_chaotic(one.ratio for one in noise)),
        "audible_force": Value(over_chaotic(one.audible for one in noise)),
    }
    curves = [vibratory_trough.drifts(runs), vibratory_trough.spectra(runs, "trough"), histogram(records, unit),
              force_histogram(records, forces), *octave_curves(noise)]
    return Measurement(values, curves, surface=surface)


def lone_impact(one: ContactRecord, p: Numbers) -> float:
    """Median over impacts of the recorded peak force over that of one grain alone, with the modulus of the run."""
    return float(np.median(one.peaks() / one.shadows(own_modulus(p), p["restitution"])[0]))


def thrown(records: list[ContactRecord], p: Numbers) -> Measurement:
    """Wear and peak force of grains thrown at known angles with a known speed, against those of the closed forms."""
    worst = np.zeros(2)
    for one in records:
        chosen = np.flatnonzero(one.begins)
        order = np.argsort(one.ids[chosen])
        if len(chosen) != p["grain_count"] or len(np.unique(one.ids[chosen])) != len(chosen):
            worst[:] = math.inf
            continue
        masses, radii, angle = one.masses[chosen][order], one.radii[chosen][order], angles(len(chosen))
        wear = removed_volume(masses, p["thrown_speed"], angle, p["flow_pressure"])
        force, _ = lone_impacts(masses, radii, p["thrown_speed"] * np.sin(angle), own_modulus(p), p["restitution"])
        errors = volumes(one, p)[order] / wear - 1.0, one.peaks()[order] / force - 1.0
        worst = np.maximum(worst, np.abs(errors).max(axis=1))
    return Measurement({name: Value(exact(float(found)), exact(0.0)) for name, found in zip(("thrown_wear", "thrown_force"), worst,
                                                                                            strict=True)})


def impulse_gap(run: vibratory_trough.Trough, record: ContactRecord) -> float:
    """Size of the difference between the impulse of the record and that of the force on the part, over the weight times the window."""
    whole = np.array([run.rows[f"part_j{axis}"][-1] - run.rows[f"part_j{axis}"][0] for axis in "xyz"])
    return float(np.linalg.norm(record.impulse() - whole) / (run.weight * run.periods * run.run.period))


def study(name: str, points: Points, along: str) -> Measurement:
    """The fluctuation at the largest amplitude over that at the smallest; or how far the steady motion depends on the numerics."""
    points, place = ordered(points, along)
    if name == "amplitude":
        found = [measured(point, "stirring") for point in points]
        gain = ratio(found[-1], found[0])
        verdict = "pass" if gain.interval[0] > 1.0 else "fail" if gain.interval[1] <= 1.0 else "info"
        curve = PowerLawFit.of(points, "stirring", place).curve("stirring", "Fluctuation over mean speed", "amplitude (m)", "")
        return Measurement({"stirring_gain": Value(gain, exact(1.0), verdict=verdict, detail="passes when all of the interval is above 1")},
                           [curve])
    return vibratory_trough.numerical_changes(points, ("circulation", "impact_energy"))
