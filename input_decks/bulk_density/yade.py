"""Bulk density: grains are poured on a plate, which then taps them; periodic along x and y."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[0, 1])
walls = dembark.planes(p, materials, plate=(2, 0.0, 1))
moving = dembark.motion(p, walls, ["plate"])
record = dembark.Recorder(p, walls, boundary="pp pp ff", gravity=weight, report=p.stride, moving=moving)
O.engines = dembark.slab_loop(p, materials, weight, moving=moving)
dembark.run(p.steps)
