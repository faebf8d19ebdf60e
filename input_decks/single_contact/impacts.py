"""Single impacts, in which nothing is random: what the spheres of a run did, and the solutions that it is compared with. The first half of
the spheres is of material A, the second of B, each with a partner of its own or the plane z = 0."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dembark.physics.exact.contact_law import solved, stepped
from dembark.physics.exact.impacts import Impacts, Rebounds, partial_slip
from dembark.postproc.measurement import Array, Numbers, Replica

_PHASES = (0.0, 0.25, 0.5, 0.75)


@dataclass(frozen=True)
class Flight:
    """A run with n spheres: `times` (frames,) in s; `overlaps` in m and `forces` in N along the line of centres (frames, n); the end, and
    the largest change of a pair's momentum over m v (None where partners are a plane)."""

    times: Array
    overlaps: Array
    forces: Array
    after: Rebounds
    momentum_error: float | None


def worst(deviations: Array) -> int:
    """Index of the largest of `deviations` (n,): the first of those that differ from it by round-off alone. Impacts that slide to the end
    miss the law by the same, and engines that choose different ones of them cannot be compared."""
    largest = deviations.max()
    return int((deviations >= largest - 1e-6 * abs(largest) - 1e-10).argmax())


def sweep(p: Numbers) -> Array:
    """What is swept, for the spheres of material A, then for those of B."""
    return np.tile(p["sweep_from"] + (p["sweep_to"] - p["sweep_from"]) * np.arange(p["points"]) / max(p["points"] - 1, 1), 2)


def impacts(p: Numbers) -> Impacts:
    """The impacts of a run with the parameters `p` of single_contact, from these alone, so that the set-up of the decks is checked, too."""
    full, value, kind = np.ones(2 * p["points"]), sweep(p), p["sweep"]
    angle = np.radians(value) if kind in ("direction", "slide", "spin") else 0.0 * full
    youngs, poisson, density = (np.repeat([p[f"{name}_a"], p[f"{name}_b"]], p["points"])
                                for name in ("youngs_modulus", "poisson_ratio", "density"))
    # Sphere and partner share Poisson's ratio.
    softness = (1.0 + 1.0 / p["stiffness_ratio"]) / youngs
    mirror, rest = p["partner"] == "mirror", p["partner"] == "rest"
    larger, denser = (p["size_ratio"], p["density_ratio"]) if rest else (1.0, 1.0) if mirror else (math.inf, 1.0)
    mass = 4.0 / 3.0 * math.pi * p["radius"] ** 3 * density
    normal = -p["speed"] * (np.cos(angle) if kind == "direction" else full)
    slide = p["speed"] * {"direction": np.sin(angle), "slide": np.tan(angle)}.get(kind, 0.0 * full)
    spin = p["speed"] * np.tan(angle) / p["radius"] if kind == "spin" else 0.0 * full
    moving = np.array([[1.0], [-1.0 if mirror else 0.0]])
    return Impacts(1.0 / ((1.0 - poisson**2) * softness), 1.0 / (2.0 * (2.0 - poisson) * (1.0 + poisson) * softness),
                   value if kind == "restitution" else p["restitution"] * full, p["friction"] * full,
                   np.array([p["radius"] * full, larger * p["radius"] * full]), np.array([mass, larger**3 * denser * mass]),
                   moving * slide, moving * normal, moving * spin, p["friction_limit"])


def read(replica: Replica, one: Impacts, touch: float) -> Flight:
    """The flight of the spheres in the impacts `one`, which touch at the time `touch` (s)."""
    frames, n, plane = list(replica.grains()), len(one), not one.arm[1].any()
    order = np.argsort(frames[0].ids)
    x, v, w, f = (np.array([getattr(frame, name)[order] for frame in frames]) for name in ("positions", "velocities", "omegas", "forces"))
    x_2, v_2, w_2 = (x[:, :n] * [1, 1, 0], np.zeros_like(v), np.zeros_like(w)) if plane else (x[:, n:], v[:, n:], w[:, n:])
    apart = x[:, :n] - x_2
    distance = np.linalg.norm(apart, axis=2)
    normal, overlaps = apart / distance[..., None], one.arm.sum(axis=0) - distance
    forces, times = (f[:, :n] * normal).sum(axis=2), np.array([frame.step for frame in frames]) * replica.time_step
    # Both flights are free: the touch is known, and the way back to the release is straight.
    release = times[-1] + overlaps[-1] / ((v[-1, :n] - v_2[-1]) * normal[-1]).sum(axis=1)
    last, spins = np.array([v[-1, :n], v_2[-1]]), np.array([w[-1, :n, 0], w_2[-1, :, 0]])
    after = Rebounds(last[..., 1], last[..., 2], spins, _top(overlaps), _top(forces), release - touch)
    if plane:
        return Flight(times, overlaps, forces, after, None)
    masses = frames[0].masses[order, None]
    momentum = masses[:n] * v[:, :n] + masses[n:] * v_2
    return Flight(times, overlaps, forces, after, float(np.abs(momentum - momentum[0]).max() / (masses[:n, 0] * one.closing).max()))


def _top(values: Array) -> Array:
    """Largest value (n,) of each column of (frames, n), from the parabola through the three highest frames."""
    column = np.arange(values.shape[1])
    place = np.clip(values.argmax(axis=0), 1, len(values) - 2)
    low, middle, high = (values[place + step, column] for step in (-1, 0, 1))
    bend = 2.0 * middle - low - high
    return middle + np.where(bend > 0.0, (high - low) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)), 0.0)


class Solutions:
    """What impacts are held against: the `scheme` (numbers) at the run's phase and three others; where friction acts the contact law solved
    exactly and in half the parts, `law`, and, for elastic impacts on a plane, where it is known, partial `slip`. `in_parts`: the contacts
    of the run slip in parts. Then that is the law, and the scheme knows the motion along the normal only."""

    def __init__(self, one: Impacts, time_step: float, phase: float, in_parts: bool = False) -> None:
        length = float((1.4 * one.duration * (1.0 - np.log(one.restitution) / 4.0)).max())
        self.scheme = [stepped(one, time_step, (phase + more) % 1.0, length).numbers(one) for more in _PHASES]
        self.law: tuple[Rebounds, ...] = (solved(one), solved(one, 500)) if one.slides else ()
        known = one.slides and not one.arm[1].any() and (one.restitution > 0.95).all()
        self.slip = partial_slip(one) if known else None
        self.in_parts, self._sliding = in_parts and self.slip is not None, one.friction * (1.0 + one.restitution)
        if self.in_parts and self.slip:
            self.law = (self.slip, partial_slip(one, 200, 1000))

    def bound(self, name: str, due: Array) -> Array:
        """Allowed difference from `due` (n,): twice what the scheme loses at this step, the worst of four phases of the touch within it. Of
        contacts that slip in parts: a hundredth of the sliding friction throughout, within which their eight rings lie."""
        if self.in_parts and name in ("slide", "spin"):
            return 0.01 * {"slide": 1.0, "spin": 2.5}[name] * self._sliding
        return np.asarray(2.0 * np.max([np.abs(each[name] - due) for each in self.scheme], axis=0), np.float64)


def materials(count: int) -> dict[str, slice]:
    """Which of `count` spheres are of each material."""
    return {"a": slice(0, count // 2), "b": slice(count // 2, None)}
