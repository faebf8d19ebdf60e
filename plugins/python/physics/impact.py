"""Impacts of logs without an engine: rows in one dimension, and systems in the plane or in space with walls and friction.

In the plane a log is a disc, in space a capsule: a cylinder with rounded ends. The scheme is that of the LIGGGHTS fix and the YADE engine;
the C++ headers are the same. A log has its mass at the centre and a massless boundary on a spring; in every time step the gaps and normal
forces of all contacts are one linear complementarity problem.
Formulas: docs/theory/lcp.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import numbers, one_each, vectors
from dembark.physics.friction import FinnieRabinowicz

Floats = NDArray[np.float64]
Friction = float | FinnieRabinowicz | None

# Rows of the bodies as _physics.ImpactScene takes them.
_BODY = np.dtype([("id", float), ("mass", float), ("inertia", float), ("radius", float), ("material", float), ("position", float, 3),
                  ("velocity", float, 3), ("spin", float, 3), ("force", float, 3), ("torque", float, 3)])
_CAPSULE = np.dtype([*_BODY.descr, ("axial_inertia", float), ("length", float), ("orientation", float, 4)])
_REPORT = ("contacts", "active", "impacts_begun", "peak_force", "impulse_sum", "dissipated_energy", "elastic_energy", "pivots",
           "block_steps", "pivots_total", "certificate", "worst_certificate", "peak_force_so_far", "kinetic_energy")


@dataclass(frozen=True)
class Impact:
    """One impact: a contact from the first step with a force to the last."""

    a: int
    b: int  # body number, or -1, -2, ...: first, second, ... wall
    time: float  # s, of its first step
    duration: float  # s
    peak_force: float  # N
    impulse: float  # N s
    relative_speed: float  # m/s, approach along the normal at the beginning, positive = closing
    dissipated: float  # J, in this contact
    point: tuple[float, float, float]  # m, of contact at the beginning
    friction_loss: float  # J, of `dissipated`: by sliding and by the dash-pot along the contact
    normal: tuple[float, float, float]  # from b to a, at the beginning
    turn_a: float  # rad, that a has turned by since the first step, at the beginning; in the plane only
    turn_b: float  # likewise, of b; 0: wall


@dataclass(frozen=True)
class ImpactMotion:
    """What a run sampled: n instants, b bodies. Vectors have one component (rows: none), two or three, as the system has."""

    time: Floats  # (n,) s
    position: Floats  # (n, b) or (n, b, d) m
    velocity: Floats  # like position, m/s, at the same instants
    spin: Floats  # (n, b), in space (n, b, 3), rad/s
    contact_force: Floats  # rows only: (n, b + 1) N; column k between bodies k - 1 and k, the first and last with the walls
    impacts: list[Impact]  # those that ended in this run
    kinetic_energy: Floats  # (n,) J, of the velocities half a step before; plus elastic and dissipated energy it balances the work done
    elastic_energy: Floats  # (n,) J
    dissipated_energy: Floats  # (n,) J, total: friction, damping, and the loss of the scheme
    report: dict[str, Floats]  # (n,) each: contacts, active, impacts_begun, peak_force, impulse_sum, pivots, certificate, ...
    orientation: Floats  # capsules only: (n, b, 4), unit quaternions (w, x, y, z) from the axes of the body, z along its own, to space

    @property
    def axis(self) -> Floats:
        """Unit vectors along the capsules, (n, b, 3)."""
        w, x, y, z = np.moveaxis(self.orientation, -1, 0)
        return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


@dataclass(frozen=True, kw_only=True)
class Plane:
    """A plane; the free space is on the side of the normal.

    point : m, any of the plane, 2 or 3 components
    normal : any length
    stiffness : N/m, of the wall's surface; inf = rigid
    velocity : m/s
    friction : with every body: a coefficient, a FinnieRabinowicz, or None for that of the bodies
    omega : rad/s, right-handed about the normal through `point`
    """

    point: Sequence[float]
    normal: Sequence[float]
    stiffness: float = np.inf
    velocity: Sequence[float] = (0.0, 0.0, 0.0)
    friction: Friction = None
    omega: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Drum:
    """The inside of a circular cylinder without ends that turns about its axis, z unless another one is given.

    radius : m
    centre : m, any point of the axis, 2 or 3 components
    omega : rad/s, right-handed about the axis (along z: anticlockwise)
    stiffness : N/m, local stiffness of the shell; inf = rigid
    friction : as for a plane
    axis : any length
    """

    radius: float
    centre: Sequence[float] = (0.0, 0.0)
    omega: float = 0.0
    stiffness: float = np.inf
    friction: Friction = None
    axis: Sequence[float] = (0.0, 0.0, 1.0)

    def end_plates(self, length: float) -> tuple[Plane, Plane]:
        """Plates that close the drum at half of `length` (m) behind and ahead of its centre, and turn with it."""
        half = 0.5 * float(numbers("length", length, "m", low=0.0, low_open=True))
        axis, centre = _direction("axis", self.axis), _three("centre", self.centre, "m")
        back, ahead = (Plane(point=tuple(centre - side * half * axis), normal=tuple(side * axis), stiffness=self.stiffness,
                             friction=self.friction, omega=side * self.omega) for side in (1.0, -1.0))
        return back, ahead


_each = partial(one_each, thing="body")


def _materials(stiffness: ArrayLike, damping: ArrayLike, n: int) -> tuple[Floats, Floats]:
    """The different pairs of stiffness and damping, and which of them each body has."""
    keys = np.column_stack([_each("stiffness", stiffness, "N/m", n, low=0.0, low_open=True),
                            _each("damping", damping, "N s/m", n, low=0.0)])
    materials, which = np.unique(keys, axis=0, return_inverse=True)
    return materials, which.ravel().astype(float)


def _three(name: str, value: Sequence[float], unit: str) -> Floats:
    array = numbers(name, value, unit)
    if array.shape not in ((2,), (3,)):
        raise ValueError(f"{name} must have two or three components ({unit}), not {value!r}")
    return np.append(array, 0.0)[:3]


def _direction(name: str, value: Sequence[float]) -> Floats:
    array = _three(name, value, "")
    if not array.any():
        raise ValueError(f"{name} must not be zero")
    return array / np.linalg.norm(array)


def _bodies(n: int, kind: np.dtype[np.void] = _BODY) -> NDArray[np.void]:
    bodies = np.zeros(n, kind)
    bodies["id"] = np.arange(n)
    return bodies


def _law(friction: Friction) -> FinnieRabinowicz:
    if isinstance(friction, FinnieRabinowicz):
        if friction.presliding == "partial_slip":
            raise ValueError("presliding of logs must be 'linear' or 'exponential': partial slip is that of spheres")
        if friction.friction_limit != "total":
            raise ValueError("friction_limit of logs must be 'total'")
        return friction
    mu = float(numbers("friction", 0.0 if friction is None else friction, "", low=0.0))
    return FinnieRabinowicz(static_friction=mu, kinetic_friction=mu, critical_slip_distance=0.0)


def _pair_law(law: FinnieRabinowicz, ratio: float, contact_damping: float) -> list[float]:
    """The row of a pair of materials; the area of contact is that of its springs."""
    return [law.static_friction, law.kinetic_friction, law.critical_slip_distance, law.interface_shear_strength, law.healing_time,
            law.presliding == "exponential", ratio, contact_damping, 0.0]


def _theta(theta: float) -> float:
    return float(numbers("theta", theta, "", low=0.5, high=1.0))


def _wall_key(number: int) -> int:
    return -1 - (number << 32)


def _impact(row: list[float]) -> Impact:
    a, b, time, duration, peak, impulse, speed, dissipated, x, y, z, friction, nx, ny, nz, turn_a, turn_b = row
    return Impact(int(a), int(b), time, duration, peak, impulse, speed, dissipated, (x, y, z), friction, (nx, ny, nz), turn_a, turn_b)


@dataclass
class _Scene:
    """Arguments of _physics.ImpactScene, kept until the time step is known."""

    bodies: NDArray[np.void]
    materials: Floats
    pairs: list[list[float]]
    planes: Floats
    drums: Floats
    theta: float
    sweeps: int
    method: str
    reach: float
    row: bool
    period: float = 0.0
    built: _physics.ImpactScene | None = field(default=None, init=False)
    dt: float = field(default=0.0, init=False)

    def build(self, dt: float) -> _physics.ImpactScene:
        bodies = self.bodies.view(float).reshape(len(self.bodies), -1)
        return _physics.ImpactScene(dt, self.theta, self.sweeps, self.method, self.materials, np.array(self.pairs, dtype=float), bodies,
                                    self.planes, self.drums, self.reach, self.row, self.period)

    def at(self, dt: float) -> _physics.ImpactScene:
        dt = float(numbers("dt", dt, "s", low=0.0, low_open=True))
        if self.built is None:
            self.built = self.build(dt)
            self.dt = dt
        elif dt != self.dt:
            raise ValueError(f"dt must stay {self.dt:g} s, as the system began, not {dt:g}")
        return self.built

    def begun(self) -> _physics.ImpactScene:
        if self.built is None:
            raise RuntimeError("nothing has been run yet: call run(duration, dt) first")
        return self.built

    def check_start(self) -> None:
        """ValueError for bodies whose contact would throw them apart; loads at rest overlap by mg/k."""
        wrong = self.build(1.0).start_error()
        if wrong:
            raise ValueError(wrong)

    def run(self, duration: float, dt: float, every: int, dimension: int, columns: Sequence[tuple[int, int]]) -> ImpactMotion:
        scene = self.at(dt)
        steps = round(float(numbers("duration", duration, "s", low=0.0)) / self.dt)
        if int(every) < 1:
            raise ValueError(f"every must be >= 1 steps, not {every}")
        time, position, velocity, spin, orientation, report, force, impacts = scene.run(
            steps, int(every), [c[0] for c in columns], [c[1] for c in columns])
        named = dict(zip(_REPORT, report.T.copy(), strict=True))
        cut = (slice(None), slice(None), 0) if dimension == 1 else (slice(None), slice(None), slice(0, dimension))
        return ImpactMotion(
            time, position[cut], velocity[cut], spin if dimension == 3 else spin[:, :, 2], force,
            [_impact(row) for row in impacts.tolist()],
            named["kinetic_energy"], named["elastic_energy"], named["dissipated_energy"], named, orientation)


class ImpactChain:
    """Logs in a row that hit each other centrally.

    mass : kg, (b,)
    stiffness : N/m, of one log at its boundary, a number or (b,)
    position, velocity : m and m/s, (b,), at time 0, in ascending order of position
    radius : m, a number or (b,); 0 = points
    force : N, constant, on each log (a weight, if the row is a stack), a number or (b,)
    left_wall, right_wall : m, position of a rigid wall, or (m, N/m) with its stiffness
    theta : 1 = backward differences, the published scheme, with the restitution exp(-pi omega dt / 2); 1/2 = without that loss
    damping : N s/m, a number or (b,), on the absolute velocity of logs in contact
    contact_damping : N s/m, on the deformation of a contact; Galilean invariant

    A start with an overlap of more than a twentieth of the smaller radius is refused. ValueError or TypeError: one line about the argument.

    >>> row = ImpactChain([20, 80], [1e7, 3e7], [0, 1e-5], [1.5, 0])
    >>> motion = row.run(0.01, 1.46e-6)
    >>> motion.velocity[-1].round(3).tolist(), round(float(motion.contact_force.max()))
    ([-0.898, 0.6], 16419)
    """

    def __init__(self, mass: ArrayLike, stiffness: ArrayLike, position: ArrayLike, velocity: ArrayLike, *, radius: ArrayLike = 0.0,
                 force: ArrayLike = 0.0, left_wall: float | tuple[float, float] | None = None,
                 right_wall: float | tuple[float, float] | None = None, theta: float = 1.0, damping: ArrayLike = 0.0,
                 contact_damping: float = 0.0, method: str = "auto") -> None:
        x = numbers("position", position, "m")
        if x.ndim != 1 or x.size == 0:
            raise ValueError(f"position must have the shape (bodies,), not {x.shape}")
        if (np.diff(x) < 0.0).any():
            raise ValueError("position must ascend along the row (m)")
        n = x.size
        bodies = _bodies(n)
        bodies["mass"] = _each("mass", mass, "kg", n, low=0.0, low_open=True)
        bodies["inertia"] = np.inf
        bodies["radius"] = _each("radius", radius, "m", n, low=0.0)
        bodies["position"][:, 0] = x
        bodies["velocity"][:, 0] = _each("velocity", velocity, "m/s", n)
        bodies["force"][:, 0] = _each("force", force, "N", n)
        materials, bodies["material"] = _materials(stiffness, damping, n)
        walls = []
        for number, (name, wall, side) in enumerate((("left_wall", left_wall, 1.0), ("right_wall", right_wall, -1.0))):
            if wall is None:
                continue
            place, hard = wall if isinstance(wall, tuple) else (wall, np.inf)
            walls.append([_wall_key(number), 0, float(numbers(f"{name} stiffness", hard, "N/m", low=0.0, low_open=True, infinite=True)),
                          float(numbers(name, place, "m")), 0, 0, side, 0, 0, 0, 0, 0, 0])
        count = len(materials)
        law = _pair_law(_law(None), 1.0, float(numbers("contact_damping", contact_damping, "N s/m", low=0.0)))
        self._scene = _Scene(bodies, materials, [law] * (count * count), np.array(walls, dtype=float).reshape(-1, 13),
                             np.zeros((0, 11)), _theta(theta), 1, method, 0.0, True)
        self._scene.check_start()
        self._columns = [(0, _wall_key(0)), *((i, i + 1) for i in range(n - 1)), (n - 1, _wall_key(1))]

    def run(self, duration: float, dt: float, *, every: int = 1) -> ImpactMotion:
        """Go on for `duration` (s) in steps of `dt` (s); samples the beginning, every `every`-th step and the end. dt must not change."""
        return self._scene.run(duration, dt, every, 1, self._columns)

    def state(self) -> Floats:
        """Everything needed to go on bit for bit."""
        return np.asarray(self._scene.begun().state())

    def restore(self, state: ArrayLike, dt: float) -> None:
        """Go on from `state` of a chain with the same logs; dt (s) as it had."""
        self._scene.at(dt).restore(np.ascontiguousarray(state, dtype=float))


def _walls(walls: Sequence[Plane | Drum], materials: int) -> tuple[Floats, Floats]:
    """Rows of the planes (p, 13) and the drums (d, 11), as the scene takes them; walls have materials after those of the bodies."""
    planes, drums = [], []
    for number, wall in enumerate(walls):
        if not isinstance(wall, Plane | Drum):
            raise TypeError(f"walls must be Plane or Drum objects, not {wall!r}")
        hard = float(numbers("wall stiffness", wall.stiffness, "N/m", low=0.0, low_open=True, infinite=True))
        head = [_wall_key(number), materials + number, hard]
        if isinstance(wall, Drum):
            size = float(numbers("radius", wall.radius, "m", low=0.0, low_open=True))
            drums.append([*head, *_three("centre", wall.centre, "m"), *_direction("axis", wall.axis), size,
                          float(numbers("omega", wall.omega, "rad/s"))])
        else:
            planes.append([*head, *_three("point", wall.point, "m"), *_direction("normal", wall.normal),
                           *_three("velocity", wall.velocity, "m/s"), float(numbers("omega", wall.omega, "rad/s"))])
    return np.array(planes, dtype=float).reshape(-1, 13), np.array(drums, dtype=float).reshape(-1, 11)


def _along_z(wall: Plane | Drum) -> bool:
    """Whether the wall and its motion are the same all along z."""
    if isinstance(wall, Drum):
        return not _direction("axis", wall.axis)[:2].any()
    return bool(_direction("normal", wall.normal)[2] == 0.0 and wall.omega == 0.0)


def _load(bodies: NDArray[np.void], force: ArrayLike | None, gravity: Sequence[float] | None, dimension: int) -> None:
    """Sets the constant forces (N); an infinite mass has no weight."""
    n, mass = len(bodies), bodies["mass"]
    if force is not None:
        bodies["force"] = vectors("force", force, "N", n, dimension)
    if gravity is not None:
        bodies["force"] += np.where(np.isinf(mass), 0.0, mass)[:, None] * vectors("gravity", gravity, "m/s^2", n, dimension)


def _system_scene(bodies: NDArray[np.void], stiffness: ArrayLike, damping: ArrayLike, friction: Friction, tangential_ratio: float,
                  walls: Sequence[Plane | Drum], theta: float, contact_damping: float, friction_sweeps: int, method: str,
                  reach: float) -> _Scene:
    """Arguments of the systems: as in ImpactSystem."""
    if int(friction_sweeps) < 1:
        raise ValueError(f"friction_sweeps must be >= 1, not {friction_sweeps}")
    materials, bodies["material"] = _materials(stiffness, damping, len(bodies))
    own = len(materials)
    planes, drums = _walls(walls, own)
    laws = [_law(friction)] * own + [_law(friction if wall.friction is None else wall.friction) for wall in walls]
    count = own + len(walls)
    ratio = float(numbers("tangential_ratio", tangential_ratio, "", low=0.0, low_open=True))
    viscous = float(numbers("contact_damping", contact_damping, "N s/m", low=0.0))
    # A wall's law holds with every body; walls do not touch each other.
    pairs = [_pair_law(laws[max(i, j)], ratio, viscous) for i in range(count) for j in range(count)]
    return _Scene(bodies, np.vstack([materials, np.tile([1.0, 0.0], (len(walls), 1))]), pairs, planes, drums, _theta(theta),
                  int(friction_sweeps), method, float(numbers("reach", reach, "m", low=0.0)), False)


class _System:
    """What systems of bodies in the plane and in space have in common."""

    _scene: _Scene
    _dimension: int

    def run(self, duration: float, dt: float, *, every: int = 1) -> ImpactMotion:
        """Go on for `duration` (s) in steps of `dt` (s); samples the beginning, every `every`-th step and the end. dt must not change."""
        return self._scene.run(duration, dt, every, self._dimension, [])

    def contacts(self) -> list[dict[str, object]]:
        """What the last instant was solved for: contacts with a force now or before, and pairs that the free motion could close. Of each
        a, b (as in Impact), gap (m), normal_force (N), opening (m), tangential (N, on a), normal (towards a), point (m)."""
        rows = np.asarray(self._scene.begun().contacts())
        return [{"a": int(r[0]), "b": int(r[1]), "gap": float(r[5]), "normal_force": float(r[6]), "opening": float(r[13]),
                 "tangential": r[7:10].copy(), "normal": r[2:5].copy(), "point": r[10:13].copy()} for r in rows]

    def state(self) -> Floats:
        """Everything needed to go on bit for bit."""
        return np.asarray(self._scene.begun().state())

    def restore(self, state: ArrayLike, dt: float) -> None:
        """Go on from `state` of a system with the same bodies and walls; dt (s) as it had."""
        self._scene.at(dt).restore(np.ascontiguousarray(state, dtype=float))


class ImpactSystem(_System):
    """Logs in cross-section (positions with two components) or balls (three), with planes, a drum and friction.

    mass, radius : kg and m, a number or (b,); an infinite mass is held fast
    position, velocity : m and m/s, (b, d), d = 2 or 3, at time 0
    spin : rad/s, (b,) about z, in space (b, 3)
    stiffness : N/m, of one body at its boundary, a number or (b,)
    force : N, constant, (d,) for all or (b, d)
    gravity : m/s^2, (d,), adds mass times gravity to the force
    inertia : 'cylinder' (m r^2 / 2), 'sphere' (2 m r^2 / 5) or kg m^2, (b,); inf = does not turn
    friction : between bodies, and with walls that name none: a coefficient or a FinnieRabinowicz
    tangential_ratio : tangential over normal stiffness of a contact
    walls : Plane and Drum objects
    theta, damping, contact_damping : as in ImpactChain
    friction_sweeps : friction and normal forces are computed in turn so many times a step
    reach : m, gap up to which a pair is a candidate; 0 = as large as the motion of each step asks for

    A start with an overlap of more than a twentieth of the smaller radius is refused. ValueError or TypeError: one line about the argument.
    """

    def __init__(self, mass: ArrayLike, radius: ArrayLike, position: ArrayLike, velocity: ArrayLike | None = None, *,
                 spin: ArrayLike | None = None, stiffness: ArrayLike = 1e7, force: ArrayLike | None = None,
                 gravity: Sequence[float] | None = None, inertia: str | ArrayLike = "cylinder", friction: Friction = 0.0,
                 tangential_ratio: float = 2.0 / 7.0, walls: Sequence[Plane | Drum] = (), theta: float = 1.0, damping: ArrayLike = 0.0,
                 contact_damping: float = 0.0, friction_sweeps: int = 2, method: str = "auto", reach: float = 0.0) -> None:
        x = numbers("position", position, "m")
        if x.ndim != 2 or x.shape[0] == 0 or x.shape[1] not in (2, 3):
            raise ValueError(f"position must have the shape (bodies, 2) or (bodies, 3), not {x.shape}")
        n, d = x.shape
        self._dimension = d
        bodies = _bodies(n)
        m = bodies["mass"] = _each("mass", mass, "kg", n, low=0.0, low_open=True, infinite=True)
        r = bodies["radius"] = _each("radius", radius, "m", n, low=0.0, low_open=True)
        if isinstance(inertia, str):
            if inertia not in ("cylinder", "sphere"):
                raise ValueError(f"inertia must be 'cylinder', 'sphere' or numbers (kg m^2), not {inertia!r}")
            bodies["inertia"] = (0.5 if inertia == "cylinder" else 0.4) * m * r**2
        else:
            bodies["inertia"] = _each("inertia", inertia, "kg m^2", n, low=0.0, low_open=True, infinite=True)
        bodies["position"] = vectors("position", x, "m", n, d)
        if velocity is not None:
            bodies["velocity"] = vectors("velocity", velocity, "m/s", n, d)
        if spin is not None:
            if d == 3:
                bodies["spin"] = vectors("spin", spin, "rad/s", n, 3)
            else:
                bodies["spin"][:, 2] = _each("spin", spin, "rad/s", n)
        if d == 2 and not all(map(_along_z, walls)):
            raise ValueError("in the plane the axis of a drum must be along z, and a plane must not turn nor have a normal with a z "
                             "component")
        _load(bodies, force, gravity, d)
        self._scene = _system_scene(bodies, stiffness, damping, friction, tangential_ratio, walls, theta, contact_damping, friction_sweeps,
                                    method, reach)
        self._scene.check_start()


def _quaternions(orientation: ArrayLike | None, axis: ArrayLike | None, n: int) -> Floats:
    """Unit quaternions (n, 4): as given, or of the shortest turn from z to `axis`."""
    if orientation is not None and axis is not None:
        raise ValueError("give orientation or axis, not both")
    if orientation is not None:
        q = numbers("orientation", orientation, "")
        if q.shape not in ((n, 4), (4,)):
            raise ValueError(f"orientation must have the shape ({n}, 4), not {q.shape}")
        q = np.broadcast_to(q, (n, 4))
    else:
        u = vectors("axis", (0.0, 0.0, 1.0) if axis is None else axis, "", n, 3)
        size = np.linalg.norm(u, axis=1, keepdims=True)
        if not size.all():
            raise ValueError("axis must not be zero")
        x, y, z = (u / size).T
        # Half of the way: the quaternion of twice the turn from z to the middle; of a half turn, about x.
        q = np.where((1 + z > 1e-14)[:, None], np.stack([1 + z, -y, x, 0 * z], axis=1), [0.0, 1.0, 0.0, 0.0])
    size = np.linalg.norm(q, axis=1, keepdims=True)
    if not size.all():
        raise ValueError("orientation must not be zero")
    return q / size


class CapsuleSystem(_System):
    """Logs in space: solid capsules, cylinders with rounded ends, with planes, a drum and friction.

    mass, radius : kg and m, > 0, a number or (b,); an infinite mass is held fast
    length : m, >= 0, of the cylinder between the centres of the caps, a number or (b,); the log is longer by two radii
    position, velocity : m and m/s, (b, 3), of the centres, at time 0
    orientation : unit quaternions (w, x, y, z), (b, 4) or (4,), from the axes of the body, z along its own, to space
    axis : instead of `orientation`, directions of the logs, (b, 3) or (3,); default: z
    spin : rad/s, (b, 3), in space
    stiffness : N/m, of one log at its boundary, a number or (b,); where a side lies on a side, each of the two points of contact has half
    force : N, constant, (3,) for all or (b, 3)
    gravity : m/s^2, (3,), adds mass times gravity to the force
    inertia : kg m^2, (b, 2) or (2,), about the axis and across it; default: those of solid capsules, exact
    period : m, everything repeats along z after this length; 0 = it does not. Positions may leave it. Walls must be the same all along z
    friction, tangential_ratio, walls, theta, damping, contact_damping, friction_sweeps, method, reach : as in ImpactSystem

    Two logs, or a log and a wall, have up to two points of contact, and each of them is a row of `contacts()` and has impacts of its own.
    Starts with an overlap of more than a twentieth of the radius are refused. ValueError or TypeError: one line about the argument.

    Model: G. N. Kolesnikov, Resources and Technology (2013); contacts of capsules: docs/theory/lcp.md.

    >>> log = CapsuleSystem(40, 0.1, 1.0, [[0, 0, 0.3]], axis=(1, 0, 0.2), gravity=(0, 0, -9.81), contact_damping=1e4,
    ...                     walls=[Plane(point=(0, 0, 0), normal=(0, 0, 1))])
    >>> motion = log.run(2.0, 1e-3)
    >>> [c["b"] for c in log.contacts()], round(sum(c["normal_force"] for c in log.contacts()), 1)
    ([-1, -1], 392.4)
    """

    def __init__(self, mass: ArrayLike, radius: ArrayLike, length: ArrayLike, position: ArrayLike, velocity: ArrayLike | None = None, *,
                 orientation: ArrayLike | None = None, axis: ArrayLike | None = None, spin: ArrayLike | None = None,
                 stiffness: ArrayLike = 1e7, force: ArrayLike | None = None, gravity: Sequence[float] | None = None,
                 inertia: ArrayLike | None = None, friction: Friction = 0.0, tangential_ratio: float = 2.0 / 7.0,
                 walls: Sequence[Plane | Drum] = (), theta: float = 1.0, damping: ArrayLike = 0.0, contact_damping: float = 0.0,
                 friction_sweeps: int = 2, method: str = "auto", reach: float = 0.0, period: float = 0.0) -> None:
        x = numbers("position", position, "m")
        if x.ndim != 2 or x.shape[0] == 0 or x.shape[1] != 3:
            raise ValueError(f"position must have the shape (bodies, 3), not {x.shape}")
        n, self._dimension = x.shape
        bodies = _bodies(n, _CAPSULE)
        m = bodies["mass"] = _each("mass", mass, "kg", n, low=0.0, low_open=True, infinite=True)
        r = bodies["radius"] = _each("radius", radius, "m", n, low=0.0, low_open=True)
        bodies["length"] = _each("length", length, "m", n, low=0.0)
        if inertia is None:
            bodies["axial_inertia"], bodies["inertia"] = np.full((2, n), np.inf)
            finite = np.isfinite(m)
            own = _physics.capsule_inertia(m[finite], r[finite], bodies["length"][finite])
            bodies["axial_inertia"][finite], bodies["inertia"][finite] = np.asarray(own).T
        else:
            given = numbers("inertia", inertia, "kg m^2", low=0.0, low_open=True, infinite=True)
            if given.shape not in ((n, 2), (2,)):
                raise ValueError(f"inertia must have the shape ({n}, 2), not {given.shape} (kg m^2)")
            axial, across = np.broadcast_to(given, (n, 2)).T
            if (axial > 2.0 * across).any() or (axial != across)[bodies["length"] == 0.0].any():
                raise ValueError("inertia (kg m^2): that about the axis is at most twice that across it, and the same without a length")
            if not np.isinf(given).all() and np.isinf(m).any():
                raise ValueError("inertia (kg m^2): of a body with an infinite mass it must be infinite")
            bodies["axial_inertia"], bodies["inertia"] = axial, across
        bodies["position"] = x
        bodies["orientation"] = _quaternions(orientation, axis, n)
        for name, value, unit in (("velocity", velocity, "m/s"), ("spin", spin, "rad/s")):
            if value is not None:
                bodies[name] = vectors(name, value, unit, n, 3)
        _load(bodies, force, gravity, 3)
        self._scene = _system_scene(bodies, stiffness, damping, friction, tangential_ratio, walls, theta, contact_damping, friction_sweeps,
                                    method, reach)
        self._scene.period = float(numbers("period", period, "m", low=0.0))
        if self._scene.period and not all(map(_along_z, walls)):
            raise ValueError("with a period all walls must be the same along z")
        self._scene.check_start()
