"""Shear cell: a layer of grains between two plates of glued grains. The upper one carries a load and moves along x at constant speed."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, glued grains not each other.
GRAINS, GLUED = 3, 2
materials, ids = dembark.begin(p, along=(0, 1), mask=GRAINS, held=GLUED)
plates = dembark.LoadedPlates(p, ids[2])


def step():
    """Set the load of this step, and write what is due at it."""
    plates.load(1 if O.iter < p.second_load else 2 if O.iter < p.third_load else 4)
    plates.record()


loop = dembark.contact_loop(p, materials, [])
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb()], 0.1 * p.grain_diameter, (0, 0, 0), periodic=True, record="step()")
dembark.run(p.steps, saving=plates.save, loaded=plates.restore)
