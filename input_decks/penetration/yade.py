"""Penetration: a ball of steel is shot into grains that lie in a box."""

from yade import dembark

p = dembark.parameters()
weight = Vector3(0, 0, -p.gravity)
grain = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
steel = O.materials.append(FrictMat(young=p.steel_youngs_modulus, poisson=p.steel_poisson_ratio, density=p.steel_density))
grains = [O.bodies.append(utils.sphere(place, 0.5 * diameter, material=O.materials[grain]))
          for _, diameter, _, place, *_ in dembark.packing()]


def of_pairs(*values):
    """A number for two grains, a grain and steel, steel and steel."""
    pairs = (grain, grain), (grain, steel), (steel, steel)
    return MatchMaker(matches=[(*pair, value) for pair, value in zip(pairs, values, strict=True)])


def loop(*recorders, damping=0):
    """All engines; recorders come between forces and motion, where positions and forces belong to the same time."""
    friction = of_pairs(p.friction, p.grain_steel_friction, p.steel_friction)
    return [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.1 * p.grain_diameter),
        SphereContactLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=of_pairs(p.restitution, p.grain_steel_restitution, p.steel_restitution),
                                                        staticFriction=friction, kineticFriction=friction, criticalSlipDistance=0)],
            [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding=p.presliding)],
        ),
        *recorders,
        NewtonIntegrator(damping=damping, gravity=weight),
    ]


def settle(modulus, time_step, steps, damping=0):
    """Let the grains fall or relax; with the contacts go their springs."""
    O.materials[grain].young, O.dt, O.engines = modulus, time_step, loop(damping=damping)
    O.run(steps, True)
    O.interactions.clear()
    O.resetTime()


def record():
    """A row, and a frame where one is due."""
    state = O.bodies[ball].state
    acceleration = O.forces.f(ball)[2] / state.mass - p.gravity
    writer.row(state.pos[2], state.vel[2] + 0.5 * O.dt * acceleration)
    if O.iter >= p.first and (O.iter - p.first) % p.stride == 0:
        writer.frame()


# The frames number bodies in this order: the ball follows the grains, then come the walls.
ball = O.bodies.append(utils.sphere((0, 0, p.ball_height), 0.5 * p.ball_diameter, material=O.materials[steel], fixed=True))
for axis, place, sense in ((0, -0.5 * p.box_length, 1), (0, 0.5 * p.box_length, -1), (1, -0.5 * p.box_width, 1), (1, 0.5 * p.box_width, -1),
                           (2, p.floor, 1)):
    O.bodies.append(utils.wall(place, axis=axis, sense=sense, material=O.materials[steel]))
if p.bed == "settled" and not dembark.options()[1]:
    settle(p.soft_modulus, p.soft_step, p.fall_steps)
    # Softer grains overlap by more: with this modulus at once they would be thrown apart. The damping takes up that energy.
    settle(p.youngs_modulus, p.time_step, p.relax_steps, damping=0.7)
    settle(p.youngs_modulus, p.time_step, p.relax_steps)
O.dt = p.time_step
for body in [*grains, ball]:
    O.bodies[body].dynamic = True
    # Velocities are half a step behind positions.
    O.bodies[body].state.vel = -0.5 * O.dt * weight - Vector3(0, 0, p.ball_speed if body == ball else 0)
writer = dembark.FrameWriter(columns=["ball_height", "ball_velocity"], gravity=weight)
O.engines = loop(PyRunner(command="record()", iterPeriod=p.every, initRun=True))
dembark.run(p.steps)
