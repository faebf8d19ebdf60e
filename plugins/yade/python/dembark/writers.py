"""Dumps and histories with the schema of the LIGGGHTS decks: LAMMPS text dumps and one CSV file.

A writer must run between InteractionLoop and NewtonIntegrator, where positions and forces are of the same time.
"""

from yade import CapillaryLiquid, DembarkSnapshot, EnergyAccount, Omega
from yade.dembark.moving import motion_columns, motion_values
from yade.dembark.report import fail
from yade.dembark.states import options, table
from yade.minieigenHP import Vector3, Vector3i

O = Omega()


class _Snapshot:
    """The bodies of a scene sorted into grains and walls, for both writers."""

    def __init__(self, walls, glued, gravity, types):
        self.names = list(walls)
        self.glued, self.gravity, self.types = glued or {}, gravity, types
        for name in self.glued:
            if name not in walls:
                fail(f"writer: glued grains of wall '{name}', but there is no such wall; walls are {', '.join(walls)}")
        self.walls = {name: [ids] if isinstance(ids, int) else list(ids) for name, ids in walls.items()}
        self.shot = DembarkSnapshot(wallCount=len(self.names), gravity=Vector3(*gravity))
        self.bodies = -1

    def current(self):
        if len(O.bodies) == self.bodies:
            return self.shot
        self.bodies = len(O.bodies)
        columns, types = [-1] * self.bodies, [-1] * self.bodies
        for body, kind in (self.types or {}).items():
            types[body] = kind
        for number, name in enumerate(self.names):
            for body in (*self.walls[name], *self.glued.get(name, ())):
                columns[body] = number
        self.shot.columns, self.shot.types = columns, types
        return self.shot

    def forces(self):
        """Force (N) of each wall, with its glued grains, on the grains."""
        return [sum((-O.forces.f(body) for body in (*ids, *self.glued.get(name, ()))), Vector3.Zero) for name, ids in self.walls.items()]


class DumpWriter:
    """Appends frames to grains.dump and contacts.dump.

    walls : name -> id of a body, or ids; the columns f_force_<name>[1..3] are the force of that wall on each grain
    bounds : ((xlo, xhi), (ylo, yhi), (zlo, zhi)), m
    boundary : LAMMPS's words, 'ff' fixed or 'pp' periodic; along a periodic axis grains are wrapped into the bounds, which must then
        be the period, and counted by image flags
    types : id -> type of a row; 0 leaves a body out. By default 1 for spheres that move and 2 for those that are held.
    glued : wall -> ids of held spheres whose force on a grain counts to that wall's
    grains, contacts : paths; contacts = None writes none
    """

    def __init__(self, walls, bounds, boundary="ff ff ff", gravity=(0.0, 0.0, -9.81), types=None, glued=None, grains="grains.dump",
                 contacts="contacts.dump"):
        self.bounds, self.boundary = bounds, boundary
        words = boundary.split()
        if len(words) != 3 or not set(words) <= {"ff", "pp"}:
            fail(f"DumpWriter: boundary '{boundary}': it must be three words ff or pp")
        self._snapshot = _Snapshot(walls, glued, gravity, types)
        self._paths = grains, contacts
        for path in filter(None, self._paths):
            open(path, "a" if options()[1] else "w").close()

    def _chosen(self, rows):
        """The rows of grains that are written: all."""
        return rows

    def _frame(self, path, kind, rows, count, columns):
        box = "".join(f"{low:.10g} {high:.10g}\n" for low, high in self.bounds)
        with open(path, "a", encoding="ascii") as file:
            file.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF {kind}\n{count}\nITEM: BOX BOUNDS {self.boundary}\n{box}")
            file.write(f"ITEM: {kind} {columns}\n")
            file.write(rows)

    def write(self):
        """Append the present state as one frame to both files."""
        shot = self._snapshot.current()
        words = self.boundary.split()
        shot.low, shot.high = (Vector3(*(bound[side] for bound in self.bounds)) for side in (0, 1))
        shot.periodic = Vector3i(*(int(word == "pp") for word in words))
        if O.periodic:
            for axis, word in enumerate(words):
                length = self.bounds[axis][1] - self.bounds[axis][0]
                if word == "pp" and abs(length - O.cell.size[axis]) > 1e-9 * length:
                    fail(f"DumpWriter: bounds of axis {'xyz'[axis]} are {length:g} m apart, the period is {O.cell.size[axis]:g} m; "
                         "they must be equal")
        walls = "".join(f" f_force_{name}[{i}]" for name in self._snapshot.names for i in (1, 2, 3))
        columns = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass" + walls
        rows = self._chosen(shot.grainRows())
        self._frame(self._paths[0], "ATOMS", rows, rows.count("\n"), columns)
        if self._paths[1] is None:
            return
        rows = shot.contactRows()
        self._frame(self._paths[1], "ENTRIES", rows, rows.count("\n"), " ".join(f"c_contacts[{i}]" for i in range(1, 13)))


class HistoryWriter:
    """Appends lines to time.csv: step, time, kinetic energy of the grains, force of each wall (with its glued grains) on the grains; with
    `liquid`, the CapillaryLiquid that the scene has or will have, also where its liquid is (m^3) and the number of bridges; with the
    engines `moving` of `motion` also `motion_values`."""

    LIQUID = {"liquid_grains": "inGrains", "liquid_bridges": "inBridges", "liquid_walls": "onWalls"}

    def __init__(self, walls, glued=None, gravity=(0.0, 0.0, -9.81), path="time.csv", progress=True, types=None, liquid=None,
                 moving=()):
        self._snapshot = _Snapshot(walls, glued, gravity, types)
        self._moving = moving
        self._liquid = liquid is not None
        columns = [*self.LIQUID, "liquid_lost", "bridge_count"] if self._liquid else []
        header = ",".join(["step", "time", "kinetic_energy", *(f"{name}_f{axis}" for name in walls for axis in "xyz"), *columns,
                           *motion_columns(moving, walls)])
        self._file = table(path, header)
        self.progress = progress

    def write(self):
        """Append the present state, and print `<step> <time> <kinetic energy>` for whoever watches."""
        shot = self._snapshot.current()
        energy = shot.kineticEnergy()
        forces = (f"{component:.9g}" for force in self._snapshot.forces() for component in force)
        where = []
        if self._liquid:
            # A scene that was loaded has engines of its own.
            carried = next(one for one in O.engines if isinstance(one, CapillaryLiquid))
            volumes = [*(getattr(carried, name)() for name in self.LIQUID.values()), carried.lost]
            where = [*(f"{volume:.17g}" for volume in volumes), str(carried.bridgeCount())]
        self._file.write(",".join([str(O.iter), f"{O.time:.9g}", f"{energy:.9g}", *forces, *where,
                                   *(f"{x:.17g}" for x in motion_values(self._moving, self._snapshot.walls))]) + "\n")
        self._file.flush()
        if self.progress:
            print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)


def energies():
    """All energies (J) of the scene's EnergyAccount by name, at the end of the last step that is over: see its keys() for the names."""
    # A scene that was loaded has engines of its own.
    account = next((one for one in O.engines if isinstance(one, EnergyAccount)), None)
    if account is None:
        fail("energies: there is no EnergyAccount in O.engines; put one before NewtonIntegrator")
    return account.energies()


class EnergyWriter:
    """Appends lines to energies.csv: step, time and energies (J) of the EnergyAccount that the scene has or will have, at the end of
    the step before; with all their digits. It may run anywhere among the engines, and between runs.

    names : column -> name of its energy, by default all energies
    more : names of further columns, whose values `more_values()` returns
    """

    def __init__(self, path="energies.csv", names=None, more=(), more_values=tuple):
        self._names = names or {name: name for name in EnergyAccount().keys()}  # noqa: SIM118 (it is no dictionary)
        self._more_values = more_values
        self._file = table(path, ",".join(["step", "time", *self._names, *more]))

    def write(self):
        """Append the present state."""
        known = energies()
        numbers = (O.time, *(known[name] for name in self._names.values()), *self._more_values())
        self._file.write(",".join([str(O.iter), *(f"{x:.17g}" for x in numbers)]) + "\n")
        self._file.flush()
