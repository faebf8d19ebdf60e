"""Dropped container: how far it rebounds, and the mass of grains from which on it does not."""

import math
from collections.abc import Mapping

import numpy as np

from dembark.input_decks.common.estimates import over_chaotic, values_and_halves
from dembark.input_decks.common.power_law import ordered
from dembark.postproc import DumpError
from dembark.postproc.measurement import Array, Curve, Measurement, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.studies import measured, propagated

# Published: grains of this mass, over that of the container times its coefficient of restitution, leave no rebound.
VANISHES = 1.5
# The ratio from which on the rebound is judged, and the largest ratio whose rebound is extrapolated to zero.
DAMPED, RISING = 2.0, 1.0


def landed(replica: Replica) -> Array:
    """Indices of the rows from the first touch on; DumpError when there is none."""
    found = np.flatnonzero(replica.times()["plate_fz"] > 0.0)
    if not len(found):
        raise DumpError(f"{replica.folder}: the container does not touch the plate")
    return np.arange(found[0], len(replica.times()["height"]))


def rebound(replica: Replica) -> float:
    """Largest height over the plate after the first touch, over the drop height."""
    return float(replica.times()["height"][landed(replica)].max()) / float(replica.parameters["drop_height"])


def touch(replica: Replica) -> float:
    """Duration (s) of the first contact with the plate."""
    rows, after = replica.times(), landed(replica)
    free = np.flatnonzero(rows["plate_fz"][after] <= 0.0)
    return float(rows["time"][after[free[0]] if len(free) else -1] - rows["time"][after[0]])


def measure(replicas: Replicas) -> Measurement:
    """The rebound over all packings, and what of energy and momentum is not accounted for in the worst of them."""
    p, grains = replicas[0].parameters, replicas[0].derived["grain_mass"]
    tables = [one.times() for one in replicas]
    up = over_chaotic(map(rebound, replicas)) if grains else exact(rebound(replicas[0]))
    values = {
        "energy_balance": Value(exact(max(unexplained(rows) for rows in tables)), exact(0.0)),
        "rebound": Value(up),
        "grain_mass": Value(exact(grains / p["container_mass"])),
        "contact_time": Value(exact(touch(replicas[0]))),
    }
    if not grains:
        values["empty_rebound"] = Value(up, exact(p["steel_restitution"] ** 2))
    else:
        values["reaction_gap"] = Value(exact(max(reaction(rows) for rows in tables)), exact(0.0))
    if grains and p["mass_ratio"] >= DAMPED:
        values["damped_rebound"] = Value(up, exact(0.0))
    return Measurement(values, heights(replicas))


def unexplained(rows: Mapping[str, Array]) -> float:
    """Largest energy in a row that no known force gave, over the energy turned over so far. What the container gets of its grains is known:
    the work of other forces."""
    left = np.maximum(np.abs(rows["balance"]), np.abs(rows["imposed"]))
    return float(np.divide(left, rows["scale"], out=left, where=rows["scale"] > 0.0).max())


def reaction(rows: Mapping[str, Array]) -> float:
    """Largest sum in a row of the works of the vessel on the grains and of the grains on the container, over the largest of either."""
    return float(np.abs(rows["walls"] + rows["other"]).max() / max(np.abs(rows["walls"]).max(), np.abs(rows["other"]).max()))


def heights(replicas: Replicas) -> list[Curve]:
    """Height of the container over the plate against time, from when it is let go on."""
    rows, p = replicas[0].times(), replicas[0].parameters
    falls = rows["step"] >= replicas[0].derived["release"]
    time = rows["time"][falls] - rows["time"][falls][0]
    return [profile("height", "Height of the container", "t / √(2 h / g)", "z / h", time / math.sqrt(2.0 * p["drop_height"] / p["gravity"]),
                    [one.times()["height"][falls] / p["drop_height"] for one in replicas])]


def study(_name: str, points: Points, along: str) -> Measurement:
    """The mass ratio at which a straight line through the square roots of the rebounds, the speeds after the impact, comes to zero."""
    points, ratio = ordered(points, along)
    values, halves = values_and_halves([measured(point, "rebound") for point in points])
    speed = np.sqrt(np.maximum(values, 0.0))
    rising = ratio <= RISING
    spread = 0.5 * halves / np.where(speed > 0.0, speed, np.inf)
    zero = propagated(lambda speeds: float(np.roots(np.polyfit(ratio[rising], speeds, 1))[0]), speed[rising], spread[rising])
    e = float(points[0]["parameters"]["steel_restitution"])
    line = np.maximum(e * (1.0 - ratio / VANISHES), 0.0) ** 2
    return Measurement({"vanishing_ratio": Value(zero, exact(VANISHES))},
                       [profile("rebound", "Rebound", "m / (e_o M)", "rebound height over drop height", ratio, [values], half=halves,
                                reference=line, reference_label="straight line in the speed to 1.5")])
