"""Bead chain: when the wave passes two contacts, and with which force; in a bed under pressure, how the front passes its planes."""

import math

import numpy as np

from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Measurement, Numbers, Points, Replica, Replicas, Value, exact, profile
from dembark.postproc.studies import fitted_exponent, measured

# Of a solitary wave in Hertz's chain: V = 0.9055157 d k^(1/3) F^(1/6) / sqrt(m), from integration of 60 spheres to 1e-6.
SPEED = 0.9055157
# Contacts that are compared, as parts of the bed.
NEAR, FAR = 0.4, 0.8
# Speed over that behind a front that spreads, at the place of the long waves: the integral of Airy's function over the part ahead.
FOOT = 1.0 / 3.0


def forces(run: Replica) -> tuple[Array, Array]:
    """Times (frames,) in s, and forces (frames, planes - 1) in N on a sphere from the overlaps of the planes; a row has planes of one."""
    frames = list(run.grains())
    places = np.array([frame.positions[:, 0] for frame in frames]).reshape(len(frames), run.parameters["grain_count"], -1)
    overlap = run.derived["spacing"] - np.diff(places.mean(axis=2), axis=1)
    return run.time_step * np.array([frame.step for frame in frames]), run.derived["stiffness"] * np.maximum(overlap, 0.0) ** 1.5


def peak(times: Array, force: Array) -> tuple[float, float]:
    """Time (s) and height (N) of the largest `force` (n,) at evenly spaced `times`, by the parabola through it and its neighbours; NaN at
    an end of the record."""
    k = int(force.argmax())
    if k in (0, len(force) - 1):
        return math.nan, math.nan
    left, middle, right = force[k - 1 : k + 2]
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float(times[k] + shift * (times[1] - times[0])), float(middle - 0.25 * (left - right) * shift)


def unlike_theory(p: Numbers) -> str:
    """Why the theory of dry elastic spheres does not hold for the parameters `p`; "" where it does. In a row nothing rubs."""
    friction = p["grain_friction"] if p["static_friction"] is None else p["static_friction"]
    if p["bridge_volume"] > 0.0:
        return "liquid bridges: the theory is that of dry spheres"
    if p["restitution"] < 1.0:
        return "contacts dissipate: the theory is that of elastic spheres, with restitution = 1"
    return "spheres rub: the theory is that of contacts without friction" if p["lattice"] != "row" and friction > 0.0 else ""


def measure(replicas: Replicas) -> Measurement:
    """Speed of the wave or the front of the one run: nothing is random."""
    return front(replicas[0]) if replicas[0].parameters["overlap"] else wave(replicas[0])


def front(run: Replica) -> Measurement:
    """Speed and shape of the front."""
    p, frames = run.parameters, list(run.grains())
    rows, turn = p["grain_count"], run.derived["row_frequency"]
    times = run.time_step * np.array([frame.step for frame in frames])
    speeds = np.array([frame.velocities[:, 0] for frame in frames]).reshape(len(frames), rows, -1) / (0.5 * p["hit_speed"])
    due, other = lattice(rows, turn * times), unlike_theory(p)
    number = np.arange(rows // 2 + rows // 16, rows // 2 + rows // 5)
    mean = speeds.mean(axis=2)
    passed = np.array([reached(times, mean[:, k], FOOT) for k in number])
    return Measurement({
        "front_speed": Value(exact(float(np.polyfit(passed, number, 1)[0]) / turn), exact(1.0), inapplicable=other),
        "front_profile": Value(exact(float(np.abs(speeds - due[:, :, None]).max())), exact(0.0), inapplicable=other)},
        [profile("front", "Speeds of the planes at the end", "plane", "speed over that behind the front", np.arange(1.0, rows + 1.0),
                 [mean[-1]], reference=due[-1], reference_label="harmonic lattice")])


def lattice(rows: int, phases: Array) -> Array:
    """Speeds (times, rows) over those behind the front, of planes in a ring of which the first half has the speed 2, at the `phases`
    Omega t (times,): each wave of the phase q from plane to plane swings with 2 Omega |sin(q/2)|."""
    start = np.fft.rfft(np.where(np.arange(rows) < rows // 2, 2.0, 0.0))
    turns = 2.0 * np.sin(np.pi * np.arange(len(start)) / rows)
    return np.asarray(np.fft.irfft(start * np.cos(np.outer(phases, turns)), rows))


def wave(run: Replica) -> Measurement:
    """Speed and force of a solitary wave."""
    times, force = forces(run)
    near, far = (round(part * force.shape[1]) for part in (NEAR, FAR))
    (begun, first), (ended, last) = peak(times, force[:, near]), peak(times, force[:, far])
    spacing = run.derived["spacing"]
    speed, high = (far - near) * spacing / (ended - begun), math.sqrt(first * last)
    due = SPEED * spacing * run.derived["stiffness"] ** (1.0 / 3.0) * high ** (1.0 / 6.0) / math.sqrt(run.derived["mass"])
    other = unlike_theory(run.parameters)
    values = {"wave_speed": Value(exact(speed / due), exact(1.0), inapplicable=other),
              "wave_decay": Value(exact(last / first), exact(1.0), inapplicable=other),
              "velocity": Value(exact(speed)), "peak_force": Value(exact(high))}
    middle = int(np.argmin(np.abs(times - 0.5 * (begun + ended))))
    return Measurement(values, [
        profile("wave", "Force along the bed, with the wave between the two contacts", "contact", "N", np.arange(1.0, force.shape[1] + 1.0),
                [force[middle]])])


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """Power of the force with which the speed grows."""
    points, _ = ordered(points, along)
    force, speed = (np.array([measured(point, name).value for point in points]) for name in ("peak_force", "velocity"))
    growth = PowerLawFit(force, speed, 0.0 * speed)
    other = next(filter(None, (unlike_theory(point["parameters"]) for point in points)), "")
    return Measurement({"force_exponent": Value(exact(fitted_exponent(force, speed)), exact(1.0 / 6.0), inapplicable=other)},
                       [growth.curve("speed", "Speed of the wave", "largest force (N)", "m/s", 1.0 / 6.0, "∝ F^(1/6)")])
