"""Log pile: logs of unequal diameter fall between two stakes and come to rest."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
weight = (0, -p.gravity, 0)
wood, ground, stakes = (O.materials.append(FrictMat(label=name)) for name in ("wood", "ground", "stakes"))
dembark.logs([wood])


def plane(name: str, place: tuple, axis: int, sense: int, material: int, **more: float) -> LogWall:
    """A wall of one body through `place`, across `axis`, that bounds the side `sense` of it."""
    body = O.bodies.append(utils.wall(place, axis=axis, sense=sense, material=material))
    return LogWall(bodies=[body], stiffness=p.wall_stiffness, name=name, **more)


walls = [plane("ground", (0, 0, 0), 1, 1, ground), plane("left", (-p.half, 0, 0), 0, 1, stakes, friction=p.stake_friction),
         plane("right", (p.half, 0, 0), 0, -1, stakes, friction=p.stake_friction)]
impacts = LogImpact(
    stiffness=p.stiffness, damping=p.damping, contactDamping=p.contact_damping, theta=p.theta, friction=p.friction, walls=walls,
    # The logs are at rest at the time zero, as in LIGGGHTS.
    impactsFile="impacts.txt", velocityAtStart=True)
writer = dembark.LogWriter(impacts, gravity=weight)
O.engines = dembark.log_loop(impacts, "writer.write()", p.stride, weight)

dembark.announce(p.steps)
dembark.run(p.steps)
