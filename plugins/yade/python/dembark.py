"""What dembark's decks need inside YADE: parameters of a case, columns of grains, dumps and histories, states to resume from.

The files have the schema of the LIGGGHTS decks: LAMMPS text dumps and one CSV file. Standard library only; SI units.

A writer must run between InteractionLoop and NewtonIntegrator, where positions and forces are of the same time.
"""

import glob
import gzip
import math
import os
import re
import shutil
import sys
import tomllib
import zlib
from types import SimpleNamespace

from yade import CapillaryLiquid, CylinderWall, DembarkSnapshot, EnergyAccount, Omega, Sphere, utils
from yade.minieigenHP import Vector3, Vector3i

O = Omega()
# How often the state is saved (steps, 0 never), and whether to go on from it: words that every deck understands beside its case's keys.
RUN_WORDS = {"restart_every": {"type": "int", "unit": "steps", "min": 0}, "resume": {"type": "choice", "values": ["no", "yes"]}}
_KEPT_STATES = 2
_resuming = False


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

    Returns a namespace of numbers and words. Optional parameters that are not set, or set to a negative number, are None. It also has
    `restart_every` (steps between saved states; 0, the default, for none) and `resume` (True: go on from the newest one), for `run`.
    """
    if path is None:
        path = os.path.join(os.path.dirname(os.path.realpath(sys.argv[0])), "case.toml")
    try:
        with open(path, "rb") as file:
            tables = tomllib.load(file)["parameters"]
    except (OSError, tomllib.TOMLDecodeError, KeyError) as error:
        fail(f"case file {path}: {error}; it must be TOML with tables [parameters.<name>]")
    values = {key: table.get("value") for key, table in tables.items()}
    states = {"restart_every": 0, "resume": "no"}
    for word in sys.argv[1:] if argv is None else argv:
        key, equals, text = word.partition("=")
        if not equals:
            fail(f"argument '{word}': it must have the form key=value")
        if key in RUN_WORDS:
            states[key] = _convert(key, RUN_WORDS[key], text)
            continue
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
    global _resuming
    _resuming = states["resume"] == "yes"
    return SimpleNamespace(**(values | {"restart_every": states["restart_every"], "resume": _resuming}))


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


def announce(steps):
    """First line of a run: its number of steps and the time step."""
    print(f"dembark: steps {steps} time_step {O.dt:.17g}", flush=True)


def finish():
    """Last line of a run that came to its end."""
    print("dembark: finished", flush=True)


def _sync(path):
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _check_sum(path):
    crc, size = 0, 0
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            crc, size = zlib.crc32(block, crc), size + len(block)
    return f"{size} {crc:08x}"


def _states(base):
    """Steps and files of all saved states `base`.<step>.yade.gz, the newest first."""
    found = ((re.fullmatch(re.escape(base) + r"\.(\d+)\.yade\.gz", path), path) for path in glob.glob(glob.escape(base) + ".*.yade.gz"))
    return sorted(((int(match.group(1)), path) for match, path in found if match), reverse=True)


def _is_whole(path):
    try:
        with open(path + ".crc", encoding="ascii") as mark:
            return mark.read().strip() == _check_sum(path)
    except (OSError, ValueError):
        return False


def _can_be_read(path):
    """Whether a packed file ends as it should."""
    try:
        with gzip.open(path) as file:
            while file.read(1 << 20):
                pass
    except (EOFError, OSError, zlib.error):
        return False
    return True


def _number(line):
    """The integer that a line begins with; infinity when it begins with something else."""
    found = re.match(rb"\d+", line)
    return int(found.group()) if found else math.inf


def _save(base, outputs):
    """Save the scene as `base`.<step>.yade.gz: whole or not at all, and marked with its check sum when it is; keep the last two."""
    path = f"{base}.{O.iter}.yade.gz"
    part = f"{base}.part.yade.gz"
    # YADE would try for ever to write on a full disk. A packed body with its contacts takes about 150 bytes.
    if shutil.disk_usage(os.path.dirname(path) or ".").free < 1000 * len(O.bodies) + (1 << 20):
        fail(f"file {path} cannot be written: No space left on the disk")
    O.save(part, quiet=True)
    if not _can_be_read(part):
        fail(f"file {part} could not be written whole. No space left on the disk?")
    for name in (*filter(os.path.isfile, outputs), part):
        _sync(name)
    if os.path.exists(path + ".crc"):
        os.unlink(path + ".crc")
    os.replace(part, path)
    with open(path + ".crc.part", "w", encoding="ascii") as mark:
        mark.write(_check_sum(path) + "\n")
    _sync(path + ".crc.part")
    os.replace(path + ".crc.part", path + ".crc")
    _sync(os.path.dirname(path) or ".")
    _forget(_states(base)[_KEPT_STATES:])


def _forget(states):
    for _, path in states:
        for name in (path + ".crc", path):
            if os.path.exists(name):
                os.unlink(name)


def _cut(path, step):
    """Cut a table or a dump before the first row or frame at or after `step`, or the first that is not whole."""
    if not os.path.isfile(path):
        return
    end = 0
    with open(path, "rb") as file:
        first = file.readline()
        if first == b"ITEM: TIMESTEP\n":
            line = first
            while line == b"ITEM: TIMESTEP\n" and _number(file.readline()) < step:
                file.readline()
                rows = _number(file.readline()) + 5  # and the box, and the names of the columns
                if rows == math.inf or sum(file.readline().endswith(b"\n") for _ in range(rows)) < rows:
                    break
                end, line = file.tell(), file.readline()
        elif first.endswith(b"\n"):
            end = file.tell()
            while (line := file.readline()).endswith(b"\n") and _number(line) < step:
                end = file.tell()
    os.truncate(path, end)


def run(steps, restart_every=0, resume=False, outputs=("time.csv", "energies.csv", "grains.dump", "contacts.dump"), base="state",
        saving=None,
        loaded=None):
    """Run the scene until step `steps` is written, and say that it is finished.

    Every `restart_every` steps (0: never) the scene is saved as `base`.<step>.yade.gz. With `resume` the newest of these that is whole
    takes the scene's place, and what `outputs` (tables that begin with the step, and dumps) got after it is cut off, for it comes again.
    Call it when the scene is complete. A scene goes on from the saved copy of itself, so that a run that was killed and resumed
    is the same to the bit as one that was not, on one thread. `saving()` is called before the scene is saved, `loaded()` after it was
    resumed.
    """
    if resume:
        whole = [path for _, path in _states(base) if _is_whole(path)]
        if not whole:
            fail(f"resume=yes: there is no whole state {base}.<step>.yade.gz in this folder; start with restart_every > 0 first")
        O.load(whole[0], quiet=True)
        for path in outputs:
            _cut(path, O.iter)
        print(f"dembark: resumed at step {O.iter} exactly", flush=True)
        if loaded:
            loaded()
    else:
        _forget(_states(base))
    # The last row and frame are written in the step that starts from their state.
    end = steps + 1
    while O.iter < end:
        O.run(min(end, (O.iter // restart_every + 1) * restart_every if restart_every else end) - O.iter, True)
        if restart_every and O.iter < end:
            if saving:
                saving()
            _save(base, outputs)
            O.load(f"{base}.{O.iter}.yade.gz", quiet=True)
    finish()


def _table(path, header):
    """A file to append rows to: with a header, or as a run left it that is resumed."""
    file = open(path, "a" if _resuming else "w", encoding="ascii")
    if not _resuming:
        file.write(header + "\n")
        file.flush()
    return file


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
            open(path, "a" if _resuming else "w").close()

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
        rows = shot.grainRows()
        self._frame(self._paths[0], "ATOMS", rows, rows.count("\n"), columns)
        rows = shot.contactRows()
        self._frame(self._paths[1], "ENTRIES", rows, rows.count("\n"), " ".join(f"c_contacts[{i}]" for i in range(1, 13)))


class HistoryWriter:
    """Appends lines to time.csv: step, time, kinetic energy of the grains, force of each wall (with its glued grains) on the grains; with
    `liquid`, the CapillaryLiquid that the scene has or will have, also where its liquid is (m^3) and the number of bridges."""

    LIQUID = {"liquid_grains": "inGrains", "liquid_bridges": "inBridges", "liquid_walls": "onWalls"}

    def __init__(self, walls, glued=None, gravity=(0.0, 0.0, -9.81), path="time.csv", progress=True, types=None, liquid=None):
        self._snapshot = _Snapshot(walls, glued, gravity, types)
        self._liquid = liquid is not None
        columns = [*self.LIQUID, "liquid_lost", "bridge_count"] if self._liquid else []
        header = ",".join(["step", "time", "kinetic_energy", *(f"{name}_f{axis}" for name in walls for axis in "xyz"), *columns])
        self._file = _table(path, header)
        self.progress = progress

    def write(self):
        """Append the present state, and print `<step> <time> <kinetic energy>` for whoever watches."""
        shot = self._snapshot.current()
        energy = shot.kineticEnergy()
        forces = (f"{component:.9g}" for force in shot.wallForces() for component in force)
        where = []
        if self._liquid:
            # A scene that was loaded has engines of its own.
            books = next(one for one in O.engines if isinstance(one, CapillaryLiquid))
            where = [*(f"{getattr(books, name)():.17g}" for name in self.LIQUID.values()), f"{books.lost:.17g}", str(books.bridgeCount())]
        self._file.write(",".join([str(O.iter), f"{O.time:.9g}", f"{energy:.9g}", *forces, *where]) + "\n")
        self._file.flush()
        if self.progress:
            print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)


def spanning(diameter):
    """Half the length (m) along x, in a periodic cell, of a box that is to be a plane, larger than the period.

    diameter : m, mean one of the grains

    After a restart YADE's collider looks for pairs along x, from a body's lower end to its upper one, within one period. So the ends of the
    box must almost meet there, with a gap that no grain fits into; or a grain just above it would never be found.
    """
    return 0.5 * (2001 * O.cell.size[0] - 0.5 * diameter)


def energies():
    """All energies (J) of the scene's EnergyAccount by name, at the end of the last step that is over: see its keys() for the names."""
    # A scene that was loaded has engines of its own.
    account = next((one for one in O.engines if isinstance(one, EnergyAccount)), None)
    if account is None:
        fail("energies: there is no EnergyAccount in O.engines; put one before NewtonIntegrator")
    return account.energies()


class EnergyWriter:
    """Appends lines to energies.csv: step, time and all energies (J) of the EnergyAccount that the scene has or will have, at the end of
    the step before; with all their digits. It may run anywhere among the engines, and between runs."""

    def __init__(self, path="energies.csv"):
        self._file = _table(path, ",".join(["step", "time", *EnergyAccount().keys()]))

    def write(self):
        """Append the present state."""
        self._file.write(",".join([str(O.iter), f"{O.time:.9g}", *(f"{energy:.17g}" for energy in energies().values())]) + "\n")
        self._file.flush()


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
            open(path, "a" if _resuming else "w").close()
        self._history = _table("time.csv", ",".join(["step", "time", "kinetic_energy", *self.NUMBERS, *self.COUNTS]))

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
            velocity = [v if axis in state.blockedDOFs else v + 0.5 * O.dt * f / state.mass
                        for axis, v, f in zip("xyz", state.vel, force, strict=True)]
            spin = [w if axis in state.blockedDOFs else w + 0.5 * O.dt * t / i
                    for axis, w, t, i in zip("XYZ", state.angVel, torque, state.inertia, strict=True)]
            energy += 0.5 * sum(state.mass * v * v for v in velocity)
            energy += 0.5 * sum(i * w * w for i, w in zip(state.inertia, spin, strict=True))
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
