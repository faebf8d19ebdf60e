"""Plane silo: grains rain between two vertical walls (periodic in the third direction), settle, and the walls creep upward."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
weight = (0, 0, -p.gravity)
dembark.periodic(axes=[1], room=8 * p.grain_diameter)
grain, wall = materials = dembark.materials(p)
dembark.grains(grain, weight)

walls = {
    "left": dembark.plane(0, 0.0, 1, wall, p.grain_diameter),
    "right": dembark.plane(0, p.silo_width, -1, wall, p.grain_diameter),
    "base": dembark.plane(2, 0.0, 1, wall, p.grain_diameter),
}
# The walls move in their own planes, so their shape stays.
for name in ("left", "right"):
    O.bodies[walls[name]].state.vel = (0, 0, p.wall_speed)

record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight)
O.engines = dembark.engine_loop(
    p, dembark.contact_loop(p, materials, [Ig2_Box_Sphere_ScGeom()]), bounds=[Bo1_Sphere_Aabb(), Bo1_Box_Aabb()],
    verlet=0.1 * p.grain_diameter, gravity=weight, periodic=True)

dembark.announce(p.steps)
dembark.run(p.steps)
