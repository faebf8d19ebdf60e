"""Dam break against cubes: a column of water, the walls of a flume, and cubes on its floor."""

import math
import os
import random

from yade import dembark

p = dembark.parameters()
side = 0.5 * p.flume_width
centres = list(zip(p.cube_x, p.cube_y, p.cube_z, strict=True))
cubes = {}


def clump(number, centre, members):
    """A cube of these bodies."""
    body = O.bodies[O.bodies.appendClumped(members)[0]]
    if max(abs(part) for part in body.state.ori) < 1.0 - 1e-9 or (body.state.pos - Vector3(*centre)).norm() > 1e-9:
        dembark.fail(f"cube {number} is not where packing.data has it: {body.state.pos}, {body.state.ori}")
    body.state.mass, body.state.inertia = p.cube_mass, Vector3(1, 1, 1) * p.cube_inertia
    body.aspherical = False
    cubes[f"cube{number}"] = body.id


def core(centre, material):
    """The box of a cube. A clump takes the axes of its members' inertia. Those of a cube could be any: one that differs along x, y and z
    has them along its edges, up to half a turn."""
    found = box(centre, [0.5 * p.edge] * 3, material=material)
    found.state.mass, found.state.inertia = 1e3, Vector3(10, 20, 30)
    return found


def walls(floor, glass):
    """Floor and walls of these materials."""
    O.bodies.append(wall(0, 2, sense=1, material=floor))
    O.bodies.append([wall(-side, 1, sense=1, material=glass), wall(side, 1, sense=-1, material=glass)])
    O.bodies.append(wall(p.downstream_length, 0, sense=-1, material=glass))


def boxes():
    """Cubes that touch by balls in their corners and along their edges, which meet the faces of others as boxes. Springs and dashpots of
    two materials act in series. The many balls along edges are for edges that cross: with a third of the stiffness of a corner, hardly
    damped."""
    r, inner = p.rounding, 0.5 * p.edge - p.rounding
    share, damped, tangential = 1.0 / 3.0, 0.05, 0.82

    def damping(restitution, mass):
        """Of a corner, N s/m: a spring and dashpot that does not pull (Schwager & Poeschel 2007), with a quarter of the mass."""
        low, high = 0.0, 1.0
        for _ in range(60):
            z = 0.5 * (low + high)
            low, high = (z, high) if math.exp(-z * (math.pi - 2.0 * math.asin(z)) / math.sqrt(1.0 - z * z)) > restitution else (low, z)
        return 2.0 * low * math.sqrt(0.25 * p.stiffness * mass)

    def material(k, c, friction):
        """The least friction of two materials counts, so that balls have the largest, and faces that of what touches them."""
        return O.materials.append(ViscElMat(kn=k, ks=tangential * k, cn=c, cs=tangential * c, frictionAngle=math.atan(friction),
                                            density=p.cube_density))

    def pair_part(one, both):
        """What gives `both` in series with `one`; hardly anything softer than `one` when that is too soft."""
        return one * both / max(one - both, 1e-3 * one)

    k, c = 2.0 * p.stiffness, 2.0 * damping(p.restitution, 0.5 * p.cube_mass)
    largest = max(p.friction, p.floor_friction, p.wall_friction)
    face_material, corner_material = material(k, c, p.friction), material(k, c, largest)
    rim_material = material(pair_part(k, share * p.stiffness), pair_part(c, damped * 0.5 * c), largest)
    ends = (-inner, inner)
    corners = [(a, b, d) for a in ends for b in ends for d in ends]
    along = [inner * (0.2 * n - 1.0) for n in range(1, 10)]
    rims = [point for t in along for a in ends for b in ends for point in ((t, a, b), (a, t, b), (a, b, t))]
    for number, centre in enumerate(centres, 1):
        balls = [sphere(Vector3(*centre) + Vector3(*point), r, material=corner_material) for point in corners]
        balls += [sphere(Vector3(*centre) + Vector3(*point), r, material=rim_material) for point in rims]
        clump(number, centre, [core(centre, face_material), *balls])
    walls(material(k, pair_part(c, damping(p.floor_restitution, p.cube_mass)), p.floor_friction),
          material(k, pair_part(c, damping(p.wall_restitution, p.cube_mass)), p.wall_friction))
    return InteractionLoop([Ig2_Box_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()], [Ip2_ViscElMat_ViscElMat_ViscElPhys()],
                           [Law2_ScGeom_ViscElPhys_Basic()])


def agglomerates():
    """Cubes of spheres at their faces, with Hertz's and Mindlin's law. Their cores touch nothing."""
    r, m = p.sphere_radius, p.edge_spheres

    def material(young, poisson):
        return O.materials.append(FrictMat(young=p.softening * young, poisson=poisson, frictionAngle=0.0, density=p.cube_density))

    own = material(p.youngs_modulus, p.poisson_ratio)
    floor = material(p.floor_youngs_modulus, p.poisson_ratio)
    glass = material(p.wall_youngs_modulus, p.wall_poisson_ratio)
    at = [(k - 0.5 * (m - 1)) * r for k in range(m)]
    places = [(a, b, d) for a in at for b in at for d in at if max(abs(a), abs(b), abs(d)) > at[-1] - 0.5 * r]
    for number, centre in enumerate(centres, 1):
        spheres = [sphere(Vector3(*centre) + Vector3(*point), r, material=own) for point in places]
        middle = core(centre, own)
        middle.mask = 2
        clump(number, centre, [middle, *spheres])
        # A face of spheres has the mass of the cube, for the dashpots.
        for one in spheres:
            one.state.mass = p.cube_mass / m**2
    walls(floor, glass)

    def pairs(of_cubes, of_floor, of_walls):
        return MatchMaker(matches=((own, own, of_cubes), (own, floor, of_floor), (own, glass, of_walls)))

    lost = pairs(p.restitution, p.floor_restitution, p.wall_restitution)
    angles = pairs(*(math.atan(mu) for mu in (p.friction, p.floor_friction, p.wall_friction)))
    return InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
                           [Ip2_FrictMat_FrictMat_MindlinPhys(en=lost, es=lost, frictAngle=angles)], [Law2_ScGeom_MindlinPhys_Mindlin()])


contacts = agglomerates() if p.contacts == "spheres" else boxes()
water = SphFluid(spacing=p.spacing, soundSpeed=p.sound_speed, density=p.fluid_density, smoothing=p.smoothing, alpha=p.alpha, delta=p.delta,
                 noSlip=p.no_slip == "yes", tension=p.tension == "yes", moment=p.moment, slitPressure=p.slit_pressure,
                 kernel=p.kernel, boundary=p.boundary, xsph=p.xsph, shepard=p.shepard,
                 threads=int(os.environ.get("OMP_NUM_THREADS", "1")))
if p.coupling == "potential":
    water.contactStiffness, water.contactExponent = p.potential_stiffness, p.potential_exponent
column = dembark.lattice((-p.column_length, -side, 0), (0, side, p.column_height), p.spacing)
# Places of the water and of the cubes vary a little from replica to replica.
drawn, noise = random.Random(p.seed), p.lattice_noise * p.spacing
water.addParticles([[c + drawn.uniform(-noise, noise) for c in point] for point in column],
                   pressures=[p.fluid_density * p.gravity * (p.column_height - z) for _, _, z in column])
water.addWall(dembark.tank_walls((-p.column_length, -side, 0), (p.downstream_length, side, p.flume_height), p.spacing,
                                 smoothing=p.smoothing))
for cube, centre in zip(cubes.values(), centres, strict=True):
    if p.coupling == "potential" or p.contacts == "spheres":
        half = 0.5 * p.edge
        water.addBody(cube, dembark.lattice([c - half for c in centre], [c + half for c in centre], p.spacing))
    else:
        water.addBox(cube, Vector3(p.edge, p.edge, p.edge))
if p.coupling != "potential" and p.contacts != "spheres":
    for point, normal in (((0, 0, 0), (0, 0, 1)), ((0, -side, 0), (0, 1, 0)), ((0, side, 0), (0, -1, 0)),
                          ((p.downstream_length, 0, 0), (-1, 0, 0))):
        water.addPlane(Vector3(*point), Vector3(*normal))

record = dembark.CubesRecorder(p, cubes)
O.dt = p.time_step
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb(), Bo1_Wall_Aabb()], avoidSelfInteractionMask=2),
    contacts,
    water,
    PyRunner(command="record()", iterPeriod=1),
    NewtonIntegrator(damping=0, gravity=(0, 0, -p.gravity)),
]
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
