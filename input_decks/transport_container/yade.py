"""Transport container: grains settle in a box, a layer with their centres in one plane, and the box is driven, jolted or tilted."""

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight)
dembark.block(ids[1])
sides = {name: dembark.mesh(f"{name}.stl", materials[1]) for name in ("left", "right", "base")}
walls = {"vessel": [triangle for side in sides.values() for triangle in side]}
moving = dembark.motion(p, sides, list(sides))
balance = dembark.Balance(walls, p.every, gravity=weight)
history = balance.writer(more=dembark.motion_columns(moving), more_values=lambda: dembark.motion_values(moving))
record = dembark.Recorder(p, walls, boundary="ff ff ff", gravity=weight, history=history, report=p.stride)


def step():
    """Add up the forces of the walls, and write what is due at this step."""
    balance.add()
    record()


O.engines = dembark.mesh_loop(p, materials, weight, account=EnergyAccount(), moving=moving, record="step()")
dembark.run(p.steps, saving=balance.save, loaded=balance.load)
