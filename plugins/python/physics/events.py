"""Hard grains: discs or spheres that collide without duration, from event to event.

For gases of grains, vibrated, sheared or cooling, where collisions are short and of two grains at a time. Method and its domain:
docs/theory/hard_grains.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import Limits, numbers, one_each, vectors
from dembark.physics.motion import WallMotion

Floats = NDArray[np.float64]

# Columns of _physics.EventSolver.account before those of the walls, of which each has five.
_SUMS = ("collisions", "elastic_collisions", "cell_crossings", "repeated_predictions", "normal_loss", "friction_loss")
_SHAPES = {"sphere": 0.4, "cylinder": 0.5}


@dataclass(frozen=True, kw_only=True)
class HardWall:
    """A plane of infinite mass; the free space is on the side of the normal.

    point : m, any of the plane at time 0, 2 or 3 components
    normal : any length
    motion : a WallMotion or its words, from time 0 on; the wall must not turn
    restitution, friction, tangential_restitution : with grains; None: those of the grains
    """

    point: Sequence[float]
    normal: Sequence[float]
    motion: WallMotion | str = ""
    restitution: float | None = None
    friction: float | None = None
    tangential_restitution: float | None = None


@dataclass(frozen=True)
class HardMotion:
    """What a run sampled: n instants, g grains, w walls; vectors have d = 2 or 3 components. Sums are from the start of the system on."""

    time: Floats  # (n,) s
    position: Floats  # (n, g, d) m, without the jumps from one end of a period to the other
    velocity: Floats  # (n, g, d) m/s
    spin: Floats  # (n, g), in space (n, g, 3), rad/s
    kinetic_energy: Floats  # (n,) J, with that of the spins
    rotational_energy: Floats  # (n,) J, of the spins
    potential_energy: Floats  # (n,) J, - sum m g.x
    normal_loss: Floats  # (n,) J, dissipated along the normals
    friction_loss: Floats  # (n,) J, and along the surfaces
    wall_work: Floats  # (n, w) J, of each wall on the grains
    wall_impulse: Floats  # (n, w, d) N s, on the grains
    wall_collisions: Floats  # (n, w)
    collisions: Floats  # (n,) of grains with grains
    virial: Floats  # (n, d, d) J, sum over these of impulse times distance of the centres
    overlap: Floats  # (n,) m, the largest of all pairs and walls; negative where none touch
    report: dict[str, Floats]  # (n,) each: elastic_collisions, cell_crossings, repeated_predictions

    @property
    def energy_balance(self) -> Floats:
        """J, (n,): kinetic + potential + losses - work of the walls, which stays what it was."""
        return self.kinetic_energy + self.potential_energy + self.normal_loss + self.friction_loss - self.wall_work.sum(axis=1)


_each = partial(one_each, thing="grain")


def _number(name: str, value: float, unit: str = "", **limits: Unpack[Limits]) -> float:
    array = numbers(name, value, unit, **limits)
    if array.shape != ():
        raise ValueError(f"{name} must be a number, not {value!r}")
    return float(array)


def _law(restitution: float, friction: float, tangential_restitution: float) -> list[float]:
    return [_number("restitution", restitution, low=0.0, high=1.0), _number("friction", friction, low=0.0, infinite=True),
            _number("tangential_restitution", tangential_restitution, low=-1.0, high=1.0)]


class HardGrains:
    """Discs or spheres, between planes or in periodic directions, that collide without duration and fly freely in between.

    mass, radius : kg and m, a number or (g,)
    position, velocity : m and m/s, (g, d), d = 2 or 3, at time 0; grains must not overlap
    spin : rad/s, (g,) about z, in space (g, 3)
    inertia : 'sphere' (2 m r^2 / 5) or 'cylinder' (m r^2 / 2); None: sphere in space, cylinder in the plane
    restitution : e, 0 ... 1
    restitution_speed : m/s, v0: restitution is 1 - (1 - e) min(1, v / v0)^p at the speed v of approach; 0: constant
    restitution_exponent : p
    friction : coefficient; inf: contacts never slide
    tangential_restitution : beta, of contacts that do not slide: -1 smooth, 0 no slip afterwards, 1 slip reversed
    gravity : m/s^2, (d,)
    periods : for each direction None or (low, high) in m, which then are the same place
    walls : HardWall objects
    contact_duration : s, collisions of a grain that had another one so shortly before are elastic (TC model); 0: none is

    Raises ValueError in one line for arguments that cannot be. `run` raises RuntimeError when grains with restitution < 1 collide without
    end at one time.

    >>> ball = HardGrains(1.0, 0.1, [[0, 0, 1.1]], gravity=(0, 0, -10), walls=[HardWall(point=(0, 0, 0), normal=(0, 0, 1))],
    ...                   restitution=0.5)
    >>> motion = ball.run(0.8)  # it falls for sqrt(0.2) s, and leaves the floor with a quarter of its energy of 10 J
    >>> round(float(motion.normal_loss[-1]), 9), round(float(motion.kinetic_energy[-1] + motion.potential_energy[-1]), 9)
    (7.5, 3.5)
    """

    def __init__(self, mass: ArrayLike, radius: ArrayLike, position: ArrayLike, velocity: ArrayLike | None = None, *,
                 spin: ArrayLike | None = None, inertia: str | None = None, restitution: float = 1.0, restitution_speed: float = 0.0,
                 restitution_exponent: float = 0.75, friction: float = 0.0, tangential_restitution: float = 0.0,
                 gravity: Sequence[float] | None = None, periods: Sequence[tuple[float, float] | None] | None = None,
                 walls: Sequence[HardWall] = (), contact_duration: float = 0.0) -> None:
        x = numbers("position", position, "m")
        if x.ndim != 2 or x.shape[0] == 0 or x.shape[1] not in (2, 3):
            raise ValueError(f"position must have the shape (grains, 2) or (grains, 3), not {x.shape}")
        n, self._dimension = x.shape
        grains = np.zeros((n, 11))
        grains[:, 0] = _each("mass", mass, "kg", n, low=0.0, low_open=True)
        grains[:, 1] = _each("radius", radius, "m", n, low=0.0, low_open=True)
        grains[:, 2:5] = vectors("position", x, "m", n, self._dimension)
        if velocity is not None:
            grains[:, 5:8] = vectors("velocity", velocity, "m/s", n, self._dimension)
        if spin is not None:
            grains[:, 8:11] = self._spins(spin, n)
        kind = inertia or ("sphere" if self._dimension == 3 else "cylinder")
        if kind not in _SHAPES:
            raise ValueError(f"inertia must be 'sphere' or 'cylinder', not {inertia!r}")
        between = _law(restitution, friction, tangential_restitution)
        speed = [_number("restitution_speed", restitution_speed, "m/s", low=0.0),
                 _number("restitution_exponent", restitution_exponent, low=0.0, low_open=True)]
        laws = [between, *(_law(*(own if given is None else given for own, given in zip(
            between, (wall.restitution, wall.friction, wall.tangential_restitution), strict=True))) for wall in walls)]
        rows = [[e, *speed, mu, beta] for e, mu, beta in laws]
        g = [0.0, 0.0, 0.0] if gravity is None else vectors("gravity", gravity, "m/s^2", 1, self._dimension)[0].tolist()
        self._walls = len(walls)
        self._solver = _physics.EventSolver(
            grains, self._dimension, _SHAPES[kind], rows[0], g, _number("contact_duration", contact_duration, "s", low=0.0),
            self._ends(periods), np.array([[*self._plane(wall), *law] for wall, law in zip(walls, rows[1:], strict=True)]).reshape(-1, 11),
            [(wall.motion if isinstance(wall.motion, WallMotion) else WallMotion(wall.motion))._motion for wall in walls])

    def _spins(self, spin: ArrayLike, n: int) -> Floats:
        if self._dimension == 3:
            return vectors("spin", spin, "rad/s", n, 3)
        out = np.zeros((n, 3))
        out[:, 2] = _each("spin", spin, "rad/s", n)
        return out

    def _plane(self, wall: HardWall) -> list[float]:
        if not isinstance(wall, HardWall):
            raise TypeError(f"walls must be HardWall objects, not {wall!r}")
        normal = vectors("normal", wall.normal, "", 1, self._dimension)[0]
        if not normal.any():
            raise ValueError("normal must not be zero")
        return [*vectors("point", wall.point, "m", 1, self._dimension)[0], *(normal / np.linalg.norm(normal))]

    def _ends(self, periods: Sequence[tuple[float, float] | None] | None) -> list[float]:
        ends = [0.0] * 6
        if periods is None:
            return ends
        if len(periods) != self._dimension:
            raise ValueError(f"periods must have {self._dimension} entries, each None or (low, high) in m, not {len(periods)}")
        for axis, period in enumerate(periods):
            if period is not None:
                pair = numbers("a period", period, "m")
                if pair.shape != (2,) or not pair[1] > pair[0]:
                    raise ValueError(f"a period must be (low, high) in m with low < high, not {period!r}")
                ends[2 * axis:2 * axis + 2] = pair.tolist()
        return ends

    @property
    def time(self) -> float:
        """Time (s) that has been reached."""
        return float(self._solver.time)

    def run(self, duration: float, *, samples: int = 1) -> HardMotion:
        """Go on for `duration` (s); samples the beginning and `samples` instants at equal distances, the last one at the end. Sampling
        changes nothing."""
        length = _number("duration", duration, "s", low=0.0)
        if int(samples) != samples or samples < 1:
            raise ValueError(f"samples must be a whole number >= 1, not {samples!r}")
        times = self.time + length * np.arange(samples + 1) / samples
        rows, sums, energies, overlap = [], [], [], []
        for time in times:
            self._solver.run(time)
            rows.append(self._solver.grains())
            sums.append(self._solver.account())
            energies.append(self._solver.energies())
            overlap.append(self._solver.overlap)
        return self._motion(times, np.array(rows), np.array(sums), np.array(energies), np.array(overlap))

    def _motion(self, times: Floats, rows: Floats, sums: Floats, energies: Floats, overlap: Floats) -> HardMotion:
        n, d = len(times), self._dimension
        named = dict(zip(_SUMS, sums.T, strict=False))
        walls = sums[:, len(_SUMS) + 9:].reshape(n, self._walls, 5)
        return HardMotion(
            times, rows[:, :, 2:2 + d], rows[:, :, 5:5 + d], rows[:, :, 8:] if d == 3 else rows[:, :, 10], energies[:, :2].sum(axis=1),
            energies[:, 1], energies[:, 2], named["normal_loss"], named["friction_loss"], walls[:, :, 1], walls[:, :, 2:2 + d],
            walls[:, :, 0], named["collisions"], sums[:, len(_SUMS):len(_SUMS) + 9].reshape(n, 3, 3)[:, :d, :d], overlap,
            {name: named[name] for name in ("elastic_collisions", "cell_crossings", "repeated_predictions")})

    def set_velocities(self, velocity: ArrayLike, spin: ArrayLike | None = None) -> None:
        """Velocities (m/s, (g, d)) and spins of all grains now, as from a thermostat; no spins: they stay. The accounts do not see it."""
        grains = np.asarray(self._solver.grains())
        n = len(grains)
        spins = grains[:, 8:] if spin is None else self._spins(spin, n)
        self._solver.set_velocities(vectors("velocity", velocity, "m/s", n, self._dimension), np.ascontiguousarray(spins))

    def state(self) -> Floats:
        """Everything needed to go on bit for bit."""
        return np.asarray(self._solver.state())

    def restore(self, state: ArrayLike) -> None:
        """Go on from `state` of a system with the same grains and walls."""
        self._solver.restore(np.ascontiguousarray(state, dtype=float))
