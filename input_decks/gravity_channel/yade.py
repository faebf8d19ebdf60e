"""Gravity-driven channel: grains fall between two flat frictional walls, periodic along the flow and in the third direction."""

import math

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, _ = dembark.begin(p, along=[1, 2])
walls = dembark.planes(p, materials, left=(0, 0.0, 1), right=(0, p.channel_width, -1))
# The period shrinks, and the grains with it, until they fill the channel; there is no gravity yet. Each step multiplies the
# period by 1 + rate times the step.
O.cell.velGrad = Matrix3(0, 0, 0, 0, 0, 0, 0, 0, math.expm1(p.squeeze * O.dt) / O.dt)
bounds = (*dembark.box()[:2], (0, p.period))
record = dembark.Recorder(p, walls, bounds, boundary="ff pp pp", gravity=weight, report=p.stride)


def step():
    """Switch on gravity when it is time, and write what is due at this step."""
    if O.iter == p.pack_steps:
        release()
    record()


def release():
    """End of the compression: friction, gravity, and a push along it."""
    O.cell.velGrad = Matrix3.Zero
    O.engines[-1].gravity = weight
    pairing = O.engines[2].physDispatcher.functors[0]
    pairing.staticFriction = dembark.pairs(materials, p.grain_static, p.wall_static)
    pairing.kineticFriction = dembark.pairs(materials, p.grain_kinetic, p.wall_kinetic)
    for contact in O.interactions:
        at_wall = contact.id1 in walls.values() or contact.id2 in walls.values()
        contact.phys.staticFriction = p.wall_static if at_wall else p.grain_static
        contact.phys.kineticFriction = p.wall_kinetic if at_wall else p.grain_kinetic
    for body in O.bodies:
        if isinstance(body.shape, Sphere):
            # Velocities are half a step behind positions, and this step adds a full step of gravity.
            body.state.vel += Vector3(0, 0, 0.5 * p.gravity * O.dt + p.start_velocity)


# Compressed with friction the grains would jam at a solid fraction at which they flow later; friction comes with gravity.
O.engines = dembark.slab_loop(p, materials, (0, 0, 0), verlet=0.3, static=(0, 0), kinetic=(0, 0), record="step()")
dembark.run(p.steps)
