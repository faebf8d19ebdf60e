"""Mixing drum: small grains above large ones in a drum that turns."""

from yade import dembark

p = dembark.parameters()
weight = Vector3(0, 0, -p.gravity)
SORTS = ["small", "large"]
materials = dembark.sort_materials(p, SORTS)
ids = dembark.grains({1: materials["small"], 3: materials["large"]})
walls = {"drum": dembark.mesh("drum.stl", materials["steel"])}


def engines(record="pass", friction=None, **more):
    """All engines, with a surface of their own; `friction` of all pairs other than that of the sorts."""
    surface, friction = FacetSurface(), dembark.of_sorts(p, materials, "friction") if friction is None else friction
    loop = SphereContactLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface)],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=dembark.of_sorts(p, materials, "restitution"), staticFriction=friction,
                                                    kineticFriction=friction, criticalSlipDistance=0)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding=p.presliding)],
    )
    return dembark.engine_loop(loop, [Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], 0.1 * p.small_diameter, weight, record=record,
                               period=p.every, surface=surface, **more)


def settle(moduli, time_step, steps, damping=0):
    """Let the grains fall or relax with these moduli, by sort; with the contacts go their springs."""
    for sort, modulus in zip(SORTS, moduli, strict=True):
        O.materials[materials[sort]].young = modulus
    O.dt, O.engines = time_step, engines(friction=p.filling_friction)
    O.engines[-1].damping = damping
    O.run(steps, True)
    O.interactions.clear()
    O.resetTime()


def numbers():
    """Of each sort how many grains are in the zones, and the centre of mass."""
    for kind in (1, 3):
        places = [O.bodies[k].state.pos for k in ids[kind]]
        yield sum(place[0] > 0 and place[2] > 0 for place in places)
        yield sum(place[0] < 0 and place[2] < 0 for place in places)
        yield from (sum(place[axis] for place in places) / len(places) for axis in range(3))


def record():
    """A row, and a frame where one is due."""
    writer.row(*numbers())
    if O.iter >= p.first and (O.iter - p.first) % p.stride == 0:
        writer.frame()


if not dembark.options()[1]:
    settle((p.small_soft_modulus, p.large_soft_modulus), p.soft_step, p.fill_steps)
    # Softer grains overlap by more: with these moduli at once they would be thrown apart. The damping takes up that energy.
    settle((p.small_modulus, p.large_modulus), p.time_step, p.relax_steps, damping=0.7)
    settle((p.small_modulus, p.large_modulus), p.time_step, p.relax_steps)
O.dt = p.time_step
for grain in ids[1] + ids[3]:
    # Velocities are half a step behind positions.
    O.bodies[grain].state.vel, O.bodies[grain].state.angVel = -0.5 * O.dt * weight, Vector3(0, 0, 0)
writer = dembark.FrameWriter(columns=[f"{sort}_{what}" for sort in SORTS for what in ("zone1", "zone2", "x", "y", "z")], gravity=weight,
                             types=dict.fromkeys(ids[3], 3))
moving = dembark.motion(p, walls, ["drum"])
O.engines = engines("record()", moving=moving)
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
