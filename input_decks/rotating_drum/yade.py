"""Rotating drum: grains between the end walls of a drum, or in a periodic slice of it, which turns about z; gravity points along -y."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, drum and lining not each other.
GRAINS, DRUM, LINING = 3, 1, 2
weight, closed = (0, -p.gravity, 0), p.ends == "walls"
materials, ids = dembark.begin(p, weight, along=[] if closed else [2], mask=GRAINS, held=LINING)
shell = dembark.drum((0, 0, 0), p.shell_radius, axis="z", omega=p.drum_speed, material=materials[1])
shell.mask = DRUM
walls = {"shell": O.bodies.append(shell)}
surfaces, bounds = [Ig2_CylinderWall_Sphere_ScGeom()], [Bo1_Sphere_Aabb(), Bo1_CylinderWall_Aabb()]
if closed:
    # They turn in their own planes, so their shape stays.
    ends = [utils.wall((0, 0, place), axis=2, sense=side, material=materials[1], mask=DRUM) for place, side in ((0, 1), (p.drum_depth, -1))]
    for end in ends:
        end.state.angVel = (0, 0, p.drum_speed)
    walls["ends"] = O.bodies.append(ends)
    surfaces, bounds = [*surfaces, Ig2_Wall_Sphere_ScGeom()], [*bounds, Bo1_Wall_Aabb()]
record = dembark.Recorder(p, walls, boundary="ff ff ff" if closed else "ff ff pp", gravity=weight, glued={"shell": ids.get(2, [])},
                          report=p.stride)
O.engines = dembark.engine_loop(
    dembark.contact_loop(p, materials, surfaces), bounds=bounds, verlet=0.1 * p.grain_diameter, gravity=weight, periodic=not closed)
if p.wall_lining == "grains":
    axis = {"zeroPoint": (0, 0, 0), "rotationAxis": (0, 0, 1)}
    O.engines += [RotationEngine(ids=ids[2], rotateAroundZero=True, angularVelocity=p.drum_speed, **axis)]
dembark.run(p.steps)
