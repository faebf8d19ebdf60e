"""Vibratory hardening: impacts on a clamped part, power and noise; what the amplitude makes of circulation and fluctuation."""

import math
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np

from dembark.input_decks.common import vibratory_trough
from dembark.input_decks.common.estimates import divided, over_chaotic, ratio
from dembark.input_decks.common.momentum import CONTACT_PARTS, imbalance
from dembark.input_decks.common.motion import motion
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.input_decks.common.trough import polygon
from dembark.postproc.measurement import Estimate, Measurement, Points, Replica, Replicas, Value, exact, over_replicas
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.studies import measured

from .part_impacts import ContactRecord, histogram, read_record

WALLS = ("trough", "part")


@cached_per_replica
def contact_record(replica: Replica) -> ContactRecord:
    """The record of the grains on the part."""
    p, derived = replica.parameters, replica.derived
    period = int(derived["period_steps"])
    moving = motion(SimpleNamespace(**p), start=int(derived["begin"]) * replica.time_step)
    corners = polygon(p["part_diameter"], p["part_corners"], (0.0, -0.2 * p["trough_width"]))
    return read_record(replica.folder / "touches.dump", moving, corners, stride=int(derived["sample"]), time_step=replica.time_step,
                        first=int(derived["first"]), periods=p["periods"], period=period * replica.time_step, depth=p["grain_diameter"])


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all replicas of a series."""
    runs, records, p = [vibratory_trough.read(one) for one in replicas], [contact_record(one) for one in replicas], replicas[0].parameters
    drive = 2.0 * math.pi * p["motion_frequency"]
    mass = p["grain_density"] * math.pi / 6.0 * p["grain_diameter"] ** 3
    unit = 0.5 * mass * runs[0].speed**2

    def over(found: list[Estimate], scale: float = 1.0) -> Value:
        return Value(divided(over_replicas(found), scale))

    def of_run(number: Callable[[vibratory_trough.Trough], float]) -> Value:
        return Value(over_chaotic(number(one) for one in runs))

    values = {
        "energy_balance": Value(exact(np.max([imbalance(one.rows, CONTACT_PARTS) for one in runs])), exact(0.0)),
        "touch_balance": Value(exact(max(impulse_gap(*pair) for pair in zip(runs, records, strict=True))), exact(0.0)),
        "impact_rate": over([one.rate() for one in records]), "impact_energy": over([one.energy() for one in records], unit),
        "friction_power": over([one.friction() for one in records]), "circulation": over([one.turning() for one in runs], drive),
        "power": over([one.power(*WALLS) for one in runs]), "noise": of_run(lambda one: one.noise("trough")),
        "stirring": over([one.fluctuation_ratio() for one in runs]), "agitation": over([one.agitation() for one in runs]),
    }
    return Measurement(values, [vibratory_trough.drifts(runs), vibratory_trough.spectra(runs, "trough"), histogram(records, unit)])


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
