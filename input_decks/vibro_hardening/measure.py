"""Vibratory hardening: impacts on a part, wear, power and noise; what the amplitude makes of circulation and fluctuation."""

import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

from dembark.input_decks.common import vibratory_trough
from dembark.input_decks.common.estimates import divided, over_chaotic, ratio
from dembark.input_decks.common.momentum import BRIDGED_PARTS, imbalance
from dembark.input_decks.common.motion import motion
from dembark.input_decks.common.part_impacts import impact_measurement, lone_impacts, own_modulus, volumes
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.physics import WallMotion
from dembark.postproc.measurement import Estimate, Measurement, Numbers, Points, Replica, Replicas, Value, exact, over_replicas
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.studies import measured
from dembark.postproc.walls import MeshWall
from dembark.postproc.wear import removed_volume

from .throws import angles
from .touches import RubbedRecord, read_record

WALLS = ("trough", "part")


@cached_per_replica
def contact_record(replica: Replica) -> RubbedRecord:
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


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all replicas of a series."""
    p = replicas[0].parameters
    if p["thrown_speed"] is not None:
        return thrown([contact_record(one) for one in replicas], p)
    runs, records = [vibratory_trough.read(one) for one in replicas], [contact_record(one) for one in replicas]
    drive = 2.0 * math.pi * p["motion_frequency"]
    hits = impact_measurement(records, part_wall(replicas[0]), p, runs[0].speed)

    def over(found: list[Estimate], scale: float = 1.0) -> Value:
        return Value(divided(over_replicas(found), scale))

    def of_run(number: Callable[[vibratory_trough.Trough], float]) -> Value:
        return Value(over_chaotic(number(one) for one in runs))

    values = {
        "energy_balance": Value(exact(np.max([imbalance(one.rows, BRIDGED_PARTS) for one in runs])), exact(0.0)),
        "touch_balance": Value(exact(max(impulse_gap(*pair) for pair in zip(runs, records, strict=True))), exact(0.0)),
        "friction_power": over([one.friction() for one in records]), "circulation": over([one.turning() for one in runs], drive),
        "power": over([one.power(*WALLS) for one in runs]), "noise": of_run(lambda one: one.noise("trough")),
        "stirring": over([one.fluctuation_ratio() for one in runs]), "agitation": over([one.agitation() for one in runs]),
    }
    curves = [vibratory_trough.drifts(runs), vibratory_trough.spectra(runs, "trough"), *hits.profiles]
    return Measurement({**values, **hits.values}, curves, surface=hits.surface)


def thrown(records: list[RubbedRecord], p: Numbers) -> Measurement:
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


def impulse_gap(run: vibratory_trough.Trough, record: RubbedRecord) -> float:
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
