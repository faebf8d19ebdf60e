"""Water in a tank in the plane: at rest, around a block or a cylinder, or above a slot."""

import math

from yade import dembark

p = dembark.parameters()
closed, half = p.scene == "cylinder", p.half


def inside(point):
    """In the block or the cylinder."""
    x, y = point[0] - p.middle, point[1] - p.body_y
    if p.scene in ("floating", "falling"):
        return abs(x) < half and abs(y) < half
    return closed and x * x + y * y < half * half


def push():
    """The force on the cylinder, which grows at the start."""
    O.forces.addF(bodies["body"], (p.load * math.sin(0.5 * math.pi * min(O.time / p.ramp, 1.0)) ** 2, 0, 0))


points = dembark.lattice((0, 0), (p.tank_right, p.depth), p.spacing)
water = dembark.fluid(p, [point for point in points if not inside(point)], p.depth)
walls = dembark.tank_walls((0, 0), (p.tank_right, p.tank_top), p.spacing, open_top=not closed)
if p.scene == "slot":
    walls = [point for point in walls if point[1] > 0 or abs(point[0] - p.middle) > half]
tank = water.addWall(walls)
bodies = {}
if p.scene in ("floating", "falling", "cylinder"):
    ball = sphere((p.middle, p.body_y, 0), half)
    bodies["body"] = number = O.bodies.append(ball)
    ball.state.mass, ball.state.blockedDOFs = p.body_mass, "zXYZ"
    low, high = (p.middle - half, p.body_y - half), (p.middle + half, p.body_y + half)
    water.addBody(number, [point for point in dembark.lattice(low, high, p.spacing) if inside(point)])
record = dembark.FluidRecorder(p, tank, bodies)
O.engines = dembark.fluid_loop(p, water, push="push()" if closed else None)
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
