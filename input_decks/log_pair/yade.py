"""Log pair: one impact of two logs, or of a log and a wall, in the plane z = 0."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
first, second = (O.materials.append(FrictMat(label=name)) for name in ("log 1", "log 2"))
dembark.logs([first, second])
walls = [dembark.log_wall((0, 0, 0), 0, -1, second, name="target", stiffness=p.stiffness_2)] if p.target == "wall" else []
impacts = LcpImpact(
    stiffness={first: p.stiffness_1, second: p.stiffness_2}, damping=p.damping, contactDamping=p.contact_damping, theta=p.theta,
    walls=walls, impactsFile="impacts.txt",
    # The velocities of the packing belong to the time zero, as in LIGGGHTS.
    velocityAtStart=True)
writer = dembark.LogWriter(impacts)
O.engines = dembark.log_loop(impacts, "writer.write()", p.stride)

dembark.run(p.steps)
