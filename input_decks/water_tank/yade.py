"""Water in the plane: in a tank at rest, around a block or a cylinder, or above a slot; or around a block that drifts."""

import math

from yade import dembark

p = dembark.parameters()
closed, half = p.scene == "cylinder", p.half
free, square = p.scene == "drifting", p.scene in ("floating", "falling", "drifting")


def inside(point):
    """In the block or the cylinder."""
    x, y = point[0] - p.middle, point[1] - p.body_y
    if square:
        return abs(x) < half and abs(y) < half
    return closed and x * x + y * y < half * half


def push():
    """The force on the cylinder, which grows at the start."""
    O.forces.addF(bodies["body"], (p.load * math.sin(0.5 * math.pi * min(O.time / p.ramp, 1.0)) ** 2, 0, 0))


points = dembark.lattice((0, 0), (p.tank_right, p.depth), p.spacing)
water = dembark.fluid(p, [point for point in points if not inside(point)], p.depth)
tank = None
if not free:
    walls = dembark.tank_walls((0, 0), (p.tank_right, p.tank_top), p.spacing, open_top=not closed, smoothing=p.smoothing)
    if p.scene == "slot":
        walls = [point for point in walls if point[1] > 0 or abs(point[0] - p.middle) > half]
    tank = water.addWall(walls)
bodies = {}
if square or closed:
    ball = sphere((p.middle, p.body_y, 0), half)
    bodies["body"] = number = O.bodies.append(ball)
    ball.state.mass, ball.state.blockedDOFs = p.body_mass, "zXY" if free else "zXYZ"
    if free:
        ball.state.inertia = Vector3(1, 1, 1) * p.body_inertia
        ball.state.vel, ball.state.angVel = Vector3(p.speed, 0.5 * p.speed, 0), Vector3(0, 0, p.speed / p.size)
    low, high = (p.middle - half, p.body_y - half), (p.middle + half, p.body_y + half)
    water.addBody(number, [point for point in dembark.lattice(low, high, p.spacing) if inside(point)])
record = dembark.FluidRecorder(p, tank, bodies)
O.engines = dembark.fluid_loop(p, water, push="push()" if closed else None)
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
