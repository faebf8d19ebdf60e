"""Log cradle: equal logs in a row along x, the first of which moves."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
dembark.logs([O.materials.append(FrictMat(label="wood"))])
# The velocities of the packing belong to the time zero, as in LIGGGHTS.
impacts = LcpImpact(stiffness=p.stiffness, theta=p.theta, impactsFile="impacts.txt", velocityAtStart=True)
writer = dembark.LogWriter(impacts)
O.engines = dembark.log_loop(impacts, "writer.write()", p.stride)

dembark.run(p.steps)
