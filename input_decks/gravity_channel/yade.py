"""Gravity-driven channel in YADE: the same grains, walls and measurements as liggghts.in. What is measured and why: README.md.

By hand, in an empty folder: yade -n -x yade.py [key=value ...]
Keys, defaults and units (SI) are those of case.toml beside this file.
"""

import math
import sys
from pathlib import Path

from yade import dembark

p = dembark.parameters(Path(sys.argv[0]).resolve().with_name("case.toml"))

# --- derived quantities; liggghts.in has the same formulas -------------------------------------------------------------
grain_static, wall_static = (p.grain_friction, p.wall_friction) if p.static_friction is None else (p.static_friction,) * 2
grain_kinetic, wall_kinetic = (
    mu * p.kinetic_friction_ratio if p.kinetic_friction is None else p.kinetic_friction for mu in (grain_static, wall_static))

r_min = 0.5 * p.grain_diameter * (1 - p.grain_diameter_spread)
d_max = p.grain_diameter * (1 + p.grain_diameter_spread)
shear_modulus = p.youngs_modulus / (2 * (1 + p.poisson_ratio))
rayleigh = math.pi * r_min * math.sqrt(p.grain_density / shear_modulus) / (0.1631 * p.poisson_ratio + 0.8766)
O.dt = p.time_step_fraction * rayleigh
fall_time = math.sqrt(p.channel_width / p.gravity)
pack_steps = math.ceil(p.pack_time * math.sqrt(p.grain_diameter / p.gravity) / O.dt)
run_in_steps = math.ceil(p.run_in * fall_time / O.dt)
stride = math.ceil(p.measure * fall_time / (O.dt * p.frames))
first = pack_steps + run_in_steps + stride
steps = pack_steps + run_in_steps + stride * p.frames
# The walls' friction is only steady in the mean, hence many rows.
every = max(1, steps // 10000)
grain_count = math.floor(p.solid_fraction * p.channel_width * p.channel_depth * p.channel_length
                         * 6 / (math.pi * p.grain_diameter**3 * (1 + p.grain_diameter_spread**2)) + 0.5)

jitter = 0.05 * d_max
margin = 0.15 * d_max
n_x = math.floor((p.channel_width - 2 * margin) / (1.15 * d_max))
n_y = math.floor(p.channel_depth / (1.15 * d_max))
for name, size, least in (("channel_width", p.channel_width, 8), ("channel_depth", p.channel_depth, 4), ("channel_length", p.channel_length, 4)):
    if size < least * p.grain_diameter:
        dembark.fail(f"{name} {size} m is too small, gravity_channel/yade.py, take at least {least * p.grain_diameter} m ({least} grain_diameter)")
cell = ((p.channel_width - 2 * margin) / n_x, p.channel_depth / n_y, 1.15 * d_max)
layers = math.ceil(1.3 * grain_count / (n_x * n_y))
z_high = layers * cell[2]


def part(number: float) -> float:
    """Fractional part."""
    return number - math.floor(number)


def shake(site: int, use: int) -> float:
    """One uniform number in [0, 1) per site and use: the fractional part of a large sine."""
    return part(43758.5453 * math.sin(12.9898 * site + 78.233 * p.seed + use))


# YADE is periodic in all three directions; along x the cell leaves room for the walls.
O.periodic = True
O.cell.setBox(p.channel_width + 8 * p.grain_diameter, p.channel_depth, z_high)

# --- grains: a pseudo-random part of the cells of the column, none touching (see liggghts.in) ---------------------------------
grain = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
wall = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
volume = 0.0
sites = [(i, j, k) for k in range(layers) for j in range(n_y) for i in range(n_x)]
for number, index in enumerate(sites, start=1):
    # Multiplication by a prime modulo the number of sites is a permutation: exactly grain_count sites are kept.
    if part((number + p.seed) * 15485863 / len(sites)) * len(sites) + 0.5 >= grain_count:
        continue
    diameter = p.grain_diameter * (1 + p.grain_diameter_spread * (2 * shake(number, 1) - 1))
    corner = (margin, 0, 0)
    place = [low + (i + 0.5) * width + jitter * (2 * shake(number, use) - 1)
             for use, (low, i, width) in enumerate(zip(corner, index, cell), start=2)]
    body = utils.sphere(place, 0.5 * diameter, material=grain)
    O.bodies.append(body)
    volume += 4 / 3 * math.pi * body.shape.radius**3

# --- walls -------------------------------------------------------------------------------------------------------------
# `Wall` is unbounded, which a periodic collider cannot sort; boxes that reach far beyond the cell and all that grains travel do the same.
far, thick = 1e6 * p.grain_diameter, p.grain_diameter


def plane(centre: tuple[float, float, float], extents: tuple[float, float, float]) -> int:
    """A fixed box; its body id."""
    return O.bodies.append(utils.box(centre, extents, fixed=True, material=wall))


walls = {
    "left": plane((-thick, 0, 0), (thick, far, far)),
    "right": plane((p.channel_width + thick, 0, 0), (thick, far, far)),
}

weight = (0, 0, -p.gravity)
# The period shrinks, and the grains with it, until they fill the channel; there is no gravity yet. Each step multiplies the
# period by 1 + rate times the step.
period = volume / (p.solid_fraction * p.channel_width * p.channel_depth)
rate = ((period / z_high) ** (1 / pack_steps) - 1) / O.dt
O.cell.velGrad = Matrix3(0, 0, 0, 0, 0, 0, 0, 0, rate)

box = ((-d_max, p.channel_width + d_max), (0, p.channel_depth), (0, period))
dump = dembark.DumpWriter(walls=walls, bounds=box, boundary="ff pp pp", gravity=weight)
history = dembark.HistoryWriter(walls=walls, gravity=weight, path="time.csv", progress=False)


def release() -> None:
    """End of the compression: friction, gravity, and a push along it."""
    O.cell.velGrad = Matrix3.Zero
    O.engines[-1].gravity = weight
    pairing = O.engines[2].physDispatcher.functors[0]
    pairing.staticFriction, pairing.kineticFriction = pairs(grain_static, wall_static), pairs(grain_kinetic, wall_kinetic)
    for contact in O.interactions:
        at_wall = contact.id1 in walls.values() or contact.id2 in walls.values()
        contact.phys.staticFriction = wall_static if at_wall else grain_static
        contact.phys.kineticFriction = wall_kinetic if at_wall else grain_kinetic
    for body in O.bodies:
        if isinstance(body.shape, Sphere):
            # Velocities are half a step behind positions, and this step adds a whole one of gravity.
            body.state.vel += Vector3(0, 0, 0.5 * p.gravity * O.dt - p.start_speed * math.sqrt(p.gravity * p.channel_width))


def record() -> None:
    """Switch on gravity when it is time, and write what is due at this step."""
    if O.iter == pack_steps:
        release()
    if O.iter > 0 and O.iter % every == 0:
        history.write()
        if O.iter % (10 * every) == 0:
            print(O.iter, f"{O.time:.6g}", flush=True)
    if O.iter >= first and (O.iter - first) % stride == 0:
        dump.write()


def pairs(between_grains: float, at_wall: float) -> MatchMaker:
    """A property of a pair of materials."""
    return MatchMaker(matches=((grain, grain, between_grains), (grain, wall, at_wall)))


# Compressed with friction the grains would jam at a solid fraction at which they flow later; friction comes with gravity.
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], allowBiggerThanPeriod=True, verletDist=0.3 * p.grain_diameter),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
            restitution=p.restitution, staticFriction=0, kineticFriction=0, criticalSlipDistance=p.critical_slip_distance,
            interfaceShearStrength=p.interface_shear_strength, bridgeVolume=p.bridge_volume, contactAngle=p.contact_angle,
            surfaceTension=p.surface_tension)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(
            presliding=p.presliding, capillaryModel=p.capillary_model if p.bridge_volume > 0 else "none")],
    ),
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="record()", iterPeriod=1),
    NewtonIntegrator(damping=0, gravity=(0, 0, 0)),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume)
