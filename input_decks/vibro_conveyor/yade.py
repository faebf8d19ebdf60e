"""Vibrating conveyor: a block or grains on a plate that shakes obliquely, periodic along x and y; the energies of all forces are booked."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[0, 1])
if p.spin == "blocked":
    dembark.block(ids[1], "XYZ")
walls = dembark.planes(p, materials, plate=(2, 0.0, 1))
moving = dembark.motion(p, walls, ["plate"])
history = dembark.machine_history(ids[1], weight, moving)
record = dembark.Recorder(p, walls, boundary="pp pp ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
