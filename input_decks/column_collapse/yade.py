"""Column collapse in YADE: the same grains, walls and measurements as liggghts.in. What is measured and why: README.md.

By hand, in an empty folder: yade -n -x yade.py [key=value ...]
Keys, defaults and units (SI) are those of case.toml beside this file.
"""

import math
import sys
from pathlib import Path

from yade import dembark, utils

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
# A row of time.csv every `every` steps, a frame every 20 rows; the gate begins to move at a row, which is the first frame.
every = math.ceil(p.collapse_time / O.dt / (20 * (p.frames - 1)))
stride = 20 * every
first = every * math.ceil(p.settle_time / O.dt / every)
steps = first + stride * (p.frames - 1)

if min(p.column_width, p.column_depth) < 4 * p.grain_diameter:
    dembark.fail(f"column_width {p.column_width} m or column_depth {p.column_depth} m is too small, column_collapse/yade.py, "
                 f"take at least {4 * p.grain_diameter} m (4 grain_diameter)")
if p.liquid_viscosity > 0 and not p.bridge_volume > 0:
    dembark.fail(f"liquid_viscosity {p.liquid_viscosity} Pa s without liquid, column_collapse/yade.py, give bridge_volume > 0 too")
jitter, margin = 0.05 * d_max, 0.15 * d_max
n_x = math.floor((p.column_width - 2 * margin) / (1.15 * d_max))
n_y = math.floor(p.column_depth / (1.15 * d_max))
cell = ((p.column_width - 2 * margin) / n_x, p.column_depth / n_y, 1.15 * d_max)
layers = math.ceil(1.3 * p.grain_count / (n_x * n_y))
z_box = layers * cell[2] + 2 * d_max
ramp = math.ceil(p.gate_speed / (p.gate_acceleration * O.dt))
x_high = p.column_width + p.gate_speed * O.dt * (steps - first) + 2 * d_max

# YADE is periodic in all three directions; along x and z the cell leaves room for the walls, so only y closes on itself.
O.periodic = True
O.cell.setBox(x_high + 8 * p.grain_diameter, p.column_depth, z_box + 10 * p.grain_diameter)

# --- grains: a pseudo-random part of the cells of the column, none touching (see liggghts.in) ---------------------------------
grain = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
wall = O.materials.append(FrictMat(young=p.youngs_modulus, poisson=p.poisson_ratio, density=p.grain_density))
sites = dembark.lattice((n_x, n_y, layers), cell, origin=(margin, 0, margin))
for *place, radius in dembark.column(sites, p.grain_count, p.grain_diameter, p.grain_diameter_spread, p.seed, jitter):
    body = utils.sphere(place, radius, material=grain)
    # Velocities are half a step behind positions: this is rest at the time zero.
    body.state.vel = (0, 0, 0.5 * p.gravity * O.dt)
    O.bodies.append(body)

# --- walls: `Wall` is unbounded, which a periodic collider cannot sort; boxes far larger than the cell do the same ---------
far, thick = 1e6 * p.grain_diameter, p.grain_diameter
floor = dembark.spanning(p.grain_diameter)


def plane(centre: tuple[float, float, float], extents: tuple[float, float, float]) -> int:
    """A fixed box; its body id."""
    return O.bodies.append(utils.box(centre, extents, fixed=True, material=wall))


walls = {
    "back": plane((-thick, 0, 0), (thick, far, far)),
    "base": plane((0, 0, -thick), (floor, far, thick)),
    "gate": plane((p.column_width + thick, 0, 0), (thick, far, far)),
}

weight = (0, 0, -p.gravity)
box = ((-d_max, x_high), (0, p.column_depth), (-2 * d_max, z_box))
dump = dembark.DumpWriter(walls=walls, bounds=box, boundary="ff pp ff", gravity=weight)
columns = ("first_kinetic", "gravity", "normal_elastic", "normal_viscous", "tangential_elastic", "tangential_viscous", "capillary",
           "liquid_viscous", "walls", "other", "imposed", "balance", "normal_stored", "tangential_stored", "step_error", "scale")
history = open("time.csv", "a" if p.resume else "w")
if not p.resume:
    history.write(",".join(["step", "time", "kinetic_energy", *columns, "potential_energy", "weight_height"]) + "\n")


def record() -> None:
    """Give the gate its speed in the coming step, and write what is due at this step."""
    if first <= O.iter < first + ramp:
        O.bodies[walls["gate"]].state.vel = (p.gate_speed * (O.iter + 1 - first) / ramp, 0, 0)
    if O.iter > 0 and O.iter % every == 0:
        write_row()
    if O.iter >= first and (O.iter - first) % stride == 0:
        dump.write()


def write_row() -> None:
    """A row of the energies (J) up to this step, with all digits."""
    energies = dembark.energies()
    grains = [O.bodies[k].state for k in range(p.grain_count)]
    height = p.gravity * math.fsum(state.mass * state.pos[2] for state in grains)
    # Gravity's work up to this step is m g times the fall of the middle between the last two positions: see README.md.
    potential = height - p.gravity * math.fsum(0.5 * O.dt * state.mass * state.vel[2] for state in grains)
    numbers = [O.time, energies["kinetic"], *(energies[name] for name in columns), potential, height]
    history.write(",".join([str(O.iter), *(f"{x:.17g}" for x in numbers)]) + "\n")
    history.flush()
    if O.iter % stride == 0:
        print(O.iter, f"{O.time:.6g}", f"{energies['kinetic']:.6g}", flush=True)


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
            criticalSlipDistance=p.critical_slip_distance, bridgeVolume=p.bridge_volume, contactAngle=p.contact_angle,
            surfaceTension=p.surface_tension, liquidViscosity=p.liquid_viscosity, minimumGap=p.minimum_gap)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(capillaryModel=p.capillary_model if p.bridge_volume > 0 else "none")],
    ),
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="record()", iterPeriod=1),
    EnergyAccount(),
    NewtonIntegrator(damping=0, gravity=weight),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume)
