"""Plug flow in YADE: the same grains, walls and measurements as liggghts.in. What is measured and why: README.md.

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
settle_steps = math.ceil(p.settle_time / O.dt)
run_in_steps = math.ceil(p.run_in * p.grain_diameter / (p.base_speed * O.dt))
stride = math.ceil(p.travel * p.grain_diameter / (p.base_speed * O.dt * p.frames))
first = settle_steps + run_in_steps + stride
steps = settle_steps + run_in_steps + stride * p.frames
every = max(1, steps // 1000)
rough = p.wall_roughness == "rough"
# Bodies with a common bit may touch: grains all others, walls and glued grains not each other.
GRAINS, WALLS, GLUED = 3, 1, 2

jitter = 0.05 * d_max
margin = 0.15 * d_max + (0.6 * p.grain_diameter if rough else 0)
n_x = math.floor((p.channel_width - 2 * margin) / (1.15 * d_max))
n_y = math.floor(p.channel_depth / (1.15 * d_max))
if min(p.channel_width, p.channel_depth) < 4 * p.grain_diameter:
    dembark.fail(f"channel_width {p.channel_width} m or channel_depth {p.channel_depth} m is too small, plug_flow/yade.py, "
                 f"take at least {4 * p.grain_diameter} m (4 grain_diameter)")
cell = ((p.channel_width - 2 * margin) / n_x, p.channel_depth / n_y, 1.15 * d_max)
layers = math.ceil(1.3 * p.grain_count / (n_x * n_y))
z_high = layers * cell[2]
z_box = z_high + 2 * d_max
sink = p.base_speed * O.dt * (steps - settle_steps)
z_low = -sink - 2 * d_max


def part(number: float) -> float:
    """Fractional part."""
    return number - math.floor(number)


def shake(site: int, use: int) -> float:
    """One uniform number in [0, 1) per site and use: the fractional part of a large sine."""
    return part(43758.5453 * math.sin(12.9898 * site + 78.233 * p.seed + use))


# YADE is periodic in all three directions; along x and z the cell leaves room for the walls, so only y closes on itself.
O.periodic = True
O.cell.setBox(p.channel_width + 8 * p.grain_diameter, p.channel_depth, z_box - z_low + 8 * p.grain_diameter)

# --- grains: a pseudo-random part of the cells of the column, none touching (see liggghts.in) ---------------------------------
grain = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
wall = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
sites = [(i, j, k) for k in range(layers) for j in range(n_y) for i in range(n_x)]
for number, index in enumerate(sites, start=1):
    # Multiplication by a prime modulo the number of sites is a permutation: exactly grain_count sites are kept.
    if part((number + p.seed) * 15485863 / len(sites)) * len(sites) + 0.5 >= p.grain_count:
        continue
    diameter = p.grain_diameter * (1 + p.grain_diameter_spread * (2 * shake(number, 1) - 1))
    corner = (margin, 0, 0.15 * d_max)
    place = [low + (i + 0.5) * width + jitter * (2 * shake(number, use) - 1)
             for use, (low, i, width) in enumerate(zip(corner, index, cell), start=2)]
    body = utils.sphere(place, 0.5 * diameter, material=grain, mask=GRAINS)
    # Velocities are half a step behind positions: this is rest at the time zero.
    body.state.vel = (0, 0, 0.5 * p.gravity * O.dt)
    O.bodies.append(body)

# --- walls -------------------------------------------------------------------------------------------------------------
# `Wall` is unbounded, which a periodic collider cannot sort; boxes that reach far beyond the cell and all that grains travel do the same.
far, thick = 1e6 * p.grain_diameter, p.grain_diameter
floor = dembark.spanning(p.grain_diameter)


def plane(centre: tuple[float, float, float], extents: tuple[float, float, float]) -> int:
    """A fixed box; its body id."""
    return O.bodies.append(utils.box(centre, extents, fixed=True, material=wall, mask=WALLS))


walls = {
    "left": plane((-thick, 0, 0), (thick, far, far)),
    "right": plane((p.channel_width + thick, 0, 0), (thick, far, far)),
    "base": plane((0, 0, -thick), (floor, far, thick)),
}
glued: dict[str, list[int]] = {"left": [], "right": []}
if rough:
    # Grains of the wall: 1.1 diameters apart in the wall's plane, moved off it by up to a tenth of a diameter.
    n_u = math.floor(p.channel_depth / (1.1 * p.grain_diameter))
    glue_y, glue_z = p.channel_depth / n_u, 1.1 * p.grain_diameter
    number = p.grain_count
    for k in range(math.ceil(z_low / glue_z - 0.5), math.floor(z_high / glue_z - 0.5) + 1):
        for j in range(n_u):
            for name, x in (("left", 0.0), ("right", p.channel_width)):
                number += 1
                off = 0.2 * p.grain_diameter * (shake(number, 2) - 0.5)
                place = (x + off, (j + 0.5) * glue_y, (k + 0.5) * glue_z)
                glued[name].append(O.bodies.append(utils.sphere(place, 0.5 * p.grain_diameter, fixed=True, material=wall, mask=GLUED)))

weight = (0, 0, -p.gravity)
box = ((-d_max, p.channel_width + d_max), (0, p.channel_depth), (z_low, z_box))
dump = dembark.DumpWriter(walls=walls, bounds=box, boundary="ff pp ff", gravity=weight)
# Grains own liquid and lend it to bridges, instead of bridges of a volume of their own. Walls have none and keep none.
carried = p.liquid_content > 0
liquid = CapillaryLiquid(content=p.liquid_content)
history = dembark.HistoryWriter(walls=walls, glued=glued if rough else {}, gravity=weight, path="time.csv", liquid=liquid if carried else None)


def record() -> None:
    """Start the plate when it is time, and write what is due at this step."""
    if O.iter == settle_steps:
        O.bodies[walls["base"]].state.vel = (0, 0, -p.base_speed)
    if O.iter > 0 and O.iter % every == 0:
        history.write()
    if O.iter >= first and (O.iter - first) % stride == 0:
        dump.write()


def pairs(between_grains: float, at_wall: float) -> MatchMaker:
    """A property of a pair of materials."""
    return MatchMaker(matches=((grain, grain, between_grains), (grain, wall, at_wall)))


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], allowBiggerThanPeriod=True, verletDist=0.1 * p.grain_diameter),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
            restitution=p.restitution, staticFriction=pairs(grain_static, wall_static), kineticFriction=pairs(grain_kinetic, wall_kinetic),
            criticalSlipDistance=p.critical_slip_distance, interfaceShearStrength=p.interface_shear_strength,
            bridgeVolume=0 if carried else p.bridge_volume, contactAngle=p.contact_angle, surfaceTension=p.surface_tension)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(
            presliding=p.presliding, capillaryModel=p.capillary_model if carried or p.bridge_volume > 0 else "none",
            carriedLiquid=carried)],
    ),
    *([liquid] if carried else []),
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="record()", iterPeriod=1),
    NewtonIntegrator(damping=0, gravity=weight),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume)
