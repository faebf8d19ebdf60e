"""Moving walls: held grains in a plate, a bed in a vessel, or a grain above a plate; the walls move as prescribed."""

from yade import dembark

p = dembark.parameters()
weight = (p.gravity_x, p.gravity_y, p.gravity_z)
materials, ids = dembark.begin(p, weight)
if p.scene == "held":
    # A body of which nothing is free would be a wall; without friction nothing turns it.
    dembark.block(ids[1], "xyzXZ")
walls = {"plate": dembark.mesh("plate.stl", materials[1])}
moving = dembark.motion(p, walls, ["plate"])
writer = dembark.FrameWriter(dembark.motion_columns(moving), gravity=weight)


def record():
    """Write what is due at this step."""
    if O.iter % p.every == 0:
        writer.row(*dembark.motion_values(moving))
    if O.iter % p.stride == 0:
        writer.frame()


O.engines = dembark.mesh_loop(p, materials, weight, moving=moving)
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
