"""Runs inside YADE: `PYTHONPATH=. yade -n -x scenes.py out.json scene...`. Each scene is a function that returns plain data."""

import builtins
import math
import os
import re
import sys

from columns import dilute_column
from scene_results import advance, place, refusal, write_results
from yade import dembark, utils

PAIR = dict(restitution=0.6, staticFriction=0.5, kineticFriction=0.3, criticalSlipDistance=1e-5)
ROLLING = dict(rollingFriction=0.1, rollingDampingRatio=0.3)
WET = dict(bridgeVolume=2e-10, surfaceTension=0.072, contactAngle=0.35)
DENSITY = 2500.0
STEP = 2e-6


def scene_with(bodies, pair=None, gravity=(0, 0, 0), **law):
    """A new scene of `bodies`; returns its law."""
    O.reset()
    place(bodies, DENSITY)
    law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**law)
    O.dt = STEP
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Box_Aabb(), Bo1_Facet_Aabb(), Bo1_CylinderWall_Aabb()],
                              allowBiggerThanPeriod=True),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom(), Ig2_Facet_Sphere_ScGeom(),
             Ig2_CylinderWall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**PAIR, **(pair or {})})], [law]),
        NewtonIntegrator(damping=0, gravity=gravity),
    ]
    return law


def follow(steps, ids):
    """Positions, velocities and angular velocities of `ids` after each step: [step][body] -> nine numbers."""
    rows = []
    for _ in range(steps):
        O.step()
        rows.append([[*O.bodies[i].state.pos, *O.bodies[i].state.vel, *O.bodies[i].state.angVel] for i in ids])
    return rows


def moving(position, radius, velocity=(0, 0, 0), spin=(0, 0, 0), **options):
    body = utils.sphere(position, radius, **options)
    body.state.vel, body.state.angVel = Vector3(*velocity), Vector3(*spin)
    return body


def plain_law():
    """The law and Ip2 with nothing but what is required."""
    scene_with([utils.wall(0, 2), moving((0, 0, 0.00249), 0.0025)])
    O.step()
    return list(O.forces.f(1))


def _against(wall):
    law = scene_with([wall, moving((0.001, 0.0005, 0.00251), 0.0025, (0.3, 0.1, -0.5), (20, -30, 10))], WET, capillaryModel="exact")
    rows = follow(1200, [1])
    return {"rows": rows, "bridges": law.bridgeCount(), "dissipated": law.dissipatedEnergy()}


def walls():
    """The same grain on a Wall, a Box and a Facet, each with the grain on either side of the interaction."""
    box = utils.box((0, 0, -0.01), (1, 1, 0.01), fixed=True)
    facet = utils.facet([(-1, -1, 0), (1, -1, 0), (0, 1, 0)])
    return {"wall": _against(utils.wall(0, 2)), "box": _against(box), "facet": _against(facet)}


def held_sphere():
    """A free sphere that hits a held one, listed first or last."""
    results = []
    for order in (0, 1):
        bodies = [moving((0.0, 0.0, 0.0), 0.003, (0.2, 0.1, 0.0), (0, 5, 30)), moving((0.0056, 0.0005, 0.0), 0.0025, fixed=True)]
        scene_with(bodies[::-1] if order else bodies)
        results.append(follow(900, [order]))
    return results


def _touch_cylinder(axis, point, across, velocity, spin, wall_velocity, wall_spin, radius=0.025, grain=0.0025, overlap=2e-5):
    """Force and torque in the first step on a grain that overlaps with the wall at `across` from the axis."""
    shape = CylinderWall(radius=radius, axis=axis)
    wall = Body()
    wall.shape, wall.state.pos = shape, Vector3(*point)
    wall.state.vel, wall.state.angVel, wall.state.blockedDOFs = Vector3(*wall_velocity), Vector3(*wall_spin), "xyzXYZ"
    where = Vector3(*point) + Vector3(*across).normalized() * (radius - grain + overlap) + 0.3 * shape.axis
    scene_with([wall, moving(where, grain, velocity, spin)])
    O.step()
    i = O.interactions[0, 1]
    return [list(O.forces.f(1)), list(O.forces.t(1)), list(O.forces.f(0)), i.geom.penetrationDepth]


def cylinder():
    """Against a plane wall at the same place that moves as the cylinder does at the contact; and a grain that turns with the cylinder."""
    velocity, spin = (0.1, 0.2, 0.3), (10, 20, -30)
    plane = utils.wall((0.025, 0, 0), 0)
    # The middle of the overlap is half of it beyond the surface.
    plane.state.vel = Vector3(0, 12 * (0.025 + 1e-5), 0.4)
    scene_with([plane, moving((0.0225 + 2e-5, 0, 0), 0.0025, velocity, spin)])
    O.step()
    flat = [list(O.forces.f(1)), list(O.forces.t(1)), list(O.forces.f(0)), O.interactions[0, 1].geom.penetrationDepth]
    upright = _touch_cylinder((0, 0, 2), (0, 0, 0), (1, 0, 0), velocity, spin, (0, 0, 0.4), (0, 0, 12))
    # The same turned by x -> y -> z -> x, moved away and beyond the axis's origin.
    turn = lambda v: (v[2], v[0], v[1])
    turned = _touch_cylinder((1, 0, 0), (0.3, -0.2, 0.1), (0, 1, 0), turn(velocity), turn(spin), turn((0, 0, 0.4)), turn((0, 0, 12)))
    rigid = _touch_cylinder((0, 0, 2), (0, 0, 0), (1, 0, 0), (0, 12 * (0.0225 + 2e-5), 0.4), (0, 0, 12), (0, 0, 0.4), (0, 0, 12))
    return {"flat": flat, "upright": upright, "turned": [[v[1], v[2], v[0]] for v in turned[:3]] + turned[3:], "rigid": rigid}


def cylinder_fill():
    """Grains that fly about in a cylinder; how far out their surfaces ever get, and the energy at begin and end."""
    wall = Body()
    wall.shape = CylinderWall(radius=0.02)
    wall.state.blockedDOFs = "xyzXYZ"
    grains = [moving((x, y, z), r, (0.8 * math.sin(x * 1e4), 0.8 * math.cos(y * 1e4 + z), 0))
              for x, y, z, r in dilute_column((3, 3, 3), 0.008, (-0.012, -0.012, 0), 20, 0.005, 0.2, 3, 0.0005)]
    scene_with([wall, *grains], {"restitution": 1.0, "staticFriction": 0.0, "kineticFriction": 0.0}, tangentialDamping=False)
    # Of a Hertz contact 2/5 of force times overlap is stored.
    energy = lambda: (sum(0.5 * b.state.mass * b.state.vel.squaredNorm() for b in O.bodies if isinstance(b.shape, Sphere))
                      + sum(0.4 * i.phys.normalForce.norm() * i.geom.penetrationDepth for i in O.interactions if i.isReal))
    O.dt = 1e-6
    begin, out = energy(), -1.0
    for _ in range(60):
        O.run(1000, True)
        out = max([out] + [math.hypot(b.state.pos[0], b.state.pos[1]) + b.shape.radius - 0.02 for b in O.bodies
                           if isinstance(b.shape, Sphere)])
    return {"begin": begin, "end": energy(), "out": out}


def periodic():
    """A wet pair, free, and across a face of a periodic cell, with grains that have left the cell."""
    first, second = ((0.0, 0.0, 0.0), 0.003, (0.4, 0.05, 0.0), (0, 5, 30)), ((0.0056, 0.0005, 0.0), 0.0025, (-0.3, 0, 0.02))
    law = scene_with([moving(*first), moving(*second)], WET, capillaryModel="willett")
    free = follow(3000, [0, 1])
    found = {"free": free, "bridges": [law.bridgeCount()]}
    for images in ((0, 0), (2, -3)):
        law = scene_with([moving((0.049 + 0.05 * images[0], 0.02, 0.02), *first[1:]),
                          moving((0.0046 + 0.05 * images[1], 0.0205, 0.02), *second[1:])], WET, capillaryModel="willett")
        O.periodic, O.cell.hSize = True, Matrix3(0.05, 0, 0, 0, 0.05, 0, 0, 0, 0.05)
        found[f"periodic {images}"] = follow(3000, [0, 1])
        found["bridges"].append(law.bridgeCount())
    return found


def bridge():
    """Approach to a gap, contact, and slow retreat beyond rupture, for a pair and for walls."""
    found = {}
    for name in ("pair", "wall", "box", "facet", "cylinder"):
        radius, partner = 0.0025, {
            "pair": lambda: moving((0, 0, -0.002), 0.002, fixed=True), "wall": lambda: utils.wall(0, 2),
            "box": lambda: utils.box((0, 0, -0.01), (1, 1, 0.01), fixed=True),
            "facet": lambda: utils.facet([(-1, -1, 0), (1, -1, 0), (0, 1, 0)]), "cylinder": Body}[name]()
        if name == "cylinder":
            partner.shape, partner.state.blockedDOFs = CylinderWall(radius=0.02, axis=(0, 1, 0)), "xyzXYZ"
            partner.state.pos = (0, 0, 0.02)
        law = scene_with([partner, moving((0, 0, radius + 1e-4), radius)], WET, capillaryModel="exact")
        grain, rows = O.bodies[1], []
        # A grain that is held on all axes would count as fixed, and two fixed bodies have no force.
        grain.state.blockedDOFs = "yzXYZ"
        gaps = [1e-4, 1e-6, -1e-6, 0.0] + [4e-5 * k for k in range(1, 40)]
        for gap in gaps:
            grain.state.pos, grain.state.vel = Vector3(0, 0, radius + gap), Vector3(0, 0, 0)
            O.step()
            i = next((i for i in O.interactions if i.isReal), None)
            rows.append([gap, O.forces.f(1)[2], law.bridgeCount(), i.phys.ruptureDistance if i else 0.0,
                         i.phys.capillaryForce if i else 0.0])
        found[name] = rows
    return found


def _contact_state():
    exact = lambda v: [float(x).hex() for x in v] if hasattr(v, "__len__") else float(v).hex()
    return {f"{i.id1}-{i.id2}": {name: exact(value) for name, value in i.phys.dict().items()} for i in O.interactions if i.isReal}


def many():
    """Equal wet pairs that all touch in the first step: the forces on their first grains."""
    bodies = [moving((0.02 * k, 0.02 * j, 0.00495 * i), 0.0025) for k in range(12) for j in range(12) for i in range(2)]
    scene_with(bodies, WET, capillaryModel="exact")
    O.step()
    return [O.forces.f(2 * k)[2] for k in range(144)]


def save_load(pair=None, **law_attributes):
    """State in the middle of sliding, wet contacts after saving and loading, and after some steps more, for each format."""
    found = {}
    for ending in ("xml", "xml.gz", "yade.gz", "bin"):
        grains = [moving((0.0045 * k, 0.0003 * k * k, 0.0024), 0.0025, (0.2 - 0.1 * k, 0.05, -0.1), (3, 4 * k, 5)) for k in range(4)]
        law = scene_with([utils.wall(0, 2), *grains], {**WET, "interfaceShearStrength": math.inf, **(pair or {})}, (0, 0, -9.81),
                         capillaryModel="exact", **law_attributes)
        O.run(250, True)
        name = f"saved.{ending}"
        O.save(name)
        before, lost = _contact_state(), law.dissipatedEnergy()
        straight = follow(200, [1, 2, 3, 4])[-1]
        O.load(name)
        law = O.engines[2].lawDispatcher.functors[0]
        after, lost_loaded = _contact_state(), law.dissipatedEnergy()
        resumed = follow(200, [1, 2, 3, 4])[-1]
        found[ending] = {"before": before, "after": after, "lost": [lost, lost_loaded], "straight": straight, "resumed": resumed,
                         "model": [law.capillaryModel, law.bridgeCount()]}
        os.remove(name)
    return found


def save_load_partial_slip():
    return save_load(ROLLING, presliding="partial_slip", rollingResistance="elastic_plastic")


def other_formats():
    """What loading says of a scene in which one class is said to be of another format: of each class that the file names."""
    O.reset()
    bodies = [moving((0, 0, 0), 0.0025), Body(shape=CylinderWall(radius=0.1))]
    place(bodies, DENSITY)
    surface = FacetSurface()
    O.engines = [surface, SphereContactLoop([Ig2_FacetSurface_Sphere_ScGeom(surface=surface)], [], []), CapillaryLiquid(), EnergyAccount(),
                 IntegrationMonitor(), WallMotion(), LcpImpact(walls=[dict(bodies=[1], stiffness=1e7)])]
    O.save("format.xml", quiet=True)
    text = open("format.xml", encoding="utf-8").read()
    said = {}
    for name in ("FacetSurface", "Ig2_FacetSurface_Sphere_ScGeom", "SphereContactLoop", "CapillaryLiquid", "EnergyAccount",
                 "IntegrationMonitor", "WallMotion", "CylinderWall"):
        changed, found = re.subn(rf'(class_name="yade::{name}" tracking_level="\d" version=)"\d+"', r'\1"99"', text)
        open("format.xml", "w", encoding="utf-8").write(changed)
        said[name] = [found, refusal(lambda: O.load("format.xml", quiet=True))]
    return said


def energy():
    """Grain that slides and rolls on a plane: kinetic energy at begin and end, and what the law says was lost."""
    law = scene_with([utils.wall(0, 2), moving((0, 0, 0.0025 - 2e-5), 0.0025, (0.5, 0, 0))])
    grain = O.bodies[1].state
    # Weight of the equilibrium overlap, so that the normal motion neither stores nor frees energy.
    O.step()
    O.engines[-1].gravity = Vector3(0, 0, -O.forces.f(1)[2] / grain.mass)
    grain.vel[2] = 0
    total = lambda: 0.5 * grain.mass * (grain.vel[0] ** 2 + grain.vel[1] ** 2) + 0.5 * grain.inertia[1] * grain.angVel[1] ** 2
    begin, lost = total(), law.dissipatedEnergy()
    O.run(4000, True)
    return {"begin": begin, "end": total(), "lost": law.dissipatedEnergy() - lost, "spin": grain.angVel[1] * 0.0025, "speed": grain.vel[0]}


def hooke():
    law = scene_with([utils.wall(0, 2), moving((0, 0, 0.00251), 0.0025, (0, 0, -0.5))], normalLaw="hooke", characteristicVelocity=0.5)
    rows = follow(1500, [1])
    return {"rows": rows, "law": law.normalLaw}


def dumps():
    """Two frames and three lines of a small periodic scene with walls and a held grain."""
    low = utils.box((0, 0.01, -0.001), (1, 1, 0.001), fixed=True)
    held = moving((0.0, 0.013, 0.0024), 0.0025, fixed=True)
    grains = [moving((0.0049, 0.013, 0.0024), 0.0025, (0.1, 0.02, 0)), moving((0.02, 0.001, 0.004), 0.0025, (0, -1.5, 0)),
              moving((0.0201, 0.0363, 0.0041), 0.0025, (0, 0, 0))]
    scene_with([low, held, *grains], gravity=(0, 0, -9.81))
    O.periodic, O.cell.hSize = True, Matrix3(0.1, 0, 0, 0, 0.02, 0, 0, 0, 0.1)
    walls, glued = {"base": 0, "left": []}, {"left": [1]}
    builtins.dump = dembark.DumpWriter(walls, ((-0.05, 0.05), (0, 0.02), (-0.01, 0.05)), "ff pp ff", glued=glued)
    builtins.history = dembark.HistoryWriter(walls, glued=glued)
    builtins.seen = []

    def look():
        seen.append([[list(O.forces.f(i)), list(O.bodies[i].state.vel), list(O.bodies[i].state.pos), O.bodies[i].state.mass]
                     for i in range(5)])

    builtins.look = look
    O.engines = [*O.engines[:3], PyRunner(iterPeriod=50, firstIterRun=50, command="dump.write(); history.write(); look()"), *O.engines[3:]]
    O.run(101, True)
    read = lambda name: open(name, encoding="utf-8").read()
    return {"grains": read("grains.dump"), "contacts": read("contacts.dump"), "time": read("time.csv"), "seen": seen}


def messages():
    """What wrong words of the law and its functors say."""
    return [refusal(wrong) for wrong in (
        lambda: Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(normalLaw="herz"),
        lambda: Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding="bent"),
        lambda: Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(frictionLimit="viscous"),
        lambda: Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(capillaryModel="wet"),
        lambda: CylinderWall(radius=-1.0), lambda: CylinderWall(radius=1, axis=(0, 0, 0)))]


def said_at_contact():
    """What is said when the first two bodies come into contact; `nothing` for nothing."""
    return refusal(lambda: utils.createInteraction(0, 1), "nothing")


def bad_values():
    """What wrong numbers say when a contact is made; `nothing` for none."""
    ok = {**PAIR, **WET}
    found = {}
    cases = [(name, {name: value}) for name, values in {
        "restitution": (0.0, 1.5, math.nan), "staticFriction": (-0.1, math.inf, math.nan), "kineticFriction": (0.9, -0.1, math.nan),
        "criticalSlipDistance": (-1e-6, math.nan), "interfaceShearStrength": (0.0, -1.0, math.nan), "healingTime": (-1.0, math.nan),
        "bridgeVolume": (-1e-10, math.inf, math.nan), "surfaceTension": (-0.07, math.inf, math.nan), "contactAngle": (math.nan,)}.items()
             for value in values]
    cases += [(name, {name: None}) for name in ("restitution", "staticFriction", "kineticFriction", "criticalSlipDistance", "contactAngle")]
    for name, wrong in cases:
        words = {key: value for key, value in {**ok, **wrong}.items() if value is not None}
        scene_with([moving((0, 0, 0), 0.0025), moving((0, 0, 0.00499), 0.0025)], capillaryModel="exact")
        O.engines[2].physDispatcher.functors = [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**words)]
        found[f"{name} {wrong[name]}"] = said_at_contact()
    for name, value in (("young", -1.0), ("young", math.inf), ("young", math.nan), ("poisson", 0.7), ("poisson", math.nan)):
        scene_with([moving((0, 0, 0), 0.0025), moving((0, 0, 0.00499), 0.0025)])
        setattr(O.materials[0], name, value)
        found[f"{name} {value}"] = said_at_contact()
    return found


def hostile():
    """Scenes that must not go wrong silently, each in a process of its own: its exit code and last line."""
    def ends(*bodies):
        scene_with(bodies)
        try:
            advance(10)
        except RuntimeError as error:
            print(error, file=sys.stderr)
            os._exit(sys.dembark_failure[1])

    def coincident():
        ends(moving((0, 0, 0), 0.0025), moving((0, 0, 0), 0.0025))

    def no_number():
        ends(moving((0, 0, 0), 0.0025), moving((0, 0, 0.00499), 0.0025, (math.nan, 0, 0)))

    def erased():
        law = scene_with([moving((0, 0, 0.00495 * k), 0.0025) for k in range(3)], WET, capillaryModel="exact")
        O.run(10, True)
        assert law.bridgeCount() == 2
        O.bodies.erase(1)
        O.run(10, True)
        assert law.bridgeCount() == 0 and O.bodies[2].state.pos.norm() < 1

    def on_top_of_a_bridge():
        law = scene_with([moving((0, 0, 0.0), 0.0025), moving((0, 0, 0.00499), 0.0025, (0, 0, 0.2))], WET, capillaryModel="exact")
        O.run(500, True)
        assert law.bridgeCount() == 1 and law.contactCount() == 0
        new = moving((0.004, 0, 0.0025), 0.0025, material=O.materials[0])
        O.bodies.append(new)
        O.run(50, True)
        assert law.bridgeCount() == 3

    def crowd():
        around = [moving((0.0269 * math.cos(0.19 * k), 0.0269 * math.sin(0.19 * k), 0.0), 0.0025) for k in range(33)]
        law = scene_with([moving((0, 0, 0), 0.0245), *around], WET, capillaryModel="exact")
        O.run(2, True)
        assert law.contactCount() >= 33 and O.forces.f(0).norm() < math.inf

    found = {}
    for case in (coincident, no_number, erased, on_top_of_a_bridge, crowd):
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            sys.stderr = open(f"{case.__name__}.txt", "w", encoding="utf-8", buffering=1)
            os.dup2(sys.stderr.fileno(), 2)
            try:
                case()
                os._exit(0)
            except BaseException as error:  # noqa: BLE001 (whatever it is, the parent is told)
                print(f"{type(error).__name__}: {error}", file=sys.stderr)
                os._exit(3)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        with open(f"{case.__name__}.txt", encoding="utf-8") as file:
            found[case.__name__] = [code, file.read().strip()]
    return found


write_results(globals())
