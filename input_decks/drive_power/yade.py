"""Drive power: grains on a plate that shakes up and down, periodic along x and y; the energies of all forces are booked."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
tube = p.sides == "walls"
if tube:
    # Planes need a period, here one that nothing reaches.
    dembark.periodic([], room=8 * p.grain_diameter)
materials, ids = dembark.begin(p, weight, along=[] if tube else [0, 1])
if p.dimensions == 2:
    dembark.block(ids[1])
walls = dembark.planes(p, materials, plate=(2, 0.0, 1))
if tube:
    sides = dembark.planes(p, materials, left=(0, 0.0, 1), right=(0, p.cell_width, -1), front=(1, 0.0, 1), back=(1, p.cell_depth, -1))
    walls = {"plate": [walls["plate"], *sides.values()]}
moving = dembark.motion(p, walls, ["plate"])
history = dembark.machine_history(ids[1], weight, moving)
record = dembark.Recorder(p, walls, boundary="ff ff ff" if tube else "pp pp ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
