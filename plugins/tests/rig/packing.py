"""A packing of 64 grains that fall on a floor, as a LIGGGHTS deck; periodic along the floor, on two ranks unless the line is taken out."""

from __future__ import annotations

from rig import liggghts_driver
from rig.scenarios import Material

SETUP = """\
{head}
processors 2 1 1
{create}
neighbor 0.002 bin
neigh_modify delay 0
timestep 1e-5
{properties}
pair_style gran {pair}
pair_coeff * *
{state}
fix floor all wall/gran {wall}
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
dump grains all custom {every} {dump} id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz
dump_modify grains sort id format "%d{numbers}"
thermo 1000
{run}
"""
# One by one, as on a lattice the numbers of grains depend on how the domain is divided.
CREATE = "\n".join([
    "region domain block 0 0.024 0 0.024 -0.001 0.06 units box", "create_box 2 domain",
    *(f"create_atoms 1 single {0.003 + 0.006 * i} {0.003 + 0.006 * j} {0.003 + 0.006 * k} units box"
      for i in range(4) for j in range(4) for k in range(4))])


def start_state(diameter: str, speed: float) -> str:
    """Sizes and velocities of the grains, told from their numbers: `diameter` in LIGGGHTS's words, `speed` along x and y at most."""
    return f"""\
variable size atom {diameter}
variable push_x atom {speed}*sin(91*id)
variable push_y atom {speed}*sin(53*id)
variable push_z atom {speed}*sin(17*id)-0.3
set group all density 2500 diameter v_size density 2500
set group all vx v_push_x vy v_push_y vz v_push_z"""


STATE = start_state("0.005*(1+0.1*sin(37*id))", 0.3)


def packing(material: Material, run_command: str, *, newton: str = "off", create: str = CREATE, state: str = STATE,
            dump: str = "grains.dump", every: int = 1500) -> str:
    """The deck: `create` makes or reads the grains, `state` gives them sizes and velocities; a frame with all digits `every` steps."""
    return SETUP.format(head=liggghts_driver.head(newton, "p p f"), create=create, state=state, every=every, dump=dump,
                        properties=liggghts_driver.properties(material),
                        pair=liggghts_driver.models(material), wall=liggghts_driver.models(material, wall="primitive type 2 zplane 0"),
                        numbers=" %.17g" * 15, run=run_command)
