"""Smoothed particle hydrodynamics: weakly compressible fluid with walls and rigid bodies, without an engine.

The terms are those of `plugins/physics/sph`; docs/reference/python_sph.md has the formulas and what was verified.
In the plane (positions with two components) masses, forces and energies are those of a metre of depth. All quantities are in SI units.
"""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import numbers

Floats = NDArray[np.float64]

SPH_KERNELS: tuple[str, ...] = tuple(_physics.sph_kernels())
SPH_BOUNDARIES: tuple[str, ...] = tuple(_physics.sph_boundaries())
SPH_MOMENTS: tuple[str, ...] = tuple(_physics.sph_moments())
# Of the longest step that the scheme allows, 0.6 h/c, what is taken when none is given: 0.4 h/(c + c/10).
_USUAL_STEP = 0.4 / 1.1 / 0.6


class SphEnergies(NamedTuple):
    """Energies (J) of a fluid with bodies, and what was lost and done since the beginning.

    kinetic, potential, compression : of the fluid; potential: 0 at the origin
    bodies : kinetic and potential, of free bodies
    contact : of the contact potential
    viscous, diffusive : lost by viscosity and diffusion of density; the latter may be a little negative, for what diffuses is the density
        that the weight of still water does not explain
    boundary : lost at solid particles, whose own pressure stores nothing
    work : done by moved walls and by loads
    """

    kinetic: float
    potential: float
    compression: float
    bodies: float
    contact: float
    viscous: float
    diffusive: float
    boundary: float
    work: float

    @property
    def stored(self) -> float:
        """J; with the losses, less the work, constant up to errors of the step."""
        return self.kinetic + self.potential + self.compression + self.bodies + self.contact


def sph_kernel(name: str, dimension: int, h: float, distance: ArrayLike) -> tuple[Floats, Floats]:
    """Value W (1/m^dimension) and slope W'(r)/r (1/m^(dimension + 2)) of a kernel with support 2h.

    name : one of `SPH_KERNELS`
    h, distance : m; any shape

    >>> value, slope = sph_kernel("wendland_c2", 2, 1.0, [0.0, 1.0, 2.0])
    >>> value.round(4).tolist()
    [0.557, 0.1044, 0.0]
    """
    if dimension not in {2, 3}:
        raise ValueError(f"dimension must be 2 or 3, not {dimension!r}")
    r = numbers("distance", distance, "m", low=0.0)
    value, slope = _physics.sph_kernel(name, dimension, float(numbers("h", h, "m", low=0.0, low_open=True)), np.ravel(r))
    return value.reshape(r.shape), slope.reshape(r.shape)


def tait_pressure(density: ArrayLike, *, rest_density: float, sound_speed: float, gamma: float = 7.0, tension: bool = False) -> Floats:
    """Pressure (Pa) of Tait's equation of state at `density` (kg/m^3), at most rest_density sound_speed^2/10; without `tension` never
    below 0.

    >>> float(tait_pressure(1001.0, rest_density=1000.0, sound_speed=40.0).round())
    1605.0
    """
    rho = numbers("density", density, "kg/m^3", low=0.0, low_open=True)
    return np.asarray(_physics.sph_tait(rest_density, sound_speed, gamma, tension, False, np.ravel(rho))).reshape(rho.shape)


def _points(name: str, value: ArrayLike, dimension: int = 0) -> Floats:
    """Shape (n, 3); `dimension`: that the value must have, 0 = 2 or 3."""
    array = numbers(name, value, "m")
    if array.ndim != 2 or array.shape[1] not in ((dimension,) if dimension else (2, 3)):
        raise ValueError(f"{name} must have the shape (n, {dimension or '2 or 3'}), not {array.shape}")
    out = np.zeros((len(array), 3))
    out[:, :array.shape[1]] = array
    return out


def _some(points: ArrayLike, dimension: int) -> Floats:
    """Those of a wall or body, of which there must be some."""
    found = _points("points", points, dimension)
    if not len(found):
        raise ValueError("points must not be empty: walls and bodies are made of particles")
    return found


def lattice(low: ArrayLike, high: ArrayLike, spacing: float) -> Floats:
    """Points (m), shape (n, d), of a square or cubic lattice that fills the box from `low` to `high`, each in the middle of its cell.

    The sides must be whole numbers of `spacing`, to a thousandth of it.

    >>> lattice([0, 0], [0.5, 0.25], 0.25).tolist()
    [[0.125, 0.125], [0.375, 0.125]]
    """
    dx = float(numbers("spacing", spacing, "m", low=0.0, low_open=True))
    a, b = numbers("low", low, "m"), numbers("high", high, "m")
    if a.shape != b.shape or a.shape not in {(2,), (3,)}:
        raise ValueError(f"low and high must both have two or three components, not shapes {a.shape} and {b.shape}")
    count = np.rint((b - a) / dx).astype(int)
    if (count < 1).any() or (np.abs(count * dx - (b - a)) > 1e-3 * dx).any():
        sides = ", ".join(f"{side:g}" for side in b - a)
        raise ValueError(f"the sides of the box, {sides} m, must be whole numbers of the spacing, {dx:g} m")
    axes = [start + dx * (np.arange(n) + 0.5) for start, n in zip(a, count, strict=True)]
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def tank_walls(low: ArrayLike, high: ArrayLike, spacing: float, *, smoothing: float = 1.3, open_top: bool = True) -> Floats:
    """Points (m), shape (n, d), of walls around the box from `low` to `high`, of the lattice that fills the box. Up is the last axis.

    There are as many layers as fill the support of a kernel, 2 h, with h of `smoothing` spacings: give that of the fluid.

    >>> [len(tank_walls([0, 0], [0.2, 0.1], 0.1, smoothing=h)) for h in (1.3, 2.0)]
    [30, 48]
    """
    layers = int(np.ceil(2.0 * float(numbers("smoothing", smoothing, "", low=0.0, low_open=True))))
    dx, inside = float(numbers("spacing", spacing, "m", low=0.0, low_open=True)), lattice(low, high, spacing)
    a, b = np.asarray(low, float), np.asarray(high, float)
    b = a + np.rint((b - a) / dx) * dx
    top = b + layers * dx
    if open_top:
        top[-1] = b[-1]
    around = lattice(a - layers * dx, top, dx)
    outside = ((around < a) | (around > b)).any(axis=1)
    assert len(around) - outside.sum() == len(inside)
    return around[outside]


class SphBody:
    """A wall or body of an :class:`SphFluid`, made by its `add_wall` and `add_body`."""

    def __init__(self, solver: _physics.SphSolver, number: int, dimension: int, *, free: bool) -> None:
        self._solver, self._number, self._dimension, self._free = solver, number, dimension, free

    def _get(self, index: int) -> Floats:
        return np.array(self._solver.body(self._number)[index])

    def _vector(self, index: int) -> Floats:
        return self._get(index)[:self._dimension]

    def _about(self, index: int) -> Floats:
        return self._get(index)[2] if self._dimension == 2 else self._get(index)

    @property
    def number(self) -> int:
        """Of the wall or body among those of its fluid, from 0."""
        return self._number

    @property
    def position(self) -> Floats:
        """Of the centre, (d,), m."""
        return self._vector(0)

    @property
    def orientation(self) -> Floats:
        """Unit quaternion (w, x, y, z) of the rotation from the body's frame into space."""
        return self._get(1)

    @property
    def velocity(self) -> Floats:
        """Of the centre, (d,), m/s."""
        return self._vector(2)

    @property
    def spin(self) -> Floats:
        """rad/s, (3,), in the plane a number."""
        return self._about(3)

    @property
    def force(self) -> Floats:
        """Of the fluid on the body in the last step, (d,), N."""
        return self._vector(4)

    @property
    def torque(self) -> Floats:
        """Of the fluid about the body's centre, (3,), in the plane a number, N m."""
        return self._about(5)

    @property
    def film_force(self) -> Floats:
        """What films in slits give of `force`, (d,), N."""
        return self._vector(10)

    @property
    def particles(self) -> tuple[Floats, Floats, Floats]:
        """Of the body's particles: positions (n, d) (m), pressures (n,) (Pa), forces of the fluid (n, d) (N)."""
        positions, pressures, forces = self._solver.solids(self._number)
        return positions[:, :self._dimension], pressures, forces[:, :self._dimension]

    def _three(self, name: str, value: ArrayLike, unit: str) -> list[float]:
        array = numbers(name, value, unit)
        if array.shape != (self._dimension,):
            raise ValueError(f"{name} must have {self._dimension} components ({unit}), not the shape {array.shape}")
        return np.append(array, 0.0)[:3].tolist()

    def _turn(self, name: str, value: ArrayLike, unit: str) -> list[float]:
        array = numbers(name, value, unit)
        if array.shape != (() if self._dimension == 2 else (3,)):
            due = "a number" if self._dimension == 2 else "three numbers"
            raise ValueError(f"{name} must be {due} ({unit}), not of shape {array.shape}")
        return [0.0, 0.0, float(array)] if self._dimension == 2 else array.tolist()

    def set_motion(self, velocity: ArrayLike, spin: ArrayLike | None = None, *, acceleration: ArrayLike | None = None,
                   spin_acceleration: ArrayLike | None = None) -> None:
        """Set velocity (m/s) and spin (rad/s); a wall goes on with the accelerations, from 0 where none is given.

        The fluid feels the acceleration through the pressure at the wall: added mass. Of free bodies the next step computes it.
        """
        none, still = np.zeros(self._dimension), 0.0 if self._dimension == 2 else np.zeros(3)
        if self._free and (acceleration is not None or spin_acceleration is not None):
            raise ValueError("the accelerations of a free body follow from its forces; use set_load")
        old = self._solver.body(self._number)
        rates = [list(old[6]), list(old[7])] if self._free else [
            self._three("acceleration", none if acceleration is None else acceleration, "m/s^2"),
            self._turn("spin_acceleration", still if spin_acceleration is None else spin_acceleration, "rad/s^2")]
        self._solver.set_motion(self._number, self._three("velocity", velocity, "m/s"),
                                self._turn("spin", still if spin is None else spin, "rad/s"), *rates)

    def set_load(self, force: ArrayLike, torque: ArrayLike | None = None) -> None:
        """Set what acts on a free body beside fluid and gravity: N, and N m about its centre."""
        if not self._free:
            raise ValueError("a wall moves as it is told and takes no load; use set_motion")
        still = 0.0 if self._dimension == 2 else np.zeros(3)
        self._solver.set_load(self._number, self._three("force", force, "N"),
                              self._turn("torque", still if torque is None else torque, "N m"))


def _check_spacing(points: NDArray[np.float64], spacing: float) -> None:
    """UserWarning when particles at `points` (n, 3) do not lie about one `spacing` (m) apart: the mass of each follows from it."""
    from scipy.spatial import cKDTree
    apart = float(np.median(cKDTree(points).query(points, 2)[0][:, 1])) / spacing
    if not 0.75 < apart < 1.35:
        warnings.warn(f"the particles of the fluid lie {apart:.3g} spacings apart (median of the nearest); the mass of each is that of one "
                      "spacing: give the spacing of their lattice", stacklevel=3)


class SphFluid:
    """Weakly compressible fluid with walls and rigid bodies.

    positions : m, (n, 2) or (n, 3), of particles of equal mass, density * spacing^d each; see :func:`lattice`
    spacing : m, of the lattice
    sound_speed : m/s, ten times the largest speed that will come, or more: density varies by its inverse square
    density : kg/m^3, at no pressure
    gravity : m/s^2, (d,)
    velocity : m/s, (n, d) or (d,), at the beginning
    pressure : Pa, (n,) or a number, at the beginning
    smoothing : h over the spacing
    kernel, boundary : one of `SPH_KERNELS`, `SPH_BOUNDARIES`
    alpha : of the artificial viscosity; acts like a kinematic viscosity of about alpha h c / 8 in the plane, / 10 in space
    delta : of the diffusion of density; 0.1 is usual
    gamma, tension : of the equation of state; with tension pressures may be negative, for closed vessels
    no_slip : viscosity acts at walls and bodies, too
    moment : one of `SPH_MOMENTS`: what sums over gradients are divided by; "particles" corrects them where particles have left the lattice
    shifting : coefficient, 2 is usual; 0 = none
    xsph : epsilon, 0 ... 1: how far particles drift with the mean velocity around them; 0.5 is usual, 0 = none
    shepard : steps from one filter of density to the next; 30 is usual, 0 = none
    contact_stiffness, contact_exponent : contact potential (Pa/m^d) between fluid and free bodies in the place of pressure; 0 = none
    threads : the same bits come from any number
    skin : over h, how far beyond the support neighbours are searched
    slit_pressure : share of the pressure around it that a film has between faces of boxes or on a plane; see :meth:`add_box`

    A UserWarning says that the particles do not lie one spacing apart. Raises ValueError for arguments out of range and, from `run` and
    `state`, when particles of fluid overlap others at the beginning, RuntimeError from `run` when the fluid blows up.

    >>> water = SphFluid(lattice([0, 0], [0.4, 0.2], 0.02), spacing=0.02, sound_speed=30.0, gravity=[0, -9.81])
    >>> floor = water.add_wall(tank_walls([0, 0], [0.4, 0.2], 0.02))
    >>> water.run(0.02)
    >>> bool(floor.force[1] < 0.0)
    True
    """

    def __init__(self, positions: ArrayLike, *, spacing: float, sound_speed: float, density: float = 1000.0,
                 gravity: ArrayLike | None = None, velocity: ArrayLike = 0.0, pressure: ArrayLike = 0.0, smoothing: float = 1.3,
                 kernel: str = "wendland_c2", alpha: float = 0.02, delta: float = 0.1, gamma: float = 7.0, tension: bool = False,
                 boundary: str = "extrapolated", no_slip: bool = False, moment: str = "lattice", shifting: float = 0.0,
                 xsph: float = 0.0, shepard: int = 0,
                 contact_stiffness: float = 0.0, contact_exponent: int = 4, threads: int = 1, skin: float = 0.2, slit_pressure: float = 1.0,
                 instruction_set: str = "best") -> None:
        points = _points("positions", positions)
        n, self._dimension = len(points), np.shape(positions)[1]
        if n == 0:
            raise ValueError("positions: there must be one particle of fluid or more")
        weight = numbers("gravity", np.zeros(self._dimension) if gravity is None else gravity, "m/s^2")
        if weight.shape != (self._dimension,):
            raise ValueError(f"gravity must have {self._dimension} components (m/s^2), not the shape {weight.shape}")
        given = numbers("velocity", velocity, "m/s")
        if given.shape not in {(), (self._dimension,), (n, self._dimension)} or (given.ndim == 0 and given != 0.0):
            raise ValueError(f"velocity must have the shape ({n}, {self._dimension}) or ({self._dimension},), not {given.shape} (m/s)")
        velocities = np.zeros((n, 3))
        velocities[:, :self._dimension] = given
        initial = numbers("pressure", pressure, "Pa", low=-np.inf if tension else 0.0)
        if initial.shape not in {(), (n,)}:
            raise ValueError(f"pressure must be a number or have the shape ({n},), not {initial.shape} (Pa)")
        self._spacing = float(spacing)
        densities = _physics.sph_tait(density, sound_speed, gamma, tension, True, np.broadcast_to(initial, (n,)).astype(float))
        self._solver = _physics.SphSolver(
            points, densities, velocities, self._dimension, spacing, smoothing, kernel, density, sound_speed, gamma, tension, alpha, delta,
            np.append(weight, 0.0)[:3].tolist(), boundary, no_slip, shifting, contact_stiffness, contact_exponent, skin, threads,
            slit_pressure, xsph, shepard, moment, instruction_set)
        if n > 1:
            _check_spacing(points, self._spacing)

    def add_wall(self, points: ArrayLike) -> SphBody:
        """A wall of particles at `points` (m, (k, d)), at rest until its `set_motion`; torques and turns are about the origin."""
        number = self._solver.add(_some(points, self._dimension), False, 0.0, [0.0] * 3, [0.0] * 3)
        return SphBody(self._solver, number, self._dimension, free=False)

    def add_body(self, points: ArrayLike, *, mass: float, inertia: ArrayLike, centre: ArrayLike) -> SphBody:
        """A free rigid body of particles at `points` (m, (k, d)), of the lattice's spacing, the outer layer half of it inside the surface.

        mass : kg (in the plane kg/m)
        inertia : kg m^2, about the axes x, y, z, which must be principal ones, (3,); in the plane a number. inf = does not turn
        centre : m, (d,), of mass
        """
        middle = _points("centre", np.reshape(np.asarray(centre, float), (1, -1)), self._dimension)
        moments = numbers("inertia", inertia, "kg m^2", low=0.0, low_open=True, infinite=True)
        if moments.shape != (() if self._dimension == 2 else (3,)):
            raise ValueError(f"inertia must be {'a number' if self._dimension == 2 else 'three numbers'} (kg m^2), not {inertia!r}")
        about = [np.inf, np.inf, float(moments)] if self._dimension == 2 else moments.tolist()
        number = self._solver.add(np.ascontiguousarray(_some(points, self._dimension) - middle), True,
                                  float(numbers("mass", mass, "kg", low=0.0, low_open=True)), about, middle[0].tolist())
        return SphBody(self._solver, number, self._dimension, free=True)

    def add_box(self, low: ArrayLike, high: ArrayLike, *, mass: float, inertia: ArrayLike | None = None) -> SphBody:
        """A free rigid box from `low` to `high` (m, (3,)), whole numbers of the spacing, in space.

        Between its faces and those of other boxes, and planes, that are nearer than half of the spacing no particle of fluid gets in. There
        a film has the pressure that is around it, times `slit_pressure` (see plugins/physics/sph/slits.hpp).

        mass : kg
        inertia : kg m^2, (3,), or a number for all axes; None: that of a homogeneous box
        """
        if self._dimension != 3:
            raise ValueError("boxes with films are for three dimensions; use add_body")
        points = lattice(low, high, self._spacing)
        a = np.asarray(low, float)
        count = np.rint((np.asarray(high, float) - a) / self._spacing).astype(int)
        edges = self._spacing * count
        weight = float(numbers("mass", mass, "kg", low=0.0, low_open=True))
        moments = weight / 12.0 * (np.sum(edges**2) - edges**2) if inertia is None else np.broadcast_to(inertia, (3,))
        body = self.add_body(points, mass=weight, inertia=moments, centre=a + 0.5 * edges)
        self._solver.add_box(body.number, edges.tolist(), count.tolist())
        return body

    def add_plane(self, point: ArrayLike, normal: ArrayLike) -> None:
        """A floor or side on which boxes can stand, through `point` (m, (3,)), solid on the side that `normal` points away from.

        It says where films can be; what keeps the fluid off is a wall.
        """
        three = [numbers(name, value, unit) for name, value, unit in (("point", point, "m"), ("normal", normal, ""))]
        if any(one.shape != (3,) for one in three):
            raise ValueError("point and normal of a plane must have three components")
        self._solver.add_plane(three[0].tolist(), three[1].tolist())

    def run(self, duration: float, step: float | None = None) -> None:
        """Go on for `duration` (s) in equal steps, of at most `step` (s); without it 0.4 h / (1.1 sound_speed)."""
        length = float(numbers("duration", duration, "s", low=0.0))
        longest = _USUAL_STEP * self._solver.longest_step if step is None else float(numbers("step", step, "s", low=0.0, low_open=True))
        count = int(np.ceil(length / longest * (1.0 - 1e-12)))
        if count:
            self._solver.run(count, length / count)

    @property
    def time(self) -> float:
        """s."""
        return self._solver.time

    @property
    def steps(self) -> int:
        """How many were made."""
        return self._solver.steps

    @property
    def particle_mass(self) -> float:
        """kg; in the plane kg/m."""
        return self._solver.particle_mass

    @property
    def smoothing_length(self) -> float:
        """h, m."""
        return self._solver.smoothing_length

    @property
    def positions(self) -> Floats:
        """m, (n, d), in the order in which they were given; so are the other arrays."""
        return self._solver.fluid()[0][:, :self._dimension]

    @property
    def velocities(self) -> Floats:
        """m/s, (n, d)."""
        return self._solver.fluid()[1][:, :self._dimension]

    @property
    def densities(self) -> Floats:
        """kg/m^3, (n,)."""
        return self._solver.fluid()[2]

    @property
    def pressures(self) -> Floats:
        """Pa, (n,)."""
        return self._solver.fluid()[3]

    def energies(self) -> SphEnergies:
        """Energies now, losses and work so far."""
        return SphEnergies(*self._solver.energies())

    def state(self) -> Floats:
        """Everything needed to go on bit for bit, in a fluid that was made the same way."""
        return self._solver.state()

    def restore(self, state: ArrayLike) -> None:
        """Go on from `state`; ValueError when it is that of another fluid."""
        self._solver.restore(np.ascontiguousarray(numbers("state", state, "", infinite=True), dtype=float))
