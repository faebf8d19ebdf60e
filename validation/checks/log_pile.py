"""Checks of case `log_pile`: forces of a stack at rest, its contacts, and the engines beside each other from the first impact on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.validation.checks.logs import SAME, LogRun, exact, over_time, read, solver_quantities
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, profile
from dembark.validation.references import KOLESNIKOV
from dembark.postproc.statistics import CONFIDENCE, Estimate, block_mean, student
from numpy.typing import NDArray

Array = NDArray[np.float64]
REFERENCES = (KOLESNIKOV,)
GROUND, LEFT, RIGHT = -1, -2, -3
# The share of the run, at its end, in which the stack is at rest.
REST = 0.1
# Impacts from the beginning in which two engines have to be the same.
FIRST = 10
FORCE_TOLERANCE = 1e-3
REST_TOLERANCE = 0.01


@dataclass(frozen=True)
class Stack:
    """Forces of all frames.

    `walls` (frames, 3, 2): of ground, left and right stake on the logs, along x and y, in N. `net` (frames, n, 2): sum of contacts and
    weight on each log, in N. `contacts` (frames,): how many carry; `mobilised` (frames,): mean of |T| / N. `weight`: of all logs, in N.
    """

    walls: Array
    net: Array
    contacts: Array
    mobilised: Array
    weight: float


def forces(run: LogRun) -> Stack:
    """Sums of the contact forces of each frame, counted contact by contact."""
    frames, logs = run.positions.shape[:2]
    walls, net = np.zeros((frames, 3, 2)), np.zeros((frames, logs, 2))
    contacts, mobilised = np.zeros(frames), np.full(frames, math.nan)
    net[:, :, 1] = -run.masses * run.parameters["gravity"]
    for frame, touch in enumerate(run.touches):
        on_first = (touch.normals * touch.forces[:, None] + touch.friction)[:, :2]
        first, second = touch.ids.T
        np.add.at(net[frame], first - 1, on_first)
        pair = second > 0
        np.add.at(net[frame], second[pair] - 1, -on_first[pair])
        for number, wall in enumerate((GROUND, LEFT, RIGHT)):
            walls[frame, number] = on_first[second == wall].sum(axis=0)
        contacts[frame] = len(touch.forces)
        if len(touch.forces):
            mobilised[frame] = float(np.mean(np.linalg.norm(touch.friction, axis=1) / touch.forces))
    return Stack(walls, net, contacts, mobilised, float(run.masses.sum() * run.parameters["gravity"]))


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks of the run (there is one)."""
    return measured(read(replicas[0]))


def measured(run: LogRun) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The same from a run that was read."""
    stack, p = forces(run), run.parameters
    rest = slice(int((1.0 - REST) * len(run.times)), None)
    found = [
        *_at_rest(run, stack, rest),
        *_contacts(run, stack, rest),
        _energy(run),
        *solver_quantities(run),
        *_beginning(run),
        *_statistics(run),
    ]
    remarks = [
        f"Measured at rest: the last {REST:.0%} of the run, {run.times[rest][-1] - run.times[rest][0]:.2f} s.",
        "Both engines are due to be the same to round-off, which grows at each impact; a bound is set to the state after the "
        f"first {FIRST} impacts, all that comes later within the intervals.",
        f"{KOLESNIKOV.short}: {KOLESNIKOV.statement}",
    ]
    if p["stake_friction"] > 0.0:
        remarks.append("The stakes are rough and carry a part of the weight.")
    return found, _curves(run, stack), remarks


def _at_rest(run: LogRun, stack: Stack, rest: slice) -> list[Quantity]:
    """Forces on ground, stakes and each log."""
    p, weight = run.parameters, stack.weight
    up = stack.walls[rest, :, 1].sum(axis=1) / weight
    aside = stack.walls[rest, :, 0].sum(axis=1) / weight
    length = 2.0 * p["radius"]
    speed = math.sqrt(float((run.velocities[rest] ** 2).sum(axis=2).mean()) / (p["gravity"] * length))
    net = np.linalg.norm(stack.net[rest].mean(axis=0), axis=1) / (run.masses * p["gravity"])
    bottom = "ground" if p["stake_friction"] == 0.0 else "ground and stakes"
    return [
        Quantity(
            "lift_over_weight",
            f"force of the {bottom} upwards over the weight",
            "1",
            block_mean(up),
            reference=exact(1.0),
            tolerance=FORCE_TOLERANCE,
            source="balance of forces",
            detail="contact by contact; mean at rest",
        ),
        Quantity(
            "ground_share",
            "force of the ground upwards over the weight",
            "1",
            block_mean(stack.walls[rest, 0, 1] / weight),
            reference=exact(1.0) if p["stake_friction"] == 0.0 else None,
            tolerance=FORCE_TOLERANCE if p["stake_friction"] == 0.0 else None,
            source="balance of forces: smooth stakes carry nothing" if p["stake_friction"] == 0.0 else "",
        ),
        Quantity(
            "side_balance",
            "sum of all horizontal forces over the weight",
            "1",
            block_mean(aside),
            reference=exact(0.0),
            tolerance=FORCE_TOLERANCE,
            absolute=True,
            source="balance of forces",
            compared=False,
        ),
        Quantity(
            "stake_push",
            "push of a stake over the weight",
            "1",
            block_mean(0.5 * (stack.walls[rest, 1, 0] - stack.walls[rest, 2, 0]) / weight),
        ),
        Quantity(
            "log_balance",
            "largest force that is left on a log over its weight",
            "1",
            exact(net.max()),
            reference=exact(0.0),
            tolerance=REST_TOLERANCE,
            absolute=True,
            source="balance of forces",
            compared=False,
            detail="contacts and weight, mean at rest",
        ),
        Quantity(
            "residual_speed",
            "speed of the logs at rest, rms over √(g d)",
            "1",
            exact(speed),
            reference=exact(0.0),
            tolerance=REST_TOLERANCE,
            absolute=True,
            source="rest",
            compared=False,
        ),
    ]


def _contacts(run: LogRun, stack: Stack, rest: slice) -> list[Quantity]:
    """How many contacts the stack has at rest and how much of their friction they need."""
    p, logs = run.parameters, run.positions.shape[1]
    rough = p["friction"] > 0.0
    per_log = block_mean(stack.contacts[rest] / logs)
    least = 1.5 if rough else 2.0
    found = [
        Quantity(
            "contacts_per_log",
            "contacts that carry, per log",
            "1",
            per_log,
            reference=exact(least),
            absolute=True,
            source="as many equations as unknowns",
            verdict="pass" if per_log.value >= least - 0.5 / logs else "fail",
            tolerance=None,
            detail="at least "
            + ("3/2: three equations a log, two unknowns a contact" if rough else "2: two equations a log, one unknown a contact"),
        ),
    ]
    if rough:
        found.append(
            Quantity(
                "mobilised",
                "friction over normal force, mean of the contacts, over the coefficient",
                "1",
                block_mean(stack.mobilised[rest] / p["friction"]),
                detail="1: every contact at its limit",
            )
        )
    return found


def _energy(run: LogRun) -> Quantity:
    """What is missing in the engine's account of energy at the end of the run."""
    height = run.positions[:, :, 1] @ run.masses * run.parameters["gravity"]
    end = run.kinetic[-1] + run.history["elastic_energy"][-1] + run.history["dissipated_energy"][-1] + height[-1]
    released = height[0] - height[-1]
    return Quantity(
        "energy_balance",
        "(kinetic + elastic + dissipated) / released − 1",
        "1",
        exact((end - height[0]) / released),
        reference=exact(0.0),
        tolerance=1e-6,
        absolute=True,
        source="conservation law",
        compared=False,
        detail="released: by the weight, from the beginning to the end",
    )


def beginning(run: LogRun) -> tuple[int, NDArray[np.int64], Array]:
    """(frame, logs, impacts): the last frame before impact FIRST + 1 begins, the logs of the first FIRST impacts, and these by time."""
    order = run.impacts[np.lexsort((run.impacts[:, 1], run.impacts[:, 0], run.impacts[:, 2]))]
    first = order[:FIRST]
    until = order[FIRST, 2] if len(order) > FIRST else run.times[-1] + 0.5 * run.time_step
    frame = int(np.flatnonzero(run.times < until - 0.5 * run.time_step)[-1])
    ids = np.unique(first[:, :2].astype(np.int64))
    return frame, ids[ids > 0] - 1, first


def _beginning(run: LogRun) -> list[Quantity]:
    """The state after the first impacts, in which the engines are due to be the same."""
    if not len(run.impacts):
        return []
    frame, logs, first = beginning(run)
    shift = run.positions[frame, logs, :2] - run.positions[0, logs, :2]
    values = {
        "first_place": ("way of the logs of the first impacts, rms", "m", math.sqrt(float((shift**2).sum(axis=1).mean()))),
        "first_speed": ("their speed after, rms", "m/s", math.sqrt(float((run.velocities[frame, logs] ** 2).sum(axis=1).mean()))),
        "first_spin": ("their spin after, rms", "rad/s", math.sqrt(float((run.spins[frame, logs] ** 2).sum(axis=1).mean()))),
        "first_sideways": ("their mean velocity along x", "m/s", float(run.velocities[frame, logs, 0].mean())),
    }
    found = [
        Quantity(
            name,
            label,
            unit,
            exact(value),
            agreement=SAME * max(abs(value), values["first_speed"][2] if unit == "m/s" else 0.0),
            detail=f"{len(first)} impacts, {len(logs)} logs, at {run.times[frame]:.4f} s" if name == "first_place" else "",
        )
        for name, (label, unit, value) in values.items()
    ]
    for name, label, unit, column in (
        ("first_impulse", "mean impulse of the first impacts", "N*s", 5),
        ("first_peak", "mean peak force of the first impacts", "N", 4),
    ):
        value = float(first[:, column].mean())
        found.append(Quantity(name, label, unit, exact(value), agreement=SAME * value))
    return found


def _statistics(run: LogRun) -> list[Quantity]:
    """Numbers over all impacts, with the intervals of as many independent ones."""
    count = len(run.impacts)
    if count < 2:
        return []
    z, basis = student(1e9, CONFIDENCE), f"{count} impacts as independent ones"
    impulse, peak = run.impacts[:, 5], np.log(run.impacts[:, 4])
    lost = run.history["dissipated_energy"][-1]
    return [
        Quantity("impact_count", "impacts", "1", Estimate(float(count), z * math.sqrt(count), "counting statistics")),
        Quantity(
            "impact_peak",
            "peak force of an impact, geometric mean",
            "N",
            Estimate(float(np.exp(peak.mean())), float(np.exp(peak.mean()) * z * peak.std() / math.sqrt(count)), basis),
        ),
        Quantity("impact_impulse", "impulse of an impact, median", "N*s", _median(impulse, z, basis)),
        Quantity(
            "highest_force",
            "largest contact force of the run",
            "N",
            exact(run.history["highest_force"][-1]),
            compared=False,
            detail=f"{run.history['highest_force'][-1] / (run.masses.sum() * run.parameters['gravity']):.2f} of the weight of the stack",
        ),
        Quantity(
            "dissipated_energy",
            "energy lost over that released by the weight",
            "1",
            exact(lost / float((run.positions[0, :, 1] - run.positions[-1, :, 1]) @ run.masses * run.parameters["gravity"])),
            compared=False,
        ),
    ]


def _median(values: Array, z: float, basis: str) -> Estimate:
    """Median with the interval of its order statistics."""
    ranked, count = np.sort(values), len(values)
    reach = 0.5 * z * math.sqrt(count)
    low, high = ranked[max(0, math.floor(0.5 * count - reach))], ranked[min(count - 1, math.ceil(0.5 * count + reach))]
    middle = float(np.median(values))
    return Estimate(middle, float(max(high - middle, middle - low)), basis)


def _curves(run: LogRun, stack: Stack) -> list[dict[str, Any]]:
    weight, times = stack.weight, run.times / 1e3
    rows = run.history
    energy = 0.5 * weight * 2.0 * run.parameters["radius"]
    peaks = np.log10(np.maximum(run.impacts[:, 4], 1e-300)) if len(run.impacts) else np.zeros(1)
    counts, edges = np.histogram(peaks, bins=np.arange(math.floor(peaks.min()), math.ceil(peaks.max()) + 0.125, 0.125))
    seconds = {"along": "time (s)"}
    curves = [
        over_time(
            "lift",
            "Force upwards over the weight",
            "F / W",
            times,
            stack.walls[:, :, 1].sum(axis=1) / weight,
            reference=np.ones(len(times)),
            label="weight",
        )
        | seconds,
        over_time(
            "lift_at_rest",
            "The same, close to rest",
            "F / W − 1",
            times[-100:],
            stack.walls[-100:, :, 1].sum(axis=1) / weight - 1.0,
            reference=np.zeros(100),
            label="weight",
        )
        | seconds,
        over_time("kinetic", "Kinetic energy", "log₁₀ E / (½ W d)", times[1:], np.log10(np.maximum(rows["kinetic_energy"] / energy, 1e-12)))
        | seconds,
        over_time(
            "active",
            "Contacts that carry, per log",
            "contacts / log",
            times,
            stack.contacts / run.positions.shape[1],
            reference=np.full(len(times), 1.5 if run.parameters["friction"] > 0.0 else 2.0),
            label="least number at rest",
        )
        | seconds,
        over_time("impacts", "Impacts begun", "number", times[1:], rows["impacts"]) | seconds,
        profile(
            "peaks",
            "Impacts by peak force",
            "log₁₀ peak force (N)",
            "impacts",
            0.5 * (edges[1:] + edges[:-1]),
            [counts.astype(float)],
        ),
    ]
    return curves


def picture(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """How the report shows the stack: in cross-section, with the contact forces as lines."""
    del parameters
    return {"cross_section": "xy", "speed": 1.0, "frames": 30, "chains": True}
