"""Scenes of decks: bodies of packing.data, materials, walls, and the engines around the Finnie-Rabinowicz law."""

import sys
from types import SimpleNamespace

from yade import (
    Bo1_Box_Aabb,
    Bo1_Facet_Aabb,
    Bo1_Sphere_Aabb,
    FacetSurface,
    ForceResetter,
    FrictMat,
    Ig2_Box_Sphere_ScGeom,
    Ig2_FacetSurface_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    InsertionSortCollider,
    Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys,
    Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz,
    MatchMaker,
    NewtonIntegrator,
    Omega,
    PyRunner,
    SphereContactLoop,
    utils,
)
from yade.dembark.report import fail
from yade.dembark.states import WORDS
from yade.dembark.writers import DumpWriter, HistoryWriter
from yade.minieigenHP import Vector3

O = Omega()


def parameters(**numbers):
    """The numbers of a run by name; 'dembark deck' writes them into the deck. A word behind the script is refused, but for those of
    restarts; one that would change a number, too, for others were computed from it."""
    if not numbers:
        fail("this deck has no numbers; write it with 'dembark deck CASE --engine yade --out FOLDER'")
    for word in sys.argv[1:]:
        if word.partition("=")[0] in numbers:
            fail(f"argument '{word}': other numbers of this deck were computed from it; write the deck anew with 'dembark deck --set'")
        if not word.startswith(WORDS):
            fail(f"argument '{word}' is not known to a deck; it takes restart_every=<steps> and resume=yes|no")
    return SimpleNamespace(**numbers)


def packing(path="packing.data"):
    """Rows (type, diameter, density, position, velocity, spin) of the bodies in a LAMMPS data file of atom style granular; SI units."""
    rows, section = {}, None
    try:
        with open(path, encoding="ascii") as file:
            for line in file:
                words = line.split()
                if words in (["Atoms"], ["Velocities"]):
                    section = words[0]
                elif words and section == "Atoms":
                    kind, (diameter, density, *place) = int(words[1]), map(float, words[2:])
                    rows[int(words[0])] = [kind, diameter, density, place, (0, 0, 0), (0, 0, 0)]
                elif words and section == "Velocities":
                    numbers = [float(word) for word in words[1:]]
                    rows[int(words[0])][4:] = numbers[:3], numbers[3:]
    except (OSError, ValueError, KeyError) as error:
        fail(f"file {path}: {error}; it must be a data file of atom style granular")
    return [rows[number] for number in sorted(rows)]


def box(path="packing.data"):
    """((xlo, xhi), (ylo, yhi), (zlo, zhi)) in m of a data file."""
    with open(path, encoding="ascii") as file:
        rows = [line.split()[:2] for line in file if line.rstrip().endswith("hi")]
    return tuple((float(low), float(high)) for low, high in rows)


def materials(p):
    """Materials (ids) of grains and walls."""
    return tuple(O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density)) for _ in range(2))


def grains(material, gravity=(0, 0, 0), mask=1, held=None, path="packing.data"):
    """Add the spheres of the packing: those of type 1 with `material` and `mask`, the others held with the (material, mask) `held`.

    `material` may be a dictionary, by type. Masses are those of the densities in the packing. YADE's velocities are half a step behind
    positions: with `gravity` (m/s^2), and O.dt set, those of the file are met at the time zero. Returns the ids of all by type.
    """
    ids = {}
    for kind, diameter, density, place, velocity, spin in packing(path):
        moves = kind == 1 or held is None
        own, bits = (material[kind] if isinstance(material, dict) else material, mask) if moves else held
        body = utils.sphere(place, 0.5 * diameter, material=own, mask=bits, fixed=not moves)
        if moves:
            # 1 but where sorts of grains share a material.
            heavier = density / O.materials[own].density
            body.state.mass, body.state.inertia = heavier * body.state.mass, heavier * body.state.inertia
            body.state.vel = Vector3(*velocity) - 0.5 * O.dt * Vector3(*gravity)
            body.state.angVel = Vector3(*spin)
        ids.setdefault(kind, []).append(O.bodies.append(body))
    return ids


def periodic(axes, room):
    """Make the scene periodic along `axes` (0 ... 2), with the box of the packing as its cell.

    YADE is periodic in all three directions; along the others the cell is larger by `room` (m) for the walls: nothing closes on itself.
    """
    O.periodic = True
    O.cell.setBox(*(high - low + (0.0 if axis in axes else room) for axis, (low, high) in enumerate(box())))


def begin(p, gravity=(0, 0, 0), along=(), mask=1, held=None):
    """Begin the scene of a deck: time step, periods along the axes `along` (0 ... 2), materials, and the grains of the packing.

    `gravity` (m/s^2) is that of the first step, see `grains`; `held`: mask of the grains that do not move. Returns the materials (ids) of
    grains and walls, and the ids of the grains by type.
    """
    O.dt = p.time_step
    if along:
        periodic(along, room=8 * p.grain_diameter)
    both = materials(p)
    return both, grains(both[0], gravity, mask, None if held is None else (both[1], held))


def block(ids, dofs="yXZ"):
    """Block the degrees of freedom `dofs` of bodies, of xyzXYZ; by default those that lead spheres out of their layer across y.

    One layer of spheres stays one only so: round-off across it would grow as a column buckles.
    """
    for k in ids:
        O.bodies[k].state.blockedDOFs = dofs


def planes(p, materials, mask=1, **walls):
    """Ids of plane walls by name, each given as (axis, position, side), see `plane`."""
    return {name: plane(*place, materials[1], p.grain_diameter, mask) for name, place in walls.items()}


def plane(axis, position, side, material, diameter, mask=1):
    """A plane wall across `axis` (0 ... 2) at `position` (m) in periodic scenes, grains of mean `diameter` (m) on its `side` (+-1); its id.

    `Wall` is unbounded, which a periodic collider cannot sort; a fixed box that reaches far beyond the cell, and all that grains travel,
    does the same. After a restart YADE's collider looks for pairs along x, from a body's lower end to its upper one, within one period.
    So the ends of the box must almost meet there, with a gap that no grain fits into; or a grain just above it would never be found.
    In a direction whose period shrinks, the collider sorts the ends of the box past all bounds once for each period that they move. So
    the box reaches no farther than grains travel: 10^5 diameters, ten times what a grain of 5 mm falls in 3 s.
    """
    extents = [1e5 * diameter] * 3
    extents[0] = 0.5 * (2001 * O.cell.size[0] - 0.5 * diameter)
    extents[axis] = diameter
    centre = [0.0] * 3
    centre[axis] = position - side * diameter
    return O.bodies.append(utils.box(centre, extents, fixed=True, material=material, mask=mask))


def pairs(materials, between_grains, at_wall):
    """A property of pairs of grains, and of a grain and a wall; `materials` as from `materials(p)`."""
    grain, wall = materials
    return MatchMaker(matches=((grain, grain, between_grains), (grain, wall, at_wall)))


def contact_loop(p, materials, walls, static=None, kinetic=None):
    """SphereContactLoop of the Finnie-Rabinowicz law with the numbers `p` of a deck; `walls`: Ig2 functors other than that of
    two spheres.

    `static`, `kinetic`: friction (of grains, of walls) other than that of `p`.
    """
    static = static or (p.grain_static, p.wall_static)
    kinetic = kinetic or (p.grain_kinetic, p.wall_kinetic)
    given = vars(p)
    # What a law that is off would not read is refused.
    liquid = {"liquidViscosity": "liquid_viscosity", "minimumGap": "minimum_gap", "contactAngle": "contact_angle",
              "surfaceTension": "surface_tension"}
    names = {"interfaceShearStrength": "interface_shear_strength"} | (liquid if p.wet else {})
    more = {word: given[key] for word, key in names.items() if key in given}
    law = {"presliding": p.presliding} if "presliding" in given else {}
    if given.get("rolling_resistance", "off") != "off":
        more["rollingFriction"] = pairs(materials, p.grain_rolling, p.wall_rolling)
        if p.rolling_resistance == "elastic_plastic":
            more["rollingDampingRatio"] = p.rolling_damping_ratio
        law["rollingResistance"] = p.rolling_resistance
    return SphereContactLoop(
        [Ig2_Sphere_Sphere_ScGeom(), *walls],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
            restitution=pairs(materials, p.restitution, given.get("wall_restitution", p.restitution)),
            staticFriction=pairs(materials, *static), kineticFriction=pairs(materials, *kinetic),
            criticalSlipDistance=p.critical_slip_distance, bridgeVolume=0 if p.carried else p.bridge_volume, **more)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(
            capillaryModel=p.capillary_model if p.wet else "none", carriedLiquid=bool(p.carried), **law)])


def engine_loop(loop, bounds, verlet, gravity, liquid=None, account=None, periodic=False, record="record()", period=None, moving=(),
                surface=None):
    """All engines of a scene, in the order in which they must run.

    `loop`: the InteractionLoop, as from `contact_loop`; `bounds`: Bo1 functors; `verlet` (m): Verlet distance of the collider;
    `record`: Python that writes what is due, called between forces and motion, where positions and forces belong to the same time: with
    `period` at step 0 and every `period` steps, by default at every step from 1 on; `liquid`: CapillaryLiquid; `account`: EnergyAccount;
    `moving`: engines of `motion`; `surface`: the FacetSurface that the functor of facets in `loop` uses.
    """
    sorting = {"allowBiggerThanPeriod": True} if periodic else {}
    return [
        ForceResetter(),
        InsertionSortCollider(bounds, verletDist=verlet, **sorting),
        *([surface] if surface is not None else []),
        loop,
        *([liquid] if liquid is not None else []),
        PyRunner(command=record, iterPeriod=period or 1, initRun=period is not None),
        *([account] if account is not None else []),
        *moving,
        NewtonIntegrator(damping=0, gravity=gravity),
    ]


def slab_loop(p, materials, gravity, verlet=0.1, static=None, kinetic=None, **more):
    """All engines of a periodic scene between `planes`; `verlet`: Verlet distance over the mean diameter, `more` as in `engine_loop`."""
    loop = contact_loop(p, materials, [Ig2_Box_Sphere_ScGeom()], static, kinetic)
    return engine_loop(loop, [Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], verlet * p.grain_diameter, gravity, periodic=True, **more)


def mesh_loop(p, materials, gravity, verlet=0.1, static=None, kinetic=None, **more):
    """All engines of a scene with walls of facets (`mesh`) and, if there are any, `planes`; arguments as of `slab_loop`."""
    surface = FacetSurface()
    loop = contact_loop(p, materials, [Ig2_Box_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface)], static, kinetic)
    bounds = [Bo1_Sphere_Aabb(), Bo1_Box_Aabb(), Bo1_Facet_Aabb()]
    return engine_loop(loop, bounds, verlet * p.grain_diameter, gravity, surface=surface, **more)


class Recorder:
    """Writes what is due at a step: a row of time.csv every p.every steps, a frame of the dumps every p.stride from p.first on.

    `history`: writer of time.csv other than HistoryWriter; `report`: steps between two lines of progress, by default each row;
    `moving`: engines of `motion`, whose numbers the history has then.
    """

    def __init__(self, p, walls, bounds=None, boundary="ff ff ff", gravity=(0, 0, 0), glued=None, liquid=None, history=None, report=None,
                 moving=()):
        self.p, self.report = p, report
        self.dump = DumpWriter(walls=walls, bounds=bounds or box(), boundary=boundary, gravity=gravity)
        self.history = history or HistoryWriter(walls=walls, glued=glued, gravity=gravity, liquid=liquid, progress=report is None,
                                                moving=moving)

    def __call__(self):
        """Once in every step."""
        if O.iter > 0 and O.iter % self.p.every == 0:
            self.history.write()
        if self.report and O.iter > 0 and O.iter % self.report == 0:
            print(O.iter, f"{O.time:.6g}", flush=True)
        if O.iter >= self.p.first and (O.iter - self.p.first) % self.p.stride == 0:
            self.dump.write()
