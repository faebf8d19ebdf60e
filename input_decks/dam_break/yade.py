"""Dam break: a column of water in the plane, and the walls of a tank."""

from yade import dembark

p = dembark.parameters()
water = dembark.fluid(p, dembark.lattice((0, 0), (p.column_width, p.depth), p.spacing))
tank = water.addWall(dembark.tank_walls((0, 0), (p.tank_right, p.tank_top), p.spacing, smoothing=p.smoothing))
record = dembark.FluidRecorder(p, tank)
O.engines = dembark.fluid_loop(p, water)
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
