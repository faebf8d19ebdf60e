"""Oblique impact: spheres with several sets of inputs, each of which hits a plane. No gravity."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
count = len(p.restitutions)
# Materials of the spheres of each set, then of its plane; by their masks a sphere touches the plane of its own set only.
materials = [O.materials.append(FrictMat(young=young, poisson=poisson, density=p.density))
             for young, poisson in zip(p.youngs_moduli, p.poisson_ratios, strict=True)]
for kind, diameter, _, place, velocity, _ in dembark.packing():
    sphere = utils.sphere(place, 0.5 * diameter, material=O.materials[materials[kind - 1]], mask=1 << (kind - 1))
    sphere.state.vel = velocity
    O.bodies.append(sphere)
for k in range(count):
    O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=O.materials[materials[count + k]], mask=1 << k))


def of_pairs(values):
    """A number for the sphere and the plane of each set."""
    return MatchMaker(matches=[(materials[k], materials[count + k], value) for k, value in enumerate(values)])


writer = dembark.FrameWriter()
loop = InteractionLoop(
    [Ig2_Wall_Sphere_ScGeom()],
    [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
        restitution=of_pairs(p.restitutions), staticFriction=of_pairs(p.frictions), kineticFriction=of_pairs(p.frictions),
        criticalSlipDistance=0)],
    [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding=p.presliding)],
)
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], 0.1 * p.radius, (0, 0, 0), record="writer.write()",
                                period=p.stride)

dembark.run(p.steps)
