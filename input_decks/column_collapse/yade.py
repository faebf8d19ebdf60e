"""Column collapse: grains settle between a back wall and a gate, the gate moves away, and the energies of all forces are booked."""

import math

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, _ = dembark.begin(p, weight, along=[1])
walls = dembark.planes(p, materials, back=(0, 0.0, 1), base=(2, 0.0, 1), gate=(0, p.column_width, -1))


def potentials():
    """Potential energy (J) that gravity's work is the loss of, and that of the positions."""
    grains = [O.bodies[k].state for k in range(p.grain_count)]
    height = p.gravity * math.fsum(state.mass * state.pos[2] for state in grains)
    # Gravity's work up to this step is m g times the fall of the middle between the last two positions: see README.md.
    return height - p.gravity * math.fsum(0.5 * O.dt * state.mass * state.vel[2] for state in grains), height


# As in LIGGGHTS, which has no numerical damping; there is no rolling resistance here.
names = EnergyAccount().keys()
left_out = ("kinetic", "numerical_damping", "rolling_elastic", "rolling_viscous", "rolling_stored")
energies = {"kinetic_energy": "kinetic"} | {name: name for name in names if name not in left_out}
history = dembark.EnergyWriter("time.csv", energies, more=("potential_energy", "weight_height"), more_values=potentials)
record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight, history=history, report=p.stride)


def step():
    """Give the gate its speed in the coming step, and write what is due at this step."""
    if p.first <= O.iter < p.first + p.ramp:
        O.bodies[walls["gate"]].state.vel = (p.gate_speed * (O.iter + 1 - p.first) / p.ramp, 0, 0)
    record()


O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), record="step()")
dembark.run(p.steps)
