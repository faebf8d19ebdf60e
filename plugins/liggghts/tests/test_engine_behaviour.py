"""What the engine does around the laws: neighbour lists, restarts, ranks, newton, meshes."""

from dataclasses import replace

import numpy as np
import pytest
from rig import python_driver
from rig.liggghts_driver import deck, motion, read_dump, run, run_deck
from rig.motion import deviation
from rig.packing import packing
from rig.scenarios import SCENARIOS, STILL, Grain, Material, Path, Scenario

DRY = Material(static_friction=0.5, kinetic_friction=0.4)
WET = replace(DRY, bridge_volume=2e-10)


def test_a_contact_that_ends_forgets(tmp_path):
    """Two touches with a gap between them, too short for a new neighbour list: the second begins unloaded, in stock it does not.

    The time step is coarse, so that the first touch ends under load.
    """
    slide = Path(displacement=("0.00001*(1-exp(-t/0.0003))", "0", "-0.00002*sin(2*PI*200*t)"),
                 velocity=("0.00001*exp(-t/0.0003)/0.0003", "0", "-0.00002*2*PI*200*cos(2*PI*200*t)"))
    case = Scenario(name="two touches", material=replace(DRY, restitution=1.0), time_step=1.27e-4, steps=45, stride=1,
                    grains=(Grain(position=(0.0, 0.0, 5e-3), path=slide), Grain(position=(0.0, 0.0, -5e-3), path=STILL)))

    def load_at_second_touch(found):
        touching = found.normal_force > 0.0
        begin = np.flatnonzero(touching[1:] & ~touching[:-1]) + 1
        assert len(begin) == 1  # it begins in touch
        return np.linalg.norm(found.tangential_force[begin[0]]) / found.normal_force[begin[0]]

    # What there is comes from this step: the normal is not quite z.
    assert load_at_second_touch(run(case, tmp_path / "ours")) < 0.01
    assert load_at_second_touch(run(case, tmp_path / "stock", tangential="history")) > 0.1


def jumping(folder, material, after: str, engines_loop: bool = False, wall: bool = False):
    """Two grains, or a grain and a wall, touch and slide; in step 20 alone they are far apart, and later, by `after` (m), as before or at a
    gap."""
    k = "(t/0.000127-20)"
    slide = Path(displacement=("0.00001*(1-exp(-t/0.0003))", "0", f"-0.00002+{after}/(1+exp(-20*({k}+0.5)))+0.0015*exp(-25*{k}*{k})"),
                 velocity=("0.00001*exp(-t/0.0003)/0.0003", "0", "0"))
    still = () if wall else (Grain(position=(0.0, 0.0, -5e-3), path=STILL),)
    case = Scenario(name="jump", material=replace(material, restitution=1.0), time_step=1.27e-4, steps=45, stride=1, wall=wall,
                    grains=(Grain(position=(0.0, 0.0, 5e-3), path=slide), *still))
    # Of pairs no new list that would end the contact, of a wall one that the grain is not in.
    text = deck(case).replace("neighbor 0.001 bin", f"neighbor {0.001 if wall else 0.004} bin")
    if engines_loop:  # a rolling model, here without resistance, stands in the way of ours
        models = next(line for line in text.splitlines() if line.startswith("pair_style"))
        rolling = "fix p_roll all property/global coefficientRollingFriction peratomtypepair 2 0 0 0 0\n"
        text = text.replace(models, rolling + models.replace(" presliding", " rolling_friction cdt presliding"))
    done = run_deck(folder, text)
    assert done.code == 0, done.error
    return motion(case, folder)


@pytest.mark.parametrize("engines_loop", [False, True])
def test_a_contact_forgets_though_the_grains_jump_out_of_reach(tmp_path, engines_loop):
    """In one step beyond the distance up to which the engine tells the models about a pair, and in the next one back."""
    found = jumping(tmp_path, DRY, "0", engines_loop)
    apart = np.flatnonzero(found.normal_force == 0.0)
    assert len(apart) == 1 and np.linalg.norm(found.tangential_force[apart[0] - 1]) > 0.1 * found.normal_force[apart[0] - 1]
    assert np.linalg.norm(found.tangential_force[apart[0] + 1]) < 0.01 * found.normal_force[apart[0] + 1]


@pytest.mark.parametrize("engines_loop", [False, True])
def test_a_bridge_ruptures_though_the_grains_jump_out_of_reach(tmp_path, engines_loop):
    pull = np.linalg.norm(jumping(tmp_path, WET, "0.00012", engines_loop).force, axis=-1)
    assert (pull[:18] > 0.0).all() and (pull[20:] == 0.0).all()


def test_a_contact_with_a_wall_ends_though_the_grain_jumps_off_the_list(tmp_path):
    """The models see grains near a primitive wall only, by a list that may be new in each step."""
    dry = jumping(tmp_path / "dry", DRY, "0", wall=True)
    apart = np.flatnonzero(dry.normal_force == 0.0)
    assert len(apart) == 1 and np.linalg.norm(dry.tangential_force[apart[0] - 1]) > 0.1 * dry.normal_force[apart[0] - 1]
    assert np.linalg.norm(dry.tangential_force[apart[0] + 1]) < 0.01 * dry.normal_force[apart[0] + 1]
    pull = np.linalg.norm(jumping(tmp_path / "wet", WET, "0.00012", wall=True).force, axis=-1)
    assert (pull[:18] > 0.0).all() and (pull[20:] == 0.0).all()


# Down, along the floor in touch, up again with a bridge, and on over the floor with a gap.
CARRIED = Scenario(
    name="carried", material=WET, wall=True, time_step=1e-5, steps=3900,
    grains=(Grain(position=(-2e-3, 0.0, 5.1003e-3), path=Path(
        displacement=("0.1*t", "0", "-0.0001*(1-cos(2*PI*25*t))"), velocity=("0.1", "0", "-0.0001*2*PI*25*sin(2*PI*25*t)"))),))
ON_MESH = [(SCENARIOS[name], edge) for edge in (1e-5, 2e-2)
           for name in ("drop, wet", "approach, bridge, wall", "cycles, exponential, wall")]


@pytest.mark.parametrize(("case", "edge"), [*ON_MESH, (CARRIED, 0.0), (CARRIED, 1.4e-3)])
def test_contact_on_a_mesh_is_that_on_a_plane(tmp_path, case, edge):
    """A floor of two triangles; their common edge lies at x = `edge`, under the contact, under the path, or away from both."""
    folder = tmp_path / "mesh"
    folder.mkdir()
    triangles = [[(edge, -0.04), (edge, 0.04), (-0.04, 0.0)], [(edge, -0.04), (0.045, 0.0), (edge, 0.04)]]
    corners = ["\n".join(f"   vertex {x:.17g} {y:.17g} 0" for x, y in triangle) for triangle in triangles]
    facets = "\n".join(f" facet normal 0 0 1\n  outer loop\n{three}\n  endloop\n endfacet" for three in corners)
    (folder / "floor.stl").write_text(f"solid floor\n{facets}\nendsolid floor\n")
    plane = deck(case)
    words = next(line for line in plane.splitlines() if line.startswith("fix floor"))
    mesh = "fix stl all mesh/surface file floor.stl type 2\n" + words.replace("primitive type 2 zplane 0", "mesh n_meshes 1 meshes stl")
    done = run_deck(folder, plane.replace(words, mesh))
    assert done.code == 0, done.error
    assert max(deviation(python_driver.run(case), motion(case, folder)).values()) < 1e-9


def last_frame(folder, dump="grains.dump"):
    return read_dump(folder / dump)[1][-1]


def assert_same(a, b, tolerance):
    """Two frames, each quantity (three columns) relative to its largest value."""
    assert (a[:, 0] == b[:, 0]).all() and len(a) > 30
    found = {name: np.abs(a[:, k : k + 3] - b[:, k : k + 3]).max() / np.abs(a[:, k : k + 3]).max()
             for k, name in ((1, "position"), (4, "velocity"), (7, "spin"), (10, "force"), (13, "torque"))}
    assert max(found.values()) < tolerance, found


BED = replace(WET, interface_shear_strength=1e5)


@pytest.mark.parametrize("material", [BED, replace(BED, presliding="exponential")])
def test_ranks_agree(tmp_path, material):
    """Grains collide and cross between the ranks; round-off grows tenfold in 500 steps of such a gas, so the run is short."""
    text = packing(material, "run 3000")
    for ranks in (1, 2):
        done = run_deck(tmp_path / str(ranks), text if ranks == 2 else text.replace("processors 2 1 1\n", ""), ranks=ranks)
        assert done.code == 0, done.output[-1000:]
    assert_same(last_frame(tmp_path / "1"), last_frame(tmp_path / "2"), 1e-9)


def test_newton_on_is_refused(tmp_path):
    done = run_deck(tmp_path, packing(BED, "run 10", newton="on").replace("processors 2 1 1\n", ""))
    assert done.code != 0 and "newton pair off" in done.error


def held_by_bridges(frame):
    """Number of grains that touch nothing and are pulled all the same."""
    number, position, force = frame[:, 0], frame[:, 1:4], frame[:, 10:13]
    radius = 0.0025 * (1.0 + 0.1 * np.sin(37.0 * number))
    apart = position[:, None] - position[None]
    apart[..., :2] -= 0.024 * np.round(apart[..., :2] / 0.024)
    overlap = radius[:, None] + radius[None] - np.linalg.norm(apart, axis=2)
    np.fill_diagonal(overlap, -1.0)
    weight = 4.0 / 3.0 * np.pi * radius**3 * 2500.0 * 9.81
    alone = (overlap.max(axis=1) < 0.0) & (position[:, 2] > radius)
    return (alone & (np.linalg.norm(force + weight[:, None] * [0.0, 0.0, 1.0], axis=1) > 1e-6)).sum()


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_restart_keeps_displacements_and_bridges(tmp_path, ranks):
    """The first forces after a restart are those of the run that wrote it, and so is what follows."""
    edit = (lambda text: text) if ranks == 2 else (lambda text: text.replace("processors 2 1 1\n", ""))
    first = packing(BED, "run 2000\nwrite_restart bed.restart\nrun 0\nundump grains\n"
                    'dump again all custom 1 again.dump id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz\n'
                    f'dump_modify again sort id format "%d{" %.17g" * 15}"\nrun 100')
    done = run_deck(tmp_path, edit(first), ranks=ranks)
    assert done.code == 0, done.error
    second = packing(BED, "run 100", create="read_restart bed.restart", state="", dump="resumed.dump", every=1)
    done = run_deck(tmp_path, edit(second), ranks=ranks, name="resume.in")
    assert done.code == 0, done.error
    steps, here = read_dump(tmp_path / "again.dump")
    again, there = read_dump(tmp_path / "resumed.dump")
    assert steps[0] == again[0] == 2000
    assert held_by_bridges(here[0]) > 0
    assert_same(here[0], there[0], 1e-12)
    assert_same(here[-1], there[-1], 1e-8)


def stopped_by(text, folder):
    done = run_deck(folder, text)
    assert done.code != 0
    assert done.error, done.output
    return done.error


def test_bridge_to_a_wall_longer_than_the_skin(tmp_path):
    text = deck(SCENARIOS["approach, bridge, wall"])
    line = stopped_by(text.replace("neighbor 0.001 bin", "neighbor 0.0002 bin"), tmp_path)
    assert "cohesion: a bridge" in line and "use neighbor 0.00" in line


def test_bridge_longer_than_the_neighbour_lists(tmp_path):
    """The reach follows the radii at the start of a run; grains that shrink after it may need more."""
    case = Scenario(name="head on", material=WET, time_step=1e-5, steps=600,
                    grains=(Grain(position=(0.0, 0.0, 5.2e-3), velocity=(0.0, 0.0, -2.0)), Grain(position=(0.0, 0.0, -5e-3))))
    text = deck(case)
    assert run_deck(tmp_path / "kept", text).code == 0
    line = stopped_by(text.replace("run 600", 'run 600 pre no every 5 "set group all diameter 0.002"'), tmp_path)
    assert "cohesion: a bridge" in line and "use neigh_modify contact_distance_factor 1." in line


SIZES = """
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block 0 0.03 0 0.03 -0.001 0.03 units box
create_box 2 box
neighbor 0.0003 bin
neigh_modify delay 0 {lists}
lattice sc 0.00101
region layer block 0.0006 0.0294 0.0006 0.0294 0.0006 0.0026 units box
create_atoms 1 region layer
create_atoms 2 single 0.0075 0.015 0.0085 units box
create_atoms 2 single 0.0176 0.015 0.0085 units box
set type 1 diameter 0.001 density 2500
set type 2 diameter 0.01 density 2500
fix m1 all property/global youngsModulus peratomtype 5.e6 5.e6
fix m2 all property/global poissonsRatio peratomtype 0.3 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.5 0.5 0.5 0.5
fix m4 all property/global staticFriction peratomtypepair 2 0.5 0.5 0.5 0.5
fix m5 all property/global kineticFriction peratomtypepair 2 0.5 0.5 0.5 0.5
fix m6 all property/global criticalSlipDistance peratomtypepair 2 1e-5 1e-5 1e-5 1e-5
fix m7 all property/global surfaceTension scalar 0.072
fix m8 all property/global contactAngle peratomtype 0 0
fix m9 all property/global bridgeVolume peratomtypepair 2 1.25e-13 1.25e-13 1.25e-13 1.25e-10
pair_style gran model hertz tangential finnie_rabinowicz {cohesion}
pair_coeff * *
timestep 1e-6
fix motion all nve/sphere
fix floor all wall/gran model hertz tangential finnie_rabinowicz {cohesion} primitive type 1 zplane 0.0
run 0
"""


def test_neighbour_lists_of_many_sizes_are_no_longer_than_the_bridges_need(tmp_path):
    """Radii of 1 : 10, each with bridges of a volume that suits it: V/R^3 = 1e-3, which reach 0.1 of the radius at the wall."""
    def neighbours(name, lists, cohesion):
        done = run_deck(tmp_path / name, SIZES.format(lists=lists, cohesion=cohesion))
        assert done.code == 0, done.error
        return int(next(line for line in done.output.splitlines() if line.startswith("Total # of neighbors")).split("=")[1])

    least, most = (neighbours(factor, f"contact_distance_factor {factor}", "") for factor in ("1.09", "1.12"))
    assert least <= neighbours("bridges", "", "cohesion capillary") <= most
