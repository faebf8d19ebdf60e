"""Compressed chain: the motion and the monitor of an engine against exact solutions; order and errors of the reference integrator."""

import math
from types import SimpleNamespace

import numpy as np

from dembark.physics import integrate_adams
from dembark.postproc.measurement import Array, Measurement, Replica, Replicas, Value, exact, profile

# omega h up to which the estimates of errors are to be right; that of the growth; phases of the step, over which impacts are averaged.
ESTIMATED, UNDAMPED, PHASES = 0.2, 0.314, 64
# Its multiples fill a step evenly.
GOLDEN = 0.618034


def measure(replicas: Replicas) -> Measurement:
    """The one run, for nothing is random; the reference integrator with the run whose errors are not estimated."""
    run = replicas[0]
    p = SimpleNamespace(**run.parameters)
    count = p.grain_count - 2
    shape = np.sin(math.pi * count * np.arange(p.grain_count) / (count + 1))
    reported = np.loadtxt(run.folder / "monitor.txt", ndmin=2)[-1]
    lasts = math.pi * math.sqrt(2.0) * math.sin(0.5 * math.pi * count / (count + 1)) / p.phase
    turn = 2.0 * math.asin(0.5 * p.phase)  # Omega h of the scheme
    moved, scheme = displacements(run, shape, turn)
    error = float(np.max(np.abs(moved - scheme))) / (p.amplitude * turn * p.run_steps)
    values = {"phase_error": error, "contact_steps": reported[2] / lasts}
    if p.phase > ESTIMATED:
        found = values | reference()
        due = {"adams_order": 4.0, "adams_estimate": 1.0, "adams_growth": 1.0, "impact_order_hooke": 2.0, "impact_order_hertz": 2.5,
               "contact_steps": 1.0}
    else:
        size = p.amplitude * math.sqrt(float(np.mean(shape[1:-1] ** 2)))
        missed = size * verlet_errors(p.phase) * [1.0, run.derived["angular"]]
        found = values | {"position_estimate": reported[0] / missed[0], "velocity_estimate": reported[1] / missed[1]}
        due = dict.fromkeys(("position_estimate", "velocity_estimate", "contact_steps"), 1.0)
    return Measurement({name: Value(exact(float(value)), exact(due.get(name, 0.0))) for name, value in found.items()}, [
        profile("mode", "Displacements at the end", "sphere", "displacement over the amplitude", np.arange(1.0, count + 1.0),
                [moved[-1] / p.amplitude], reference=scheme[-1] / p.amplitude, reference_label="solution of the scheme")])


def displacements(run: Replica, shape: Array, turn: float) -> tuple[Array, Array]:
    """Of the free spheres in each frame (frames, spheres), in m: measured, and amplitude * `shape` * cos(`turn` * step)."""
    p, frames = run.parameters, list(run.grains())
    rest = (p["grain_diameter"] - p["overlap"]) * np.arange(p["grain_count"])
    measured = np.array([frame.positions[:, 0] for frame in frames]) - rest
    steps = np.array([frame.step for frame in frames])
    scheme = p["amplitude"] * np.cos(turn * steps)[:, None] * shape
    # The spheres at the ends are held.
    return measured[:, 1:-1], scheme[:, 1:-1]


def verlet_errors(phase: float, steps: int = 2000) -> Array:
    """(2,): root mean square of what a step of velocity Verlet misses of x'' = -x, of position and velocity, from x = 1 at rest."""
    h, x, v, missed = phase, 1.0, 0.0, []
    for _ in range(steps):
        true = x * math.cos(h) + v * math.sin(h), v * math.cos(h) - x * math.sin(h)
        x, v = x + h * v - 0.5 * h * h * x, v - 0.5 * h * (2.0 * x + h * v - 0.5 * h * h * x)
        missed.append((true[0] - x, true[1] - v))
    return np.asarray(np.sqrt(np.mean(np.square(missed), axis=0)))


def reference() -> dict[str, float]:
    """What is known of Adams' predictor-corrector, as `dembark.physics` has it."""
    ends = [np.abs(oscillator(10.0 * math.pi, 2.0 * math.pi / steps)[1][-1] - [1.0, 0.0]).max() for steps in (160, 320)]
    h, states, errors = oscillator(10.0 * math.pi, 2.0 * math.pi / 160.0)
    x, v = states[4:-2].T
    missed = np.column_stack([x * math.cos(h) + v * math.sin(h), v * math.cos(h) - x * math.sin(h)]) - states[5:-1]
    size = np.linalg.norm(oscillator(2200 * UNDAMPED, UNDAMPED, tolerance=1e-300)[1], axis=1)
    found = {"adams_order": math.log2(ends[0] / ends[1]), "adams_estimate": float(np.linalg.norm(errors[5:-1]) / np.linalg.norm(missed)),
             "adams_growth": math.log(size[2200] / size[200]) / (2000.0 * math.log(growth(UNDAMPED)))}
    lasts = 2.943275 * 1.25**0.4
    touches = integrate_adams(bounce(1.5), [0.1, -1.0], 0.2 + lasts, lasts / 400.0, tolerance=1e-12, events=lambda _, y: [y[0]]).events
    found["impact_time"] = (touches[1].time - touches[0].time) / lasts - 1.0
    for name, power, whole in (("hooke", 1.0, math.pi), ("hertz", 1.5, lasts)):
        coarse, fine = (speed_error(power, whole, steps) for steps in (20, 160))
        found[f"impact_order_{name}"] = math.log(coarse / fine) / math.log(8.0)
    return found


def oscillator(end: float, step: float, tolerance: float = 1e-3) -> tuple[float, Array, Array]:
    """Time step, states (n, 2) and estimates of local errors (n, 2) of x'' = -x from x = 1 at rest."""
    run = integrate_adams(lambda _, y: [y[1], -y[0]], [1.0, 0.0], end, step, tolerance=tolerance)
    return step, run.state, run.error


def growth(phase: float) -> float:
    """Largest factor by which a step with two corrections multiplies y of y' = i y, at the step `phase`: of the companion matrix."""
    z = 1j * phase / 24.0
    start = np.array([1.0, 0.0, 0.0, 0.0])
    row = start + z * np.array([55.0, -59.0, 37.0, -9.0])
    for _ in range(2):
        row = start + z * (9.0 * row + np.array([19.0, -5.0, 1.0, 0.0]))
    return float(np.abs(np.linalg.eigvals(np.vstack([row, np.eye(4)[:3]]))).max())


def bounce(power: float):  # type: ignore[no-untyped-def]
    """Derivative of a grain of unit mass that hits the plane x = 0 with the force |x|^`power`."""
    return lambda _, y: [y[1], max(-y[0], 0.0) ** power]


def speed_error(power: float, lasts: float, steps: int) -> float:
    """Root mean square error of the speed after an impact at unit speed that `lasts` so long, at about `steps` a contact, over PHASES
    places of touch and release between two steps: were the contact a whole number of steps, their errors would cancel."""
    found = []
    for k in range(PHASES):
        step = lasts / (steps + GOLDEN * k % 1.0)
        run = integrate_adams(bounce(power), [(4.0 + (k + 0.5) / PHASES) * step, -1.0], lasts + 10.0 * step, step)
        found.append(run.state[-1, 1] - 1.0)
    return float(np.sqrt(np.mean(np.square(found))))
