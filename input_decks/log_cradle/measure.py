"""Log cradle: the velocities after an impact through a row of logs against the exact motion of the row."""

import math

import numpy as np

from dembark.input_decks.common.log_run import read, solver_values, unended
from dembark.input_decks.log_pair.exact_motion import row_curves
from dembark.physics.exact.chains import Chain
from dembark.postproc.measurement import Measurement, Numbers, Replicas, number


def row(p: Numbers) -> Chain:
    """The logs of a run with parameters `p`, the first of which moves; a contact is two boundaries in series."""
    n = int(p["log_count"])
    return Chain(np.full(n, p["mass"]), np.full(n - 1, 0.5 * p["stiffness"]), np.full(n - 1, p["gap"]), p["velocity"] * np.eye(n)[0])


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of the run (there is one)."""
    run = read(replicas[0])
    p, chain, duration = run.parameters, row(run.parameters), float(run.times[-1])
    motion, speed, turn = chain.motion(run.times), p["velocity"], chain.highest_frequency * run.time_step
    due, peak = motion.velocities[-1], chain.peak_force(duration)
    with_loss = chain.velocities_with_loss(duration, (2.0 * p["theta"] - 1.0) * run.time_step)
    final = run.velocities[-1, :, 0]
    # What the phases of all the beginnings and ends within a step add up to.
    phase = len(chain.gaps) * turn**2
    values = {
        f"velocity_{log + 1}_after": number(
            final[log], due[log], bound=1.25 * abs(with_loss[log] - due[log]) + phase * speed, scale=speed,
            detail=f"the numerical dissipation of the scheme is expected to change it by {with_loss[log] - due[log]:+.2e} m/s")
        for log in range(len(final))
    } | {
        "scheme_deviation": number(np.abs(final - with_loss).max() / speed, 0.0, bound=phase),
        "peak_force": number(run.history["highest_force"][-1], peak, bound=0.25 * math.pi * turn, scale=peak),
        "energy_kept": number(run.kinetic[-1] / run.kinetic[0], 0.5 * chain.masses @ with_loss**2 / run.kinetic[0], bound=phase),
        "momentum_error": number(run.momentum_error(), 0.0),
        **solver_values(run),
    }
    # Logs that still press or approach each other have an impact before them.
    if motion.forces[-1].any() or np.diff(due).min() < -1e-9 * speed:
        of_all = ["scheme_deviation", "peak_force", "energy_kept"]
        values = unended(values, [name for name in values if name.startswith("velocity_")] + of_all)
    shares = ", ".join(f"{value:.4f}" for value in due / speed)
    return Measurement(values, row_curves(run, chain, motion), [
        (f"Exact velocities after, over that of the first log: {shares} ({motion.events} contacts close or open meanwhile). All act at "
         "the same time; a row of separate pairs would pass on all of the velocity.")])
