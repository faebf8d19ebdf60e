"""A packing of 48 grains of two types that fall on a floor, as a LAMMPS deck; periodic along the floor, on two ranks if there are two."""

from __future__ import annotations

from dataclasses import replace

from rig import lammps_driver
from rig.scenarios import SPRING, Material

WET = Material(static_friction=0.5, kinetic_friction=0.4, interface_shear_strength=1e5, bridge_volume=2e-10, presliding="partial_slip",
               **SPRING)
# One by one: on a lattice the numbers of the grains would depend on how the domain is divided.
CREATE = "\n".join([
    "region domain block 0 0.024 0 0.024 -0.001 0.05 units box", "create_box 3 domain",
    *(f"create_atoms {1 + (i + j) % 2} single {0.003 + 0.006 * i} {0.003 + 0.006 * j} {0.003 + 0.006 * k} units box"
      for i in range(4) for j in range(4) for k in range(3))])
STATE = """\
set group all density 2500
variable size atom 0.005*(1+0.1*sin(37*id))
variable push_x atom 0.3*sin(91*id)
variable push_y atom 0.3*sin(53*id)
variable push_z atom 0.3*sin(17*id)-0.3
set group all diameter v_size density 2500 vx v_push_x vy v_push_y vz v_push_z"""
COLUMNS = "id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz f_floor[1] f_floor[2] f_floor[3]"


def bed(run: str, *, material: Material = WET, newton: str = "off", create: str = CREATE, state: str = STATE, dump: str = "grains.dump",
        every: int = 500, head: str = "") -> str:
    """The deck: `create` makes or reads the grains, `state` gives them sizes and velocities; a frame with all digits `every` steps."""
    softer = replace(material, youngs_modulus=5e6, static_friction=0.7)
    return f"""\
{lammps_driver.head(newton, "p p f")}
{head}
{create}
neighbor 0.002 bin
neigh_modify delay 0
timestep 1e-5
pair_style dembark/granular {lammps_driver.settings(material)}
pair_coeff * * {lammps_driver.coefficients(material)}
pair_coeff 2 2 {lammps_driver.coefficients(softer)}
pair_coeff 1 2 static_friction 0.6
{state}
region floor plane 0 0 0 0 0 1 units box
fix floor all wall/dembark region floor type 3
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
dump grains all custom {every} {dump} {COLUMNS}
dump_modify grains sort id format float %.17g
thermo_modify lost error
thermo 1000
{run}
"""
