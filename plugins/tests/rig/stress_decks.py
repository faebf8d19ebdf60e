"""Decks of random scenes for LAMMPS and LIGGGHTS."""

from __future__ import annotations

from rig import lammps_driver, liggghts_driver
from rig.energy_account import FIX, THERMO
from rig.stress import (
    COLUMNS,
    CONTENT,
    DENSITY,
    EVERY,
    FIRST,
    GRAVITY,
    GROWTH,
    INSERTED,
    LAST,
    SIDE,
    STATES,
    STEP,
    Grain,
    Scene,
    first,
    second,
)

DOMAIN = f"region domain block 0 {SIDE} 0 {SIDE} -0.004 0.06 units box\ncreate_box 2 domain"
FLOOR = [((0.0, 0.0, 0.0), (SIDE, 0.0, 0.0), (SIDE, SIDE, 0.0)), ((0.0, 0.0, 0.0), (SIDE, SIDE, 0.0), (0.0, SIDE, 0.0))]
SLOT = f"region slot block 0.0005 {SIDE - 0.0005} 0.0005 {SIDE - 0.0005} 0.03 0.05 units box"
LIQUID = """\
fix liquid all capillary/liquid content {}{}
variable now equal step
variable held equal f_liquid[7]
variable error equal f_liquid[8]
fix books all print {} "${{now}} ${{held}} ${{error}}" file books.txt screen no title "#"
"""


def _create(grains: list[Grain], begin: int) -> str:
    lines = []
    for number, grain in enumerate(grains, start=begin):
        place, speed = (" ".join(map(repr, part)) for part in (grain.position, grain.velocity))
        vx, vy, vz = speed.split()
        lines += [f"create_atoms 1 single {place} units box",
                  f"set atom {number} diameter {2.0 * grain.radius!r} density {DENSITY} vx {vx} vy {vy} vz {vz}"]
    return "\n".join(lines)


def lammps(scene: Scene, *, ranks: int = 1, resumed: bool = False) -> str:
    law = lammps_driver.settings(scene.law)
    coefficients = lammps_driver.coefficients(scene.law)
    if scene.carried:
        law += " carried_liquid on"
        coefficients = coefficients.replace(f"bridge_volume {scene.law.bridge_volume!r}", "")
    surface = "region floor" if scene.floor == "plane" else "stl floor.stl"
    wall = f"fix floor all wall/dembark {surface} type 2"
    moved = f"{wall} motion {scene.motion}" if scene.motion else wall
    liquid = LIQUID.format(CONTENT, " wall floor 1e-9 0.1 0.3", EVERY) if scene.carried else ""
    enters = ""
    if scene.entering in INSERTED:
        count, radius = INSERTED[scene.entering]
        enters = (f"{SLOT}\nfix enter all pour {count} 1 4711 region slot diam one {2.0 * radius} dens {DENSITY} {DENSITY} "
                  "vel -0.1 0.1 -0.1 0.1 -1.0")
    return _deck(scene, resumed, enters=enters, head=f"""\
{lammps_driver.head("off", "p p f")}
processors {ranks} 1 1""", styles=f"""\
pair_style dembark/granular {law}
pair_coeff * * {coefficients}
region floor plane 0 0 0 0 0 1 units box""", walls=moved if not scene.late else "" if resumed else wall,
                 late=(moved if resumed else f"unfix floor\n{moved}") if scene.late else "",
                 liquid=liquid, columns=COLUMNS + " f_floor[1] f_floor[2] f_floor[3]", digits="float %.17g")


def liggghts(scene: Scene, *, ranks: int = 1, resumed: bool = False) -> str:
    """Moves STL surfaces only."""
    overrides = {"bridgeVolume": ""} if scene.carried else {}
    law = scene.law
    models = liggghts_driver.models(law) + (" carried_liquid on" if scene.carried else "")
    place = "primitive type 2 zplane 0" if scene.floor == "plane" else "mesh n_meshes 1 meshes surface"
    wall = f"fix floor all wall/gran {liggghts_driver.models(law, wall=place)}" + (" carried_liquid on" if scene.carried else "")
    mesh = "fix surface all mesh/surface file floor.stl type 2\n" if scene.floor == "stl" else ""
    moved = f"fix move all wall/motion mesh surface {scene.motion}\n" if scene.motion else ""
    walls = f"{mesh}{'' if scene.late else moved}{wall}"
    liquid = LIQUID.format(CONTENT, " wall floor 1e-9 0.1 0.3" if scene.floor == "plane" else "", EVERY) if scene.carried else ""
    enters = ""
    if scene.entering in INSERTED:
        count, radius = INSERTED[scene.entering]
        enters = f"""\
{SLOT}
fix template all particletemplate/sphere 15485863 atom_type 1 density constant {DENSITY} radius constant {radius}
fix mixture all particledistribution/discrete 32452843 1 template 1.0
fix enter all insert/pack seed 32452867 distributiontemplate mixture vel constant 0 0 -1 insert_every once overlapcheck yes all_in yes &
 particles_in_region {count} region slot"""
    return _deck(scene, resumed, enters=enters, head=f"""\
{liggghts_driver.head("off", "p p f")}
processors {ranks} 1 1""", styles=f"""\
{liggghts_driver.properties(law, **overrides)}
pair_style gran {models}
pair_coeff * *""", walls=walls, late=moved if scene.late else "", liquid=liquid, columns=COLUMNS, digits='"%d' + " %.17g" * 11 + '"')


def _deck(scene: Scene, resumed: bool, *, head: str, styles: str, walls: str, late: str, liquid: str, enters: str, columns: str,
          digits: str) -> str:
    begins = "resume_state state" if resumed else DOMAIN
    first_part = "" if resumed else f"{_create(first(scene), 1)}\n"
    between = late if resumed else "\n".join([
        f"run {FIRST}", _create(second(scene), len(first(scene)) + 1),
        *(f"set atom {n} diameter {2.0 * GROWTH * grain.radius!r}\nset atom {n} density {DENSITY}"
          for n, grain in enumerate(first(scene), start=1) if scene.entering == "grown"), late])
    dump = f"dump grains all custom {EVERY} grains.dump {columns}\ndump_modify grains sort id format {digits}\n"
    before, after = ("", f"{dump}dump_modify grains append yes\n") if resumed else (dump, "")
    state = f"fix state all resume/exact {STATES} state cut grains.dump books.txt\n" if scene.resumed else ""
    books = liquid.replace("file books.txt", "append books.txt" if resumed else "file books.txt")
    return f"""\
{head}
{begins}
neighbor 0.002 bin
neigh_modify delay 0
timestep {STEP}
{styles}
{first_part}{walls}
{books}
fix weight all gravity {GRAVITY} vector 0 0 -1
fix motion all nve/sphere
{FIX}
{before}{THERMO}thermo {EVERY}
{between}
{after}{enters}
{state}run {LAST} upto
"""
