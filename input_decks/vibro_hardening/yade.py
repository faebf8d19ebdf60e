"""Vibratory hardening: grains in a trough that moves on a circle, and a part that is clamped in it; all energies are booked."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight)
dembark.block(ids[1])
walls = {name: dembark.mesh(f"{name}.stl", materials[1]) for name in ("trough", "part")}
moving = dembark.motion(p, walls, *((["trough", "part"], []) if p.part_held == "clamped" else (["trough"], ["part"])))
history = dembark.machine_history(ids[1], weight, moving)
vessel = {"vessel": [*walls["trough"], *walls["part"]]}
frames = dembark.Recorder(p, vessel, boundary="ff ff ff", gravity=weight, history=history, report=p.stride)
touches = dembark.TouchWriter("vessel", walls["part"], dembark.box(), boundary="ff ff ff", gravity=weight)


def record():
    """Write what is due at this step, and several times in each impact the grains on the part."""
    frames()
    if O.iter >= p.first and (O.iter - p.first) % p.sample == 0:
        touches.write()


O.engines = dembark.mesh_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps, outputs=("time.csv", "grains.dump", "contacts.dump", "touches.dump"))
