"""Runs inside YADE: `PYTHONPATH=. yade -n -x energy_scenes.py out.json scene...`. Each scene is a function that returns plain data."""

import os
import random
import re

from columns import dilute_column
from scene_results import advance, place, refusal, write_results
from yade import dembark, utils

PAIR = dict(restitution=0.6, staticFriction=0.5, kineticFriction=0.3, criticalSlipDistance=1e-5)
WET = dict(bridgeVolume=2e-11, surfaceTension=0.072, contactAngle=0.35, liquidViscosity=5e-3, minimumGap=1e-5)
ROLLING = dict(rollingFriction=0.1, rollingDampingRatio=0.3)
DENSITY, R = 2500.0, 0.0025


def scene_with(bodies, pair=None, law=None, gravity=(0, 0, 0), damping=0.0, step=2e-6, before=(), between=(), **newton):
    """A new scene of `bodies` with an account, engines before it and between it and the integrator; returns the account."""
    O.reset()
    place(bodies, DENSITY)
    account, surface = EnergyAccount(), FacetSurface()
    O.dt = step
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Box_Aabb(), Bo1_Facet_Aabb(), Bo1_CylinderWall_Aabb()],
                              verletDist=0.2 * R, allowBiggerThanPeriod=True),
        surface,
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface),
             Ig2_CylinderWall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**PAIR, **(pair or {})})],
            [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**(law or {}))]),
        *before, account, *between,
        NewtonIntegrator(damping=damping, gravity=gravity, **newton),
    ]
    return account


def grain(position, radius=R, velocity=(0, 0, 0), spin=(0, 0, 0), **options):
    body = utils.sphere(position, radius, **options)
    body.state.vel, body.state.angVel = Vector3(*velocity), Vector3(*spin)
    return body


def _motion(steps, ids):
    """Before each step and after the last: positions, velocities, angular velocities; and xi of the only contact in each step."""
    state = lambda: [[*O.bodies[i].state.pos, *O.bodies[i].state.vel, *O.bodies[i].state.angVel] for i in ids]
    rows, displacement = [state()], []
    for _ in range(steps):
        O.step()
        rows.append(state())
        contact = next((i for i in O.interactions if i.isReal), None)
        displacement.append(list(contact.phys.elasticDisplacement) if contact else [0, 0, 0])
    return {"rows": rows, "displacement": displacement}


def read_by(law):
    """Numbers of a liquid, or of rolling, that the law reads."""
    if "capillaryModel" in law:
        return WET
    return {"elastic_plastic": ROLLING, "constant_torque": dict(rollingFriction=0.1)}.get(law.get("rollingResistance"), {})


def impacts():
    """Oblique impacts, of two grains and of a grain on a wall that moves, listed first or last; with all positions and velocities."""
    found = {}
    wet = dict(capillaryModel="willett")
    rolling = [dict(rollingResistance=name) for name in ("constant_torque", "elastic_plastic")]
    for law in ({}, dict(normalLaw="hooke", characteristicVelocity=0.5), dict(limitForce=True), wet, *rolling):
        name = "+".join(["grains", *map(str, law.values())])
        grains = [grain((0, 0, 0), 0.003, (0.4, 0.9, 0), (0, 5, 30)), grain((0.00551, 0.0005, 0), R, (-0.3, 0, 0.02))]
        account = scene_with(grains, read_by(law), law)
        found[name] = _motion(600, (0, 1)) | {"energies": account.energies(), "law": law}
    for order, law in ((0, {}), (1, {}), (0, wet), (1, rolling[1])):
        wall = utils.wall(0, 2)
        wall.state.vel = Vector3(0.1, 0, 0.2)
        bodies = [wall, grain((0.001, 0.0005, 0.00251), R, (0.9, 0.1, -0.5), (20, -30, 10))]
        account = scene_with(bodies[::-1] if order else bodies, read_by(law), law)
        found["+".join([f"wall{order}", *law.values()])] = _motion(600, (1 - order, order)) | {"energies": account.energies(), "law": law}
    return found


def elastic():
    """Head-on impact without damping and friction: the largest energy in the spring, and the energies at the end, for two time steps."""
    found = []
    for step in (4e-6, 2e-6):
        account = scene_with([grain((0, 0, 0)), grain((0.00501, 0, 0), R, (-0.5, 0, 0))],
                             dict(restitution=1.0, staticFriction=0, kineticFriction=0), step=step)
        highest, errors = 0.0, []
        for _ in range(round(1.6e-3 / step)):
            O.step()
            highest = max(highest, account["normal_stored"])
            errors.append(account["step_error"])
        found.append({"highest": highest, "error": max(map(abs, errors)), "end": account.energies()})
    return found


def column(wet=False, damping=0.0, step=2e-5, gate=None, count=12):
    """Grains of three sizes in a column on a floor of triangles, with a gate of two; returns the account and the ids of the gate."""
    chance = random.Random(1)
    width, cell = 0.026, 0.0052
    corner = lambda i, j: (0.02 * i - 0.01, 0.02 * j - 0.01, 0.0)
    squares = [(corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)) for i in range(7) for j in range(3)]
    floor = [utils.facet(three) for a, b, c, d in squares for three in ((a, b, c), (a, c, d))]
    walls = [*floor, utils.wall(0, 0), utils.wall(0, 1), utils.wall(width, 1)]
    low, right, top, left = [(width, y, z) for y, z in ((-0.01, -0.01), (0.04, -0.01), (0.04, 0.1), (-0.01, 0.1))]
    gates = [utils.facet([low, right, top]), utils.facet([low, top, left])] if gate is None else [gate]
    grains = [grain([cell * (n + 0.5) + chance.uniform(-1e-4, 1e-4) for n in (i, j, k)], R * chance.choice((0.85, 0.95, 1.0)))
              for k in range(count) for j in range(5) for i in range(5)]
    liquid = (WET, dict(capillaryModel="willett")) if wet else (None, None)
    account = scene_with([*walls, *gates, *grains], *liquid, (0, 0, -9.81), damping, step)
    return account, range(len(walls), len(walls) + len(gates))


def collapse(settle=1500, steps=3000, samples=15, **options):
    """A column of 300 grains is set down, its gate is lifted and drags it along, and it collapses. Energies on the way."""
    account, gates = column(**options)
    rows = []
    for part in range(samples):
        if part == samples // 3:
            for gate in gates:
                O.bodies[gate].state.vel = Vector3(0, 0.05, 0.8)
        advance((settle if part < samples // 3 else steps // 2) // (samples // 3))
        rows.append(account.energies())
    return {"rows": rows, "grains": sum(isinstance(b.shape, Sphere) for b in O.bodies), "step": account.step, "iter": O.iter,
            "handed": O.engines[2].handedOver, "law": O.engines[3].lawDispatcher.functors[0].dissipatedEnergy()}


def dry():
    return collapse()


def wet():
    return collapse(wet=True)


def damped():
    return collapse(settle=1000, steps=2000, wet=True, damping=0.2)


def box_gate():
    """The gate is a Box that is pushed into the column."""
    account, gates = column(gate=utils.box((0.036, 0.013, 0.03), (0.01, 0.03, 0.06), fixed=True), count=4)
    O.bodies[gates[0]].state.vel = Vector3(-0.1, 0, 0.1)
    advance(1200)
    return account.energies()


def drum(**law):
    """Grains in a drum that turns and drifts along its axis, one of them carried along, one lowered at a fixed speed."""
    shape = Body()
    shape.shape, shape.state.blockedDOFs = CylinderWall(radius=0.02, axis=(0, 1, 0)), "xyzXYZ"
    shape.state.vel, shape.state.angVel = Vector3(0, 0.02, 0), Vector3(0, 12, 0)
    grains = [grain((x, y, z), r) for x, y, z, r in dilute_column((4, 3, 4), 0.0055, (-0.011, -0.008, -0.011), 40, 0.005, 0.1, 3, 0.0001)]
    held, guided = grain((0, 0.0, -0.0174), R, (0.05, 0, 0), fixed=True), grain((0.0005, 0, 0.0165), R, (0, 0, -0.2))
    guided.state.blockedDOFs = "zX"
    account = scene_with([shape, held, guided, *grains], read_by(law), law, gravity=(0, 0, -9.81), step=1e-5)
    advance(6000)
    return account.energies()


def rolling_drum():
    return drum(rollingResistance="elastic_plastic")


def flying(count, spacing, speed):
    """Grains on a cube of `count` by `count` by `count` places, `speed` at most along each axis."""
    chance = random.Random(5)
    return [grain([spacing * n + 0.003 for n in (i, j, k)], R, [chance.uniform(-speed, speed) for _ in range(3)])
            for i in range(count) for j in range(count) for k in range(count)]


def periodic():
    """Grains that fly about in a periodic cell."""
    account = scene_with(flying(4, 0.006, 0.5), WET, dict(capillaryModel="willett"), step=1e-5)
    O.periodic, O.cell.hSize = True, Matrix3(0.024, 0, 0, 0, 0.024, 0, 0, 0, 0.024)
    advance(2000)
    return account.energies()


def carried():
    """Bridges of carried liquid form and break between the forces and the account."""
    words = {key: value for key, value in WET.items() if key != "bridgeVolume"}
    liquid = CapillaryLiquid(content=0.01)
    account = scene_with(flying(3, 0.0052, 1.0), words, dict(capillaryModel="willett", carriedLiquid=True), step=1e-5, before=[liquid])
    counts = []
    for _ in range(20):
        advance(50)
        counts.append(liquid.bridgeCount())
    return {"energies": account.energies(), "bridges": counts}


def two_steps():
    """The step's error in the first 0.03 s of a falling column, for three time steps."""
    found = []
    for step in (4e-5, 2e-5, 1e-5):
        account, _ = column(step=step, count=3)
        errors = []
        for _ in range(20):
            advance(round(1.5e-3 / step))
            errors.append(account["step_error"])
        found.append(errors)
    return found


def briefly():
    """Energies of a column after 400 steps: on one and on two threads."""
    account, gates = column(wet=True, count=4)
    for gate in gates:
        O.bodies[gate].state.vel = Vector3(0.3, 0, 0.5)
    advance(400)
    return account.energies()


def save_load():
    """Energies of a run that goes on, and of one that was saved and loaded, at the saving and 300 steps later."""
    found = {}
    for ending in ("xml", "yade.gz", "bin"):
        account, _ = column(wet=True, count=3)
        advance(500)
        name = f"energy.{ending}"
        O.save(name)
        before = account.energies()
        advance(300)
        straight = account.energies()
        O.load(name)
        after = dembark.energies()
        advance(300)
        found[ending] = {"before": before, "after": after, "straight": straight, "resumed": dembark.energies()}
        os.remove(name)
    return found


def cut_ledger():
    """What loading says of an account whose saved ledger has a number less."""
    column(count=1)
    advance(20)
    O.save("cut.xml", quiet=True)
    text = open("cut.xml", encoding="utf-8").read()
    saved = re.search(r"<saved>\s*<count>(\d+)</count>.*?</saved>", text, re.DOTALL)
    shorter = re.sub(r"<count>\d+", f"<count>{int(saved[1]) - 1}", saved[0])
    shorter = re.sub(r"\s*<item>[^<]*</item>\s*</saved>", "</saved>", shorter)
    open("cut.xml", "w", encoding="utf-8").write(text.replace(saved[0], shorter))
    return refusal(lambda: O.load("cut.xml", quiet=True))


def come_and_go():
    """Bodies are inserted in contact, erased in contact, held and let go; velocities are set; a force is added; the time step changes."""
    account = scene_with([utils.wall(0, 2), grain((0, 0, 0.00247)), grain((0.00497, 0, 0.00247), R, (0.01, 0, 0.02))],
                         gravity=(0, 0, -9.81))
    rows = []

    def after(act):
        act()
        advance(200)
        rows.append(account.energies())

    def fly():
        O.bodies[1].state.vel = Vector3(0.1, 0.2, 0.3)

    def hold(body, how):
        O.bodies[body].state.blockedDOFs = how

    after(lambda: None)
    after(lambda: O.bodies.append(grain((0.0025, 0.003, 0.00553), R, (0, -0.01, -0.02), material=O.materials[0])))
    after(lambda: O.bodies.erase(2))
    after(fly)
    after(lambda: hold(1, "xyzXYZ"))
    after(lambda: hold(1, ""))
    after(lambda: O.forces.setPermF(3, Vector3(0.001, 0, 0)))
    after(lambda: setattr(O, "dt", 1e-6))
    return rows


def kinetic():
    """J, of all bodies and clumps that forces move, from their velocities."""
    total = 0.0
    for body in O.bodies:
        state = body.state
        if body.isClumpMember or not body.dynamic:
            continue
        spin = state.ori.conjugate() * state.angVel
        total += 0.5 * state.mass * state.vel.squaredNorm() + 0.5 * sum(state.inertia[k] * spin[k] ** 2 for k in range(3))
    return total


def thrown_clump(step, samples=10, duration=0.02, damping=0.0, **newton):
    """A clump of unequal moments is thrown, spinning, at a wall, a grain and a clump that moves as it is made to; energies on the way, and
    the kinetic one from the velocities."""
    thrown = [grain((x, y, 0.009 + z), r) for x, y, z, r in ((0, 0, 0, 0.003), (0.0054, 0, 0, R), (0, 0, 0.005, 0.002))]
    held = [grain((0.009, 0, 0.003), 0.003), grain((0.009, 0.006, 0.003), 0.003)]
    loose = grain((-0.0056, 0.001, 0.0027), R)
    account = scene_with([utils.wall(0, 2), loose, *thrown, *held], gravity=(0, 0, -9.81), damping=damping, step=step, **newton)
    clump, guided = O.bodies[O.bodies.clump([2, 3, 4])].state, O.bodies[O.bodies.clump([5, 6])].state
    clump.vel, clump.angVel = Vector3(0.1, 0.02, -0.4), Vector3(30, -60, 50)
    spin = clump.ori.conjugate() * clump.angVel
    clump.angMom = clump.ori * Vector3(*(clump.inertia[k] * spin[k] for k in range(3)))
    guided.blockedDOFs, guided.vel, guided.angVel = "xyzXYZ", Vector3(-0.1, 0, 0), Vector3(0, 0, 20)
    rows = []
    for _ in range(samples):
        advance(round(duration / step / samples))
        rows.append({"energies": account.energies(), "kinetic": kinetic()})
    return rows


def clumps():
    """Of unequal moments, for three algorithms and two steps, and with moments as those of a sphere; damped; saved and loaded."""
    found = {name: [thrown_clump(step, rotAlgorithm=name) for step in (4e-6, 2e-6)]
             for name in ("delValle2023", "Omelyan1998", "Fincham1992")}
    found["as spheres"] = thrown_clump(4e-6, exactAsphericalRot=False)
    found["damped"] = thrown_clump(4e-6, damping=0.1)
    O.save("clump.bin", quiet=True)
    advance(200)
    found["straight"] = dembark.energies()
    O.load("clump.bin", quiet=True)
    advance(200)
    found["resumed"] = dembark.energies()
    os.remove("clump.bin")
    return found


def in_a_step():
    """What an engine reads before, between and after account and integrator, and how often it may ask."""
    import builtins

    builtins.seen = []
    ask = lambda where: PyRunner(
        iterPeriod=1, command=f"seen.append(('{where}', O.iter, account_['kinetic'], account_['balance'], account_.step))")
    account = scene_with([utils.wall(0, 2), grain((0, 0, 0.0024), R, (0, 0, -0.1))], gravity=(0, 0, -9.81), before=[ask("before")],
                         between=[ask("between")])
    builtins.account_ = account
    O.engines = [*O.engines, ask("after")]
    advance(50)
    return {"seen": builtins.seen, "end": account.energies(), "step": account.step}


def set_in_a_step():
    """An engine behind the account sets a velocity and adds a force: neither is lost."""
    kick = PyRunner(iterPeriod=7, command="O.forces.addF(0, (0, 0, 1e-3))")
    account = scene_with([grain((0, 0, 0), R, (0, 0, 0.1)), grain((1, 0, 0))], between=[kick])
    O.engines = [*O.engines, PyRunner(iterPeriod=10, command="O.bodies[1].state.vel += Vector3(0.01, 0, 0)")]
    advance(92)
    return account.energies()


def reset():
    account = scene_with([utils.wall(0, 2), grain((0, 0, 0.0024), R, (0.2, 0, -0.1))], gravity=(0, 0, -9.81))
    advance(300)
    before = account.energies()
    account.reset()
    zero = account.energies()
    advance(300)
    return [before, zero, account.energies()]


def table():
    """energies.csv, and a mapping's habits."""
    account = scene_with([utils.wall(0, 2), grain((0, 0, 0.0024), R, (0.2, 0, -0.1))], gravity=(0, 0, -9.81))
    import builtins

    builtins.writer = dembark.EnergyWriter()
    O.engines = [*O.engines, PyRunner(iterPeriod=10, command="writer.write()")]
    advance(31)
    return {"text": open("energies.csv", encoding="utf-8").read(), "keys": account.keys(),
            "items": [list(item) for item in account.items()],
            "energies": account.energies(), "found": dembark.energies()}


def messages():
    """What the account says to scenes whose energies it cannot tally; `nothing` for none."""
    found = {}

    def heard(name, change, **options):
        account = scene_with([grain((0, 0, 0)), grain((0.02, 0, 0))], **options)
        try:
            change(account)
            O.step()
            O.step()
            found[name] = "nothing"
        except (RuntimeError, KeyError) as error:
            found[name] = str(error).strip("'\"")

    def engines(change):
        O.engines = change(list(O.engines))

    def scaled(account):
        O.engines = [*O.engines, GlobalStiffnessTimeStepper(active=False)]
        O.engines[-2].densityScaling = True

    def missed(account):
        O.step()
        account.dead = True
        O.step()
        account.dead = False

    heard("all right", lambda account: None)
    heard("no integrator", lambda account: engines(lambda e: [account]))
    heard("two integrators", lambda account: engines(lambda e: [*e, NewtonIntegrator()]))
    heard("before the loop", lambda account: engines(lambda e: [e[0], e[4], *e[1:4], e[5]]))
    heard("after the integrator", lambda account: engines(lambda e: [*e[:4], e[5], e[4]]))
    heard("time step", lambda account: engines(lambda e: [*e[:5], GlobalStiffnessTimeStepper(), e[5]]))
    heard("density scaling", scaled)
    heard("clump", lambda account: setattr(O.bodies[O.bodies.clump([0, 1])].state, "blockedDOFs", "xY"))
    heard("cell", lambda account: (setattr(O, "periodic", True), setattr(O.cell, "velGrad", Matrix3(0, 1, 0, 0, 0, 0, 0, 0, 0))))
    heard("missed", missed)
    heard("unknown", lambda account: account["heat"])
    return found


def without_account():
    O.reset()
    dembark.energies()


def other_law():
    O.reset()
    O.bodies.append([utils.sphere((0, 0, 0), 1), utils.sphere((0, 0, 1.99), 1)])
    O.engines = [
        ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()]),
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_FrictPhys()], [Law2_ScGeom_FrictPhys_CundallStrack()]),
        EnergyAccount(), NewtonIntegrator()]
    advance(3)


write_results(globals())
