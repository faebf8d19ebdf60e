"""Vibrating screen: grains of two sizes above bars that shake up and down, in a bin with a pan."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight)
dembark.block(ids[1])
parts = {name: dembark.mesh(f"{name}.stl", materials[1]) for name in ("screen", "bin")}
walls = {"vessel": [triangle for part in parts.values() for triangle in part]}
moving = dembark.motion(p, parts, ["screen"], still=["bin"])
# Kinetic energy, the screen's work, and what the account cannot explain.
energies = {"kinetic_energy": "kinetic"} | {name: name for name in ("walls", "other", "imposed", "balance", "scale")}
history = dembark.EnergyWriter("time.csv", energies, more=dembark.motion_columns(moving), more_values=lambda: dembark.motion_values(moving))
record = dembark.Recorder(p, walls, boundary="ff ff ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.mesh_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
