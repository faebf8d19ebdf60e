"""Oedometer: a layer of grains between two plates of glued grains. The load of the upper one rises to its highest value and falls again."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch: grains all others, glued grains not each other.
GRAINS, GLUED = 3, 2
materials, ids = dembark.begin(p, along=(0, 1), mask=GRAINS, held=GLUED)
plates = dembark.LoadedPlates(p, ids[2])


def step():
    """Set the load, which doubles every p.octave_steps up to p.peak_step and is halved as fast from p.fall_step on; write what is due."""
    rising = max(min(O.iter, p.peak_step) - p.start_step, 0)
    plates.load(2 ** ((rising - max(O.iter - p.fall_step, 0)) / p.octave_steps))
    plates.record()


loop = dembark.contact_loop(p, materials, [])
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb()], 0.1 * p.grain_diameter, (0, 0, 0), periodic=True, record="step()")
dembark.run(p.steps, saving=plates.save, loaded=plates.restore)
