"""Triaxial test: a periodic cell with grains is compressed along z under constant stresses along x and y."""

from yade import dembark

p = dembark.parameters()
materials, ids = dembark.begin(p, along=(0, 1, 2))
cell = dembark.StressedCell(p)


def step():
    """Set the rates of this step: of all sides until the gas is dense; as the stress demands; of z alone as the test has it."""
    seconds = O.iter * p.time_step
    if O.iter <= p.closed_step:
        rates = [-p.closing_rate / (1 - p.closing_rate * seconds)] * 3
    else:
        driven = O.iter > p.start_step
        rates = cell.follow(integrate=driven)
        if driven:
            if p.condition == "constant_width":
                rates = [0, 0, 0]
            rates[2] = -p.strain_rate * min((O.iter - p.start_step) / p.ramp_steps, 1)
    cell.strain(rates)
    cell.record()


loop = dembark.contact_loop(p, materials, [])
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb()], 0.1 * p.grain_diameter, (0, 0, 0), periodic=True, record="step()")
dembark.run(p.steps, saving=cell.save, loaded=cell.restore)
