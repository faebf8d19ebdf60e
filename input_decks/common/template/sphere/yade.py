"""A sphere falls on a plane and bounces. p.name: a parameter or derived number of case.toml."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
O.bodies.append(utils.sphere((0, 0, p.radius + p.height), p.radius, material=material))
plane = O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=material))
weight = (0, 0, -9.81)
dump = dembark.DumpWriter({"plane": plane}, ((-1, 1), (-1, 1), (-1, 1)), gravity=weight)
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=p.restitution, staticFriction=0, kineticFriction=0,
                                                    criticalSlipDistance=0)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]),
    PyRunner(command="if O.iter: dump.write()", iterPeriod=p.stride),
    NewtonIntegrator(damping=0, gravity=weight),
]
dembark.run(p.steps)
