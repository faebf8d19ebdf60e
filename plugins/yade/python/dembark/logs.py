"""Logs for LcpImpact: bodies, the drum around them, engines, and what a case of logs in cross-section is measured by."""

import math
from numbers import Real

from yade import Capsule, CylinderWall, ForceResetter, LogWall, NewtonIntegrator, Omega, PyRunner, utils
from yade.dembark.frames import FrameWriter
from yade.dembark.report import fail
from yade.dembark.scene import packing
from yade.minieigenHP import Quaternion, Vector3

O = Omega()


def _plane(axis, what):
    if axis not in ("x", "y", "z"):
        fail(f"{what}: axis '{axis}': it must be x, y or z")
    return "xyz".index(axis)


def _unit(axis, what):
    direction = Vector3.Unit(_plane(axis, what)) if isinstance(axis, str) else Vector3(*map(float, axis))
    if not 0.0 < direction.norm() < math.inf:
        fail(f"{what}: the axis must be x, y or z, or a direction that is not zero")
    direction.normalize()
    return direction


def log(position, radius, mass, velocity=(0.0, 0.0, 0.0), spin=0.0, axis="z", material=-1, color=None, length=None):
    """A log for LcpImpact: in cross-section, a sphere that moves in the plane across `axis` and turns about it; with a length, a Capsule.

    position (m), radius (m, > 0), mass (kg, > 0, of the whole log), velocity (m/s), spin (rad/s, about `axis`); material: id, label
    or Material. The inertia in cross-section is that of a solid cylinder, m r^2 / 2.
    length : m, >= 0, of the cylinder between the centres of the caps; then `axis` may be any direction, and spin any vector. LcpImpact
        sets the inertia, that of the solid capsule, in its first step.
    Returns a body for O.bodies.append.
    """
    for name, value, unit in (("radius", radius, "m"), ("mass", mass, "kg")):
        if not 0.0 < value < math.inf:
            fail(f"log: {name} {value:g}: it must be > 0 {unit}")
    if length is not None and not 0.0 <= length < math.inf:
        fail(f"log: length {length:g}: it must be >= 0 m")
    if length is None:
        _plane(axis, "log")
    direction = _unit(axis, "log")
    body = utils.sphere(position, radius, material=material, color=color)
    body.state.mass = mass
    body.state.vel = Vector3(*velocity)
    body.state.angVel = spin * direction if isinstance(spin, Real) else Vector3(*spin)
    if length is None:
        body.state.inertia = Vector3(1, 1, 1) * (0.5 * mass * radius * radius)
        body.state.blockedDOFs = axis + "XYZ".replace(axis.upper(), "")
    else:
        body.shape = Capsule(radius=radius, length=length, color=body.shape.color)
        body.state.ori = Quaternion(Vector3(0, 0, 1), direction)
        body.state.blockedDOFs = "XYZ"
    return body


def drum(centre, radius, axis="z", omega=0.0, material=-1):
    """The inside of a drum as a wall of LcpImpact, or of the contact laws: a CylinderWall that turns with omega (rad/s) about `axis`.

    centre (m): any point of the axis; radius (m, > 0); axis: x, y, z or a direction. Returns a body for O.bodies.append.
    """
    direction = _unit(axis, "drum")
    body = utils.sphere(centre, radius, material=material, fixed=True)
    body.shape = CylinderWall(radius=radius, axis=direction)
    body.state.angVel = omega * direction
    return body


def log_wall(place, axis, sense, material, **more):
    """A plane wall of LcpImpact through `place` (m), across `axis` (0 ... 2), that bounds the side `sense`; `more`: its attributes."""
    return LogWall(bodies=[O.bodies.append(utils.wall(place, axis=axis, sense=sense, material=material))], **more)


def logs(materials, axis="z", path="packing.data"):
    """Add the logs of a packing, which must be the first bodies; `materials` (ids) of the types 1, 2 ...

    A packing has the density of the sphere that has the mass of the log.
    """
    for kind, diameter, density, place, velocity, spin in packing(path):
        radius = 0.5 * diameter
        mass = 4.0 * math.pi / 3.0 * radius * radius * radius * density
        O.bodies.append(log(place, radius, mass, velocity, spin[_plane(axis, "logs")], axis, O.materials[materials[kind - 1]]))


def log_loop(impacts, record, stride=1, gravity=(0.0, 0.0, 0.0)):
    """All engines of a scene of logs around the LcpImpact `impacts`; the command `record` runs every `stride` steps, from step 0 on."""
    return [
        ForceResetter(),
        impacts,
        # Between forces and motion, where positions and forces belong to the same time.
        PyRunner(command=record, iterPeriod=stride, initRun=True),
        NewtonIntegrator(damping=0, gravity=gravity),
    ]


class LogWriter(FrameWriter):
    """Writes what a case of logs is measured by: frames of grains.dump and contacts.dump, and a line of time.csv with each.

    engine : the LcpImpact that the scene has or will have. The logs must be the first bodies: their number is the body's id + 1.
    bounds, gravity : see FrameWriter
    """

    NUMBERS = {"elastic_energy": "elasticEnergy", "dissipated_energy": "dissipatedEnergy", "peak_force": "peakForce",
               "highest_force": "highestForce", "impulse": "impulseSum", "certificate": "certificate",
               "worst_certificate": "worstCertificate", "contacts": "contactCount", "active": "activeCount", "impacts": "impactsBegun",
               "pivots": "pivots", "pivots_total": "pivotsTotal"}

    def __init__(self, engine, bounds=None, gravity=(0.0, 0.0, 0.0)):
        super().__init__(self.NUMBERS, bounds, gravity)
        self.kind = type(engine)
        self._begin("contacts.dump")

    def write(self):
        """Append the present state; to be called between LcpImpact and NewtonIntegrator."""
        # A scene that was loaded has engines of its own.
        engine = next(one for one in O.engines if isinstance(one, self.kind))
        self.frame()
        touching = [(a + 1, b + 1 if b >= 0 else b, *normal, gap, force, *friction, *point)
                    for a, b, normal, gap, force, friction, point in engine.contacts() if force > 0.0]
        self._frame("contacts.dump", "ENTRIES", touching, " ".join(f"f_impacts[{i}]" for i in range(1, 14)))
        self.row(*(getattr(engine, name) for name in self.NUMBERS.values()))
