"""Silo in YADE: the same grains, walls and measurements as liggghts.in. What is measured and why: README.md.

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
stride = math.ceil(p.measure_time / O.dt / p.frames)
settle_steps = math.ceil(p.settle_time / O.dt)
first = settle_steps + stride
steps = settle_steps + stride * p.frames
every = max(1, steps // 1000)

if p.cylinder_radius < 3 * p.grain_diameter:
    dembark.fail(f"cylinder_radius {p.cylinder_radius} m is too small, silo/yade.py, "
                 f"take at least {3 * p.grain_diameter} m (3 grain_diameter)")
spacing = 1.15 * d_max
jitter = 0.05 * d_max
fill_radius = 1.000001 * (p.cylinder_radius - 0.65 * d_max - jitter)
layers = math.ceil(1.3 * p.grain_count * spacing**2 / (math.pi * fill_radius**2)) + 2
z_low = 0.65 * d_max + jitter
z_high = z_low + layers * spacing
half = p.cylinder_radius + d_max


def part(number: float) -> float:
    """Fractional part."""
    return number - math.floor(number)


def shake(site: int, use: int) -> float:
    """One uniform number in [0, 1) per site and use: the fractional part of a large sine."""
    return part(43758.5453 * math.sin(12.9898 * site + 78.233 * p.seed + use))


# --- grains: a pseudo-random part of the sites of a cubic lattice, none touching (see liggghts.in) ----------------------------
reach = math.ceil(p.cylinder_radius / spacing)
plane = [(i * spacing, j * spacing) for j in range(-reach, reach + 1) for i in range(-reach, reach + 1)
         if math.hypot(i, j) * spacing <= fill_radius]
levels = [k * spacing for k in range(math.ceil(z_low / spacing), math.floor(z_high / spacing) + 1)]
sites = [(x, y, z) for z in levels for x, y in plane]

grain = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
wall = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
for number, place in enumerate(sites, start=1):
    # Multiplication by a prime modulo the number of sites is a permutation: exactly grain_count sites are kept.
    if part((number + p.seed) * 15485863 / len(sites)) * len(sites) + 0.5 >= p.grain_count:
        continue
    diameter = p.grain_diameter * (1 + p.grain_diameter_spread * (2 * shake(number, 1) - 1))
    body = utils.sphere([x + jitter * (2 * shake(number, use) - 1) for use, x in enumerate(place, start=2)], 0.5 * diameter, material=grain)
    # Velocities are half a step behind positions: this is rest at the time zero.
    body.state.vel = (0, 0, 0.5 * p.gravity * O.dt)
    O.bodies.append(body)

# --- walls: the cylinder moves along its own axis, so its shape stays --------------------------------------------------
side_body = Body()
side_body.shape = CylinderWall(radius=p.cylinder_radius, axis=(0, 0, 1))
side_body.material = O.materials[wall]
side_body.state.blockedDOFs = "xyzXYZ"
side_body.dynamic = False
side_body.state.vel = (0, 0, p.wall_speed)
side = O.bodies.append(side_body)
base = O.bodies.append(utils.wall((0, 0, 0), axis=2, sense=1, material=wall))

weight = (0, 0, -p.gravity)
walls = {"side": side, "base": base}
box = ((-half, half), (-half, half), (-d_max, z_high + 4 * d_max))
dump = dembark.DumpWriter(walls=walls, bounds=box, boundary="ff ff ff", gravity=weight)
# Grains own liquid and lend it to bridges, instead of bridges of a volume of their own. Walls have none and keep none.
carried = p.liquid_content > 0
liquid = CapillaryLiquid(content=p.liquid_content)
history = dembark.HistoryWriter(walls=walls, gravity=weight, path="time.csv", liquid=liquid if carried else None)


def record() -> None:
    """Write what is due at this step."""
    if O.iter > 0 and O.iter % every == 0:
        history.write()
    if O.iter >= first and (O.iter - first) % stride == 0:
        dump.write()


def pairs(between_grains: float, at_wall: float) -> MatchMaker:
    """A property of a pair of materials."""
    return MatchMaker(matches=((grain, grain, between_grains), (grain, wall, at_wall)))


O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_CylinderWall_Aabb(), Bo1_Wall_Aabb()], verletDist=0.1 * p.grain_diameter),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_CylinderWall_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
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
