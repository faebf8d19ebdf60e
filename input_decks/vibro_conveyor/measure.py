"""Vibrating conveyor: mean transport speed of a block, a ball or a bed, next to that of a block from event to event."""

import math
from functools import cache

import numpy as np

from dembark.input_decks.common.drive_levels import acceleration
from dembark.input_decks.common.momentum import BRIDGED_PARTS, imbalance
from dembark.input_decks.common.power_law import ordered
from dembark.postproc.measurement import (
    Array,
    Estimate,
    Measurement,
    Numbers,
    Points,
    Replica,
    Replicas,
    Value,
    exact,
    over_replicas,
    profile,
)
from dembark.postproc.profiles import lagrangian_velocities
from dembark.postproc.studies import measured

from .block import WINDOW, Conveyed, conveyed

# Force on the plate over the weight that is none.
NONE = 1e-3
# Largest part by which means of the block's motion may differ for its speed to count as known.
STEADY = 0.01


block_on_plate = cache(conveyed)


def block(p: Numbers) -> Conveyed:
    """The motion of a block with the parameters of a run."""
    return block_on_plate(acceleration(p), p["throw_angle"], p["static_friction"], p["restitution"])


def expected(p: Numbers) -> float:
    """Its mean speed over the largest horizontal speed of the plate."""
    return block(p).speed * math.tan(p["throw_angle"]) / acceleration(p)


def irregular(p: Numbers) -> str:
    """Why no speed is expected of a block that bounces without repeating itself; "" of one that does."""
    found = block(p)
    part = found.spread / abs(found.speed) if found.spread > 1e-9 else 0.0
    return f"a block with this restitution moves irregularly: its means over {WINDOW} periods differ by {part:.1%}" if part > STEADY else ""


def coulomb(p: Numbers) -> bool:
    """Whether the run is dry and has one coefficient of friction, as the block of the theory."""
    kinetic = p["static_friction"] * p["kinetic_friction_ratio"] if p["kinetic_friction"] is None else p["kinetic_friction"]
    return bool(not p["bridge_volume"] and math.isclose(kinetic, p["static_friction"]))


def plate_speed(p: Numbers) -> float:
    """Largest horizontal speed (m/s) of the plate."""
    return acceleration(p) * p["gravity"] / (2.0 * math.pi * p["motion_frequency"]) / math.tan(p["throw_angle"])


def slips_nowhere(p: Numbers) -> bool:
    """Whether friction holds a block, or a ball that rolls, on the plate at all phases: it needs the acceleration, or 2/7 of it."""
    throw, share = acceleration(p), 1.0 if p["spin"] == "blocked" else 2.0 / 7.0
    return throw < 1.0 and share * throw / math.tan(p["throw_angle"]) < p["static_friction"] * (1.0 - throw)


def speeds(run: Replica) -> Array:
    """Mean speeds (periods,) of the grains along x in m/s in each period of the measuring window."""
    frames = list(run.grains())
    places = np.array([frame.positions for frame in frames])[::8]
    times = run.time_step * np.array([frame.step for frame in frames])[::8]
    masses = frames[0].masses
    return np.array([np.average(lagrangian_velocities(places[k : k + 2], times[k : k + 2])[:, 0], weights=masses)
                     for k in range(len(times) - 1)])


def flight(run: Replica) -> float:
    """Share of the rows of time.csv in the measuring window in which there is no force on the plate."""
    rows, frames = run.times(), list(run.grains())
    weight = float(frames[0].masses.sum()) * run.parameters["gravity"]
    inside = rows["step"] > frames[0].step
    return float(np.mean(rows["plate_fz"][inside] < NONE * weight))


def measure(replicas: Replicas) -> Measurement:
    """Values and curves from all packings. Of a single body nothing is random, and it moves alike in all periods."""
    p, single = replicas[0].parameters, replicas[0].parameters["grain_count"] == 1
    scale, found = plate_speed(p), [speeds(run) for run in replicas]
    means = [float(one.mean()) for one in found]
    speed = exact(means[0]) if single else over_replicas([Estimate(mean, math.inf, "one packing") for mean in means])
    ratio = Estimate(speed.value / scale, speed.half / scale, speed.basis)
    still, theory = single and slips_nowhere(p), expected(p)
    like_it = single and p["spin"] == "blocked" and coulomb(p)
    values = {
        "energy_balance": Value(exact(max(imbalance(run.times(), BRIDGED_PARTS) for run in replicas)), exact(0.0)),
        **({"rest_speed": Value(ratio, exact(0.0))} if still else
           {"transport_speed": Value(ratio, exact(theory) if like_it else None, inapplicable=irregular(p) if like_it else "")}),
        "flight": Value(exact(float(np.mean([flight(run) for run in replicas])))),
        "block_speed": Value(exact(theory)),
        "speed": Value(speed),
    }
    number = np.arange(1.0, 1.0 + len(found[0]))
    return Measurement(values, [profile("periods", "Transport in each period", "period", "speed over the plate's", number,
                                        [one / scale for one in found], reference=np.full(len(number), theory), reference_label="block")])


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """Transport speed over the throw number."""
    points, throw = ordered(points, along)
    p = points[0]["parameters"]
    found = np.array([measured(point, "transport_speed").value for point in points])
    due = np.array([expected(point["parameters"]) for point in points])
    scale = throw * p["gravity"] / (2.0 * math.pi * p["motion_frequency"]) / math.tan(p["throw_angle"])
    worst = float(np.abs((found - due) * scale).max() / np.abs(due * scale).max())
    unknown = next(filter(None, (irregular(point["parameters"]) for point in points)), "")
    return Measurement({"speed_rise": Value(exact(worst), exact(0.0), inapplicable=unknown)}, [
        profile("speed", "Transport speed over the throw number", "throw number", "m/s", throw, [scale * found], reference=scale * due,
                reference_label="block, from event to event")])
