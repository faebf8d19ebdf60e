"""Bead chain: spheres that touch in a row, of which the first has a speed; or a lattice of them, of which one plane or half has one."""

from yade import dembark

p = dembark.parameters()
materials, ids = dembark.begin(p, along=[0] * (p.overlap > 0) + {"row": [], "hexagonal": [2]}.get(p.lattice, [1, 2]))
if p.lattice == "hexagonal":
    dembark.block(ids[1])
writer = dembark.FrameWriter()


def record():
    """Write what is due at this step."""
    if O.iter % p.stride == 0:
        writer.write()


O.engines = dembark.engine_loop(dembark.contact_loop(p, materials, []), [Bo1_Sphere_Aabb()], 0.1 * p.grain_diameter, (0, 0, 0))
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
