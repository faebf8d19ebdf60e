"""Log pile: forces of a stack at rest, its contacts, and the state after the first impacts, in which engines are due to be the same."""

import math

import numpy as np

from dembark.postproc.instruments.logs import Loads, LogRun, beginning, impact_values, loads, over_time, read, solver_values
from dembark.postproc.measurement import Array, Curve, Measurement, Replicas, Value, block_mean, exact, number, profile

WALLS = (-1, -2, -3)  # ground, left and right stake
REST = 0.1  # the share of the run, at its end, in which the stack is at rest
FIRST = 10  # impacts from the beginning in which two engines have to be the same


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of the run (there is one)."""
    run = read(replicas[0])
    stack, rest = loads(run, WALLS), slice(int((1.0 - REST) * len(run.times)), None)
    height = run.positions[:, :, 1] @ run.masses * run.parameters["gravity"]
    values = {**_at_rest(run, stack, rest), **_energy(run, height), **solver_values(run), **_beginning(run), **impact_values(run)}
    remarks = [
        f"Measured at rest: the last {REST:.0%} of the run, {run.times[rest][-1] - run.times[rest][0]:.2f} s.",
        ("All engines are due to be the same to round-off, which grows at each impact; a bound is set to the state after the "
         f"first {FIRST} impacts, all that comes later within the intervals."),
    ]
    if run.parameters["stake_friction"] > 0.0:
        remarks.append("The stakes are rough and carry a part of the weight.")
    return Measurement(values, _curves(run, stack), remarks)


def _at_rest(run: LogRun, stack: Loads, rest: slice) -> dict[str, Value]:
    """Forces on ground, stakes and each log, and the number of contacts: at least as many unknowns as equations."""
    p, weights, logs = run.parameters, run.masses * run.parameters["gravity"], len(run.masses)
    walls, down = stack.walls[rest] / weights.sum(), np.stack([0.0 * weights, weights], axis=1)
    speed = math.sqrt(float((run.velocities[rest] ** 2).sum(axis=2).mean()) / (p["gravity"] * 2.0 * p["radius"]))
    net = np.linalg.norm(stack.net[rest].mean(axis=0) - down, axis=1) / weights
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


def _beginning(run: LogRun) -> dict[str, Value]:
    """The state after the first impacts; what two engines may differ by is a share of the value, for velocities of the speed."""
    if not len(run.impacts):
        return {}
    frame, logs, first = beginning(run, FIRST)

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


def _curves(run: LogRun, stack: Loads) -> list[Curve]:
    times, p, weight, last = run.times, run.parameters, run.masses.sum() * run.parameters["gravity"], slice(-100, None)
    lift, energy = stack.walls[:, :, 1].sum(axis=1) / weight, weight * p["radius"]
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
