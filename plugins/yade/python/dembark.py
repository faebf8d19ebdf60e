"""What dembark's decks need inside YADE: parameters of a case, columns of grains, dumps and histories.

The files have the schema of the LIGGGHTS decks: LAMMPS text dumps and one CSV file. Standard library only; SI units.

A writer must run between InteractionLoop and NewtonIntegrator, where positions and forces are of the same time.
"""

import math
import os
import sys
import tomllib
from types import SimpleNamespace

from yade import DembarkSnapshot, Omega, Sphere
from yade.minieigenHP import Vector3, Vector3i

O = Omega()


def fail(line, code=2):
    """Say in one line on stderr what is wrong, where and what would be right, and end the process."""
    sys.stdout.flush()
    print(f"dembark: {line}", file=sys.stderr, flush=True)
    # SystemExit would not leave the thread in which YADE runs its engines.
    os._exit(code)


def _convert(key, table, text):
    kind = table.get("type", "float")
    where = f"parameter {key}={text}"
    if kind == "choice":
        if text not in table["values"]:
            fail(f"{where}: it must be one of {', '.join(table['values'])}")
        return text
    try:
        value = int(text) if kind == "int" else float(text)
    except ValueError:
        fail(f"{where}: it must be {'an integer' if kind == 'int' else 'a number'} ({table.get('unit', '1')})")
    if math.isnan(value):
        fail(f"{where}: it must be a number ({table.get('unit', '1')})")
    unset = table.get("optional", False) and value < 0.0
    low, high = table.get("min", -math.inf), table.get("max", math.inf)
    if not unset and (value < low or value > high or (table.get("exclusive_min", False) and value == low)):
        least = f"{'>' if table.get('exclusive_min', False) else '>='} {low:g}" if low > -math.inf else ""
        most = f"<= {high:g}" if high < math.inf else ""
        fail(f"{where}: it must be {' and '.join(part for part in (least, most) if part)} {table.get('unit', '1')}")
    return value


def parameters(path=None, argv=None):
    """Parameters of the case file `path` (default: case.toml beside the script) with `key=value` words of `argv` (default: the
    script's) in place of its values.

    Returns a namespace of numbers and words. Optional parameters that are not set, or set to a negative number, are None.
    """
    if path is None:
        path = os.path.join(os.path.dirname(os.path.realpath(sys.argv[0])), "case.toml")
    try:
        with open(path, "rb") as file:
            tables = tomllib.load(file)["parameters"]
    except (OSError, tomllib.TOMLDecodeError, KeyError) as error:
        fail(f"case file {path}: {error}; it must be TOML with tables [parameters.<name>]")
    values = {key: table.get("value") for key, table in tables.items()}
    for word in sys.argv[1:] if argv is None else argv:
        key, equals, text = word.partition("=")
        if not equals:
            fail(f"argument '{word}': it must have the form key=value")
        if key not in tables:
            fail(f"parameter {key} is unknown in {path}; known are {', '.join(sorted(tables))}")
        values[key] = _convert(key, tables[key], text)
    for key, table in tables.items():
        value = values[key]
        if value is None:
            if not table.get("optional", False):
                fail(f"parameter {key} in {path} has no value; give it one or mark it optional = true")
        elif table.get("optional", False) and not isinstance(value, str) and value < 0.0:
            values[key] = None
        elif table.get("type", "float") == "float":
            values[key] = float(value)
    return SimpleNamespace(**values)


def uniform(number, seed, use):
    """A number in [0, 1) that depends on a grain's number (from 1), the seed and what it is used for; as in the LIGGGHTS decks."""
    x = 43758.5453 * math.sin(12.9898 * number + 78.233 * seed + use)
    return x - math.floor(x)


def lattice(counts, cell, origin=(0.0, 0.0, 0.0), inside=None):
    """Middles of the cells of a lattice (m), x fastest, for which `inside(x, y, z)` holds."""
    sites = []
    for k in range(counts[2]):
        for j in range(counts[1]):
            for i in range(counts[0]):
                site = tuple(origin[a] + (n + 0.5) * cell[a] for a, n in enumerate((i, j, k)))
                if inside is None or inside(*site):
                    sites.append(site)
    return sites


def column(sites, count, diameter, spread, seed, jitter=0.0):
    """A dilute column: `count` of the sites, chosen by the seed, with a grain each, moved by up to `jitter` (m) along each axis.

    Diameters are uniform in diameter * (1 -+ spread). Grains do not touch when sites are more than
    diameter * (1 + spread) + 2 * jitter apart. Returns tuples (x, y, z, radius) in the order of the sites.
    """
    total = len(sites)
    if count > total:
        fail(f"grain_count {count} is more than the {total} places of the column; take fewer grains or a larger vessel")
    grains = []
    for number, site in enumerate(sites, 1):
        # Multiplying by a prime modulo the number of sites is a permutation, unless the prime divides it: exactly `count` stay.
        if (number + seed) * 15485863 % total >= count:
            continue
        radius = 0.5 * diameter * (1.0 + spread * (2.0 * uniform(number, seed, 1) - 1.0))
        grains.append((*(x + jitter * (2.0 * uniform(number, seed, use) - 1.0) for use, x in enumerate(site, 2)), radius))
    return grains


def announce(steps):
    """First line of a run: its number of steps and the time step."""
    print(f"dembark: steps {steps} time_step {O.dt:.17g}", flush=True)


def finish():
    """Last line of a run that came to its end."""
    print("dembark: finished", flush=True)


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
        columns, types = [-1] * self.bodies, [0] * self.bodies
        for body in O.bodies:
            if isinstance(body.shape, Sphere):
                types[body.id] = 1 if body.dynamic else 2
        for body, kind in (self.types or {}).items():
            types[body] = kind
        for number, name in enumerate(self.names):
            for body in (*self.walls[name], *self.glued.get(name, ())):
                columns[body] = number
        self.shot.columns, self.shot.types = columns, types
        return self.shot


class DumpWriter:
    """Appends frames to grains.dump and contacts.dump.

    walls : name -> id of a body, or ids; the columns f_force_<name>[1..3] are the force of that wall on each grain
    bounds : ((xlo, xhi), (ylo, yhi), (zlo, zhi)), m
    boundary : LAMMPS's words, 'ff' fixed or 'pp' periodic; along a periodic axis grains are wrapped into the bounds, which must then
        be the period, and counted by image flags
    types : id -> type of a row; 0 leaves a body out. By default 1 for spheres that move and 2 for those that are held.
    glued : wall -> ids of held spheres whose force on a grain counts to that wall's
    """

    def __init__(self, walls, bounds, boundary="ff ff ff", gravity=(0.0, 0.0, -9.81), types=None, glued=None, grains="grains.dump",
                 contacts="contacts.dump"):
        self.bounds, self.boundary = bounds, boundary
        words = boundary.split()
        if len(words) != 3 or not set(words) <= {"ff", "pp"}:
            fail(f"DumpWriter: boundary '{boundary}': it must be three words ff or pp")
        self._snapshot = _Snapshot(walls, glued, gravity, types)
        self._paths = grains, contacts
        for path in self._paths:
            open(path, "w").close()

    def _frame(self, path, kind, rows, count, columns):
        box = "".join(f"{low:.10g} {high:.10g}\n" for low, high in self.bounds)
        with open(path, "a", encoding="ascii") as file:
            file.write(f"ITEM: TIMESTEP\n{O.iter}\nITEM: NUMBER OF {kind}\n{count}\nITEM: BOX BOUNDS {self.boundary}\n{box}ITEM: {kind} {columns}\n")
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
                    fail(f"DumpWriter: bounds of axis {'xyz'[axis]} are {length:g} m apart, the period is {O.cell.size[axis]:g} m; they must be equal")
        walls = "".join(f" f_force_{name}[{i}]" for name in self._snapshot.names for i in (1, 2, 3))
        columns = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass" + walls
        rows = shot.grainRows()
        self._frame(self._paths[0], "ATOMS", rows, rows.count("\n"), columns)
        rows = shot.contactRows()
        self._frame(self._paths[1], "ENTRIES", rows, rows.count("\n"), " ".join(f"c_contacts[{i}]" for i in range(1, 13)))


class HistoryWriter:
    """Appends lines to time.csv: step, time, kinetic energy of the grains, force of each wall (with its glued grains) on the grains."""

    def __init__(self, walls, glued=None, gravity=(0.0, 0.0, -9.81), path="time.csv", progress=True, types=None):
        self._snapshot = _Snapshot(walls, glued, gravity, types)
        self._file = open(path, "w", encoding="ascii")
        self.progress = progress
        self._file.write(",".join(["step", "time", "kinetic_energy", *(f"{name}_f{axis}" for name in walls for axis in "xyz")]) + "\n")

    def write(self):
        """Append the present state, and print `<step> <time> <kinetic energy>` for whoever watches."""
        shot = self._snapshot.current()
        energy = shot.kineticEnergy()
        forces = (f"{component:.9g}" for force in shot.wallForces() for component in force)
        self._file.write(",".join([str(O.iter), f"{O.time:.9g}", f"{energy:.9g}", *forces]) + "\n")
        self._file.flush()
        if self.progress:
            print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)
