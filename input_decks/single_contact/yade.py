"""Single contact: spheres of two materials, each of which hits a plane or a sphere of its own. No gravity."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
levels = len(p.restitutions)
# Materials by type: A, one for each restitution coefficient; B likewise; those of the partners of A and B.
materials = [O.materials.append(FrictMat(young=young, poisson=poisson, density=density))
             for young, poisson, density in zip(p.youngs_moduli, p.poisson_ratios, p.densities, strict=False)]
partners = materials[2 * levels:]
for kind, diameter, _, place, velocity, spin in dembark.packing():
    # A sphere touches those of its own mask only: A or B.
    m = (kind - 1) // levels if kind <= 2 * levels else kind - 1 - 2 * levels
    sphere = utils.sphere(place, 0.5 * diameter, material=O.materials[materials[kind - 1]], mask=1 << m)
    sphere.state.vel, sphere.state.angVel = velocity, spin
    O.bodies.append(sphere)
if p.partner == "plane":
    for m, partner in enumerate(partners):
        O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=O.materials[partner], mask=1 << m))

rebound = [(materials[m * levels + k], partners[m], value) for m in (0, 1) for k, value in enumerate(p.restitutions)]
writer = dembark.FrameWriter()
loop = InteractionLoop(
    [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
    [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
        restitution=MatchMaker(matches=rebound), staticFriction=p.friction, kineticFriction=p.friction, criticalSlipDistance=0)],
    [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding=p.presliding, frictionLimit=p.friction_limit)],
)
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], 0.1 * p.radius, (0, 0, 0), record="writer.write()",
                                period=p.stride)

dembark.run(p.steps)
