"""Penetration: a ball of steel is shot into grains that lie in a box."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
weight = Vector3(0, 0, -p.gravity)
grain = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
steel = O.materials.append(FrictMat(young=p.steel_youngs_modulus, poisson=p.steel_poisson_ratio, density=p.steel_density))
for kind, diameter, _, place, velocity, _ in dembark.packing():
    sphere = utils.sphere(place, 0.5 * diameter, material=O.materials[(grain, steel)[kind - 1]])
    # Velocities are half a step behind positions.
    sphere.state.vel = Vector3(*velocity) - 0.5 * O.dt * weight
    O.bodies.append(sphere)
ball = len(O.bodies) - 1
for axis, place, sense in ((0, -0.5 * p.box_length, 1), (0, 0.5 * p.box_length, -1), (1, -0.5 * p.box_width, 1), (1, 0.5 * p.box_width, -1),
                           (2, p.floor, 1)):
    O.bodies.append(utils.wall(place, axis=axis, sense=sense, material=O.materials[steel]))


def of_pairs(*values):
    """A number for two grains, a grain and steel, steel and steel."""
    pairs = (grain, grain), (grain, steel), (steel, steel)
    return MatchMaker(matches=[(*pair, value) for pair, value in zip(pairs, values, strict=True)])


friction = of_pairs(p.friction, p.grain_steel_friction, p.steel_friction)
writer = dembark.FrameWriter(columns=["ball_height", "ball_velocity"], gravity=weight)


def record():
    """A row, and a frame where one is due."""
    state = O.bodies[ball].state
    acceleration = O.forces.f(ball)[2] / state.mass - p.gravity
    writer.row(state.pos[2], state.vel[2] + 0.5 * O.dt * acceleration)
    if O.iter >= p.first and (O.iter - p.first) % p.stride == 0:
        writer.frame()


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.1 * p.grain_diameter),
    SphereContactLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=of_pairs(p.restitution, p.grain_steel_restitution, p.steel_restitution),
                                                    staticFriction=friction, kineticFriction=friction, criticalSlipDistance=0)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding=p.presliding)],
    ),
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="record()", iterPeriod=p.every, initRun=True),
    NewtonIntegrator(damping=0, gravity=weight),
]

dembark.run(p.steps)
