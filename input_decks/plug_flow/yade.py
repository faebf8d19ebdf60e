"""Plug flow: grains rain into a vertical channel (in the third direction periodic or between walls), settle, and the plate that carries
them sinks."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, walls and glued grains not each other.
GRAINS, WALLS, GLUED = 3, 1, 2
weight = (0, 0, -p.gravity)
ended = p.ends == "walls"
dembark.periodic([] if ended else [1], room=8 * p.grain_diameter)
materials, ids = dembark.begin(p, weight, mask=GRAINS, held=GLUED)
walls = dembark.planes(p, materials, WALLS, left=(0, 0.0, 1), right=(0, p.channel_width, -1), base=(2, 0.0, 1))
if ended:
    walls |= dembark.planes(p, materials, WALLS, front=(1, 0.0, 1), rear=(1, p.channel_depth, -1))
glue = ids.get(2, [])
liquid = CapillaryLiquid(content=p.liquid_content) if p.carried else None
record = dembark.Recorder(p, walls, boundary="ff ff ff" if ended else "ff pp ff", gravity=weight,
                          glued={"left": glue[::2], "right": glue[1::2]}, liquid=liquid)


def step():
    """Start the plate when it is time, and write what is due at this step."""
    if O.iter == p.settle_steps:
        O.bodies[walls["base"]].state.vel = (0, 0, -p.base_speed)
    record()


O.engines = dembark.slab_loop(p, materials, weight, liquid=liquid, record="step()")
dembark.run(p.steps)
