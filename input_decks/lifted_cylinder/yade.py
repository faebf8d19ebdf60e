"""Lifted cylinder: grains settle in a cylinder on a plate, the cylinder is lifted, and a heap is left."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, _ = dembark.begin(p, weight)
parts = {name: dembark.mesh(f"{name}.stl", materials[1]) for name in ("cylinder", "pan")}
walls = {"vessel": [triangle for part in parts.values() for triangle in part]}
moving = dembark.motion(p, parts, ["cylinder"], still=["pan"])
record = dembark.Recorder(p, walls, boundary="ff ff ff", gravity=weight, report=p.stride, moving=moving)
O.engines = dembark.mesh_loop(p, materials, weight, moving=moving)
dembark.run(p.steps)
