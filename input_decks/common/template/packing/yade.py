"""Grains settle on a floor, in a box that is periodic along x and y. p.name: a parameter or derived number."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[0, 1])
walls = dembark.planes(p, materials, floor=(2, 0.0, 1))
record = dembark.Recorder(p, walls, boundary="pp pp ff", gravity=weight)
O.engines = dembark.slab_loop(p, materials, weight)
dembark.run(p.steps)
