"""Logs in cross-section, for LogImpact: bodies, the drum around them, and what a case of logs is measured by."""

import math

from yade import CylinderWall, Omega, Sphere, utils
from yade.dembark.report import fail
from yade.dembark.states import options, table
from yade.minieigenHP import Vector3

O = Omega()


def _plane(axis, what):
    if axis not in ("x", "y", "z"):
        fail(f"{what}: axis '{axis}': it must be x, y or z")
    return "xyz".index(axis)


def log(position, radius, mass, velocity=(0.0, 0.0, 0.0), spin=0.0, axis="z", material=-1, color=None):
    """A log in cross-section, for LogImpact: a sphere that moves in the plane across `axis` and turns about it.

    position (m), radius (m, > 0), mass (kg, > 0, of the whole log), velocity (m/s), spin (rad/s, about `axis`); material: id, label
    or Material. Its inertia is that of a solid cylinder, m r^2 / 2. Returns a body for O.bodies.append.
    """
    k = _plane(axis, "log")
    for name, value, unit in (("radius", radius, "m"), ("mass", mass, "kg")):
        if not 0.0 < value < math.inf:
            fail(f"log: {name} {value:g}: it must be > 0 {unit}")
    body = utils.sphere(position, radius, material=material, color=color)
    body.state.mass = mass
    body.state.inertia = Vector3(1, 1, 1) * (0.5 * mass * radius * radius)
    body.state.vel = Vector3(*velocity)
    body.state.angVel = Vector3(*(spin if i == k else 0.0 for i in range(3)))
    body.state.blockedDOFs = axis + "XYZ".replace(axis.upper(), "")
    return body


def drum(centre, radius, axis="z", omega=0.0, material=-1):
    """The inside of a drum as a wall of LogImpact, or of the contact laws: a CylinderWall that turns with omega (rad/s) about `axis`.

    centre (m): any point of the axis; radius (m, > 0). Returns a body for O.bodies.append.
    """
    k = _plane(axis, "drum")
    direction = Vector3(*(float(i == k) for i in range(3)))
    body = utils.sphere(centre, radius, material=material, fixed=True)
    body.shape = CylinderWall(radius=radius, axis=direction)
    body.state.angVel = omega * direction
    return body


class LogWriter:
    """Writes what a case of logs is measured by: frames of grains.dump and contacts.dump, and a line of time.csv with each.

    Numbers have all their digits, so that runs can be compared to round-off; velocities are those of the time of the positions.

    engine : the LogImpact that the scene has or will have. The logs must be the first bodies: their number is the body's id + 1.
    bounds : ((xlo, xhi), (ylo, yhi), (zlo, zhi)), m
    gravity : m/s^2
    """

    COUNTS = {"contacts": "contactCount", "active": "activeCount", "impacts": "impactsBegun", "pivots": "pivots",
              "pivots_total": "pivotsTotal"}
    NUMBERS = {"elastic_energy": "elasticEnergy", "dissipated_energy": "dissipatedEnergy", "peak_force": "peakForce",
               "highest_force": "highestForce", "impulse": "impulseSum", "certificate": "certificate",
               "worst_certificate": "worstCertificate"}

    def __init__(self, engine, bounds, gravity=(0.0, 0.0, 0.0)):
        self.kind, self.gravity = type(engine), Vector3(*gravity)
        self._box = "".join(f"{low:.17g} {high:.17g}\n" for low, high in bounds)
        for path in ("grains.dump", "contacts.dump"):
            open(path, "a" if options()[1] else "w").close()
        self._history = table("time.csv", ",".join(["step", "time", "kinetic_energy", *self.NUMBERS, *self.COUNTS]))

    def _frame(self, path, kind, rows, columns):
        with open(path, "a", encoding="ascii") as file:
            file.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF {kind}\n{len(rows)}\nITEM: BOX BOUNDS ff ff ff\n{self._box}")
            file.write(f"ITEM: {kind} {columns}\n")
            file.writelines(" ".join(f"{x:.17g}" for x in row) + "\n" for row in rows)

    def write(self):
        """Append the present state; to be called between LogImpact and NewtonIntegrator."""
        # A scene that was loaded has engines of its own.
        engine = next(one for one in O.engines if isinstance(one, self.kind))
        rows, energy = [], 0.0
        for body in O.bodies:
            if not isinstance(body.shape, Sphere) or not body.dynamic:
                continue
            state = body.state
            force, torque = O.forces.f(body.id) + state.mass * self.gravity, O.forces.t(body.id)
            # The engine's velocities are half a step behind.
            velocity = [v if axis in state.blockedDOFs else v + 0.5 * O.dt * f / state.mass for axis, v, f in zip("xyz", state.vel, force)]
            spin = [w if axis in state.blockedDOFs else w + 0.5 * O.dt * t / i
                    for axis, w, t, i in zip("XYZ", state.angVel, torque, state.inertia)]
            energy += 0.5 * sum(state.mass * v * v for v in velocity) + 0.5 * sum(i * w * w for i, w in zip(state.inertia, spin))
            rows.append((body.id + 1, 1, *state.pos, 0, 0, 0, *velocity, *spin, *force, body.shape.radius, state.mass))
        self._frame("grains.dump", "ATOMS", rows, "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass")
        touching = [(a + 1, b + 1 if b >= 0 else b, *normal, gap, force, *friction, *place)
                    for a, b, normal, gap, force, friction, place in engine.contacts() if force > 0.0]
        self._frame("contacts.dump", "ENTRIES", touching, " ".join(f"f_impacts[{i}]" for i in range(1, 14)))
        if O.iter == 0:
            return
        values = [f"{O.time:.17g}", f"{energy:.17g}", *(f"{getattr(engine, name):.17g}" for name in self.NUMBERS.values()),
                  *(str(getattr(engine, name)) for name in self.COUNTS.values())]
        self._history.write(",".join([str(O.iter), *values]) + "\n")
        self._history.flush()
        print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)
