"""Runs inside YADE: `PYTHONPATH=. yade -n -x fluid_scenes.py out.json scene...`. Bodies in the fluid of SphFluid."""

from scene_results import advance, refusal, write_results
from yade import dembark, utils

DX, SOUND, G = 0.02, 25.0, 9.81
STEP = 3e-4


def block(centre, mass, inertia, velocity=(0, 0, 0), spin=(0, 0, 0), plane=False, free=True):
    """A clump of two spheres with given mass and inertia; its id."""
    x, y, z = centre
    spheres = [utils.sphere((x + s, y, z), 0.01) for s in (-0.01, 0.01)]
    number, _ = O.bodies.appendClumped(spheres)
    body = O.bodies[number]
    body.state.pos, body.state.ori = Vector3(*centre), Quaternion.Identity
    body.state.mass, body.state.inertia = mass, Vector3(*inertia)
    body.aspherical = False
    body.state.vel, body.state.angVel = Vector3(*velocity), Vector3(*spin)
    if plane:
        body.state.blockedDOFs = "zXY"
    if not free:
        body.state.blockedDOFs = "xyzXYZ"
    return number


def begin(gravity, step=STEP, **options):
    O.reset()
    O.dt = step
    O.materials.append(FrictMat(density=1000))
    fluid = SphFluid(spacing=DX, soundSpeed=SOUND, **options)
    O.engines = [ForceResetter(), fluid, NewtonIntegrator(damping=0, gravity=gravity)]
    return fluid


def pool(gravity, low, high, top, **options):
    """Still water in a tank whose last axis is up."""
    fluid = begin(gravity, dimension=len(low), **options)
    points = dembark.lattice(low, high, DX)
    up = len(low) - 1
    fluid.addParticles(points, pressures=[1000.0 * G * (high[up] - p[up]) for p in points])
    fluid.addWall(dembark.tank_walls(low, [*high[:up], top], DX))
    return fluid


def tell(fluid, body):
    state = O.bodies[body].state
    return {"place": list(state.pos), "turn": [state.ori[3], state.ori[0], state.ori[1], state.ori[2]],
            "force": list(fluid.force(body)), "torque": list(fluid.torque(body)), "energies": dict(fluid.energies()),
            "fluid": [list(p) for p in fluid.positions()], "pressures": list(fluid.pressures()), "time": fluid.fluidTime}


def falling_plane():
    """A turning block falls into water, in the plane."""
    fluid = pool((0, -G, 0), (0, 0), (0.4, 0.12), 0.4, delta=0.1, alpha=0.05, noSlip=True, moment="particles")
    low = (0.14, 0.22)
    body = block((low[0] + 0.05, low[1] + 0.05, 0), 8.0, (0.0133, 0.0133, 0.0133), (0.2, -1.0 + 0.5 * STEP * G, 0), (0, 0, 2.0), plane=True)
    fluid.addBody(body, dembark.lattice(low, (low[0] + 0.1, low[1] + 0.1), DX))
    # The engine takes its first step with the second one of the scene.
    advance(801)
    return tell(fluid, body)


def falling_space():
    fluid = pool((0, 0, -G), (0, 0, 0), (0.2, 0.2, 0.1), 0.3, xsph=0.5, shepard=20)
    body = block((0.09, 0.11, 0.23), 0.4096, (4.4e-4, 4.4e-4, 4.4e-4), (0, 0.1, -1.0 + 0.5 * STEP * G), (1.0, 2.0, 3.0))
    fluid.addBody(body, dembark.lattice((0.05, 0.07, 0.19), (0.13, 0.15, 0.27), DX))
    advance(401)
    return tell(fluid, body)


def moved():
    """A wall that WallMotion moves."""
    fluid = pool((0, -G, 0), (0, 0), (0.4, 0.12), 0.3)
    body = block((0.2, 0.23, 0), 1.0, (1.0, 1.0, 1.0), plane=True, free=False)
    walls = WallMotion(ids=[body], motion="uniform velocity 0.1 -1 0")
    fluid.addBody(body, dembark.lattice((0.16, 0.18), (0.24, 0.28), DX))
    O.engines = [*O.engines[:-1], walls, O.engines[-1]]
    walls.start()
    advance(301)
    return tell(fluid, body)


def momentum():
    """A blob of fluid hits a free block without gravity: momentum of both, and impulses, with sub-steps and without."""
    found = {}
    for substeps in (1, 4):
        fluid = begin((0, 0, 0), step=STEP / substeps, substeps=substeps)
        points = dembark.lattice((0, 0, 0), (0.12, 0.12, 0.12), DX)
        fluid.addParticles(points, velocity=Vector3(2.0, 0.1, 0))
        body = block((0.19, 0.07, 0.06), 0.8, (1e-3, 1e-3, 1e-3))
        fluid.addBody(body, dembark.lattice((0.15, 0.03, 0.02), (0.23, 0.11, 0.1), DX))
        whole, rows = 120 * substeps, []
        for _ in range(whole):
            O.step()
            state, force = O.bodies[body].state, fluid.force(body)
            # At the time of the fluid: its last step ended `passed` steps ago, each of which gave the body its force over O.dt.
            passed = (O.iter - 1) % substeps + 1
            momentum = state.mass * state.vel + (0.5 * substeps - passed) * O.dt * force + fluid.momentum()
            rows.append([*momentum, state.mass * state.vel[0]])
        found[str(substeps)] = rows
    return found


def floats_on_substeps():
    """A floating block, with one and with ten steps of the scene in one of the fluid."""
    found = {}
    for substeps in (1, 10):
        fluid = pool((0, -G, 0), (0, 0), (0.4, 0.16), 0.4, substeps=substeps, alpha=0.1)
        O.dt = STEP / substeps
        low = (0.14, 0.16)
        body = block((low[0] + 0.06, low[1] + 0.06, 0), 7.2, (0.0173, 0.0173, 0.0173), plane=True)
        fluid.addBody(body, dembark.lattice(low, (low[0] + 0.12, low[1] + 0.12), DX))
        advance(500 * substeps + 1)
        found[str(substeps)] = [list(O.bodies[body].state.pos), fluid.steps]
    return found


def saved():
    """A run that is saved in the middle of a step of the fluid, and goes on, beside the one that was saved and loaded.

    By then the block is where fluid was at the beginning.
    """
    found = {}
    for ending in ("xml", "yade.gz", "bin"):
        fluid = pool((0, -G, 0), (0, 0), (0.4, 0.12), 0.4, substeps=3, xsph=0.5, shepard=7)
        O.dt = STEP / 3
        body = block((0.19, 0.2, 0), 8.0, (0.0133, 0.0133, 0.0133), (0.2, -3.0, 0), (0, 0, 2.0), plane=True)
        fluid.addBody(body, dembark.lattice((0.14, 0.15), (0.24, 0.25), DX))
        advance(200)
        O.save("fluid." + ending, quiet=True)
        advance(200)
        ends = [tell(fluid, body)]
        for _ in range(2):
            O.load("fluid." + ending, quiet=True)
            early = dembark.fluid_engine().fluidTime
            advance(200)
            ends.append(tell(dembark.fluid_engine(), body))
        found[ending] = [ends[0] == ends[1] == ends[2], early, ends[0]["time"]]
    return found


def written():
    """Frames and rows."""
    fluid = pool((0, -G, 0), (0, 0), (0.4, 0.12), 0.3)
    body = block((0.2, 0.2, 0), 8.0, (0.01, 0.01, 0.01), plane=True)
    fluid.addBody(body, dembark.lattice((0.16, 0.16), (0.24, 0.24), DX))
    box = ((0, 0.4), (0, 0.3), (-0.01, 0.01))
    writer = dembark.FluidWriter(box, {"block": body})
    globals()["writer"] = writer
    O.engines = [*O.engines[:-1], PyRunner(command="writer.frame(); writer.row()", iterPeriod=50, initRun=True), O.engines[-1]]
    advance(101)
    dembark.FluidWriter(box, dump="part.dump", history="", within=((0, 0.1), (0, 0.1), (-0.01, 0.01))).frame()
    texts = {}
    for kind, name in (("dump", "fluid.dump"), ("part", "part.dump"), ("rows", "fluid.csv")):
        with open(name, encoding="ascii") as file:
            texts[kind] = file.read()
    return {**texts, "mass": fluid.particleMass()}


def wrong_writers():
    """What a FluidWriter says of a box and of bodies that are none."""
    begin((0, 0, 0))
    box = ((0, 1), (0, 1), (0, 1))
    return [refusal(lambda words=words: dembark.FluidWriter(*words)) for words in (
        (((0, 0, 0), (1, 1, 1)),), (box, {}, "", "", ((0, 1), (0, 1))), (box, {"block": 99}), (box, {"block": -1}))]


def moved_out_of_the_water():
    fluid = pool((0, -G, 0), (0, 0), (0.2, 0.1), 0.2)
    body = block((0.1, 0.05, 0), 1.0, (1, 1, 1), plane=True)
    fluid.addBody(body, dembark.lattice((0.07, 0.02), (0.13, 0.08), DX))
    said = refusal(O.step)
    O.bodies[body].state.pos = Vector3(0.1, 0.3, 0)
    O.step()
    O.step()
    return [said, fluid.steps]


def messages():
    def go(steps):
        for _ in range(steps):
            O.step()

    def after(change, steps=1):
        fluid = pool((0, -G, 0), (0, 0), (0.2, 0.1), 0.2)
        change(fluid)
        return refusal(lambda: go(steps))

    def attribute(name, value):
        return after(lambda fluid: setattr(fluid, name, value))

    def with_newton(**words):
        return after(lambda fluid: setattr(O, "engines", [*O.engines[:-1], NewtonIntegrator(**words)]))

    def put_into_the_water(fluid):
        fluid.substeps = 10
        sunk = block((0.1, 0.05, 0), 1.0, (1, 1, 1), plane=True)
        fluid.addBody(sunk, dembark.lattice((0.07, 0.02), (0.13, 0.08), DX))

    def under_tension(fluid):
        fluid.tension = True
        fluid.addParticles([(1, 0, 0)], pressures=[-1000.0 * fluid.soundSpeed**2 / 7])

    said = {
        "spacing": attribute("spacing", 0.0), "sound": attribute("soundSpeed", -1.0), "kernel": attribute("kernel", "gauss"),
        "smoothing": attribute("smoothing", 0.5), "substeps": attribute("substeps", 0), "damping": with_newton(damping=0.2),
        "order": after(lambda fluid: setattr(O, "engines", [ForceResetter(), O.engines[-1], fluid])),
        "long": after(lambda fluid: setattr(O, "dt", 2e-3), 2),
        "overlap": after(put_into_the_water),
        "torn": after(under_tension),
        "long sub-steps": after(lambda fluid: (setattr(O, "dt", 2e-4), setattr(fluid, "substeps", 10)), 11),
    }
    fluid = pool((0, -G, 0), (0, 0), (0.2, 0.1), 0.2)
    body = block((0.1, 0.15, 0), 1.0, (1, 1, 1))
    said |= {
        "empty": refusal(lambda: fluid.addWall([])), "points": refusal(lambda: fluid.addWall([1.0, 2.0])),
        "out of plane": refusal(lambda: fluid.addWall([(0, 0, 1)])), "no body": refusal(lambda: fluid.addBody(99, [(0, 0, 0)])),
        "member": refusal(lambda: fluid.addBody(0, [(0, 0, 0)])), "body without particles": refusal(lambda: fluid.addBody(body, [])),
        "pressures": refusal(lambda: fluid.addParticles([(0, 0, 0)], pressures=[1.0, 2.0])),
        "stranger": refusal(lambda: fluid.force(body)),
    }
    fluid.addBody(body, [(0.1, 0.15, 0)])
    said["twice"] = refusal(lambda: fluid.addBody(body, [(0.1, 0.15, 0)]))
    advance(1)
    said["late"] = refusal(lambda: fluid.addWall([(0, 0, 0)]))
    for name, value in (("alpha", 0.5), ("soundSpeed", 2 * fluid.soundSpeed), ("kernel", "cubic_spline")):
        before = getattr(fluid, name)
        setattr(fluid, name, value)
        said[f"changed {name}"] = refusal(lambda: go(1))
        setattr(fluid, name, before)
    O.engines[-1].gravity = Vector3(0, -1, 0)
    said["gravity"] = refusal(lambda: go(1))
    empty = begin((0, 0, 0))
    said["no fluid"] = refusal(lambda: go(1))
    empty.addParticles([(0, 0, 0)], velocity=Vector3(60, 0, 0))
    said["blows up"] = refusal(lambda: go(2))
    return said


write_results(globals())
