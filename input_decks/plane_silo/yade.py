"""Plane silo: grains rain between two vertical walls (periodic in the third direction), settle, and the walls creep upward."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, _ = dembark.begin(p, weight, along=[1])
walls = dembark.planes(p, materials, left=(0, 0.0, 1), right=(0, p.silo_width, -1), base=(2, 0.0, 1))
# The walls move in their own planes, so their shape stays.
for name in ("left", "right"):
    O.bodies[walls[name]].state.vel = (0, 0, p.wall_speed)

record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight)
O.engines = dembark.slab_loop(p, materials, weight)
dembark.run(p.steps)
