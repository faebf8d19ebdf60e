"""Adhesive impact: spheres meet a plane at different speeds. No gravity, no friction."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
material = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.density))
for _, diameter, _, place, velocity, _ in dembark.packing():
    sphere = utils.sphere(place, 0.5 * diameter, material=O.materials[material])
    sphere.state.vel = velocity
    O.bodies.append(sphere)
O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=O.materials[material]))

writer = dembark.FrameWriter()
loop = InteractionLoop(
    [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
    [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=1, staticFriction=0, kineticFriction=0, criticalSlipDistance=0,
                                                workOfAdhesion=p.work_of_adhesion)],
    [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(cohesion=p.cohesion)],
)
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], 0.1 * p.radius, (0, 0, 0), record="writer.write()",
                                period=p.stride)

dembark.run(p.steps)
