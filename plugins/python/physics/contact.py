"""A single contact and small two-body systems without an engine, stepped like the engines step them.

The integrator is the leapfrog that the engines reduce to: forces at step n see the positions of step n and the velocities of the
half step before; so the same contact gives the same numbers in all of them to round-off.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dembark import _physics
from dembark.physics._checks import contact_number, numbers
from dembark.physics.capillary import check_model
from dembark.physics.friction import FrictionLaw
from dembark.physics.viscous import check_viscous

Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)
# As the monitor of integration in the engines.
LEAST_STEPS = 10
# Numbers without which a law of cohesion would do nothing.
_NEEDS = {"bridge": ("bridge_volume",), "constant": ("cohesive_force",), "dmt": ("work_of_adhesion",), "jkr": ("work_of_adhesion",)}


def _vector(name: str, value: Sequence[float], unit: str) -> NDArray[np.float64]:
    array = numbers(name, value, unit)
    if array.shape != (3,):
        raise ValueError(f"{name} must have three components ({unit}), not {value!r}")
    return array


@dataclass(frozen=True)
class ContactForce:
    """One step of a contact. Forces in N on body 1, torques in N m, lengths in m."""

    force: Vector
    torque_1: Vector
    torque_2: Vector
    overlap: float  # negative = gap
    normal_force: float  # repulsive, of the normal law alone
    capillary_force: float  # attractive, of a bridge or of adhesion
    tangential: Vector  # friction
    viscous_normal: float  # of the liquid, along the normal from body 2 to body 1
    viscous_tangential: Vector  # of the liquid
    interacting: bool  # touching or held by a bridge
    rolling: Vector  # couple of rolling resistance on body 1, N m, a part of torque_1; body 2 has its negative


@dataclass(frozen=True, kw_only=True)
class RollingResistance:
    """A couple against the relative rotation of two bodies in contact, but for what turns about the normal.

    model : 'off'; 'constant_torque', M = mu_r R* N against the rolling, or less where that stops it within one step; or 'elastic_plastic',
        a spring of stiffness k_t R*^2 that yields at the same couple, which holds bodies at rest
    friction : mu_r, >= 0; N is the repulsive force of the normal law, R* the effective radius
    damping_ratio : eta, >= 0, of the spring below its limit; 1 is critical

    J. Ai, J.-F. Chen, J. M. Rotter & J. Y. Ooi, Powder Technology 206 (2011) 269, models A and C. ValueError for values out of range.

    >>> law = RollingResistance(model="elastic_plastic", friction=0.1, damping_ratio=0.3)
    """

    model: str = "off"
    friction: float = 0.0
    damping_ratio: float = 0.0
    _law: _physics.RollingResistance = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        contact_number("rolling_friction", self.friction, "friction")
        contact_number("rolling_damping_ratio", self.damping_ratio, "damping_ratio")
        _physics.refuse_switched_off("hertz", "none", {"rolling_resistance": self.model, "rolling_friction": float(self.friction),
                                                       "rolling_damping_ratio": float(self.damping_ratio)})
        object.__setattr__(self, "_law", _physics.RollingResistance(self.model, float(self.friction), float(self.damping_ratio)))


@dataclass(frozen=True, kw_only=True)
class Contact:
    """The laws of one contact; `begin()` makes the state that goes with one pair of bodies.

    effective_youngs_modulus, effective_shear_modulus : E*, G*, Pa
    restitution : 0 < e <= 1
    friction : the tangential law, `FinnieRabinowicz` or another `FrictionLaw`
    normal_law : 'hertz' or 'hooke' (with characteristic_velocity, m/s)
    cohesion : 'none', 'bridge', 'constant' (cohesive_force, N), 'dmt' or 'jkr' (work_of_adhesion, J/m^2), see `dembark.physics.adhesion`;
        default: 'bridge' with a bridge_volume, else 'none'
    bridge_volume : m^3 of each bridge; 0, and none: dry; with surface_tension (N/m, required), contact_angle (rad) and capillary_model
    viscosity : Pa s of the liquid, 0 = no viscous force; with minimum_gap (m, > 0), see `viscous_resistance`
    rolling : rolling resistance

    ValueError for values out of range, for numbers other than 0 that the laws do not read, and for missing ones.
    """

    effective_youngs_modulus: float
    effective_shear_modulus: float
    restitution: float
    friction: FrictionLaw
    normal_law: str = "hertz"
    characteristic_velocity: float = 1.0
    tangential_damping: bool = True
    limit_force: bool = False
    cohesion: str = ""
    cohesive_force: float = 0.0
    work_of_adhesion: float = 0.0
    bridge_volume: float | None = None
    surface_tension: float | None = None
    contact_angle: float = 0.0
    capillary_model: str = "exact"
    viscosity: float = 0.0
    minimum_gap: float = 0.0
    rolling: RollingResistance = field(default_factory=RollingResistance)

    def __post_init__(self) -> None:
        for name in ("restitution", "characteristic_velocity", "bridge_volume", "surface_tension", "contact_angle", "cohesive_force",
                     "work_of_adhesion"):
            contact_number(name, self._number(name))
        for name in ("effective_youngs_modulus", "effective_shear_modulus"):
            contact_number("youngs_modulus", getattr(self, name), name)
        if self.normal_law not in ("hertz", "hooke"):
            raise ValueError(f"normal_law must be 'hertz' or 'hooke', not {self.normal_law!r}")
        if self.cohesion and self.cohesion not in _physics.cohesion_laws():
            raise ValueError(f"cohesion {self.cohesion!r} is unknown; it can be {', '.join(_physics.cohesion_laws())}")
        if self.cohesion == "jkr" and self.normal_law != "hertz":
            raise ValueError("the cohesion 'jkr' needs the normal law 'hertz'")
        check_model(self.capillary_model)
        check_viscous(self.viscosity, self.minimum_gap)
        # Of a bridge volume of 0, which is dry, the liquid may be given.
        chosen = "bridge" if not self.cohesion and self.bridge_volume is not None else self._cohesion
        _physics.refuse_switched_off(self.normal_law, chosen, {
            "liquid_viscosity": float(self.viscosity), **{name: float(self._number(name)) for name in (
                "bridge_volume", "surface_tension", "contact_angle", "minimum_gap", "cohesive_force", "work_of_adhesion")}})
        for name in _NEEDS.get(self._cohesion, ()):
            if not getattr(self, name):
                raise ValueError(f"the cohesion {self._cohesion!r} needs a {name} > 0")
        if self._cohesion == "bridge" and self.surface_tension is None:
            raise ValueError("the cohesion 'bridge' needs a surface_tension (N/m)")

    def _number(self, name: str) -> float:
        """0 where it is not given."""
        return getattr(self, name) if getattr(self, name) is not None else 0.0

    @property
    def _cohesion(self) -> str:
        return self.cohesion or ("bridge" if self._number("bridge_volume") > 0.0 else "none")

    def begin(self) -> _physics.Contact:
        """State of a contact that has not touched yet."""
        return _physics.Contact(self.normal_law, self.effective_youngs_modulus, self.effective_shear_modulus, self.restitution,
                                self.characteristic_velocity, self.tangential_damping, self.limit_force, self.friction._law,
                                self.rolling._law, self._cohesion, self.cohesive_force, self.work_of_adhesion, self.capillary_model,
                                self.contact_angle, self._number("surface_tension"), self._number("bridge_volume"), self.viscosity,
                                self.minimum_gap)


@dataclass(frozen=True, kw_only=True)
class Body:
    """A sphere. Lengths in m, mass in kg, velocities in m/s and rad/s."""

    radius: float
    mass: float
    position: Sequence[float] = ZERO
    velocity: Sequence[float] = ZERO
    angular_velocity: Sequence[float] = ZERO

    def __post_init__(self) -> None:
        numbers("radius", self.radius, "m", low=0.0, low_open=True)
        numbers("mass", self.mass, "kg", low=0.0, low_open=True)
        for name, unit in (("position", "m"), ("velocity", "m/s"), ("angular_velocity", "rad/s")):
            _vector(name, getattr(self, name), unit)


@dataclass
class Trajectory:
    """Motion of the bodies; positions, velocities and angular velocities have the shape (steps, bodies, 3), forces (steps,)."""

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    angular_velocity: NDArray[np.float64]
    contacts: list[ContactForce] = field(repr=False)


def _triple(vector: NDArray[np.float64]) -> Vector:
    return (float(vector[0]), float(vector[1]), float(vector[2]))


def _integrate(contact: Contact, bodies: Sequence[Body], wall: tuple[Vector, Vector] | None, gravity: Sequence[float], time_step: float,
               steps: int) -> Trajectory:
    numbers("time_step", time_step, "s", low=0.0, low_open=True)
    if steps != int(steps) or steps < 0:
        raise ValueError(f"steps must be an integer >= 0, not {steps!r}")
    n = len(bodies)
    x = np.array([b.position for b in bodies], dtype=float)
    v = np.array([b.velocity for b in bodies], dtype=float)
    w = np.array([b.angular_velocity for b in bodies], dtype=float)
    mass = np.array([b.mass for b in bodies])
    inertia = 0.4 * mass * np.array([b.radius for b in bodies]) ** 2
    g = _vector("gravity", gravity, "m/s^2")
    point, normal = (_vector("wall_point", wall[0], "m"), _vector("wall_normal", wall[1], "1")) if wall else (x[-1], None)

    def separation() -> NDArray[np.float64]:
        return x[0] - x[1] if normal is None else np.dot(x[0] - point, normal) * normal

    if normal is not None and abs(np.linalg.norm(normal) - 1.0) > 1e-9:
        raise ValueError(f"wall_normal must be of length 1, not {np.linalg.norm(normal):g}")
    least = min(body.radius for body in bodies)
    volume = 4.0 / 3.0 * np.pi * least**3
    gap = (np.linalg.norm(separation()) if normal is None else np.dot(x[0] - point, normal)) - sum(body.radius for body in bodies)
    if gap < 0.0:
        raise ValueError(f"bodies must not touch at the start, but overlap by {-gap:g} m")
    if contact._number("bridge_volume") > volume:
        raise ValueError(f"bridge_volume must be at most that of the smallest sphere ({volume:.3g} m^3), not {contact.bridge_volume:g}")
    state = contact.begin()
    times = time_step * np.arange(1, steps + 1, dtype=np.float64)
    out = Trajectory(times, np.empty((steps, n, 3)), np.empty((steps, n, 3)), np.empty((steps, n, 3)), [])
    apart, near = separation(), sum(body.radius for body in bodies)
    # The first half step: no contact yet, gravity only, as the engines' set-up finds it.
    v += 0.5 * time_step * g
    for k in range(steps):
        x += time_step * v
        before, apart = apart, separation()
        # A wall has no velocity, and its mass is infinite.
        other = (_triple(v[1]), _triple(w[1]), bodies[1].radius, bodies[1].mass) if wall is None else (ZERO, ZERO, np.inf, np.inf)
        step = ContactForce(*state.step(_triple(apart), _triple(v[0]), other[0], _triple(w[0]), other[1], bodies[0].radius, other[2],
                                        bodies[0].mass, other[3], time_step, True))
        unseen = step.overlap <= 0.0 and np.linalg.norm(before) >= near and _closest(before, apart) < near - 0.01 * least
        if step.overlap > least or unseen:
            raise ValueError(f"the bodies pass through each other in step {k + 1}; take a shorter time_step, a larger "
                             "effective_youngs_modulus or a lower speed")
        acceleration = np.tile(g, (n, 1))
        force = np.asarray(step.force)
        acceleration[0] += force / mass[0]
        spin_up = np.zeros((n, 3))
        spin_up[0] = np.asarray(step.torque_1) / inertia[0]
        if wall is None:
            acceleration[1] -= force / mass[1]
            spin_up[1] = np.asarray(step.torque_2) / inertia[1]
        # Full-step velocities are what the engines write; the next half step goes on from there.
        v += 0.5 * time_step * acceleration
        w += 0.5 * time_step * spin_up
        out.position[k], out.velocity[k], out.angular_velocity[k] = x, v, w
        out.contacts.append(step)
        v += 0.5 * time_step * acceleration
        w += 0.5 * time_step * spin_up
    _warn_of_few_steps(np.array([step.overlap > 0.0 for step in out.contacts]), time_step)
    return out


def _closest(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Least distance between two centres, or of one from a wall, on a straight way from one separation to another."""
    way = after - before
    length = float(np.dot(way, way))
    part = min(1.0, max(0.0, -float(np.dot(before, way)) / length)) if length else 0.0
    return float(np.linalg.norm(before + part * way))


def _warn_of_few_steps(touching: NDArray[np.bool_], time_step: float) -> None:
    """A warning about the shortest contact that has ended, when it lasted fewer than LEAST_STEPS steps."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], touching]).astype(int)))
    lasted = [int(end - start) for start, end in zip(edges[::2], edges[1::2], strict=False)]
    if lasted and min(lasted) < LEAST_STEPS:
        warnings.warn(f"a contact lasted {min(lasted)} steps of {time_step:g} s only, fewer than {LEAST_STEPS}; take a shorter time_step",
                      RuntimeWarning, stacklevel=4)


def collide(contact: Contact, body_1: Body, body_2: Body, *, time_step: float, steps: int, gravity: Sequence[float] = ZERO) -> Trajectory:
    """Free motion of two spheres through a contact; they must not touch at the start. `time_step` in s, `gravity` in m/s^2.

    Raises ValueError or TypeError for arguments out of range, and ValueError for bodies that pass through each other. A
    RuntimeWarning says that a contact lasted fewer than ten steps, so that its restitution is not the given one.
    """
    return _integrate(contact, [body_1, body_2], None, gravity, time_step, steps)


def drop(contact: Contact, body: Body, *, time_step: float, steps: int, gravity: Sequence[float] = (0.0, 0.0, -9.81),
         wall_point: Vector = ZERO, wall_normal: Vector = (0.0, 0.0, 1.0)) -> Trajectory:
    """Motion of a sphere above a fixed plane wall given by a point (m) and a unit normal into the free side.

    Arguments and errors as in `collide`.
    """
    return _integrate(contact, [body], (wall_point, wall_normal), gravity, time_step, steps)
