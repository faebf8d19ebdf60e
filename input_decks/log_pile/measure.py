"""Log pile: forces of a stack at rest, its contacts, and the state after the first impacts, in which engines must agree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dembark.input_decks.common.estimates import over_chaotic
from dembark.input_decks.common.log_run import LogRun, over_time, read, solver_values
from dembark.postproc.measurement import Array, Curve, Measurement, Replicas, Value, block_mean, exact, number, over_replicas, profile

REST = 0.1  # the share of the run, at its end, in which the stack is at rest
WALLS = (-1, -2, -3)  # ground, left and right stake
SPENT = 0.99  # the share of the energy that is dissipated when a collapse counts as over
FIRST = 10  # impacts from the beginning in which two engines have to be the same


@dataclass(frozen=True)
class Loads:
    """What contacts carry in all frames, in N, along x and y. `walls` (frames, walls, 2): force of each wall on the logs; `net` (frames, n,
    2): sum of the contact forces on each log; `contacts` (frames,): how many carry; `alone` (frames,): logs that have a single one, with
    the ground; `mobilised` (frames,): mean of |T| / N, NaN without contacts."""

    walls: Array
    net: Array
    contacts: Array
    alone: Array
    mobilised: Array


def loads(run: LogRun, walls: Sequence[int]) -> Loads:
    """Sums over the contacts of each frame; `walls`: the ids of those to tell apart."""
    frames, logs = run.positions.shape[:2]
    on_walls, net, mobilised = np.zeros((frames, len(walls), 2)), np.zeros((frames, logs, 2)), np.full(frames, np.nan)
    alone = np.zeros(frames)
    for frame, touch in enumerate(run.touches):
        on_first = (touch.normals * touch.forces[:, None] + touch.friction)[:, :2]
        first, second = touch.ids.T
        np.add.at(net[frame], first - 1, on_first)
        pair = second > 0
        np.add.at(net[frame], second[pair] - 1, -on_first[pair])
        held = np.bincount(np.concatenate([first, second[pair]]) - 1, minlength=logs)
        alone[frame] = np.sum(held[first[second == WALLS[0]] - 1] == 1)
        on_walls[frame] = [on_first[second == wall].sum(axis=0) for wall in walls]
        if len(touch.forces):
            mobilised[frame] = float(np.mean(np.linalg.norm(touch.friction, axis=1) / touch.forces))
    return Loads(on_walls, net, np.array([len(touch.forces) for touch in run.touches], float), alone, mobilised)


def before_impact(run: LogRun, count: int) -> tuple[int, NDArray[np.int64], Array]:
    """(frame, logs, impacts): the last frame before impact `count` + 1 begins, the logs of the first `count` impacts, and these by time."""
    order = run.impacts[np.lexsort((run.impacts[:, 1], run.impacts[:, 0], run.impacts[:, 2]))]
    until = order[count, 2] if len(order) > count else run.times[-1] + 0.5 * run.time_step
    frame = int(np.flatnonzero(run.times < until - 0.5 * run.time_step)[-1])
    ids = np.unique(order[:count, :2].astype(np.int64))
    return frame, ids[ids > 0] - 1, order[:count]


def impact_values(runs: Sequence[LogRun]) -> dict[str, Value]:
    """How many impacts a pile had, the geometric mean of their peak forces and the median of their impulses, with Student's intervals over
    the piles; nothing where one of them had fewer than two. Impacts come in cascades, each the cause of the next ones: as independent ones
    they would have intervals that are far too narrow."""
    found = [run.impacts for run in runs]
    if min(map(len, found)) < 2:
        return {}
    return {
        "impact_count": Value(over_chaotic(len(impacts) for impacts in found)),
        "impact_peak": Value(over_chaotic(float(np.exp(np.log(impacts[:, 4]).mean())) for impacts in found)),
        "impact_impulse": Value(over_chaotic(float(np.median(impacts[:, 5])) for impacts in found)),
    }


def together(piles: Sequence[Mapping[str, Value]]) -> dict[str, Value]:
    """The values of several piles as one: means over them; of numbers without an interval that have a reference, the farthest from it, and
    a verdict of their own only when all have it."""
    first, *others = piles
    return {name: _together([value, *(one[name] for one in others if name in one)]) for name, value in first.items()}


def _together(values: Sequence[Value]) -> Value:
    first = values[0]
    if len(values) == 1:
        return first
    if first.reference is not None and not first.verdict and all(one.estimate.half == 0.0 for one in values):
        due = first.reference.value
        return max(values, key=lambda one: abs(one.estimate.value - due))
    verdict = next((one.verdict for one in values if one.verdict != "pass"), first.verdict)
    return replace(first, estimate=over_replicas([one.estimate for one in values]), verdict=verdict)


def at_rest(run: LogRun, stack: Loads, rest: slice) -> dict[str, Value]:
    """Forces on ground, stakes and each log, and the number of contacts: at least as many unknowns as equations. A log that lies alone on
    the ground rests on one."""
    p, weights, logs = run.parameters, run.masses * run.parameters["gravity"], len(run.masses)
    walls, down = stack.walls[rest] / weights.sum(), np.stack([0.0 * weights, weights], axis=1)
    speed = math.sqrt(float((run.velocities[rest] ** 2).sum(axis=2).mean()) / (p["gravity"] * 2.0 * p["radius"]))
    net = np.linalg.norm(stack.net[rest].mean(axis=0) - down, axis=1) / weights
    rough, per_log, one = p["friction"] > 0.0, block_mean(stack.contacts[rest] / logs), exact(1.0)
    alone = float(stack.alone[rest].mean()) / logs
    least = (1.5 if rough else 2.0) * (1.0 - alone) + alone
    counted = "3/2: three equations per log, two unknowns per contact" if rough else "2: two equations per log, one unknown per contact"
    counted += f"; 1 for the {alone * logs:.3g} that lie alone on the ground" if alone else ""
    values = {
        "lift_over_weight": Value(block_mean(walls[:, :, 1].sum(axis=1)), one),
        "ground_share": Value(block_mean(walls[:, 0, 1]), one if p["stake_friction"] == 0.0 else None),
        "side_balance": Value(block_mean(walls[:, :, 0].sum(axis=1)), exact(0.0)),
        "stake_push": Value(block_mean(0.5 * (walls[:, 1, 0] - walls[:, 2, 0]))),
        "log_balance": number(net.max(), 0.0),
        "residual_speed": number(speed, 0.0),
        "contacts_per_log": Value(per_log, exact(least), verdict="pass" if per_log.value >= least - 0.5 / logs else "fail",
                                  detail=f"at least {counted}"),
    }
    return values | ({"mobilised": Value(block_mean(stack.mobilised[rest] / p["friction"]))} if rough else {})


def energy(run: LogRun) -> dict[str, Value]:
    """The engine's account of energy at the end of the run."""
    height = run.positions[:, :, 1] @ run.masses * run.parameters["gravity"]
    lost, released = run.history["dissipated_energy"][-1], height[0] - height[-1]
    end = run.kinetic[-1] + run.history["elastic_energy"][-1] + lost + height[-1]
    strongest, weight = run.history["highest_force"][-1], run.masses.sum() * run.parameters["gravity"]
    return {
        "energy_balance": number((end - height[0]) / released, 0.0),
        "dissipated_energy": number(lost / released),
        "highest_force": number(strongest, detail=f"{strongest / weight:.2f} of the weight of the stack"),
    }


def collapse(run: LogRun) -> dict[str, Value]:
    """How many impacts of each log, and how much time, the stack of the beginning takes to come to rest."""
    lost = run.history["dissipated_energy"]
    row = int(np.argmax(lost >= SPENT * lost[-1]))
    return {"impacts_to_rest": number(run.history["impacts"][row] / len(run.masses)), "time_to_rest": number(run.times[row + 1])}


def first_impacts(run: LogRun) -> dict[str, Value]:
    """The state after the first impacts; what two engines may differ by is a share of the value, for velocities of the speed."""
    if not len(run.impacts):
        return {}
    frame, logs, first = before_impact(run, FIRST)

    def rms(vectors: Array) -> float:
        return math.sqrt(float((vectors**2).sum(axis=1).mean()))

    speed, sideways = rms(run.velocities[frame, logs]), float(run.velocities[frame, logs, 0].mean())
    values = {
        "first_place": rms(run.positions[frame, logs, :2] - run.positions[0, logs, :2]), "first_speed": speed,
        "first_spin": rms(run.spins[frame, logs]), "first_impulse": float(first[:, 5].mean()), "first_peak": float(first[:, 4].mean()),
    }
    detail = f"{len(first)} impacts, {len(logs)} logs, at {run.times[frame]:.4f} s"
    return {name: number(value, scale=value, detail=detail) for name, value in values.items()} | {
        "first_sideways": number(sideways, scale=max(abs(sideways), speed), detail=detail)}


def curves(run: LogRun, stack: Loads) -> list[Curve]:
    """Over time: force upwards, kinetic energy, contacts and impacts; and the impacts by their peak forces."""
    times, p, weight, last = run.times, run.parameters, run.masses.sum() * run.parameters["gravity"], slice(-100, None)
    lift, energy = stack.walls[:, :, 1].sum(axis=1) / weight, weight * p["radius"]
    peaks = np.log10(np.maximum(run.impacts[:, 4], 1e-300)) if len(run.impacts) else np.zeros(1)
    counts, edges = np.histogram(peaks, bins=np.arange(math.floor(peaks.min()), math.ceil(peaks.max()) + 0.125, 0.125))
    kinetic = np.log10(np.maximum(run.history["kinetic_energy"] / energy, 1e-12))
    least = np.full(len(times), 1.5 if p["friction"] > 0.0 else 2.0)
    return [
        over_time("lift", "Upward force over the weight", "F / W", times, lift, np.ones(len(times)), label="weight", seconds=True),
        over_time("lift_at_rest", "The same, close to rest", "F / W − 1", times[last], lift[last] - 1.0, np.zeros(100), label="weight",
                  seconds=True),
        over_time("kinetic", "Kinetic energy", "log₁₀ E / (½ W d)", times[1:], kinetic, seconds=True),
        over_time("active", "Loaded contacts per log", "contacts / log", times, stack.contacts / len(run.masses), least,
                  label="least number at rest", seconds=True),
        over_time("impacts", "Impacts started", "number", times[1:], run.history["impacts"], seconds=True),
        profile("peaks", "Impacts by peak force", "log₁₀ peak force (N)", "impacts", 0.5 * (edges[1:] + edges[:-1]),
                [counts.astype(np.float64)]),
    ]


def measure(replicas: Replicas) -> Measurement:
    """Values of all piles; the curves and the state after the first impacts, in which engines must agree, of the first one."""
    runs = [read(replica) for replica in replicas]
    stacks, run = [loads(one, WALLS) for one in runs], runs[0]
    rest = slice(int((1.0 - REST) * len(run.times)), None)
    piles = [{**at_rest(one, stack, rest), **energy(one), **collapse(one), **solver_values(one)}
             for one, stack in zip(runs, stacks, strict=True)]
    values = {**together(piles), **first_impacts(run), **impact_values(runs)}
    remarks = [
        f"Measured at rest: the last {REST:.0%} of the run, {run.times[rest][-1] - run.times[rest][0]:.2f} s.",
        ("All engines must agree to round-off, which grows at each impact; a bound is set for the state after the "
         f"first {FIRST} impacts of the first pile, later quantities are compared within the intervals over the piles."),
    ]
    if run.parameters["stake_friction"] > 0.0:
        remarks.append("The stakes are rough and carry part of the weight.")
    return Measurement(values, curves(run, stacks[0]), remarks)
