"""Log pile: forces of a stack at rest, its contacts, and the state after the first impacts, in which engines are due to be the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.instruments.logs import LogRun, number, over_time, read, solver_values
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Array, Replica
from dembark.postproc.resampling import profile
from dembark.postproc.statistics import CONFIDENCE, Estimate, block_mean, exact, student

WALLS = (-1, -2, -3)  # ground, left and right stake
REST = 0.1  # the share of the run, at its end, in which the stack is at rest
FIRST = 10  # impacts from the beginning in which two engines have to be the same


@dataclass(frozen=True)
class Stack:
    """Forces of all frames.

    `walls` (frames, 3, 2): of ground, left and right stake on the logs, along x and y, over the weight of all logs. `net` (frames, n, 2):
    sum of contacts and weight on each log, in N. `contacts` (frames,): how many carry; `mobilised` (frames,): mean of |T| / N.
    """

    walls: Array
    net: Array
    contacts: Array
    mobilised: Array


def forces(run: LogRun) -> Stack:
    """Sums of the contact forces of each frame, counted contact by contact."""
    frames, logs = run.positions.shape[:2]
    walls, net, gravity = np.zeros((frames, 3, 2)), np.zeros((frames, logs, 2)), run.parameters["gravity"]
    mobilised = np.full(frames, math.nan)
    net[:, :, 1] = -run.masses * gravity
    for frame, touch in enumerate(run.touches):
        on_first = (touch.normals * touch.forces[:, None] + touch.friction)[:, :2]
        first, second = touch.ids.T
        np.add.at(net[frame], first - 1, on_first)
        pair = second > 0
        np.add.at(net[frame], second[pair] - 1, -on_first[pair])
        walls[frame] = [on_first[second == wall].sum(axis=0) for wall in WALLS]
        if len(touch.forces):
            mobilised[frame] = float(np.mean(np.linalg.norm(touch.friction, axis=1) / touch.forces))
    contacts = np.array([len(touch.forces) for touch in run.touches], float)
    return Stack(walls / float(run.masses.sum() * gravity), net, contacts, mobilised)


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Values and curves of the run (there is one)."""
    return measured(read(replicas[0]))


def measured(run: LogRun) -> Measurement:
    """The same from a run that was read."""
    stack, rest = forces(run), slice(int((1.0 - REST) * len(run.times)), None)
    height = run.positions[:, :, 1] @ run.masses * run.parameters["gravity"]
    values = {**_at_rest(run, stack, rest), **_energy(run, height), **solver_values(run), **_beginning(run), **_impacts(run)}
    remarks = [
        f"Measured at rest: the last {REST:.0%} of the run, {run.times[rest][-1] - run.times[rest][0]:.2f} s.",
        ("All engines are due to be the same to round-off, which grows at each impact; a bound is set to the state after the "
         f"first {FIRST} impacts, all that comes later within the intervals."),
    ]
    if run.parameters["stake_friction"] > 0.0:
        remarks.append("The stakes are rough and carry a part of the weight.")
    return Measurement(values, _curves(run, stack), remarks)


def _at_rest(run: LogRun, stack: Stack, rest: slice) -> dict[str, Value]:
    """Forces on ground, stakes and each log, and the number of contacts: at least as many unknowns as equations."""
    p, walls, logs = run.parameters, stack.walls[rest], run.positions.shape[1]
    speed = math.sqrt(float((run.velocities[rest] ** 2).sum(axis=2).mean()) / (p["gravity"] * 2.0 * p["radius"]))
    net = np.linalg.norm(stack.net[rest].mean(axis=0), axis=1) / (run.masses * p["gravity"])
    rough, per_log, one = p["friction"] > 0.0, block_mean(stack.contacts[rest] / logs), exact(1.0)
    least = 1.5 if rough else 2.0
    told = "3/2: three equations a log, two unknowns a contact" if rough else "2: two equations a log, one unknown a contact"
    values = {
        "lift_over_weight": Value(block_mean(walls[:, :, 1].sum(axis=1)), one),
        "ground_share": Value(block_mean(walls[:, 0, 1]), one if p["stake_friction"] == 0.0 else None),
        "side_balance": Value(block_mean(walls[:, :, 0].sum(axis=1)), exact(0.0)),
        "stake_push": Value(block_mean(0.5 * (walls[:, 1, 0] - walls[:, 2, 0]))),
        "log_balance": number(net.max(), 0.0),
        "residual_speed": number(speed, 0.0),
        "contacts_per_log": Value(per_log, exact(least), verdict="pass" if per_log.value >= least - 0.5 / logs else "fail",
                                  detail=f"at least {told}"),
    }
    return values | ({"mobilised": Value(block_mean(stack.mobilised[rest] / p["friction"]))} if rough else {})


def _energy(run: LogRun, height: Array) -> dict[str, Value]:
    """The engine's account of energy at the end of the run; `height` (frames,): potential energy in J."""
    lost, released = run.history["dissipated_energy"][-1], height[0] - height[-1]
    end = run.kinetic[-1] + run.history["elastic_energy"][-1] + lost + height[-1]
    strongest, weight = run.history["highest_force"][-1], run.masses.sum() * run.parameters["gravity"]
    return {
        "energy_balance": number((end - height[0]) / released, 0.0),
        "dissipated_energy": number(lost / released),
        "highest_force": number(strongest, detail=f"{strongest / weight:.2f} of the weight of the stack"),
    }


def beginning(run: LogRun) -> tuple[int, NDArray[np.int64], Array]:
    """(frame, logs, impacts): the last frame before impact FIRST + 1 begins, the logs of the first FIRST impacts, and these by time."""
    order = run.impacts[np.lexsort((run.impacts[:, 1], run.impacts[:, 0], run.impacts[:, 2]))]
    until = order[FIRST, 2] if len(order) > FIRST else run.times[-1] + 0.5 * run.time_step
    frame = int(np.flatnonzero(run.times < until - 0.5 * run.time_step)[-1])
    ids = np.unique(order[:FIRST, :2].astype(np.int64))
    return frame, ids[ids > 0] - 1, order[:FIRST]


def _beginning(run: LogRun) -> dict[str, Value]:
    """The state after the first impacts; what two engines may differ by is a share of the value, for velocities of the speed."""
    if not len(run.impacts):
        return {}
    frame, logs, first = beginning(run)

    def rms(vectors: Array) -> float:
        return math.sqrt(float((vectors**2).sum(axis=1).mean()))

    speed, sideways = rms(run.velocities[frame, logs]), float(run.velocities[frame, logs, 0].mean())
    values = {
        "first_place": rms(run.positions[frame, logs, :2] - run.positions[0, logs, :2]), "first_speed": speed,
        "first_spin": rms(run.spins[frame, logs]), "first_impulse": float(first[:, 5].mean()), "first_peak": float(first[:, 4].mean()),
    }
    told = f"{len(first)} impacts, {len(logs)} logs, at {run.times[frame]:.4f} s"
    return {name: number(value, scale=value, detail=told) for name, value in values.items()} | {
        "first_sideways": number(sideways, scale=max(abs(sideways), speed), detail=told)}


def _impacts(run: LogRun) -> dict[str, Value]:
    """Numbers over all impacts, with the intervals of as many independent ones."""
    count, z = len(run.impacts), student(1e9, CONFIDENCE)
    if count < 2:
        return {}
    basis, peak, impulse = f"{count} impacts as independent ones", np.log(run.impacts[:, 4]), np.sort(run.impacts[:, 5])
    middle, mean, reach = float(np.median(impulse)), float(np.exp(peak.mean())), 0.5 * z * math.sqrt(count)
    # The interval of a median is that of its order statistics.
    low, high = impulse[max(0, math.floor(0.5 * count - reach))], impulse[min(count - 1, math.ceil(0.5 * count + reach))]
    return {
        "impact_count": Value(Estimate(float(count), z * math.sqrt(count), "counting statistics")),
        "impact_peak": Value(Estimate(mean, float(mean * z * peak.std() / math.sqrt(count)), basis)),
        "impact_impulse": Value(Estimate(middle, float(max(high - middle, middle - low)), basis)),
    }


def _curves(run: LogRun, stack: Stack) -> list[dict[str, Any]]:
    times, p, lift, last = run.times, run.parameters, stack.walls[:, :, 1].sum(axis=1), slice(-100, None)
    energy = run.masses.sum() * p["gravity"] * p["radius"]
    peaks = np.log10(np.maximum(run.impacts[:, 4], 1e-300)) if len(run.impacts) else np.zeros(1)
    counts, edges = np.histogram(peaks, bins=np.arange(math.floor(peaks.min()), math.ceil(peaks.max()) + 0.125, 0.125))
    kinetic = np.log10(np.maximum(run.history["kinetic_energy"] / energy, 1e-12))
    least = np.full(len(times), 1.5 if p["friction"] > 0.0 else 2.0)
    return [
        over_time("lift", "Force upwards over the weight", "F / W", times, lift, np.ones(len(times)), label="weight", seconds=True),
        over_time("lift_at_rest", "The same, close to rest", "F / W − 1", times[last], lift[last] - 1.0, np.zeros(100), label="weight",
                  seconds=True),
        over_time("kinetic", "Kinetic energy", "log₁₀ E / (½ W d)", times[1:], kinetic, seconds=True),
        over_time("active", "Contacts that carry, per log", "contacts / log", times, stack.contacts / len(run.masses), least,
                  label="least number at rest", seconds=True),
        over_time("impacts", "Impacts begun", "number", times[1:], run.history["impacts"], seconds=True),
        profile("peaks", "Impacts by peak force", "log₁₀ peak force (N)", "impacts", 0.5 * (edges[1:] + edges[:-1]), [1.0 * counts]),
    ]
