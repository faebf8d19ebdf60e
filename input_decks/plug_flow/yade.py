"""Plug flow: grains rain into a vertical channel (periodic in the third direction), settle, and the plate that carries them sinks."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, walls and glued grains not each other.
GRAINS, WALLS, GLUED = 3, 1, 2
O.dt = p.time_step
weight = (0, 0, -p.gravity)
dembark.periodic(axes=[1], room=8 * p.grain_diameter)
grain, wall = materials = dembark.materials(p)
glue = dembark.grains(grain, weight, mask=GRAINS, held=(wall, GLUED)).get(2, [])

walls = {
    "left": dembark.plane(0, 0.0, 1, wall, p.grain_diameter, WALLS),
    "right": dembark.plane(0, p.channel_width, -1, wall, p.grain_diameter, WALLS),
    "base": dembark.plane(2, 0.0, 1, wall, p.grain_diameter, WALLS),
}
liquid = CapillaryLiquid(content=p.liquid_content) if p.carried else None
record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight, glued={"left": glue[::2], "right": glue[1::2]}, liquid=liquid)


def step():
    """Start the plate when it is time, and write what is due at this step."""
    if O.iter == p.settle_steps:
        O.bodies[walls["base"]].state.vel = (0, 0, -p.base_speed)
    record()


O.engines = dembark.engine_loop(
    p, dembark.contact_loop(p, materials, [Ig2_Box_Sphere_ScGeom()]), bounds=[Bo1_Sphere_Aabb(), Bo1_Box_Aabb()],
    verlet=0.1 * p.grain_diameter, gravity=weight, liquid=liquid, periodic=True, record="step()")

dembark.announce(p.steps)
dembark.run(p.steps)
