"""Granular collapse: grains settle between a back wall and a gate on a floor of glued grains, and the gate leaves."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, walls and glued grains not each other.
GRAINS, WALLS, GLUED = 3, 1, 2
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[1], mask=GRAINS, held=GLUED)
walls = dembark.planes(p, materials, WALLS, back=(0, 0.0, 1), base=(2, p.base, 1), gate=(0, p.column_width, -1))
record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight, glued={"base": ids[2]}, report=p.stride)


def step():
    """Start and stop the gate when it is time, and write what is due at this step."""
    if O.iter in (p.first, p.opened):
        O.bodies[walls["gate"]].state.vel = (p.gate_speed if O.iter == p.first else 0.0, 0, 0)
    record()


O.engines = dembark.slab_loop(p, materials, weight, record="step()")
dembark.run(p.steps)
