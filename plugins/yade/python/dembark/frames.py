"""Frames of all bodies and a history with all digits, so that runs can be compared to round-off."""

from itertools import count

from yade import Capsule, Omega, Sphere
from yade.dembark.scene import box
from yade.dembark.states import options, table
from yade.minieigenHP import Vector3

O = Omega()


def spheres():
    """The bodies that are spheres, or logs, and move."""
    return [body for body in O.bodies if isinstance(body.shape, Sphere) and body.dynamic]


def motion(body, gravity=(0.0, 0.0, 0.0)):
    """Force (N, with the weight), velocity (m/s) and angular velocity (rad/s) at the time of the positions.

    YADE's own velocities are half a step behind.
    """
    state = body.state
    force, torque = O.forces.f(body.id) + state.mass * Vector3(*gravity), O.forces.t(body.id)
    velocity = [v if axis in state.blockedDOFs else v + 0.5 * O.dt * f / state.mass
                for axis, v, f in zip("xyz", state.vel, force, strict=True)]
    if isinstance(body.shape, Capsule):
        # LcpImpact has turned its angular momentum on already.
        own = state.ori.conjugate() * (state.angMom - 0.5 * O.dt * torque)
        return force, velocity, state.ori * Vector3(*(m / i for m, i in zip(own, state.inertia, strict=True)))
    spin = [w if axis in state.blockedDOFs else w + 0.5 * O.dt * t / i
            for axis, w, t, i in zip("XYZ", state.angVel, torque, state.inertia, strict=True)]
    return force, velocity, spin


class StepMeans:
    """Means of numbers over every `every` steps, as those of LIGGGHTS' fix ave/time; the first begins after step 0.

    Those that have begun belong to a saved scene: give `save` and `load` to `run` as `saving` and `loaded`.
    """

    _numbers = count()

    def __init__(self, every):
        # By its place in the script, which is the same when the run is resumed.
        self._tag = f"sums{next(self._numbers) or ''}"
        self.every = every
        self.sums = []

    def add(self, *values):
        """Take the numbers of this step; the means, in the last step of each, else an empty list."""
        if O.iter == 0:
            return []
        self.sums = [one + value for one, value in zip(self.sums or [0.0] * len(values), values, strict=True)]
        if O.iter % self.every:
            return []
        means, self.sums = [one / self.every for one in self.sums], []
        return means

    def save(self):
        """Write the sums into the scene."""
        O.tags[self._tag] = " ".join(value.hex() for value in self.sums)

    def load(self):
        """The sums as they are in the scene."""
        self.sums = [float.fromhex(word) for word in O.tags[self._tag].split()]


class FrameWriter:
    """Appends frames of the moving spheres to grains.dump, and rows to time.csv.

    columns : names of the columns of time.csv after step, time and kinetic_energy
    bounds : ((xlo, xhi), (ylo, yhi), (zlo, zhi)), m; by default those of packing.data
    gravity : m/s^2
    types : id -> type of a row of grains.dump; 1 for others
    """

    def __init__(self, columns=(), bounds=None, gravity=(0.0, 0.0, 0.0), types=None):
        self.gravity, self.types = gravity, types or {}
        self._box = "".join(f"{low:.17g} {high:.17g}\n" for low, high in bounds or box())
        self._history = table("time.csv", ",".join(["step", "time", "kinetic_energy", *columns]))
        self._begin("grains.dump")

    @staticmethod
    def _begin(path):
        open(path, "a" if options()[1] else "w").close()

    def _frame(self, path, kind, rows, columns):
        with open(path, "a", encoding="ascii") as file:
            file.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF {kind}\n{len(rows)}\nITEM: BOX BOUNDS ff ff ff\n{self._box}")
            file.write(f"ITEM: {kind} {columns}\n")
            file.writelines(" ".join(f"{x:.17g}" for x in row) + "\n" for row in rows)

    def frame(self):
        """Append the present state to grains.dump; call it between forces and motion, where positions and forces are of the same time."""
        rows = []
        for body in spheres():
            force, velocity, spin = motion(body, self.gravity)
            kind = self.types.get(body.id, 1)
            rows.append((body.id + 1, kind, *body.state.pos, 0, 0, 0, *velocity, *spin, *force, body.shape.radius, body.state.mass))
        self._frame("grains.dump", "ATOMS", rows, "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass")

    def row(self, *values):
        """Append a row with the `values` of all columns to time.csv, after step 0; print step, time and energy for whoever watches."""
        if O.iter == 0:
            return
        energy = 0.0
        for body in spheres():
            _, velocity, spin = motion(body, self.gravity)
            energy += 0.5 * sum(body.state.mass * v * v for v in velocity)
            if isinstance(body.shape, Capsule):
                spin = body.state.ori.conjugate() * spin
            energy += 0.5 * sum(i * w * w for i, w in zip(body.state.inertia, spin, strict=True))
        self._history.write(",".join([str(O.iter), *(f"{x:.17g}" for x in (O.time, energy, *values))]) + "\n")
        self._history.flush()
        print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)

    def write(self):
        """A frame and a row."""
        self.frame()
        self.row()
