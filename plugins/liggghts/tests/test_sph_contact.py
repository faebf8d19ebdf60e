"""fix sph/contact: cubes that fall on each other, on any number of ranks, resumed exactly, with energy; what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rig.fluid import deck as deck_of
from rig.fluid import neutral, resumed, solved, standing
from rig.liggghts_driver import read_dump, run_deck

# Two cubes of 3 x 3 x 3 particles over a floor, turned against each other by their spins, and a little water beside them.
DECK = """units si
atom_style hybrid granular sph
atom_modify map array
boundary f f f
newton off
communicate single vel yes
{grid}
{begin}
neighbor 0.0052 bin
neigh_modify delay 0 check yes
pair_style sph/coupled spacing 0.02 sound_speed 20
pair_coeff * *
timestep 2e-4
fix weight all gravity 9.81 vector 0 0 -1
fix water water nve/sph/coupled
fix one one sph/body mass 0.2 inertia 1.2e-4 1.2e-4 1.2e-4 centre 0.1 0.1 0.05 spin 3 5 0
fix two two sph/body mass 0.2 inertia 1.2e-4 1.2e-4 1.2e-4 centre 0.105 0.11 0.16
fix touch all sph/contact stiffness 2e4 friction 0.4 restitution 0.5 box one 0.06 0.06 0.06 box two 0.06 0.06 0.06 &
    plane 0 0 0 0 0 1 0.4 0.6
fix state all resume/exact 400 state
variable energy equal f_water[4]+f_touch[1]
fix rows all print 50 "$(step) $(f_one[3]) $(f_two[3]) $(v_energy) $(f_touch[2]) $(f_touch[3])" screen no file {rows} title none
dump cubes two custom 100 cubes.dump id type x y z vx vy vz
dump_modify cubes sort id format "%d %d %.17g %.17g %.17g %.17g %.17g %.17g"
thermo_style custom step
thermo 1000
thermo_modify lost error norm no
{run}
"""
MADE = """region domain block -0.1 0.5 -0.1 0.3 -0.1 0.4 units box
create_box 3 domain
lattice sc 0.02 origin 0.5 0.5 0.5
region pool block 0.3 0.36 0.1 0.16 0.2 0.26 units box
create_atoms 1 region pool
lattice sc 0.02 origin 0 0 0.5
region first block 0.079 0.121 0.079 0.121 0.029 0.071 units box
create_atoms 2 region first
lattice sc 0.02 origin 0.25 0.5 0
region second block 0.084 0.126 0.089 0.131 0.139 0.181 units box
create_atoms 3 region second
mass * 0.008
set group all diameter 0.02 density 1000
set group all mass 0.008
set group all meso_rho 1000
group water type 1
group one type 2
group two type 3"""
GROUPS = "resume_state state\ngroup water type 1\ngroup one type 2\ngroup two type 3"


def deck(*, begin: str = MADE, grid: str = "", run: str = "run 600", rows: str = "rows", old: str = "", new: str = "") -> str:
    text = DECK.format(begin=begin, grid=grid, run=run, rows=rows)
    assert old in text
    return text.replace(old, new) if old else text


def table(folder: Path, name: str = "rows") -> np.ndarray:
    return np.loadtxt(folder / name, skiprows=1)


def test_cubes_fall_on_each_other_and_on_the_floor(tmp_path: Path) -> None:
    done = run_deck(tmp_path / "one", deck())
    assert done.code == 0, done.error or done.output[-1500:]
    rows = table(tmp_path / "one")
    assert rows[:, 5].max() >= 3
    assert 0.0 < rows[:, 4].max() < 0.004
    # Both have touched: they would be below the floor. What they have of energy only falls.
    assert rows[-1, 1] > 0.025
    assert rows[-1, 2] > 0.025
    assert np.diff(rows[:, 3]).max() < 1e-3 * rows[0, 3]
    assert rows[-1, 3] < 0.9 * rows[0, 3]
    two = run_deck(tmp_path / "two", deck(grid="processors 2 1 1", run="run 500"), ranks=2)
    assert two.code == 0, two.error or two.output[-1500:]
    frames = [read_dump(tmp_path / name / "cubes.dump")[1][5] for name in ("one", "two")]
    assert rows[5:9, 5].max() > 0
    np.testing.assert_allclose(frames[1], frames[0], rtol=1e-9, atol=1e-12)


def test_friction_without_a_spring_lets_a_cube_creep(tmp_path: Path) -> None:
    """On a slope of 0.2 with a coefficient of 0.4, at v0 atanh(0.5)."""
    text = deck(old="restitution 0.5 box", new="friction_speed 0.125 restitution 0.5 box")
    for old, new in (("vector 0 0 -1", "vector 0.2 0 -1"), ("centre 0.1 0.1 0.05 spin 3 5 0", "centre 0.1 0.1 0.03"),
                     ("region first block 0.079 0.121 0.079 0.121 0.029 0.071", "region first block 0.079 0.121 0.079 0.121 0.009 0.051"),
                     ("centre 0.105 0.11 0.16", "centre 0.105 0.21 0.16"),
                     ("block 0.084 0.126 0.089 0.131", "block 0.084 0.126 0.189 0.231"),
                     ("dump cubes two custom", "dump cubes one custom")):
        assert old in text
        text = text.replace(old, new)
    done = run_deck(tmp_path, text.replace("run 600", "run 1000"))
    assert done.code == 0, done.error or done.output[-1500:]
    _, frames = read_dump(tmp_path / "cubes.dump")
    assert frames[-1][:, 5].mean() == pytest.approx(0.125 * np.arctanh(0.2 / 0.4), rel=0.02)


def test_resumes_to_the_bit(tmp_path: Path) -> None:
    whole = run_deck(tmp_path / "whole", deck(run="run 500"))
    first = run_deck(tmp_path / "parts", deck(run="run 450"))
    again = run_deck(tmp_path / "parts", deck(begin=GROUPS, run="run 500 upto", rows="late"), name="second.in")
    for done in (whole, first, again):
        assert done.code == 0, done.error or done.output[-1500:]
    assert "resumed at step 400 exactly" in again.output
    frames = [read_dump(tmp_path / name / "cubes.dump")[1][-1] for name in ("whole", "parts")]
    assert (frames[0] == frames[1]).all()


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_films_in_slits_are_those_of_the_solver(ranks: int, tmp_path: Path) -> None:
    """Boxes that open and close slits: 60 steps, as in Python to 1e-9; without films they are elsewhere."""
    scene = standing(0.7)
    table, energies = solved(tmp_path, scene, 60, ranks=ranks)
    fluid, bodies = neutral(scene, 60)
    _, dry = neutral(standing(0.0), 60)
    for number, (body, without) in enumerate(zip(bodies, dry, strict=True), 3):
        found, due = table[table[:, 1] == number][:, 2:5], body.particles[0]
        np.testing.assert_allclose(found, due, rtol=0.0, atol=1e-9)
        assert np.abs(due - without.particles[0]).max() > 1e-4
    np.testing.assert_allclose(table[table[:, 1] == 1][:, 2:5], fluid.positions, rtol=0.0, atol=1e-9)
    # The work of films stands with that of loads.
    due = np.array(fluid.energies())
    assert np.abs(energies - due).max() <= 1e-8 * np.abs(due).max()
    assert abs(due[8]) > 1e-4


def test_resumes_to_the_bit_with_films(tmp_path: Path) -> None:
    """From step 30 on, with films that push."""
    scene = standing(1.0)

    def text(run: str) -> str:
        load = "variable load equal f_body3[22]\n"
        return load + deck_of(scene, 60, run="fix state all resume/exact 30 state\n" + run + '\nprint "load ${load}"')

    whole = run_deck(tmp_path / "whole", text("run 60"))
    first = run_deck(tmp_path / "parts", text("run 40"))
    again = run_deck(tmp_path / "parts", resumed(text("run 60 upto"), 4), name="second.in")
    for done in (whole, first, again):
        assert done.code == 0, done.error or done.output[-1500:]
    assert "resumed at step 30 exactly" in again.output
    frames = [read_dump(tmp_path / name / "grains.dump")[1][-1] for name in ("whole", "parts")]
    assert (frames[0] == frames[1]).all()
    loads = [float(next(line for line in done.output.splitlines() if line.startswith("load ")).split()[1]) for done in (whole, again)]
    assert loads[0] == loads[1] and abs(loads[0]) > 0.1


def test_a_state_of_other_boxes_is_refused(tmp_path: Path) -> None:
    assert run_deck(tmp_path, deck(run="run 450")).code == 0
    plane = "plane 0 0 0 0 0 1 0.4 0.6"
    for old, new, named in ((plane, f"{plane} plane 0 0 0 1 0 0 0.4 0.6", "plane 0 0 0 1 0 0"),
                            (plane, "plane 0 0 0.01 0 0 1 0.4 0.6", "plane 0 0 0.01"),
                            ("box two 0.06 0.06 0.06", "box two 0.06 0.06 0.05", "box two 0.06 0.06 0.05")):
        done = run_deck(tmp_path, deck(begin=GROUPS, run="run 500 upto", old=old, new=new), name="second.in")
        assert done.code != 0
        before = "rounding 0.004 box one 0.06 0.06 0.06 box two 0.06 0.06 0.06 plane 0 0 0 0 0 1"
        assert f"the state has contacts of '{before}', not of" in done.error
        assert named in done.error, done.error


def test_a_body_goes_on_with_the_properties_of_the_script(tmp_path: Path) -> None:
    """With twice the mass a body of a restart file moves otherwise from there on."""
    body, again = "fix two two sph/body mass 0.2", GROUPS.replace("resume_state state", "read_restart here.restart")
    state = "fix state all resume/exact 400 state"
    assert run_deck(tmp_path, deck(run="run 450\nwrite_restart here.restart", old=state)).code == 0
    ends = []
    for number, mass in enumerate((0.2, 0.4)):
        text = deck(begin=again, run="run 200", rows=f"rows{number}", old=state).replace(body, f"fix two two sph/body mass {mass}")
        done = run_deck(tmp_path, text, name="second.in")
        assert done.code == 0, done.error or done.output[-1500:]
        ends.append(table(tmp_path, f"rows{number}")[-1][2])
    assert abs(ends[1] - ends[0]) > 1e-5


def test_boxes_that_are_too_soft_end_the_run(tmp_path: Path) -> None:
    """Deeper than the rounding two edges would pass each other, and then their springs push the wrong way."""
    done = run_deck(tmp_path, deck(old="stiffness 2e4", new="stiffness 1e3"))
    assert done.code != 0
    assert "boxes overlap by" in done.error
    assert "more than the rounding, 0.004 m; take a higher stiffness" in done.error


REFUSED = {
    "start": ("plane 0 0 0 0 0 1", "plane 0 0 0 0 0 -1",
              "as the run begins; put their centres, edges, planes and normals right, or the rounding"),
    "stiffness": ("stiffness 2e4 ", "", "stiffness (N/m) is missing"),
    "keyword": ("stiffness 2e4 ", "soft 3 ", "'soft' is no keyword; known are stiffness, rounding"),
    "restitution": ("restitution 0.5", "restitution 0.1", "restitution must be between 0.14 (critical damping) and 1"),
    "friction_speed": ("friction 0.4 ", "friction 0.4 friction_speed -1 ", "friction_speed must not be negative"),
    "plane": ("plane 0 0 0 0 0 1 0.4 0.6", "plane 0 0 0 0 0 1 -0.4 0.6", "plane: friction must be a number >= 0"),
    "normal": ("plane 0 0 0 0 0 1", "plane 0 0 0 0 0 0", "plane: the normal must not be zero"),
    "no body": ("box two", "box water", "box: 'water' is the ID of no fix sph/body"),
    "twice": ("box two", "box one", "box: 'one' stands there twice"),
    "no box": ("box one 0.06 0.06 0.06 box two 0.06 0.06 0.06", "", "there is no box"),
    "rounding": ("friction 0.4 ", "rounding 0.03 friction 0.4 ", "rounding must be less than half of the shortest edge"),
    "step": ("stiffness 2e4", "stiffness 2e7", "the time step must be at most"),
    "share": ("friction 0.4 ", "slit_pressure 2 friction 0.4 ", "slit_pressure must be between 0 and 1"),
    "edge": ("box two 0.06 0.06 0.06", "box two 0.06 0.06 0.05 slit_pressure 1",
             "box two: an edge of 0.05 m must be an integer multiple of the spacing, 0.02 m"),
    "lattice": ("box two 0.06 0.06 0.06", "box two 0.06 0.06 0.08 slit_pressure 1",
                "the particles of box two must be the lattice that fills it, 36 of them; of its 27, 0 are on that lattice"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_says_what_is_wrong(name: str, tmp_path: Path) -> None:
    old, new, message = REFUSED[name]
    done = run_deck(tmp_path, deck(run="run 1", old=old, new=new))
    assert done.code != 0
    assert message in done.error, done.error or done.output[-800:]


def test_films_want_pressure(tmp_path: Path) -> None:
    text = deck(run="run 1", old="sound_speed 20", new="sound_speed 20 boundary dynamic coupling potential 2e4 4")
    done = run_deck(tmp_path, text.replace("friction 0.4 restitution", "friction 0.4 slit_pressure 1 restitution"))
    assert done.code != 0
    assert "slit_pressure is for boxes on which the fluid acts by pressure, not by the contact potential" in done.error, done.error
