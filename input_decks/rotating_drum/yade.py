"""Rotating drum: grains in a slice of a drum, periodic along its axis z, which turns at constant speed; gravity points along -y."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, drum and lining not each other.
GRAINS, DRUM, LINING = 3, 1, 2
weight = (0, -p.gravity, 0)
materials, ids = dembark.begin(p, weight, along=[2], mask=GRAINS, held=LINING)
shell = dembark.drum((0, 0, 0), p.shell_radius, axis="z", omega=p.drum_speed, material=materials[1])
shell.mask = DRUM
walls = {"shell": O.bodies.append(shell)}
record = dembark.Recorder(p, walls, boundary="ff ff pp", gravity=weight, glued={"shell": ids.get(2, [])}, report=p.stride)
O.engines = dembark.engine_loop(
    p, dembark.contact_loop(p, materials, [Ig2_CylinderWall_Sphere_ScGeom()]), bounds=[Bo1_Sphere_Aabb(), Bo1_CylinderWall_Aabb()],
    verlet=0.1 * p.grain_diameter, gravity=weight, periodic=True)
if p.wall_lining == "grains":
    axis = {"zeroPoint": (0, 0, 0), "rotationAxis": (0, 0, 1)}
    O.engines += [RotationEngine(ids=ids[2], rotateAroundZero=True, angularVelocity=p.drum_speed, **axis)]
dembark.run(p.steps)
