"""Wrong input of LcpImpact is one line, said where it is made or in the first step."""

import json
import textwrap

import pytest

SCENE = """
import json
from yade import dembark, utils
said = []

def scene(apart=0.2, **more):
    global bark, floor, newton
    O.reset()
    bark = O.materials.append(FrictMat(young=1e9, poisson=0.3, density=700, label="bark"))
    O.bodies.append([utils.wall(0, 1, sense=1), *(dembark.log((x, 0.1, 0), 0.1, 30.0, **more) for x in (0, apart))])
    floor = dict(bodies=[0], stiffness=1e7, name="floor")
    newton = NewtonIntegrator(damping=0, gravity=(0, -9.81, 0))
    O.dt = 1e-5

def capsules(apart=0.2):
    scene(apart, length=1.0)

def step(engine=None, between=(), **words):
    impact = LcpImpact(**{**dict(stiffness=1e7, walls=[floor]), **words}) if engine is None else engine
    O.engines = [ForceResetter(), impact, *between, newton]
    O.step()

def refused(call):
    scene()
    try:
        exec(call, globals())
        said.append("went on")
    except RuntimeError as error:
        said.append(str(error))

"""


def run(yade, text):
    path = yade.folder / "log-input.py"
    path.write_text(SCENE + textwrap.dedent(text) + "\nprint('went on')\n")
    return yade(path)


def test_right_input_goes_on(yade):
    done = run(yade, """
        scene()
        step(stiffness={'bark': 1e7}, damping={bark: 3.0}, friction={('bark', bark): dict(static=0.4, kinetic=0.3, slip=1e-4)},
             walls=[dict(floor, friction=0.2)])
        step(walls=[LogWall(bodies=0, stiffness=1e7, friction=dict(static=0.4, strength=1e6, area=1e-4))], contactDamping=10)
        step(ids=[1], mask=1)
        """)
    assert "went on" in done.stdout, done.stderr


CASES = [
    ("step(LcpImpact())", ("LcpImpact.stiffness", "not set", "N/m")),
    ("step(stiffness=0)", ("LcpImpact.stiffness is 0", "> 0 N/m")),
    ("step(stiffness='high')", ("LcpImpact.stiffness is high", "number")),
    ("step(stiffness={'birch': 1e7})", ("no material birch", "id or the label")),
    ("step(stiffness={bark: -1})", ("LcpImpact.stiffness[0] is -1", "> 0 N/m")),
    ("O.materials.append(FrictMat(label='b'))\nO.bodies[1].mat = O.materials[1]\nstep(stiffness={'bark': 1e7})",
     ("stiffness has no value for material 1",)),
    ("step(damping=-1)", ("LcpImpact.damping is -1", ">= 0 N s/m")),
    ("step(contactDamping=-1)", ("LcpImpact: ", "contact damping must be >= 0 N s/m", "-1")),
    ("step(theta=0.4)", ("LcpImpact: theta must lie between 0.5 and 1", "0.4")),
    ("step(theta=1.1)", ("LcpImpact: theta must lie between 0.5 and 1", "1.1")),
    ("step(method='lemke')", ("LcpImpact: ", "lemke", "auto", "pgs")),
    ("step(sweeps=0)", ("LcpImpact: friction sweeps must be >= 1",)),
    ("step(tangentialRatio=0)", ("LcpImpact: ", "tangential stiffness ratio must be > 0")),
    ("step(friction=-0.1)", ("LcpImpact.friction", "static friction", ">= 0")),
    ("step(friction=dict(static=0.3, kinetic=0.5))", ("LcpImpact.friction", "kinetic friction must not exceed")),
    ("step(friction=dict(static=0.3, speed=0.5))", ("'speed' is unknown", "static, kinetic, slip")),
    ("step(friction=dict(kinetic=0.5))", ("has no 'static'",)),
    ("step(friction={(bark, bark): 0.3, ('bark', bark): 0.4})", ("LcpImpact.friction", "is given twice")),
    ("step(friction={bark: 0.3})", ("the key 0 is no pair",)),
    ("step(friction={(bark, bark): 0.3})", ("walls[0] 'floor' has no friction", "give the wall its own")),
    ("step(walls=floor)", ("LcpImpact.walls must be a list",)),
    ("step(walls=[3])", ("LcpImpact.walls must be a list",)),
    ("step(walls=[dict(floor, stiffness=-1)])", ("stiffness is -1", "> 0 N/m")),
    ("step(walls=[dict(bodies=[0])])", ("walls[0].stiffness is not set", "N/m")),
    ("step(walls=[dict(stiffness=1e7)])", ("walls[0].bodies is empty",)),
    ("step(walls=[dict(floor, bodies=[7])])", ("walls[0] 'floor'.bodies: body 7 does not exist",)),
    ("step(walls=[dict(floor, bodies=[1])])", ("body 1 can move freely", "xyzXYZ")),
    ("O.bodies.append(box((0, -1, 0), (1, 1, 1), fixed=True))\nstep(walls=[dict(floor, bodies=[3])])",
     ("body 3 is a Box", "Wall, a CylinderWall or a Facet")),
    ("O.bodies.append(utils.wall(1, 0))\nstep(walls=[dict(floor, bodies=[0, 3])])", ("several bodies must be all Facet",)),
    ("newton.damping = 0.2\nstep()", ("NewtonIntegrator.damping is 0.2", "must be 0")),
    ("newton.mask = 1\nstep()", ("NewtonIntegrator.mask is 1",)),
    ("impact = LcpImpact(stiffness=1e7)\nO.engines = [ForceResetter(), newton, impact]\nO.step()",
     ("LcpImpact must stand in O.engines", "before NewtonIntegrator")),
    ("O.engines = [ForceResetter(), LcpImpact(stiffness=1e7)]\nO.step()", ("LcpImpact: there is no NewtonIntegrator in O.engines",)),
    ("step(between=[GravityEngine(gravity=(0, -1, 0))])", ("GravityEngine stands after LcpImpact",)),
    ("O.periodic = True\nstep()", ("periodic",)),
    ("O.bodies[1].state.blockedDOFs = 'x'\nstep()", ("log 2 has blockedDOFs", "blocked alike")),
    ("O.bodies[1].state.blockedDOFs = 'xyXYZ'\nstep()", ("log 1 has blockedDOFs", "'zXY'")),
    ("O.bodies[1].state.blockedDOFs = 'zZ'\nstep()", ("log 1 has blockedDOFs", "'zXY'")),
    ("O.bodies[1].state.mass = 0\nstep()", ("log 1 has a mass of 0 kg", "> 0")),
    ("O.bodies[1].state.inertia = (0, 0, 0)\nstep()", ("log 1 has an inertia of 0",)),
    ("O.bodies[1].aspherical = True\nstep()", ("log 1 is aspherical",)),
    ("O.bodies[1].state.pos = (0, 0.1, 0.01)\nstep()", ("log 1 meets log 2 out of the plane", "one z")),
    ("O.bodies[0].state.angVel = (0, 1, 0)\nstep()", ("walls[0] 'floor': body 0 turns, and carries logs out of the plane",)),
    ("capsules()\nO.bodies[0].state.angVel = (1, 1, 0)\nstep()", ("body 0 turns about another axis than its own", "its normal")),
    ("Capsule(radius=0.1, length=-1)", ("Capsule.length is -1; it must be >= 0 m",)),
    ("dembark.log((0, 0, 0), 0.1, 30.0, length=-1)", ("log: length -1: it must be >= 0 m",)),
    ("dembark.log((0, 0, 0), 0.1, 30.0, length=1, axis=(0, 0, 0))", ("log: the axis must be x, y or z, or a direction that is not zero",)),
    ("dembark.log((0, 0, 0), 0.1, 30.0, axis=(0, 0, 1))", ("log: axis '(0, 0, 1)': it must be x, y or z",)),
    ("capsules()\nO.bodies[1].state.blockedDOFs = ''\nstep()", ("log 1 is a Capsule and has blockedDOFs ''", "'XYZ' (LcpImpact turns it)")),
    ("capsules()\nO.bodies[1].state.mass = 0\nstep()", ("log 1 has a mass of 0 kg", "> 0")),
    ("capsules(0.19)\nstep()", ("log 1 and log 2 overlap at the start by 0.1 of the radius",)),
    ("capsules()\nO.bodies[2].state.pos = (0.5, 0.08, 0)\nstep()", ("log 2 and LcpImpact.walls[0] 'floor' overlap at the start",)),
    ("capsules()\nO.bodies.append(dembark.log((0.5, 0.1, 0), 0.1, 30.0))\nstep()", ("log 3 has blockedDOFs 'zXY'", "blocked alike")),
    ("capsules()\nO.bodies.append(utils.facet([(-1, 0, -1), (1, 0, -1), (0, 0, 1)]))\nstep(walls=[dict(floor, bodies=[3])])",
     ("walls[0] 'floor': a Facet is for logs without a length, and log 1 has one; use Wall and CylinderWall",)),
    ("O.bodies.appendClumped([sphere((1, 1, 0), 0.1), sphere((1.1, 1, 0), 0.1)])\nstep()", ("belongs to a clump", "mask or ids")),
    ("O.bodies[2].state.pos = (0.19, 0.1, 0)\nstep()",
     ("LcpImpact: log 1 and log 2 overlap at the start by 0.1 of the radius; at most 0.05 is allowed",)),
    ("O.bodies[2].state.pos = (0.5, 0.08, 0)\nstep()", ("log 2 and LcpImpact.walls[0] 'floor' overlap at the start by 0.2 of the radius",)),
    ("step(ids=[0])", ("LcpImpact.ids: body 0 is no Sphere",)),
    ("step(ids=[9])", ("LcpImpact.ids: body 9 does not exist",)),
    ("O.dt = 0\nstep()", ("time step",)),
    ("step(impactsFile='nowhere/impacts.txt')", ("nowhere/impacts.txt", "cannot be written")),
    ("LcpImpact(stiffness=1e7).wallForce('shell')", ("no wall has the name 'shell'",)),
]


def test_a_scene_that_goes_on_may_overlap_and_long_steps_are_warned_of(yade):
    """Two logs of 30 kg meet with omega = sqrt(1e7 / 30): the limit of omega tau = 1 is 1.73 ms."""
    done = run(yade, """
        scene()
        impact = LcpImpact(stiffness=1e7, walls=[floor])
        step(impact)
        O.bodies[2].state.pos = (0.19, 0.1, 0)
        step(impact)
        O.saveTmp()
        O.loadTmp()
        O.step()
        scene()
        impact = LcpImpact(stiffness=1e7, walls=[floor])
        for O.dt in (5e-3, 5e-3, 1e-3, 4e-3):
            step(impact)
        """)
    assert "went on" in done.stdout, done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("WARNING: dembark: LcpImpact: the time step of ")]
    assert len(lines) == 2
    assert all("impacts are resolved up to 1 / omega, 0.00173 s" in line for line in lines), lines


@pytest.fixture(scope="module")
def said(yade):
    out = yade.folder / "said.json"
    done = run(yade, f"for call in {[call for call, _ in CASES]!r}: refused(call)\njson.dump(said, open({str(out)!r}, 'w'))")
    assert "went on" in done.stdout, (done.stdout + done.stderr)[-3000:]
    return json.loads(out.read_text())


@pytest.mark.parametrize("number", range(len(CASES)), ids=[call for call, _ in CASES])
def test_wrong_input_is_one_line(said, number):
    assert said[number].startswith("dembark: ")
    assert "\n" not in said[number]
    assert all(part in said[number] for part in CASES[number][1]), said[number]


@pytest.mark.parametrize(("call", "parts", "code"), [
    # Raised in YADE's own thread, by a function of yade.dembark, when the engine is made.
    ("scene()\nnewton.damping = 0.2\nO.engines = [ForceResetter(), LcpImpact(stiffness=1e7), newton]\nO.run(2, True)", ("damping is 0.2",),
     2),
    ("scene()\ndembark.log((0, 0, 0), 0.1, -3)", ("log: mass -3", "> 0 kg"), 2),
    pytest.param("scene()\ndembark.drum((0, 0, 0), 1, axis='w')", ("drum: axis 'w'", "x, y or z"), 2, marks=pytest.mark.full),
    ("LcpImpact(theta=2)", ("LcpImpact: theta", "not 2"), 2)])
def test_line_and_code_of_a_run(yade, call, parts, code):
    done = run(yade, call)
    lines = [line for line in done.stderr.splitlines() if line.startswith("dembark: ")]
    assert len(lines) == 1, done.stderr
    assert all(part in lines[0] for part in parts), lines[0]
    assert done.returncode == code
    assert "Traceback" not in done.stderr
    assert "went on" not in done.stdout
