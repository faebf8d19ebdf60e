"""Log pile: logs of unequal diameter fall between two stakes and come to rest."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
weight = (0, -p.gravity, 0)
wood, ground, stakes = (O.materials.append(FrictMat(label=name)) for name in ("wood", "ground", "stakes"))
dembark.logs([wood])
walls = [
    dembark.log_wall((0, 0, 0), 1, 1, ground, name="ground", stiffness=p.wall_stiffness),
    dembark.log_wall((-p.half, 0, 0), 0, 1, stakes, name="left", stiffness=p.wall_stiffness, friction=p.stake_friction),
    dembark.log_wall((p.half, 0, 0), 0, -1, stakes, name="right", stiffness=p.wall_stiffness, friction=p.stake_friction),
]
impacts = LcpImpact(
    stiffness=p.stiffness, damping=p.damping, contactDamping=p.contact_damping, theta=p.theta, friction=p.friction, walls=walls,
    # The logs are at rest at the time zero, as in LIGGGHTS.
    impactsFile="impacts.txt", velocityAtStart=True)
writer = dembark.LogWriter(impacts, gravity=weight)
O.engines = dembark.log_loop(impacts, "writer.write()", p.stride, weight)

dembark.run(p.steps)
