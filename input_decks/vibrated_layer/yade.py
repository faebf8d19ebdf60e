"""Vibrated layer: grains on a plate that shakes up and down, periodic along x and y."""

from yade import dembark

p = dembark.parameters()
if p.floor == "strips":
    dembark.fail("floor 'strips': facets have no periods here; use 'flat', or an engine with periodic meshes")
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[0, 1])
if p.spins == "blocked":
    dembark.block(ids[1], "XYZ")
walls = dembark.planes(p, materials, plate=(2, 0.0, 1))
moving = dembark.motion(p, walls, ["plate"])
# Kinetic energy, the plate's work, and what the account cannot explain.
energies = {"kinetic_energy": "kinetic"} | {name: name for name in ("walls", "other", "imposed", "balance", "scale")}
history = dembark.EnergyWriter("time.csv", energies, more=dembark.motion_columns(moving), more_values=lambda: dembark.motion_values(moving))
record = dembark.Recorder(p, walls, boundary="pp pp ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
