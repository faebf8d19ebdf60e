"""Angle of repose: grains settle on a plate between two walls, which make way, and are discharged over both edges of the plate."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
dembark.periodic([] if p.walled else [1], room=8 * p.grain_diameter)
materials, _ = dembark.begin(p, weight)
walls = dembark.planes(p, materials, pit=(2, p.pit, 1))
sides = dembark.planes(p, materials, left=(0, 0.0, 1), right=(0, p.plate_width, -1))
# As thick as a grain, and wider than the period.
half = (p.middle, 1e6 * p.grain_diameter, 0.5 * p.grain_diameter)
plate = O.bodies.append(utils.box((p.middle, 0, -0.5 * p.grain_diameter), half, fixed=True, material=materials[1]))
walls = {"container": [plate, *sides.values()]} | walls
if p.walled:
    walls |= dembark.planes(p, materials, front=(1, 0.0, 1), rear=(1, p.thickness, -1))
record = dembark.Recorder(p, walls, boundary="ff ff ff" if p.walled else "ff pp ff", gravity=weight, report=p.stride)


def step():
    """Start and stop the side walls when it is time, and write what is due at this step."""
    if O.iter in (p.first, p.opened):
        for name, sign in (("left", -1.0), ("right", 1.0)):
            O.bodies[sides[name]].state.vel = (sign * p.gate_speed if O.iter == p.first else 0.0, 0, 0)
    record()


O.engines = dembark.slab_loop(p, materials, weight, record="step()")
dembark.run(p.steps)
