"""Fluids of SphFluid: lattices of their particles, and what they write."""

import math
import os
from itertools import compress

from yade import ForceResetter, NewtonIntegrator, Omega, PyRunner, SphFluid
from yade.dembark.frames import FrameWriter
from yade.dembark.report import fail
from yade.dembark.states import table

O = Omega()


def lattice(low, high, spacing):
    """Points (m) of a square or cubic lattice that fills the box from `low` to `high`, each in the middle of its cell, as tuples of three.

    The sides must be whole numbers of `spacing`, to a thousandth of it. Two components: the plane z = 0. The last axis changes first.
    """
    if len(low) != len(high) or len(low) not in (2, 3):
        fail("lattice: low and high must both have two or three components")
    if not spacing > 0.0:
        fail(f"lattice: spacing {spacing:g}: it must be > 0 m")
    axes = []
    for a, b in zip(low, high, strict=True):
        count = round((b - a) / spacing)
        if count < 1 or abs(count * spacing - (b - a)) > 1e-3 * spacing:
            fail(f"lattice: a side of {b - a:g} m: it must be a whole number of the spacing, {spacing:g} m")
        axes.append([a + spacing * (k + 0.5) for k in range(count)])
    if len(axes) == 2:
        axes.append([0.0])
    return [(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]]


def tank_walls(low, high, spacing, *, open_top=True, smoothing=1.3):
    """Points (m) of walls around the box from `low` to `high`, of the lattice that fills the box. Up is the last axis.

    There are as many layers as fill the support of a kernel, 2 h, with h of `smoothing` spacings: give that of the fluid.
    """
    if not smoothing > 0.0:
        fail(f"tank_walls: smoothing {smoothing:g}: it must be > 0")
    thick = math.ceil(2.0 * smoothing) * spacing
    high = [a + spacing * round((b - a) / spacing) for a, b in zip(low, high, strict=True)]
    top = [b + thick for b in high]
    if open_top:
        top[-1] = high[-1]
    around = lattice([a - thick for a in low], top, spacing)
    return [p for p in around if any(not a < x < b for a, b, x in zip(low, high, p, strict=False))]


def fluid_engine():
    """The scene's SphFluid: a scene that was loaded has engines of its own."""
    found = next((one for one in O.engines if isinstance(one, SphFluid)), None)
    if found is None:
        fail("there is no SphFluid in O.engines; put one before NewtonIntegrator")
    return found


def fluid(p, points, depth=None, dimension=2):
    """A fluid in the plane, or in space, with the parameters of the group `fluid`, `spacing` and `sound_speed`, and particles at `points`
    (m), below the level `depth` (m) with the pressure of rest. Up is the last axis."""
    water = SphFluid(spacing=p.spacing, soundSpeed=p.sound_speed, dimension=dimension, density=p.fluid_density, smoothing=p.smoothing,
                     alpha=p.alpha, delta=p.delta, noSlip=p.no_slip == "yes", tension=p.tension == "yes", moment=p.moment,
                     threads=int(os.environ.get("OMP_NUM_THREADS", "1")))
    level, up = depth or 0.0, dimension - 1
    water.addParticles(points, pressures=[p.fluid_density * p.gravity * max(level - point[up], 0.0) for point in points])
    return water


def fluid_loop(p, water, push=None):
    """Engines of a fluid and free bodies without contacts; the deck has `record`, a FluidRecorder.

    push: Python that is run in each step, to add forces to bodies
    """
    O.dt = p.time_step
    weight = (0, -p.gravity, 0) if water.dimension == 2 else (0, 0, -p.gravity)
    return [ForceResetter(), *([PyRunner(command=push, iterPeriod=1)] if push else []), water, PyRunner(command="record()", iterPeriod=1),
            NewtonIntegrator(damping=0, gravity=weight)]


def _pose_names(bodies):
    return [f"{name}_{what}" for name in bodies for what in ("x", "y", "z", "qw", "qx", "qy", "qz")]


def _pose(state, upright=None):
    """Place and orientation w, x, y, z, which is none when `state.ori` is `upright`."""
    turned = state.ori if upright is None else state.ori * upright.inverse()
    return [*state.pos, turned[3], turned[0], turned[1], turned[2]]


class FluidWriter(FrameWriter):
    """Appends frames of the fluid to fluid.dump, and rows of poses of bodies and energies of the fluid to fluid.csv.

    bodies : name -> id of a body of YADE, in the fluid or not
    bounds : ((xlo, xhi), (ylo, yhi), (zlo, zhi)), m, of the dump's box
    within : if given, bounds (m) of the particles that frames have
    """

    ENERGIES = ("kinetic", "potential", "compression", "contact", "viscous", "diffusive", "boundary", "work")
    COLUMNS = "id type x y z vx vy vz radius mass density pressure"

    def __init__(self, bounds, bodies=None, dump="fluid.dump", history="fluid.csv", within=None):
        bounds, within = ([tuple(one) for one in given or ()] for given in (bounds, within))
        for name, pairs in (("bounds", bounds), ("within", within or bounds)):
            if [len(one) for one in pairs] != [2, 2, 2]:
                fail(f"FluidWriter: {name} must be ((xlo, xhi), (ylo, yhi), (zlo, zhi)) (m), not {pairs}")
        self._bodies, self._dump, self._within = dict(bodies or {}), dump, within
        for name, body in self._bodies.items():
            if not 0 <= body < len(O.bodies) or O.bodies[body] is None:
                fail(f"FluidWriter: there is no body {body} for {name!r}")
        self._box = "".join(f"{low:.17g} {high:.17g}\n" for low, high in bounds)
        self._history = table(history, ",".join(["step", "time", *_pose_names(self._bodies), *self.ENERGIES])) if history else None
        if dump:
            self._begin(dump)

    def frame(self):
        """Append a frame of the fluid."""
        rows = fluid_engine().particleRows()
        if self._within:
            inside = [all(low <= float(x) <= high for x, (low, high) in zip(row.split(maxsplit=5)[2:5], self._within, strict=True))
                      for row in rows.splitlines()]
            rows = "".join(compress(rows.splitlines(keepends=True), inside))
        with open(self._dump, "a", encoding="ascii") as file:
            file.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF ATOMS\n{rows.count(chr(10))}\nITEM: BOX BOUNDS ff ff ff\n{self._box}")
            file.write(f"ITEM: ATOMS {self.COLUMNS}\n{rows}")

    def row(self):
        """Append a row; print step, time and kinetic energy of the fluid for whoever watches."""
        energies = fluid_engine().energies()
        numbers = [O.time]
        for body in self._bodies.values():
            numbers += _pose(O.bodies[body].state)
        numbers += [energies[name] for name in self.ENERGIES]
        self._history.write(",".join([str(O.iter), *(f"{x:.17g}" for x in numbers)]) + "\n")
        self._history.flush()
        print(O.iter, f"{O.time:.6g}", f"{energies['kinetic']:.6g}", flush=True)


class _CaseRecorder:
    """Writes a row of time.csv and a frame of grains.dump when they are due; those that follow it know what a row holds."""

    ENERGIES = ("kinetic", "potential", "compression")

    def __init__(self, p, bounds, columns):
        self._p = p
        self._frames = FluidWriter(bounds, dump="grains.dump", history="")
        self._history = table("time.csv", ",".join(["step", "time", *columns]))

    def __call__(self):
        """Write what is due at this step."""
        if O.iter and O.iter % self._p.every == 0:
            energies = fluid_engine().energies()
            self._history.write(",".join([str(O.iter), *(f"{x:.15g}" for x in (O.time, *self._row(energies)))]) + "\n")
            self._history.flush()
            print(O.iter, f"{O.time:.6g}", f"{energies['kinetic']:.6g}", flush=True)
        if O.iter and O.iter % self._p.stride == 0:
            self._frames.frame()


class FluidRecorder(_CaseRecorder):
    """Writes time.csv and grains.dump of a fluid when they are due: in space if `p` has `low_z` and `high_z`, else in the plane.

    tank: number of the wall whose force is written; None, without walls: momenta of fluid and bodies about the origin instead, in the plane
    bodies : name -> id of a free body
    more : name -> number, or function of the positions (m) of the fluid: further columns of time.csv
    near : bounds of the particles that are written to near.dump with each row
    """

    def __init__(self, p, tank, bodies=None, more=None, near=None):
        self._tank, self._bodies, self._more = tank, dict(bodies or {}), dict(more or {})
        poses = [f"{name}_{what}" for name in self._bodies for what in ("x", "y", "vx")]
        energies = [f"{name}_energy" for name in self.ENERGIES]
        space = hasattr(p, "low_z")
        bounds = ((p.low_x, p.high_x), (p.low_y, p.high_y), (p.low_z, p.high_z) if space else (-p.spacing, p.spacing))
        forces = ("tank_fx", "tank_fy", "tank_fz") if space else ("tank_fx", "tank_fy")
        kept = ("momentum_x", "momentum_y", "angular_momentum") if tank is None else forces
        super().__init__(p, bounds, [*energies, *kept, *poses, *self._more])
        self._axes = len(forces)
        self._near = FluidWriter(bounds, dump="near.dump", history="", within=near) if near else None

    def __call__(self):
        """Write what is due at this step."""
        super().__call__()
        if self._near and O.iter and O.iter % self._p.every == 0:
            self._near.frame()

    def _row(self, energies):
        kept = self._momentum() if self._tank is None else tuple(fluid_engine().wallForce(self._tank))[:self._axes]
        row = [*(energies[name] for name in self.ENERGIES), *kept]
        for number in self._bodies.values():
            state = O.bodies[number].state
            row += [state.pos[0], state.pos[1], state.vel[0]]
        places = fluid_engine().positions() if self._more else []
        row += [one(places) if callable(one) else one for one in self._more.values()]
        return row

    def _momentum(self):
        """Momentum (N s) along x and y and angular momentum (N m s) about z, of a metre of depth."""
        water, mass = fluid_engine(), fluid_engine().particleMass()
        (x, y, _), angular = water.momentum(), 0.0
        for place, velocity in zip(water.positions(), water.velocities(), strict=True):
            angular += mass * (place[0] * velocity[1] - place[1] * velocity[0])
        for number in self._bodies.values():
            state = O.bodies[number].state
            # Velocities are half a step behind the forces of this one.
            moving = state.mass * state.vel + 0.5 * O.dt * water.force(number)
            turning = state.inertia[2] * state.angVel[2] + 0.5 * O.dt * water.torque(number)[2]
            x, y, angular = x + moving[0], y + moving[1], angular + turning + state.pos[0] * moving[1] - state.pos[1] * moving[0]
        return [x, y, angular]


class CubesRecorder(_CaseRecorder):
    """Writes time.csv and grains.dump of a fluid in space with boxes that touch by springs, when they are due.

    bodies : name -> id of a free body. Orientations are written from that at this moment on: clumps may be made with half a turn.
    """

    def __init__(self, p, bodies):
        self._bodies = dict(bodies)
        self._upright = {number: O.bodies[number].state.ori for number in self._bodies.values()}
        bounds = ((-p.column_length, p.downstream_length), (-0.5 * p.flume_width, 0.5 * p.flume_width), (0.0, p.flume_height))
        energies = [f"{name}_energy" for name in (*self.ENERGIES, "body", "contact")]
        super().__init__(p, bounds, [*energies, *_pose_names(self._bodies)])

    def _row(self, energies):
        moving, poses, springs = 0.0, [], energies["contact"]
        for number in self._bodies.values():
            state = O.bodies[number].state
            # Velocities are half a step behind the forces of this one.
            moving += 0.5 * state.mass * state.vel.squaredNorm() + 0.5 * state.inertia[0] * state.angVel.squaredNorm()
            moving += state.mass * self._p.gravity * state.pos[2]
            poses += _pose(state, self._upright[number])
        for one in O.interactions:
            if one.isReal and type(one.phys).__name__ == "MindlinPhys":
                # kn is the slope of Hertz's force; that of shear follows the overlap and has no energy of its own.
                springs += 4.0 / 15.0 * one.phys.kn * one.geom.penetrationDepth**2
            elif one.isReal:
                # Fn is the spring's force; normalForce has the dashpot's, too.
                springs += 0.5 * (one.phys.Fn**2 / one.phys.kn + one.phys.shearForce.squaredNorm() / one.phys.ks)
        return [*(energies[name] for name in self.ENERGIES), moving, springs, *poses]
