"""Moving walls: forces on fixed grains against the contact law, on a bed against one at rest, landings of a grain, impulse of the walls."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from scipy.optimize import brentq

from dembark.input_decks.common.momentum import unaccounted
from dembark.input_decks.common.motion import amplitude, motion
from dembark.physics import effective_youngs_modulus
from dembark.postproc.measurement import Array, Curve, Measurement, Points, Replica, Replicas, Value, exact, profile

# Landings that are compared; speed (m/s) of the impact whose duration they are compared by.
LANDINGS, USUAL = 5, 0.3


@dataclass(frozen=True)
class Contact:
    """A sphere of `radius` (m) and `mass` (kg) on a plane; `modulus` is the effective one E* (Pa), `restitution` the coefficient of
    restitution."""

    radius: float
    mass: float
    modulus: float
    restitution: float

    def force(self, overlap: Array, approach: Array) -> Array:
        """N, (n,): 4/3 E* sqrt(R) overlap^(3/2) and the damping for the speed `approach` (m/s, > 0 when it grows), after Tsuji et al.,
        Powder Technology 71 (1992) 239, with S = 2 E* sqrt(R overlap); 0 without overlap."""
        inside = np.maximum(overlap, 0.0)
        log_e = math.log(self.restitution)
        beta = -log_e / math.hypot(log_e, math.pi)
        stiffness = 2.0 * self.modulus * np.sqrt(self.radius * inside)
        return np.asarray(2.0 / 3.0 * stiffness * inside + 2.0 * math.sqrt(5.0 / 6.0) * beta * np.sqrt(stiffness * self.mass) * approach)

    def overlap(self, force: Array) -> Array:
        """m, (n,): of an elastic contact with this `force` (N)."""
        return np.asarray((np.maximum(force, 0.0) / (4.0 / 3.0 * self.modulus * math.sqrt(self.radius))) ** (2.0 / 3.0))

    def duration(self, speed: float) -> float:
        """s, of an elastic impact at `speed` (m/s): 2.87 (m² / (R E*² v))^(1/5), K. L. Johnson, Contact Mechanics (1985) section 11.4."""
        return float(2.87 * (self.mass**2 / (self.radius * self.modulus**2 * speed)) ** 0.2)


def heights_over_plate(places: Array, times: Array, rate: float, along: Array) -> tuple[Array, Array]:
    """Heights (times, n) in m of `places` (n, 3) over a plate, the plane z = 0 at the time 0, which turns about y with `rate` (rad/s) while
    the point of the axis that was the origin moves with the velocity `along` (3,) in m/s; and the speeds (times, n) in m/s with which the
    plate comes up to these places along its normal: n · (v + ω × r)."""
    angle = rate * times
    normal = np.column_stack([np.sin(angle), 0.0 * angle, np.cos(angle)])
    arm = places[None] - times[:, None, None] * along
    height = np.einsum("ta,tna->tn", normal, arm)
    # (0, w, 0) x r = w (r_z, 0, -r_x)
    speed = along + rate * np.stack([arm[..., 2], 0.0 * arm[..., 0], -arm[..., 0]], axis=-1)
    return height, np.einsum("ta,tna->tn", normal, speed)


def landings(count: int, place: Callable[[float], float], velocity: Callable[[float], float], gap: float, gravity: float,
             contact: Contact) -> list[tuple[float, float]]:
    """Times (s) at which a point that falls from rest, `gap` (m) above a plate at `place(t)` (m) with `velocity(t)` (m/s), lands on it, and
    the speeds (m/s) with which. It goes with the plate for as long as an elastic contact lasts, and leaves it with the restitution."""
    found: list[tuple[float, float]] = []
    since, height, speed = 0.0, place(0.0) + gap, 0.0

    def above(t: float) -> float:
        return height + speed * (t - since) - 0.5 * gravity * (t - since) ** 2 - place(t)

    for _ in range(count):
        high = since + 1e-5
        while above(high) > 0.0:
            high += 1e-5
        high = brentq(above, high - 1e-5, high, xtol=1e-16)
        hits = velocity(high) - speed + gravity * (high - since)
        found.append((high, hits))
        since = high + contact.duration(hits)
        height, speed = place(since), velocity(since) + contact.restitution * hits
    return found


def touch_times(times: Array, force: Array) -> Array:
    """s: times at which `force` (n,) becomes positive."""
    begins = (force[1:] > 0.0) & ~(force[:-1] > 0.0)
    return times[1:][begins]


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of the one run: nothing is random."""
    run = replicas[0]
    scene = {"held": _held, "bed": _bed, "bounce": _bounce}[run.parameters["scene"]]
    values, curves = scene(run)
    return Measurement({name: Value(exact(value), exact(0.0)) for name, value in values.items()}, curves)


def contact(run: Replica) -> Contact:
    """Of a grain on the plate, which is of the same material."""
    p = run.parameters
    radius = 0.5 * p["grain_diameter"]
    modulus = effective_youngs_modulus(p["youngs_modulus"], p["poisson_ratio"], p["youngs_modulus"], p["poisson_ratio"])
    return Contact(radius, p["grain_density"] * 4.0 / 3.0 * math.pi * radius**3, modulus, p["restitution"])


def _frames(run: Replica) -> tuple[Array, Array, Array]:
    """Times (frames,) in s, positions and forces (frames, grains, 3) in m and N."""
    frames = list(run.grains())
    return (run.time_step * np.array([frame.step for frame in frames]), np.array([frame.positions for frame in frames]),
            np.array([frame.forces for frame in frames]))


def _held(run: Replica) -> tuple[dict[str, float], list[Curve]]:
    p, law, (times, places, forces) = run.parameters, contact(run), _frames(run)
    if p["turning"]:
        along = np.array([run.derived[f"along_{axis}"] for axis in "xyz"])
        height, speed = heights_over_plate(places[0], times, p["turning"], along)
        due = law.force(law.radius - height, speed)
        found = np.linalg.norm(forces, axis=2)
        error = float(np.abs(found - due).max() / due.max())
        return {"contact_error": error}, [_curve("force", "Force of the plate on the first grain", times, found[:, 0], due[:, 0], "N")]
    way = motion(SimpleNamespace(**p)).displacement(times)[:, 2]
    plate = places[:, 0, 2] - law.radius + law.overlap(forces[:, 0, 2])
    late = times > p["motion_ramp"] / p["motion_frequency"]
    size = amplitude(SimpleNamespace(**p))
    last = times > times[-1] - 2.0 / p["motion_frequency"]
    return {"place_error": float(np.abs(plate - way)[late].max() / size)}, [
        _curve("place", "Position of the plate from the force on a fixed grain", times[last], plate[last], way[last], "m")]


def _bed(run: Replica) -> tuple[dict[str, float], list[Curve]]:
    times, _, forces = _frames(run)
    frames, rows = list(run.grains()), run.times()
    masses = frames[0].masses
    gravity = np.array([run.derived[f"gravity_{axis}"] for axis in "xyz"])
    weight, lasts = masses.sum() * np.linalg.norm(gravity), times[-1] - times[0]
    missing = [unaccounted(frames[0], frames[-1], rows, ["plate"], axis, own, run.time_step)
               for axis, own in zip("xyz", gravity, strict=True)]
    push = (forces - masses[:, None] * gravity).ravel()
    label = "index: by frame, grain and component"
    return {"impulse_error": float(np.linalg.norm(missing) / (weight * lasts))}, [
        profile("forces", "Contact forces on all grains", label, "N", np.arange(len(push), dtype=float), [push])]


def _bounce(run: Replica) -> tuple[dict[str, float], list[Curve]]:
    p, law, rows = run.parameters, contact(run), run.times()
    way = motion(SimpleNamespace(**p))
    due = landings(LANDINGS, lambda t: float(way.displacement(t)[2]), lambda t: float(way.velocity(t)[2]), run.derived["gap"],
                   p["gravity"], law)
    found = touch_times(np.append(0.0, rows["time"]), np.append(0.0, rows["plate_fz"]))
    expected = np.array([time for time, _ in due])
    if len(found) < LANDINGS:
        return {}, []
    number = np.arange(1.0, LANDINGS + 1.0)
    return {"landing_error": float(np.abs(found[:LANDINGS] - expected).max() / law.duration(USUAL))}, [
        profile("landings", "Landings", "number", "time (s)", number, [found[:LANDINGS]], reference=expected,
                reference_label="event-driven")]


def _curve(name: str, title: str, times: Array, found: Array, due: Array, unit: str) -> Curve:
    return profile(name, title, "time (s)", unit, times, [found], reference=due, reference_label="as prescribed")


def study(name: str, points: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """Forces in moving vessels against those in vessels at rest."""
    forces = {point["parameters"][along]: np.array(next(one["value"] for one in point["profiles"] if one["name"] == "forces"))
              for point in points}
    pairs = {"speed_error": ("speed", "rest"), "push_error": ("push", "tilt")}
    return Measurement({found: Value(exact(float(np.abs(forces[one] - forces[other]).max() / np.abs(forces[other]).max())), exact(0.0))
                        for found, (one, other) in pairs.items()})
