"""Dam break in space: a column of water that ends at x = 0, the walls of a tank, and a box on its floor."""

from yade import dembark

p = dembark.parameters()
dx = p.spacing
water = dembark.fluid(p, dembark.lattice((-p.column, -p.side, 0), (0, p.side, p.column_depth), dx), p.depth, dimension=3)
solid = dembark.tank_walls((-p.column, -p.side, 0), (p.tank_end, p.side, p.tank_top), dx, smoothing=p.smoothing)
solid += dembark.lattice((p.distance, -0.5 * p.box_y, p.box_foot), (p.distance + p.box_x, 0.5 * p.box_y, p.box_z), dx)
tank = water.addWall(solid)


def level(place):
    """A function that counts the water in a square of four spacings, whose depth is measured."""
    return lambda points: sum(abs(x - place) <= 2 * dx and -1.75 * dx <= y <= 2.25 * dx for x, y, _ in points)


# Where the box is, for pictures.
more = {"box_x": p.distance + 0.5 * p.box_x, "box_y": 0, "box_z": 0.5 * p.box_z, "box_qw": 1, "box_qx": 0, "box_qy": 0, "box_qz": 0}
more |= {f"H{k}": level(place) for k, place in enumerate(p.gauge, 1)}
seen = [(getattr(p, f"seen_low_{axis}"), getattr(p, f"seen_high_{axis}")) for axis in "xyz"]
record = dembark.FluidRecorder(p, tank, more=more, near=seen)
O.engines = dembark.fluid_loop(p, water)
dembark.run(p.steps, outputs=("time.csv", "grains.dump", "near.dump"))
