"""Mixing and segregation: grains in a vessel of a floor and two side walls that shakes up and down, periodic along y."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[1])
if p.dimensions == 2:
    dembark.block(ids[1])
sides = dembark.planes(p, materials, base=(2, 0.0, 1), left=(0, 0.0, 1), right=(0, p.vessel_width, -1))
walls = {"vessel": list(sides.values())}
moving = dembark.motion(p, walls, ["vessel"])
# Kinetic energy, the vessel's work, and what the account cannot explain.
energies = {"kinetic_energy": "kinetic"} | {name: name for name in ("walls", "other", "imposed", "balance", "scale")}
history = dembark.EnergyWriter("time.csv", energies, more=dembark.motion_columns(moving), more_values=lambda: dembark.motion_values(moving))
record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
