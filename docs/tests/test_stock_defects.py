"""The statements of docs/how-to/stock_defects.md about LIGGGHTS 3.8.0, tried with the stock program.

A test that fails means that the installed LIGGGHTS no longer has the defect: the page is then to be changed.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from dembark.validation.engines import call

STOCK = shutil.which("liggghts")
pytestmark = pytest.mark.skipif(STOCK is None, reason="the stock LIGGGHTS (package liggghts) is not installed")

WASHINO = "hertz tangential history cohesion washino/capillary/viscous"
MATERIAL = """
fix m1 all property/global youngsModulus peratomtype 5e6 5e6
fix m2 all property/global poissonsRatio peratomtype 0.3 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.5 0.5 0.5 0.5
fix m4 all property/global coefficientFriction peratomtypepair 2 0.5 0.5 0.5 0.5
"""


def run(folder: Path, deck: str, *words: str) -> subprocess.CompletedProcess[str]:
    """The stock program on `deck` in `folder`."""
    (folder / "deck.in").write_text(deck)
    return call([STOCK, "-in", "deck.in", "-log", "none", *words], folder)


def scene(radius: float, boundary: str = "f f f", skin: float | None = None) -> str:
    """Head of a deck with a box of 20 radii around the origin and two types."""
    size = 10.0 * radius
    return (f"units si\natom_style granular\natom_modify map array\nboundary {boundary}\nnewton off\ncommunicate single vel yes\n"
            f"region box block {-size} {size} {-size} {size} {-size} {size} units box\ncreate_box 2 box\n"
            f"neighbor {radius if skin is None else skin} bin\nneigh_modify delay 0\n")


def wet_force(folder: Path, gap: float, *, radius: float = 0.0025, content: float = 0.01, angles: tuple[float, float] = (0.0, 0.0),
              viscosity: float = 0.0, floor: float = 1.01, speed: float = 0.0, wall: bool = False, longest: float = 1.5) -> float:
    """Force (N) along x of washino/capillary/viscous on the right one of two spheres (or on a sphere over a wall), Hertz subtracted."""
    right = gap if wall else gap + 2.0 * radius
    position = radius + gap if wall else right
    left = "" if wall else "create_atoms 1 single 0 0 0 units box\n"

    def total(cohesion: bool) -> float:
        model = WASHINO if cohesion else "hertz tangential history"
        body = scene(radius) + left + f"create_atoms 2 single {position!r} 0 0 units box\n"
        body += f"set group all density 2500 diameter {2 * radius!r}\nset type 2 vx {speed}\n" + MATERIAL
        if cohesion:
            body += (f"fix c1 all property/global surfaceLiquidContentInitial scalar {content!r}\n"
                     "fix c2 all property/global surfaceTension scalar 0.072\n"
                     f"fix c3 all property/global fluidViscosity scalar {viscosity!r}\n"
                     f"fix c4 all property/global contactAngle peratomtype {angles[0]} {angles[1]}\n"
                     f"fix c5 all property/global minSeparationDistanceRatio scalar {floor!r}\n"
                     f"fix c6 all property/global maxSeparationDistanceRatio scalar {longest!r}\n")
        body += f"pair_style gran model {model}\npair_coeff * *\ntimestep 1e-9\n"
        if wall:
            body += f"fix wall all wall/gran model {model} primitive type 1 xplane 0\n"
        body += ("group right type 2\ncompute f right reduce sum fx\nvariable f equal c_f\nthermo_style custom step c_f\n"
                 "run 1\nprint 'force ${f}'\n")
        result = run(folder, body)
        assert result.returncode == 0, result.stdout[-2000:] + result.stderr
        return float(next(line.split()[1] for line in result.stdout.splitlines() if line.startswith("force ")))

    # Without a touch there is nothing to subtract.
    return total(True) - (total(False) if gap < 0.0 else 0.0)


def bridge_volume(radius: float, content: float) -> float:
    """What the stock model puts into a bridge of two equal spheres: 5 % of both films."""
    return 0.05 * 2.0 * 4.0 / 3.0 * math.pi * radius**3 * content


def test_contact_angle_is_a_product(tmp_path: Path) -> None:
    dry = wet_force(tmp_path, -1e-9)
    assert wet_force(tmp_path, -1e-9, angles=(60.0, 0.0)) == pytest.approx(dry, rel=1e-9)  # the mean is 30 degrees
    assert wet_force(tmp_path, -1e-9, angles=(60.0, 60.0)) / dry == pytest.approx(math.cos(0.5 * math.radians(60.0) ** 2), rel=1e-3)


def test_small_volumes_have_no_force(tmp_path: Path) -> None:
    assert wet_force(tmp_path, 1e-9, radius=13e-6) == 0.0
    assert wet_force(tmp_path, 1e-9, radius=14e-6) < -1e-7


@pytest.mark.parametrize(("reduced", "jump"), [(1e-4, 0.008), (1e-2, 0.078)])
def test_force_jumps_at_touching(tmp_path: Path, reduced: float, jump: float) -> None:
    radius = 0.0025
    content = reduced * (0.5 * radius) ** 3 / bridge_volume(radius, 1.0)
    ratio = wet_force(tmp_path, 1e-11, radius=radius, content=content) / wet_force(tmp_path, -1e-11, radius=radius, content=content)
    assert ratio - 1.0 == pytest.approx(jump, abs=0.001)


def test_no_number_at_zero_gap(tmp_path: Path) -> None:
    assert math.isnan(wet_force(tmp_path, 0.0, radius=0.5))


def test_force_is_half_of_the_bridge(tmp_path: Path) -> None:
    from dembark.physics import capillary_force

    radius, content = 0.0025, 0.001
    exact = capillary_force(radius, radius, 0.0, bridge_volume(radius, content), 0.072, 0.0)
    assert -wet_force(tmp_path, -1e-9, radius=radius, content=content) / exact == pytest.approx(0.53, abs=0.02)


def test_wall_has_a_quarter_and_nothing_when_touched(tmp_path: Path) -> None:
    radius = 0.0025
    plane = 4.0 * math.pi * radius * 0.072
    assert -wet_force(tmp_path, 1e-10, content=1e-5, wall=True) / plane == pytest.approx(0.25, abs=0.02)
    assert wet_force(tmp_path, -1e-10, content=1e-5, wall=True) == pytest.approx(0.0, abs=1e-9 * plane)


def test_bridge_is_there_before_the_first_touch(tmp_path: Path) -> None:
    assert wet_force(tmp_path, 0.2e-3) < -1e-5


def test_liquid_content_is_a_fraction(tmp_path: Path) -> None:
    radius = 0.0025
    per_cent, fraction = (bridge_volume(radius, content) ** (1 / 3) for content in (0.01, 1.0))
    gap = 0.5 * (per_cent + fraction)
    assert wet_force(tmp_path, gap, radius=radius, content=1.0) < 0.0  # as 1 % it would have ruptured


def test_recommended_floor_switches_lubrication_off(tmp_path: Path) -> None:
    radius, viscosity, speed, gap = 0.0025, 0.001, 0.1, 1e-5
    drag = wet_force(tmp_path, gap, viscosity=viscosity, speed=speed) - wet_force(tmp_path, gap)
    assert drag == pytest.approx(-6 * math.pi * viscosity * 0.5 * radius * speed / 1.01, rel=1e-3)
    real = -6 * math.pi * viscosity * (0.5 * radius) ** 2 * speed / gap
    assert real / drag > 100.0


def touched_twice(folder: Path, factor: str) -> float:
    """Tangential force in the first step of a second contact over that at the end of the first one, which slid.

    The pair parts and meets again within one step each, without a tangential motion and without a new neighbour list.
    """
    radius = 0.0025
    result = run(folder, scene(radius, skin=0.002) + factor + f"""
create_atoms 1 single 0 0 0 units box
create_atoms 1 single {2 * radius - 1e-6!r} 0 0 units box
set group all density 2500 diameter {2 * radius}
group right id 2
{MATERIAL.replace("0.5 0.5 0.5 0.5", "1.0 1.0 1.0 1.0", 1)}
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
variable vx equal 0.5*(step>100)*(step<=101)-0.5*(step>120)*(step<=121)
variable vy equal 0.01*(step<=100)
variable zero equal 0.0
fix m right move variable NULL NULL NULL v_vx v_vy v_zero units box
variable overlap equal {2 * radius!r}-sqrt((x[2]-x[1])^2+(y[2]-y[1])^2)
variable fy equal fy[2]
thermo_style custom step v_overlap v_fy
thermo 1
run 122
""")
    rows = [line.split() for line in result.stdout.splitlines() if line.strip()[:1].isdigit() and len(line.split()) == 3]
    table = {int(step): (float(overlap), float(force)) for step, overlap, force in rows}
    touching = [step for step, (overlap, _) in table.items() if overlap > 0.0]
    last = max(step for step in touching if step < 110)
    again = min(step for step in touching if step > 110)
    return table[again][1] / table[last][1]


def test_tangential_displacement_outlives_the_contact(tmp_path: Path) -> None:
    assert touched_twice(tmp_path, "") == pytest.approx(1.0, rel=0.05)
    assert touched_twice(tmp_path, "neigh_modify contact_distance_factor 1.01\n") == pytest.approx(0.0, abs=0.05)


def test_viscous_friction_is_not_limited_and_shows_in_local_forces(tmp_path: Path) -> None:
    radius = 0.0025
    result = run(tmp_path, scene(radius) + f"""
create_atoms 1 single 0 0 0 units box
create_atoms 1 single {2 * radius - 1e-6!r} 0 0 units box
set group all density 2500 diameter {2 * radius}
group right id 2
{MATERIAL}
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix m right move linear 0 0.01 0 units box
compute pair all pair/gran/local force
dump pair all local 100 pair.dump c_pair[1] c_pair[2] c_pair[3]
variable fx equal fx[2]
variable fy equal fy[2]
thermo_style custom step v_fx v_fy
thermo 1
run 100
""")
    assert result.returncode == 0, result.stdout[-2000:]
    rows = {int(line.split()[0]): line.split()[1:] for line in result.stdout.splitlines() if re.fullmatch(r"\s*\d+(\s+\S+){2}\s*", line)}
    normal, friction = (abs(float(word)) for word in rows[1])
    assert friction > 2.0 * 0.5 * normal  # viscous, without Coulomb's limit
    normal, friction = (abs(float(word)) for word in rows[100])
    assert friction == pytest.approx(0.5 * normal, rel=0.05)  # it slides
    local = float((tmp_path / "pair.dump").read_text().splitlines()[-1].split()[1])
    assert abs(local) > 2.0 * friction


def test_insertion_without_screen_crashes(tmp_path: Path) -> None:
    deck = scene(0.0025) + MATERIAL + """
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-6
fix t1 all particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant 0.0025
fix d1 all particledistribution/discrete 32452843 1 t1 1.0
region fill block -0.02 0.02 -0.02 0.02 -0.02 0.02 units box
fix i1 all insert/pack seed 49979687 distributiontemplate d1 insert_every once overlapcheck yes particles_in_region 5 region fill
fix motion all nve/sphere
run 1
"""
    assert run(tmp_path, deck).returncode == 0
    assert run(tmp_path, deck, "-screen", "none").returncode < 0


def bed(steps: str, shift: float = 0.0) -> str:
    """Grains in disorder that fall on each other; positions and velocities at the end go to end.dump. A `shift` (m) along x takes some of
    them across the border, which is periodic."""
    radius, side = 0.0025, 0.05
    rng = np.random.default_rng(1)
    lines = [f"create_atoms 1 single {(x + shift + 0.5 * side) % side - 0.5 * side!r} {y!r} {z!r} units box" for x, y, z in
             (np.array([[i, j, k] for i in range(3) for j in range(3) for k in range(3)]) * 0.00495 - 0.005
              + rng.uniform(-1e-5, 1e-5, (27, 3))).tolist()]
    return scene(radius, "p f f" if shift else "f f f") + "\n".join(lines) + f"""
set group all density 2500 diameter {2 * radius}
{MATERIAL}
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix g all gravity 9.81 vector 0.3 0.1 -1
fix floor all wall/gran model hertz tangential history primitive type 2 zplane -0.0075
fix motion all nve/sphere
{steps}
write_dump all custom end.dump id x y z vx vy vz modify sort id format "%d %.17g %.17g %.17g %.17g %.17g %.17g"
"""


def end_state(folder: Path, steps: str, **words: float) -> np.ndarray:
    result = run(folder, bed(steps, **words))
    assert result.returncode == 0, result.stdout[-2000:]
    return np.loadtxt(folder / "end.dump", skiprows=9)


def test_two_runs_are_not_one(tmp_path: Path) -> None:
    whole, parts, joined = (end_state(tmp_path, steps) for steps in ("run 200", "run 100\nrun 100", "run 100\nrun 100 pre no"))
    assert np.array_equal(whole, joined)
    assert np.abs(whole - parts).max() > 1e-9


def test_atoms_created_between_runs_take_histories_away(tmp_path: Path) -> None:
    new = "".join(f"create_atoms 1 single {0.006 * k} {0.006 * j} 0.022 units box\nset atom {34 + 4 * j + k} diameter 0.005 density 2500\n"
                  for j in range(-1, 2) for k in range(-2, 2))
    left, added, stored = (end_state(tmp_path, f"run 60\n{between}run 40", shift=0.025)[:27]
                           for between in ("", new, f"write_restart state\n{new}"))
    assert np.array_equal(left, stored)
    assert np.abs(left - added).max() > 1e-9


def printed(folder: Path, body: str, name: str) -> float:
    """The number that the deck `body` prints after `name`."""
    result = run(folder, body)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr
    return float(next(line.split()[1] for line in result.stdout.splitlines() if line.startswith(f"{name} ")))


def pressed_over_edge(folder: Path, angle: float, place: float, curvature: str = "") -> float:
    """Force (N) along z on a grain 0.03 mm deep in the first of two strips; the second one beyond x = 0 rises by `angle` (degrees)."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    far = (0.02 * c, 0.02 * s)
    strips = [((-0.02, 0.0), (0.0, 0.0)), ((0.0, 0.0), far)]
    corners = []
    for (x, z), (u, w) in strips:
        a, b, d, e = (x, -0.02, z), (u, -0.02, w), (u, 0.021, w), (x, 0.021, z)
        corners += [(a, b, d), (a, d, e)]
    facets = "".join(" facet normal 0 0 1\n  outer loop\n" + "".join(f"   vertex {p[0]!r} {p[1]!r} {p[2]!r}\n" for p in three) +
                     "  endloop\n endfacet\n" for three in corners)
    (folder / "bent.stl").write_text(f"solid bent\n{facets}endsolid bent\n")
    body = scene(0.005) + f"create_atoms 1 single {place!r} 0.003 0.00497 units box\nset group all density 2500 diameter 0.01\n" + MATERIAL
    body += f"""
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-9
fix stl all mesh/surface file bent.stl type 2 {curvature}
fix wall all wall/gran model hertz tangential history mesh n_meshes 1 meshes stl
compute f all reduce sum fz
variable f equal c_f
thermo_style custom step c_f
run 1
print 'force ${{f}}'
"""
    return printed(folder, body, "force")


def test_edges_of_a_mesh_count_beside_their_faces(tmp_path: Path) -> None:
    """At a ridge twice the force of the face, as far as sqrt(2 R overlap); none with a large `curvature`; a groove counts both faces."""
    flat = pressed_over_edge(tmp_path, 0.0, -1e-5)
    assert flat > 0.0
    assert max(pressed_over_edge(tmp_path, -2.0, place) for place in (-1e-5, 3e-4)) == pytest.approx(2.0 * flat, rel=0.05)
    assert pressed_over_edge(tmp_path, -2.0, -1e-3) == pytest.approx(flat, rel=1e-6)
    assert pressed_over_edge(tmp_path, -2.0, 8e-5, "curvature 3") == 0.0
    assert pressed_over_edge(tmp_path, 2.0, -1e-5) == pytest.approx(2.0 * flat, rel=0.1)


@pytest.mark.parametrize("axis", "xyz")
def test_a_cylinder_along_y_does_not_turn(axis: str, tmp_path: Path) -> None:
    """A sphere pressed on the inside, of a wall with a shear across its axis."""
    across = "y" if axis == "x" else "x"
    place = " ".join("-0.0178" if one == across else "0" for one in "xyz")
    body = scene(0.0025) + f"create_atoms 1 single {place} units box\nset group all density 2500 diameter 0.005\n" + MATERIAL + f"""
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-6
fix drum all wall/gran model hertz tangential history primitive type 2 {axis}cylinder 0.02 0 0 shear {across} 3
fix motion all nve/sphere
compute spin all property/atom omega{axis}
compute sum all reduce sum c_spin
variable s equal c_sum
thermo_style custom step c_sum
run 50
print 'spin ${{s}}'
"""
    spin = printed(tmp_path, body, "spin")
    assert spin == 0.0 if axis == "y" else spin > 0.0
