"""Avalanche: front, deposit and obstacle; acceleration and stop of a single grain; speed and profile of a bed on a chute."""

import math
from dataclasses import dataclass

import numpy as np

from dembark.input_decks.common.estimates import over_chaotic
from dembark.input_decks.common.heaps import at_rest
from dembark.input_decks.common.momentum import imbalance, impulses, left_to, walls_of
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc import GrainFrame
from dembark.postproc.history import reached
from dembark.postproc.measurement import Curve, Measurement, Points, Replicas, Value, block_mean, exact, over_replicas, profile
from dembark.postproc.replica import Array, Replica
from dembark.postproc.studies import measured

from .slope_flow import Slope, front_law, layers, mean_power

# Inclinations (rad) up to which a bed on the chute shall be at rest, up to which it flows slowly, and from which on it flows well above its
# angle of repose. Between the last two the source has no power.
REST, SLOW, FAST = 0.25, 0.30, 0.40


def slope(replica: Replica) -> Slope:
    """The floor of a run."""
    p, d = replica.parameters, float(replica.parameters["grain_diameter"])
    return Slope(p["slope_angle"], d, d * (p["slab_depth"] or 1.0))


def measure(replicas: Replicas) -> Measurement:
    """Values, curves and remarks from all replicas of a series."""
    balance = {"energy_balance": Value(exact(max(imbalance(replica.times()) for replica in replicas)), exact(0.0))}
    p = replicas[0].parameters
    found = _chute(replicas) if p["bed_height"] > 0.0 else _single(replicas[0]) if p["grain_released"] == 1 else _avalanche(replicas)
    return Measurement({**balance, **found.values}, found.profiles, found.remarks)


@dataclass(frozen=True)
class Flow:
    """One avalanche: `times` (s) since the opening, `fronts` (m, along the floor, the toe at 0); what is measured of it by name."""

    times: Array
    fronts: Array
    law: Array
    numbers: dict[str, float]
    impulse: tuple[float, float]
    rests: bool


def read(replica: Replica) -> Flow:
    """Measure one avalanche."""
    p, rows, place, dt = replica.parameters, replica.times(), slope(replica), replica.time_step
    frames = list(replica.grains())
    free = [frame.select(frame.types == 1) for frame in frames]
    first, last = free[0], free[-1]
    d, g = float(p["grain_diameter"]), float(p["gravity"])
    times = dt * np.array([frame.step - frames[0].step for frame in frames])
    fronts = np.array([place.front(frame) for frame in free])
    length = p["gate_place"] * d
    arrival = reached(times, fronts, 0.0)
    running = [frame for frame, time in zip(frames, times, strict=True) if 0.2 * arrival < time < arrival]
    grip = np.array([_grip(replica, place, frame) for frame in running]).reshape(-1, 2).sum(axis=0)
    friction = float(grip[0] / grip[1]) if running else math.nan
    near = np.abs(place.along(first.positions) + length) < 3.0 * d
    depth = float((place.height(first.positions) + first.radii)[near].max(initial=0.0))
    law = fronts[0] + front_law(times, depth, place.angle, friction, g)
    start, end = (np.average(frame.positions, axis=0, weights=frame.masses) for frame in (first, last))
    crest = first.positions[np.argmax(first.positions[:, 2])]
    stop = place.reach(last)
    numbers = {
        "front_toe": arrival / math.sqrt(length / g), "floor_friction": friction,
        "front_ratio": -fronts[0] / float(np.interp(arrival, times, law) - fronts[0]), "run_out": stop / d,
        "travel_angle": math.degrees(math.atan2(crest[2], stop - crest[0])),
        "centre_angle": math.degrees(math.atan2(start[2] - end[2], end[0] - start[0]))}
    impulse = (math.nan, math.nan)
    if "obstacle" in walls_of(rows):
        opening = int(np.flatnonzero(rows["step"] == frames[0].step)[0])
        own, mass = impulses(rows, "obstacle", "x", dt), float(first.masses.sum())
        impulse = float(own[opening:].sum()), left_to(rows, "obstacle", "x", dt, 0.0, opening)
        span = dt * np.diff(rows["step"])
        numbers |= {"peak_force": float((-own / span)[opening:].max()) / (mass * g),
                    "obstacle_share": -impulse[0] / (mass * math.sqrt(2.0 * g * (start[2] - end[2]))),
                    "passed": float(last.masses[last.positions[:, 0] > p["obstacle_place"] * d].sum()) / mass}
    return Flow(times, fronts, law, numbers, impulse, at_rest(last, g, d))


def _grip(replica: Replica, place: Slope, frame: GrainFrame) -> tuple[float, float]:
    if "ground" in frame.wall_forces:
        return place.grip(frame, frame.types == 2, "ground")
    grains = replica.derived["grain_count"]
    return place.grip(frame, (frame.ids > grains) & (frame.ids <= grains + replica.derived["floor_count"]))


def _avalanche(replicas: Replicas) -> Measurement:
    runs = [read(replica) for replica in replicas]
    values = {name: Value(over_chaotic(run.numbers[name] for run in runs)) for name in runs[0].numbers}
    values["front_ratio"] = Value(values["front_ratio"].estimate, exact(1.0))
    remarks = [] if all(run.rests for run in runs) else ["The deposit still moves when the run ends."]
    if all(run.impulse[0] == 0.0 for run in runs):
        remarks.append("No grain reaches the obstacle.")
    elif "passed" in values:
        worst = max(runs, key=lambda run: abs(run.impulse[0] - run.impulse[1]))
        values["obstacle_impulse"] = Value(exact(worst.impulse[0]), exact(worst.impulse[1]))
    place, d = slope(replicas[0]), float(replicas[0].parameters["grain_diameter"])
    times = runs[0].times
    curves = [profile("front", "Front", "time since the gate moves (s)", "distance along the floor from the toe, over d", times,
                      [np.interp(times, run.times, run.fronts) / d for run in runs],
                      reference=np.mean([np.interp(times, run.times, run.law) for run in runs], axis=0) / d,
                      reference_label="2√(gH cos θ) t + ½ g cos θ (tan θ − tan δ) t²")]
    edges = d * np.arange(-replicas[0].parameters["slope_length"], replicas[0].parameters["flat_length"] + 1.0, 4.0)
    tops = [[place.thickness(frame.select(frame.types == 1), edges) / d for frame in (frames[0], frames[len(frames) - 1])]
            for frames in (replica.grains() for replica in replicas)]
    curves.append(profile("deposit", "Deposit", "distance along the floor from the toe, over d", "solid volume over area, over d",
                          0.5 * (edges[1:] + edges[:-1]) / d, [last for _, last in tops],
                          reference=np.mean([first for first, _ in tops], axis=0), reference_label="when the gate opens"))
    if "passed" in values:
        curves.append(_force(replicas))
    return Measurement(values, curves, remarks)


def _force(replicas: Replicas) -> Curve:
    """Force on the obstacle against time."""
    found = []
    for replica in replicas:
        rows, frames = replica.times(), replica.grains()
        weight = replica.parameters["gravity"] * float(frames[0].masses[frames[0].types == 1].sum())
        time = replica.time_step * (rows["step"] - frames[0].step)
        found.append((time[1:], -impulses(rows, "obstacle", "x", replica.time_step) / np.diff(time) / weight))
    place = np.linspace(0.0, found[0][0][-1], 201)
    return profile("obstacle_force", "Force on the obstacle", "time since the gate moves (s)", "over the weight of all grains", place,
                   [np.interp(place, *one) for one in found])


def _single(replica: Replica) -> Measurement:
    """A grain that slides or rolls down the slope, or slides to its stop on the flat."""
    p, place = replica.parameters, slope(replica)
    frames = replica.grains()
    d, g, friction = float(p["grain_diameter"]), float(p["gravity"]), float(replica.derived["wall_kinetic"])
    at, velocity = (np.array([getattr(frame, name)[frame.types == 1][0] for frame in frames]) for name in ("positions", "velocities"))
    times = replica.time_step * np.array([frame.step for frame in frames])
    s = place.along(at)
    if p["start_speed"] > 0.0:
        due = velocity[0, 0] ** 2 / (2.0 * friction * g)
        way = np.where(times < times[0] + velocity[0, 0] / (friction * g),
                       velocity[0, 0] * (times - times[0]) - 0.5 * friction * g * (times - times[0]) ** 2, due)
        curve = _way(times, (s - s[0]) / d, way / d, "v t − ½ μ g t², up to v²/(2 μ g)")
        if abs(velocity[-1, 0]) > 1e-4 * math.sqrt(g * d):
            return Measurement({}, [curve], ["The grain does not stop before the run ends."])
        return Measurement({"stopping_distance": Value(exact((s[-1] - s[0]) / due), exact(1.0))}, [curve])
    # Once the springs have their load, and before the toe.
    down = place.above(at) & (s < -d) & (times > 0.1 * times[-1])
    fitted = 2.0 * float(np.polyfit(times[down] - times[down].mean(), s[down], 2)[0])
    sine, cosine = math.sin(place.angle), math.cos(place.angle)
    due = sine - friction * cosine if p["spin"] == "blocked" else 5.0 / 7.0 * sine
    return Measurement({"slope_acceleration": Value(exact(fitted / g), exact(due))}, [
        _way(times[down], s[down] / d, (s[0] + 0.5 * due * g * times[down] ** 2) / d, "½ a t²")])


def _way(times: Array, way: Array, reference: Array, label: str) -> Curve:
    return profile("way", "Distance of a single grain", "time (s)", "distance along the floor, over d", times, [way], reference=reference,
                   reference_label=label)


def _chute(replicas: Replicas) -> Measurement:
    """A bed on a chute: its mean speed, and the power of its profile where it flows."""
    p = replicas[0].parameters
    d, unit = float(p["grain_diameter"]), math.sqrt(p["gravity"] * p["grain_diameter"])
    depths, means, powers = [], [], []
    curves: list[Curve] = []
    for replica in replicas:
        frames = [frame.select(frame.types == 1) for frame in replica.grains()]
        speed = np.array([float(np.average(frame.velocities[:, 0], weights=frame.masses)) for frame in frames]) / unit
        means.append(block_mean(speed))
        depth = float(np.mean([2.0 * np.average(frame.positions[:, 2], weights=frame.masses) for frame in frames]))
        depths.append(depth / d)
        sums = [layers(frame, d) for frame in frames]
        count = max(len(mass) for mass, _ in sums)
        mass, momentum = (np.array([np.pad(one[k], (0, count - len(one[k]))) for one in sums]) for k in (0, 1))
        middles = d * (np.arange(count) + 0.5)
        inside = (middles < 0.95 * depth) & (mass.sum(axis=0) > 0.0)
        u = momentum.sum(axis=0)[inside] / mass.sum(axis=0)[inside] / unit
        powers.append(mean_power(middles[inside] / depth, mass[:, inside], momentum[:, inside]))
        curves.append(profile(f"speed_{len(curves) + 1}", "Velocity profile", "z / H", "speed over √(g d)", middles[inside] / depth, [u],
                              vertical=True))
    values = {"bed_depth": Value(over_chaotic(depths)), "mean_speed": Value(over_replicas(means))}
    if p["slope_angle"] <= REST:
        values["rest_speed"] = Value(exact(max(abs(one.value) for one in means)), exact(0.0))
    else:
        angle, mean = p["slope_angle"], values["mean_speed"].estimate
        between = f"the power is known up to {SLOW:g} rad and from {FAST:g} rad on" if SLOW < angle < FAST else ""
        still = "" if abs(mean.value) > mean.half else "the mean speed is not above its interval"
        values["profile_power"] = Value(over_replicas(powers), exact(1.0 if angle <= SLOW else 1.5), inapplicable=between or still)
    return Measurement(values, curves)


def study(name: str, results: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """Power of the depth with which the mean speed grows, over the depths that were measured."""
    results, _ = ordered(results, along)
    depth = np.array([measured(one, "bed_depth").value for one in results])
    growth = PowerLawFit.of(results, "mean_speed", depth)
    return Measurement({"speed_power": Value(growth.exponent, exact(1.5))},
                       [growth.curve("mean_speed", "Mean speed on the chute", "depth of the bed over d", "over √(g d)")])
