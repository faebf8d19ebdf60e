"""Hydrostatics, Archimedes, added mass, the contraction of a jet and what is conserved, in a fluid of particles."""

import math
from pathlib import Path

import numpy as np

from dembark.input_decks.common.estimates import reference_rows, unlike
from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.input_decks.common.water_run import common_values, pressure
from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Curve, Measurement, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.studies import measured

# m, of the experiment with the falling block: the level, and the places below it between which it is timed.
REFERENCE, LEVEL, PASSED = Path(__file__).with_name("reference") / "falling.csv", 0.131, (0.011, 0.081)
# Of a jet behind a thin plate (Kirchhoff 1869).
# Tank and block of that experiment.
FALLING = {"size": 0.02, "tank_width": 0.15, "water_depth": 0.131, "body_density": 2120.0, "fluid_density": 1000.0, "gravity": 9.81}
CONTRACTION = math.pi / (math.pi + 2.0)
# The least width of a slot, over the spacing, that is judged; the largest, over that of the tank, of which the contraction is the limit.
RESOLVED, NARROW = 4, 0.15
# Of its momentum, what a block must give to the water for the sum of both to count.
FELT = 0.01


def late(run: Replica, times: Array) -> Array:
    """Which times belong to the part that is measured."""
    end = run.derived["steps"] * run.time_step
    return np.asarray(times > (1.0 - run.parameters["measured_part"]) * end * (1.0 + 1e-12))


def still(run: Replica) -> tuple[dict[str, Value], list[Curve]]:
    """Pressures of the particles, and what the walls carry."""
    p, depth, width = run.parameters, run.derived["depth"], run.derived["tank_right"]
    weight = p["fluid_density"] * p["gravity"]
    squares = []
    for frame in run.grains():
        below, found = depth - frame.positions[:, 1], pressure(frame)
        if late(run, np.array([frame.step * run.time_step]))[0]:
            squares.append(float(np.mean((found / (weight * depth) - below / depth) ** 2)))
    rows = run.times()
    force = -float(rows["tank_fy"][late(run, rows["time"])].mean()) / (weight * depth * width)
    levels = np.argsort(-below)
    shown = profile("pressure", "Pressure at the end", "depth / H", "p / (ρ g H)", below[levels] / depth,
                    [found[levels] / (weight * depth)], reference=below[levels] / depth, reference_label="hydrostatics")
    return {"pressure_rms": Value(exact(math.sqrt(float(np.mean(squares)))), exact(0.0)),
            "wall_force": Value(exact(force), exact(1.0))}, [shown]


def floating(run: Replica) -> tuple[dict[str, Value], list[Curve]]:
    """The share of the block that is under water: level * width = water + share * side**2."""
    p, d, rows = run.parameters, run.derived, run.times()
    side, width = p["size"], d["tank_right"]
    bottom = rows["body_y"] - 0.5 * side
    share = (d["grain_count"] * d["spacing"] ** 2 - width * bottom) / (width - side) / side
    due = p["body_density"] / p["fluid_density"]
    shown = profile("draught", "Displaced volume", "t / s", "over the block's", rows["time"], [share], reference=np.full(len(share), due),
                    reference_label="Archimedes")
    return {"displaced_volume": Value(exact(float(share[late(run, rows["time"])].mean())), exact(due))}, [shown]


def falling(run: Replica) -> tuple[dict[str, Value], list[Curve]]:
    """The time between two places below the level, in the run and the experiment."""
    rows, depth = run.times(), run.derived["depth"]
    times, heights = np.array([(row.number("time"), row.number("height")) for row in reference_rows(REFERENCE)]).T
    below = heights - LEVEL

    def between(t: Array, y: Array) -> float:
        return reached(t, -y, PASSED[1]) - reached(t, -y, PASSED[0])

    # From the level on: its own place is where it begins.
    own_t, own_y = (np.concatenate([[0.0], part]) for part in (rows["time"], rows["body_y"] - depth))
    found = between(own_t, own_y)
    seen = (times > 0.0) & (times <= own_t[-1])
    shown = profile("fall", "Falling block", "t / s", "height above the level / m", times[seen], [np.interp(times[seen], own_t, own_y)],
                    reference=below[seen], reference_label="experiment in Qiu et al. (2017)")
    return {"fall_time": Value(exact(found), exact(between(times, below)), reason="" if found > 0.0 else "the run ends before",
                               inapplicable=unlike(run.parameters, FALLING))}, [shown]


def added_mass(radius: float, width: float, height: float) -> float:
    """Over the mass of the water displaced, of a cylinder in the middle of a box, moved along its width. The walls are those of images, a
    lattice of dipoles that point forth and back along x; higher poles are left out, of order (radius / height)**6. 1 without walls."""
    images = -math.pi**2 / 3.0 + 2.0 * sum((-1) ** m * (math.pi / math.sinh(math.pi * m * width / height)) ** 2 for m in range(1, 30))
    stream = images * (radius / height) ** 2
    return (1.0 - stream) / (1.0 + stream)


def cylinder(run: Replica) -> tuple[dict[str, Value], list[Curve]]:
    """Force over acceleration, less its mass. A straight line through the speeds takes out the sound that still goes forth and back."""
    p, d, rows = run.parameters, run.derived, run.times()
    chosen = rows["time"] >= p["ramp"]
    times, speeds = rows["time"][chosen], rows["body_vx"][chosen]
    found = d["load"] / float(np.polyfit(times, speeds, 1)[0]) - d["body_mass"]
    # The circle that has the area of the lattice.
    displaced = p["fluid_density"] * d["body_count"] * d["spacing"] ** 2
    radius = math.sqrt(d["body_count"] / math.pi) * d["spacing"]
    theory = added_mass(radius, d["tank_right"], d["depth"])
    straight = speeds[0] + d["load"] / (d["body_mass"] + theory * displaced) * (times - times[0])
    shown = profile("speed", "Speed of the cylinder", "t / s", "v / (m/s)", times, [speeds], reference=straight,
                    reference_label="theory")
    return {"added_mass": Value(exact(found / (theory * displaced)), exact(1.0))}, [shown]


def slot(run: Replica) -> tuple[dict[str, Value], list[Curve]]:
    """The width that fits the volume which has flown out, compared with the integral of CONTRACTION sqrt(2 g head)."""
    p, d = run.parameters, run.derived
    times = np.array([frame.step * run.time_step for frame in run.grains()])
    out = np.array([float((frame.positions[:, 1] < 0.0).sum()) for frame in run.grains()]) * d["spacing"] ** 2
    speeds = CONTRACTION * np.sqrt(2.0 * p["gravity"] * (d["depth"] - out / d["tank_right"]))
    due = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(times) * (speeds[1:] + speeds[:-1]))])
    chosen = late(run, times)
    width = float(np.polyfit(due[chosen], out[chosen], 1)[0])
    error = width - p["size"]
    values = {"slot_error": Value(exact(error / p["size"]))}
    if p["across"] >= RESOLVED:
        wide = f"the contraction is that of slots up to {NARROW:g} of the tank's width" if p["size"] > NARROW * d["tank_right"] else ""
        values["slot_width"] = Value(exact(error / d["spacing"]), exact(0.0), inapplicable=wide)
    start = out[chosen][0] - due[chosen][0] * p["size"]
    return values, [profile("flow", "Water that has flown out", "t / s", "V / m²", times[chosen], [out[chosen]],
                            reference=start + due[chosen] * p["size"], reference_label="contraction 0.611")]


def drifting(run: Replica) -> tuple[dict[str, Value], list[Curve]]:
    """Changes of the momenta about the origin, over those of the block at the start."""
    p, d, rows = run.parameters, run.derived, run.times()
    # Velocities (1, 1/2) and 1/size times the speed, about the centre.
    momentum, start = d["body_mass"] * p["speed"], d["body_inertia"] * p["speed"] / p["size"]
    whole, given = math.hypot(1.0, 0.5), 1.0 - float(rows["body_vx"][-1]) / p["speed"]
    untouched = "" if given > FELT else "the water does not act on the block"
    along = np.hypot(rows["momentum_x"] / momentum - 1.0, rows["momentum_y"] / momentum - 0.5) / whole
    about = np.abs(rows["angular_momentum"] - start - momentum * (0.5 * d["middle"] - d["body_y"])) / (whole * momentum * d["depth"])
    shown = profile("momentum", "Change of momentum, over that of the block at the start", "t / s", "Δ / 1", rows["time"], [along])
    return {"momentum_given": Value(exact(given)), "momentum_error": Value(exact(float(along.max())), exact(0.0), reason=untouched),
            "angular_momentum_error": Value(exact(float(about.max())), exact(0.0), reason=untouched)}, [shown]


SCENES = {"still": still, "floating": floating, "falling": falling, "cylinder": cylinder, "slot": slot, "drifting": drifting}


def outside(run: Replica, places: Array) -> Array:
    """Particles (n,) of positions (n, 3) in the walls, deeper than half a spacing, or beyond them."""
    if run.parameters["scene"] == "drifting":
        return np.zeros(len(places), bool)
    scene, half, dx = run.parameters["scene"], run.derived["half"], run.derived["spacing"]
    x, y, right = places[:, 0], places[:, 1], run.derived["tank_right"]
    below = y < -0.5 * dx
    if scene == "slot":
        # The jet is free below the plate.
        below &= (np.abs(x - run.derived["middle"]) > half + 0.5 * dx) & (y > -run.derived["thick"] + 0.5 * dx)
    above = y > run.derived["tank_top"] + 0.5 * dx if scene == "cylinder" else np.zeros(len(y), bool)
    return np.asarray(below | above | (y > 0.0) & ((x < -0.5 * dx) | (x > right + 0.5 * dx)))


def measure(replicas: Replicas) -> Measurement:
    """Of the one run: nothing is random."""
    run = replicas[0]
    p, d = run.parameters, run.derived
    values, curves = SCENES[p["scene"]](run)
    energy = 0.5 * p["fluid_density"] * p["gravity"] * d["tank_right"] * d["depth"] ** 2
    common = common_values(run, energy or 1.0, lambda places: outside(run, places))
    if p["scene"] in ("floating", "falling", "cylinder", "drifting"):
        # A body that is free gives the water energy.
        del common["energy_growth"]
    return Measurement({**values, **common}, curves)


def study(name: str, points: Points, along: str) -> Measurement:
    """The error at the finest spacing over that at the coarsest."""
    points, place = ordered(points, along)
    p = points[0]["parameters"]
    quantity, due = {"still": ("pressure_rms", 0.0), "floating": ("displaced_volume", p["body_density"] / p["fluid_density"]),
                     "cylinder": ("added_mass", 1.0), "slot": ("slot_error", 0.0)}[name.split("_", maxsplit=1)[0]]
    errors = np.abs([measured(point, quantity).value - due for point in points])
    return Measurement({f"{name}_converges": Value(exact(float(errors[-1] / errors[0])), exact(0.0))},
                       [PowerLawFit(place, errors, 0.0 * errors).curve("error", "Error", "particles across", "deviation from theory")])
