"""Discharge of a bin: grains settle in a rectangular bin, the gate below the slot in its bottom drops."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
ended = p.ends == "walls"
dembark.periodic([] if ended else [1], room=8 * p.grain_diameter)
materials, _ = dembark.begin(p, weight)
walls = dembark.planes(p, materials, left=(0, 0.0, 1), right=(0, p.bin_width, -1), floor=(2, -p.fall, 1))
if ended:
    walls |= dembark.planes(p, materials, front=(1, 0.0, 1), rear=(1, p.bin_depth, -1))


def panel(low, high):
    """Id of a thin plate between two x (m), whose upper side is the plane z = 0; without end along the slot."""
    thickness = 0.2 * p.grain_diameter
    centre, extents = (0.5 * (low + high), 0, -0.5 * thickness), (0.5 * (high - low), 1e6 * p.grain_diameter, 0.5 * thickness)
    return O.bodies.append(utils.box(centre, extents, fixed=True, material=materials[1]))


# A plate that ends at a wall reaches into it; boxes that are fixed do not touch each other.
gate = panel(p.outlet_left, p.outlet_right)
walls["base"] = [panel(-p.grain_diameter, p.outlet_left), panel(p.outlet_right, p.bin_width + p.grain_diameter), gate]
record = dembark.Recorder(p, walls, boundary="ff ff ff" if ended else "ff pp ff", gravity=weight, report=p.stride)


def step():
    """Drop the gate when it is time, and write what is due at this step."""
    if O.iter in (p.settle_steps, p.settle_steps + p.drop_steps):
        O.bodies[gate].state.vel = (0, 0, -p.gate_speed if O.iter == p.settle_steps else 0)
    record()


O.engines = dembark.slab_loop(p, materials, weight, record="step()")
dembark.run(p.steps)
