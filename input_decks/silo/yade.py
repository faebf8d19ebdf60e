"""Silo: grains rain into a vertical cylinder, settle, and the wall creeps upward so that its friction is mobilised."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, _ = dembark.begin(p, weight)
# The cylinder moves along its own axis, so its shape stays.
side = dembark.drum((0, 0, 0), p.cylinder_radius, axis="z", material=materials[1])
side.state.vel = (0, 0, p.wall_speed)
walls = {"side": O.bodies.append(side), "base": O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=materials[1]))}

liquid = CapillaryLiquid(content=p.liquid_content) if p.carried else None
record = dembark.Recorder(p, walls, gravity=weight, liquid=liquid)
O.engines = dembark.engine_loop(
    dembark.contact_loop(p, materials, [Ig2_CylinderWall_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()]),
    bounds=[Bo1_Sphere_Aabb(), Bo1_CylinderWall_Aabb(), Bo1_Wall_Aabb()], verlet=0.1 * p.grain_diameter, gravity=weight, liquid=liquid)

dembark.run(p.steps)
