"""Avalanche: a gate above grains on a slope makes way, and they run down to a flat with an obstacle; or a bed flows on an endless chute."""

from yade import dembark

p = dembark.parameters()
# Bodies with a common bit may touch, but not those that share the bit of walls and glued grains.
GRAINS, HELD, WALLS = 1, 4, 5
weight = (p.gravity_x, 0, p.gravity_z)
O.dt = p.time_step
dembark.periodic([0] * p.chute + [1] * p.slab, room=8 * p.grain_diameter)
materials, ids = dembark.begin(p, weight, mask=GRAINS, held=WALLS)
if p.spin == "blocked" or not p.slab:
    dembark.block(ids[1], ("" if p.slab else "y") + ("XYZ" if p.spin == "blocked" else "XZ"))
glued, rest = {}, ids.get(2, [])
for name, count in (("floor", p.floor_count), ("gate", p.gate_count), ("obstacle", p.obstacle_count)):
    if count:
        glued[name], rest = rest[:count], rest[count:]
walls = {}
if p.floor == "strips":
    # Boxes as thick as a grain, wider than all that grains travel.
    half, turn = 0.5 * p.grain_diameter, Quaternion((0, 1, 0), p.slope_angle)
    walls["ground"] = []
    for length, sign, way in ((p.slope_length, -1.0, turn), (p.flat_length, 1.0, Quaternion.Identity)):
        long = 0.5 * length * p.grain_diameter
        box = utils.box(way * Vector3(sign * long, 0, -half), (long, 1e3 * half, half), orientation=way, fixed=True,
                        material=materials[1], mask=WALLS)
        walls["ground"].append(O.bodies.append(box))
if not p.chute:
    walls |= dembark.planes(p, materials, WALLS, back=(0, p.back, 1), finish=(0, p.end, -1))

parts = {"floor": walls.get("ground", [])} | {name: [] for name in glued if name != "floor"}
parts |= {name: walls[name] for name in ("back", "finish") if name in walls}
balance = dembark.Balance(parts, p.every, gravity=weight, glued=glued)
boundary = " ".join(("pp" if p.chute else "ff", "pp" if p.slab else "ff", "ff"))
record = dembark.Recorder(p, walls, boundary=boundary, gravity=weight, history=balance.writer(), report=p.stride)
# Ahead of the grains down the slope, and then up along itself.
gate_speeds = {p.first: (p.ahead_x, 0, p.ahead_z), p.turned: (p.rise_x, 0, p.rise_z), p.opened: (0, 0, 0)}


def step():
    """Start, turn and stop the gate when it is time, add up the forces of the walls, and write what is due at this step."""
    if O.iter in gate_speeds:
        for k in glued.get("gate", ()):
            O.bodies[k].state.vel = gate_speeds[O.iter]
    balance.add()
    record()


O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), record="step()")
next(engine for engine in O.engines if isinstance(engine, InsertionSortCollider)).avoidSelfInteractionMask = HELD
dembark.run(p.steps, saving=balance.save, loaded=balance.load)
