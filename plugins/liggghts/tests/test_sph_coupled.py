"""pair_style sph/coupled with its fixes: the same fluid as the solver's, on any number of ranks, resumed exactly; what it refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig.fluid import Scene, box, dam, deck, neutral, resumed, solved
from rig.liggghts_driver import Run, read_dump, run_deck

from dembark.physics import SphFluid

STEPS = 200
POTENTIAL = {"contact_stiffness": 2e4, "contact_exponent": 4, "boundary": "dynamic", "kernel": "cubic_spline"}
SCENES: dict[str, Scene] = {
    "dam": dam(),
    "no_slip": dam(no_slip=True, alpha=0.1, shifting=2.0),
    "tension": dam(tension=True, delta=0.0, kernel="cubic_spline", smoothing=1.5),
    "potential": dam(**POTENTIAL),
    "older": dam(**POTENTIAL, xsph=0.5, shepard=15, delta=0.0),
    "moment": dam(moment="particles", kernel="cubic_spline"),
    "box": box(),
}


def assert_close(found: Any, due: Any, tolerance: float = 1e-9) -> None:
    scale = np.abs(due).max()
    assert np.abs(np.asarray(found) - due).max() <= tolerance * scale


def assert_same_fluid(table: Any, scene: Scene, steps: int, tolerance: float = 1e-9) -> None:
    """Positions, velocities, densities and the places of bodies are those of the solver."""
    fluid, bodies = neutral(scene, steps)
    rows, d = table[table[:, 1] == 1], scene.dimension
    assert len(rows) == len(scene.points)
    assert_close(rows[:, 2 : 2 + d], fluid.positions, tolerance)
    assert_close(rows[:, 5 : 5 + d], fluid.velocities, tolerance)
    assert_close(rows[:, 8], fluid.densities, tolerance)
    assert_close(rows[:, 9], fluid.pressures, 1e3 * tolerance)
    for number, (body, block) in enumerate(zip(bodies, scene.blocks, strict=True), 3):
        mine = table[table[:, 1] == number]
        assert len(mine) == len(block.points)
        assert_close(mine[:, 2 : 2 + d], body.particles[0], tolerance)


# Ranks wait for each other three times a step, which on a busy machine takes long. Neighbours are searched about every 20 steps.
@pytest.mark.parametrize(("name", "ranks", "steps"), [*((name, 1, STEPS) for name in SCENES), ("dam", 2, STEPS), ("no_slip", 2, 60),
                                                      ("potential", 2, 60), ("older", 2, 60), ("moment", 2, 60), ("box", 2, 40)])
def test_is_the_fluid_of_the_solver(name: str, ranks: int, steps: int, tmp_path: Path) -> None:
    scene = SCENES[name]
    table, energies = solved(tmp_path, scene, steps, ranks=ranks)
    assert_same_fluid(table, scene, steps)
    fluid, _ = neutral(scene, steps)
    due = np.array(fluid.energies())
    assert np.abs(energies - due).max() <= 1e-8 * np.abs(due).max()


def test_four_ranks_and_an_atom_style_without_grains(tmp_path: Path) -> None:
    scene = SCENES["dam"]
    one, _ = solved(tmp_path / "one", scene, 60, style="sph")
    four, _ = solved(tmp_path / "four", scene, 60, ranks=4)
    assert_same_fluid(one, scene, 60)
    for columns in (slice(2, 5), slice(5, 8), slice(8, 9)):
        assert_close(four[:, columns], one[:, columns])


def test_a_wall_that_moves_does_work(tmp_path: Path) -> None:
    scene = Scene(SCENES["dam"].points, SCENES["dam"].wall, 0.02, 30.0)
    table, energies = solved(tmp_path, scene, STEPS, changes=(("fix wall g2 sph/wall", "fix wall g2 sph/wall velocity 0.05 0.02 0.0"),))
    fluid = SphFluid(scene.points, spacing=0.02, sound_speed=30.0, gravity=[0, -9.81])
    wall = fluid.add_wall(scene.wall)
    wall.set_motion([0.05, 0.02])
    fluid.run(STEPS * scene.step, scene.step)
    assert_close(table[table[:, 1] == 1][:, 2:4], fluid.positions)
    assert energies[8] == pytest.approx(fluid.energies().work, rel=1e-8) and abs(energies[8]) > 1e-3


def pushed(folder: Path, wall: str, ranks: int = 1, goes_on: bool = False, name: str = "wall") -> Run:
    """Twenty steps with the wall `sph/wall` of these words, from the restart file of the run before in this folder if it goes on."""
    scene = Scene(SCENES["dam"].points, SCENES["dam"].wall, 0.02, 30.0)
    shown = "variable x equal xcm(g2,x)\nvariable v equal vcm(g2,x)\nvariable p equal f_wall[1]\nvariable w equal f_wall[9]\n"
    text = deck(scene, 20, ranks=ranks, extra=shown, changes=(("fix wall g2 sph/wall", f"fix wall g2 sph/wall {wall}"),))
    if goes_on:
        text = resumed(text, 2).replace("resume_state state", "read_restart wall.restart")
    text = text.replace("fix wall ", f"fix {name} ").replace("f_wall", f"f_{name}")
    end = "" if goes_on else "write_restart wall.restart\n"
    return run_deck(folder, f'{text}print "wall $x $v $p $w"\n{end}', ranks=ranks)


def wall_numbers(done: Run) -> list[float]:
    """x and its velocity of the wall's particles, x of the wall and its spin about z."""
    assert done.code == 0, done.error or done.output[-1500:]
    return [float(word) for word in next(line for line in done.output.splitlines() if line.startswith("wall ")).split()[1:]]


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_a_wall_moves_as_the_script_says_after_a_restart_too(ranks: int, tmp_path: Path) -> None:
    """Its place goes on; from the file it would have the velocity of the run before."""
    step = 20 * SCENES["dam"].step
    before = wall_numbers(pushed(tmp_path, "velocity 0.1 0 0", ranks))
    assert before[1] == pytest.approx(0.1) and before[2] == pytest.approx(0.1 * step)
    for speed in (-0.3, 0.0):
        after = wall_numbers(pushed(tmp_path, f"velocity {speed} 0 0", ranks, goes_on=True))
        assert after[1] == pytest.approx(speed, abs=1e-12) and after[2] - before[2] == pytest.approx(speed * step, abs=1e-7)
        assert after[0] - before[0] == pytest.approx(speed * step, abs=1e-6)


def test_a_wall_that_begins_to_turn_after_a_restart_needs_its_centre(tmp_path: Path) -> None:
    words = "centre 0.24 0.15 0 spin 0 0 "
    pushed(tmp_path / "turns", f"{words}0.5")
    assert wall_numbers(pushed(tmp_path / "turns", f"{words}0.2", goes_on=True))[3] == 0.2
    pushed(tmp_path / "rests", "")
    refused = pushed(tmp_path / "rests", f"{words}0.2", goes_on=True)
    assert refused.code != 0 and "it turns, and did not when the restart file was written" in refused.error, refused.output[-800:]
    anew = wall_numbers(pushed(tmp_path / "rests", f"{words}0.2", goes_on=True, name="turned"))
    assert anew[2:] == [0.24, 0.2]


@pytest.mark.parametrize(("style", "ranks", "scene"), [("hybrid granular sph", 1, dam(shifting=2.0)), ("sph", 2, dam(shifting=2.0)),
                                                       ("hybrid granular sph", 1, box(xsph=0.5, shepard=7)),
                                                       ("sph", 2, dam(moment="particles"))])
def test_resumes_to_the_bit(style: str, ranks: int, scene: Scene, tmp_path: Path) -> None:
    """The body of `box` has unequal moments."""

    def text(run: str) -> str:
        states = "fix state all resume/exact 30 state\n"
        return deck(scene, 60, ranks=ranks, style=style, run=states + run)

    whole = run_deck(tmp_path / "whole", text("run 60"), ranks=ranks)
    assert whole.code == 0, whole.error or whole.output[-1500:]
    run_deck(tmp_path / "parts", text("run 40"), ranks=ranks)
    again = run_deck(tmp_path / "parts", resumed(text("run 60 upto"), 3), ranks=ranks, name="second.in")
    assert again.code == 0, again.error or again.output[-1500:]
    assert "resumed at step 30 exactly" in again.output, again.output[-3000:]
    one, two = (read_dump(tmp_path / folder / "grains.dump")[1][-1] for folder in ("whole", "parts"))
    assert (one == two).all()
    lines = [next(line for line in run.output.splitlines() if line.startswith("energies ")) for run in (whole, again)]
    a, b = (np.array(line.split()[1:], float) for line in lines)
    assert_close(b, a, 1e-9)


REFUSED = {
    "step": ("timestep ", "timestep 1", "the time step must be > 0 and at most 0.6 h/sound_speed"),
    "mass": ("set group all mass 0.4", "set group all mass 0.5", "of the fluid has the mass 0.5 kg where density * spacing^2 is 0.4 kg"),
    "density": ("meso_rho 1000", "meso_rho 0", "of the fluid has the density 0 kg/m^3"),
    "ghosts": ("communicate single vel yes", "communicate single vel no", "communicate single vel yes"),
    "newton": ("newton off", "newton on", "set newton off"),
    "xsph": ("sound_speed 30.0 ", "sound_speed 30.0 xsph 2", "xsph must be between 0 and 1"),
    "shepard": ("sound_speed 30.0 ", "sound_speed 30.0 shepard 2.5", "the steps are a whole number >= 0, not 2.5"),
    "smoothing": ("sound_speed 30.0 ", "sound_speed 30.0 smoothing 0.7", "smoothing (h over the spacing) must be between 0.8 and 3"),
    "keyword": ("sound_speed 30.0 ", "sound_speed 30.0 wavy 3", "'wavy' is no keyword; known are spacing"),
    "spacing": ("spacing 0.02", "", "spacing (m) is missing"),
    "sound": ("sound_speed 30.0", "", "sound_speed (m/s) is missing"),
    "number": ("spacing 0.02", "spacing wide", "dx (m) must be a number, not 'wide'"),
    "moment": ("sound_speed 30.0 ", "sound_speed 30.0 moment own", "what gradients are divided by can be lattice or particles, not 'own'"),
    "kernel": ("sound_speed 30.0 ", "sound_speed 30.0 kernel gauss", "the kernel can be wendland_c2 or cubic_spline, not 'gauss'"),
    "empty body": ("fix body3 g3", "group none type 99\nfix body3 none", "its group has no atoms"),
    "no mass": ("mass 6.4 ", "", "mass is missing"),
    "no inertia": ("inertia 0.009 ", "", "inertia is missing"),
    "no fluid": ("fix fluid g1 nve/sph/coupled", "group nobody type 99", "nothing moves the fluid"),
    "no group": ("fix body3 g3", "create_atoms 2 single 0.2 0.3 0 units box\nfix body3 g3",
                 "is in no group of the fixes nve/sph/coupled, sph/wall and sph/body"),
    "out of plane": ("fix fluid g1", "set atom 5 z 0.001\nfix fluid g1", "atom 5 is at z = 0.001 m; in the plane all are at z = 0"),
    "overlap": ("fix fluid g1", "displace_atoms g1 move 0.1 0 0 units box\nfix fluid g1", "of the fluid overlaps another: it is 0.00"),
    "two groups": ("fix body3 g3", "fix again g1 sph/wall\nfix body3 g3", "is in two groups"),
    "units": ("units si", "units metal", "in units metal force is not mass times acceleration"),
    "no pair": ("fix weight", "unfix fluid\npair_style none\natom_modify sort 0 0.0\nfix weight", "it needs pair_style sph/coupled"),
    "weight": ("fix weight all", "fix weight g2", "the group of fix gravity must hold the whole fluid"),
    "changing gravity": ("fix weight all gravity 9.81 vector 0 -1 0", "variable g equal 9.81\nfix weight all gravity v_g vector 0 -1 0",
                         "the gravity of fix weight comes from a variable, and the fluid takes a constant one"),
    "changing direction": ("fix weight all gravity 9.81 vector 0 -1 0",
                           "variable g equal -1-time\nfix weight all gravity 9.81 vector 0 v_g 0\nrun 0", "comes from a variable"),
    "moved wall": ("fix weight", "fix paddle g2 move linear 0.1 0 NULL\nfix weight",
                   "fix paddle (move) moves its particles; give this fix the motion by velocity, spin and centre"),
    "moved wall, first": ("fix wall g2", "fix paddle g2 move linear 0.1 0 NULL\nfix wall g2", "fix paddle (move) moves its particles"),
    "excluded types": ("fix weight", "neigh_modify exclude type 1 2\nfix weight",
                       "of the fluid is excluded from pairs by neigh_modify exclude type 1 2; leave what has no forces with the fluid"),
    "excluded groups": ("fix weight", "neigh_modify exclude group g2 g1\nfix weight", "of the fluid is in a group of neigh_modify exclude"),
    "moved body": ("fix weight", "fix paddle all move linear 0.1 0 NULL\nfix weight", "fix paddle (move) moves its particles"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_says_what_is_wrong(name: str, tmp_path: Path) -> None:
    old, new, message = REFUSED[name]
    done = run_deck(tmp_path, deck(SCENES["dam"], 2, changes=((old, new),)))
    assert done.code != 0 and message in done.error, done.error or done.output[-800:]


@pytest.mark.parametrize("others", ["* *", "2*3 2*3"])
def test_pairs_that_are_left_out_are_refused(others: str, tmp_path: Path) -> None:
    """The fluid finds all that takes part, so that pairs cannot be left out one by one."""
    coefficients = f"pair_coeff {others} sph/coupled\npair_coeff 1 1 sph/coupled\npair_coeff 1 3 sph/coupled\npair_coeff 1 2 none"
    done = run_deck(tmp_path, deck(SCENES["dam"], 2, changes=(("pair_style sph/coupled", "pair_style hybrid/overlay sph/coupled"),
                                                              ("pair_coeff * *", coefficients))))
    assert done.code != 0 and "has type 1, whose pairs with type 2 are not of pair sph/coupled" in done.error, done.error


def test_neighbours_of_a_group_alone_are_refused(tmp_path: Path) -> None:
    change = ("fix weight", "atom_modify first g1\nneigh_modify include g1\nfix weight")
    done = run_deck(tmp_path, deck(SCENES["dam"], 2, changes=(change,)))
    assert done.code != 0 and "neigh_modify include leaves atoms out" in done.error, done.error or done.output[-800:]


@pytest.mark.parametrize("name", ["mass", "overlap", *(pytest.param(name, marks=pytest.mark.full) for name in ("two groups", "weight"))])
def test_what_one_rank_finds_wrong_is_a_line_of_its_own(name: str, tmp_path: Path) -> None:
    """If that rank ended the run by itself, its message could begin in the middle of another's line, with the launcher's words after it."""
    old, new, message = REFUSED[name]
    done = run_deck(tmp_path, deck(SCENES["dam"], 2, ranks=2, changes=((old, new),)), ranks=2)
    lines = [line for line in done.output.splitlines() if message in line]
    assert len(lines) == 1 and lines[0].startswith("ERROR: Pair sph/coupled: "), done.output[-800:]
    assert done.code != 0 and "MPI_ABORT" not in done.output + done.error


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_overlaps_are_told_at_the_first_run_only(ranks: int, tmp_path: Path) -> None:
    """Fluid that was put on a block is refused; states that the fluid has reached are not: a later run, and one from a state file."""
    scene, jump = dam(), "displace_atoms g1 move 0.1 0 0 units box"

    def run(folder: str, text: str) -> Run:
        return run_deck(tmp_path / folder, text, ranks=ranks, name=f"{folder}.in")

    states = "fix state all resume/exact 2 state\n"
    later = run("later", deck(scene, 1, ranks=ranks, run=f"{states}run 1\n{jump}\nrun 2"))
    assert later.code == 0, later.error
    again = run("later", resumed(deck(scene, 4, ranks=ranks, run=f"{states}run 4 upto"), 3))
    assert again.code == 0 and "resumed at step 2 exactly" in again.output, again.error or again.output[-1500:]
    first = run("first", deck(scene, 2, ranks=ranks, run=f"{jump}\nrun 2"))
    assert first.code != 0 and "of the fluid overlaps another: it is 0.00" in first.error, first.error or first.output[-800:]


def test_a_fluid_that_blows_up_is_told(tmp_path: Path) -> None:
    done = run_deck(tmp_path, deck(SCENES["dam"], 2, extra="set atom 5 vx 31.0 vy 0.0"))
    assert done.code != 0 and "the fluid blew up: at step 1 atom 5 moves at 3" in done.error, done.error
