"""fix integration/monitor: the figures of LIGGGHTS's, warnings, adapted steps, ranks, exact restarts, mistakes."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lammps_bed import CREATE, STATE, bed
from rig import lammps_driver, liggghts_driver
from rig.chains import MATERIAL, RADIUS, CompressedChain
from rig.lammps_driver import run_deck
from rig.liggghts_driver import Run, read_dump
from rig.monitor import BED, MONITOR, POSITION, SPIN, THERMO, VELOCITY, assert_estimates_are_true, figures, line_of_grains, oblique_impact

SOFTER = replace(MATERIAL, normal_law="hertz", restitution=0.6)


def compressed(folder: Path, chain: CompressedChain, steps: int, words: str = "speed 1 limit 1e9 every 1") -> Run:
    places = chain.places.copy()
    places[1:-1] = chain.positions(0)
    return run_deck(folder, line_of_grains(lammps_driver, places, 0 * places, MATERIAL, chain.step, f"""\
group free id 2:{chain.count + 1}
fix motion free nve/sphere
{MONITOR}{words} length 1
{THERMO}thermo {steps}
run {steps}"""))


@pytest.mark.parametrize("phase", [0.05, 0.2])
def test_the_estimates_are_the_true_local_errors(tmp_path: Path, phase: float) -> None:
    chain = CompressedChain(phase)
    assert_estimates_are_true(compressed(tmp_path, chain, 4000), chain, 4000)


def pairs(driver: object, folder: Path, step: float, count: int = 16) -> np.ndarray:
    """Figures of pairs that touch at as many times between two steps."""
    assert driver in (lammps_driver, liggghts_driver)
    module = lammps_driver if driver is lammps_driver else liggghts_driver
    gaps = 1e-5 + 0.6 * step * (np.arange(count) + 0.5) / count
    places = (8 * RADIUS * np.arange(count)[:, None] + np.array([0.0, 1.0]) * (2 * RADIUS + gaps)[:, None]).ravel()
    text = line_of_grains(module, places, np.tile([0.3, -0.3], count), SOFTER, step, f"""\
fix motion all nve/sphere
{MONITOR}speed 1 every 1 impacts 1
{THERMO}thermo 100
run {round(2.4e-3 / step)}""")
    return figures(module.run_deck(folder, text))[-1, 1:]


def test_impacts_are_judged_as_in_liggghts(tmp_path: Path) -> None:
    ours, theirs = (pairs(driver, tmp_path / name, 2.4e-5) for driver, name in ((lammps_driver, "lammps"), (liggghts_driver, "liggghts")))
    assert ours[20] == 16
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("dimension", "motion"), [(3, "nve/sphere"), (2, "nve/sphere"), (2, "nve/sphere disc"), (3, "nve")])
def test_impacts_are_those_of_discs_and_of_grains_that_do_not_turn(tmp_path: Path, dimension: int, motion: str) -> None:
    """The reference of an oblique impact has the moments of inertia with which the engine turns the grains."""
    found = figures(run_deck(tmp_path, oblique_impact(lammps_driver, dimension, motion, 2e-6)))[-1, 1:]
    assert found[20] == 1 and found[21] < 5e-3


def falling(words: str, run: str = "run 3000", *, ranks: int = 1, create: str = CREATE, state: str = STATE, step: str = "1e-5") -> str:
    text = bed(f"{MONITOR}{words}\n{THERMO}thermo 100\n{run}", material=BED, create=create, state=state,
               head="processors 2 1 1" if ranks == 2 and state else "")
    return text.replace("timestep 1e-5", f"timestep {step}")


def test_a_bed_is_silent_with_a_right_step_and_told_with_a_long_one(tmp_path: Path) -> None:
    done = run_deck(tmp_path / "right", falling("speed 1 impacts 1 every 5"))
    assert "WARNING: fix watch" not in done.output
    found = figures(done)[-1, 1:]
    assert found[POSITION][0] > 0 and found[VELOCITY][0] > 0 and found[SPIN][0] > 0
    assert found[13] > 50 and found[20] > 0
    assert found[15] == -2 or found[15] > found[14] > 0
    long = run_deck(tmp_path / "long", falling("speed 1 every 1", "run 400", step="1e-4"))
    told = re.findall(r"WARNING: fix watch integration/monitor: at step (\d+) (.*)", long.output)
    assert sum("less than 10; take a shorter time step" in line for _, line in told) == 1
    stopped = run_deck(tmp_path / "stop", falling("speed 1 every 1 action stop", "run 400", step="1e-4"))
    assert stopped.code != 0 and "take a shorter time step" in stopped.error + stopped.output


def test_walls_are_judged(tmp_path: Path) -> None:
    """A grain that lies on the floor by its own weight: half a period on the spring of that overlap."""
    create = """region domain block 0 0.024 0 0.024 -0.001 0.05 units box
create_box 3 domain
create_atoms 1 single 0.012 0.012 0.00249"""
    text = bed(f"{MONITOR}speed 1 every 1\n{THERMO}thermo 1\nrun 1", material=BED, create=create,
               state="set group all density 2500 diameter 0.005 density 2500")
    found = figures(run_deck(tmp_path, text))[-1, 1:]
    rigidity = BED.youngs_modulus / (2 * (1 - BED.poisson_ratio**2))
    mass = 4 / 3 * np.pi * 0.0025**3 * 2500
    assert found[15] == -2 and found[14] == 1
    assert found[13] == pytest.approx(np.pi * np.sqrt(mass / (2 * rigidity * np.sqrt(0.0025 * 1e-5))) / 1e-5, rel=1e-4)


def test_the_step_is_adapted_at_rows_whose_times_stay(tmp_path: Path) -> None:
    places = 2 * RADIUS * np.array([-2.2, 0.0, 1.2, 3.4])
    material = replace(MATERIAL, normal_law="hertz")
    done = run_deck(tmp_path, line_of_grains(lammps_driver, places, [0.0, 1.0, -1.0, 0.0], material, 1e-4, f"""\
group free id 2 3
fix motion free nve/sphere
{MONITOR}speed 1 action adapt rows 4 every 1
variable next equal f_watch[20]
variable n equal step
variable h equal dt
variable now equal time
fix times all print 1 "${{n}} ${{h}} ${{now}}" file times.txt screen no
dump grains all custom 4 grains.dump id x vx
dump_modify grains sort id every v_next first yes
{THERMO}thermo 100
run 4000"""))
    assert done.code == 0, done.error
    _, lengths, now = np.loadtxt(tmp_path / "times.txt").T
    assert lengths.min() < 1e-4 / 2 * 1.001 and lengths.max() == 1e-4
    np.testing.assert_allclose(np.diff(now), lengths[:-1], rtol=1e-9)
    np.testing.assert_allclose(np.diff(now[read_dump(tmp_path / "grains.dump")[0]]), 4 * 1e-4, rtol=1e-9)


def test_two_ranks_see_what_one_sees(tmp_path: Path) -> None:
    one, two = (figures(run_deck(tmp_path / str(ranks), falling("speed 1 impacts 1 every 3", ranks=ranks), ranks=ranks))
                for ranks in (1, 2))
    assert one[-1, 21] > 2
    np.testing.assert_allclose(one, two, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_a_resumed_run_has_the_same_figures_to_the_bit(tmp_path: Path, ranks: int) -> None:
    words, state = "speed 1 impacts 1 every 5", "fix state all resume/exact 709 bed cut grains.dump\n"

    def run(folder: Path, steps: str, **how: str) -> Run:
        text = falling(words, f"{state}run {steps}", ranks=ranks, **how)
        return run_deck(folder, text.replace("sort id", "append yes sort id") if how else text, ranks=ranks)

    whole = run(tmp_path / "whole", "3000")
    assert run(tmp_path / "broken", "1600").code == 0
    again = run(tmp_path / "broken", "3000 upto", create="resume_state bed", state="")
    assert "at step 1418 exactly" in again.output, again.output[-1500:]
    expected, found = figures(whole), figures(again)
    assert expected[-1, 0] == found[-1, 0] == 3000
    np.testing.assert_array_equal(expected[-1], found[-1])


@pytest.mark.parametrize(("words", "told"), [
    ("", "it needs 'speed'"), ("speed fast", "speed: the value must be a number, not 'fast'"),
    ("speed 1 every 2.5", "every: the value must be an integer, not 2.5"),
    ("speed 1 action adapt", "action 'adapt' needs 'rows'"), ("speed 1 sped 2", "keyword 'sped' is unknown; it can be speed, length"),
    ("speed 1\nfix more all integration/monitor speed 1", "there can be one such fix only, and there is fix watch"),
    ("speed 1\nfix plate all wall/gran hooke/history 1e4 NULL 10 NULL 0.5 0 zplane 0 NULL", "and there is fix plate (wall/gran)"),
])
def test_mistakes_are_told_in_one_line(tmp_path: Path, words: str, told: str) -> None:
    assert_one_line(run_deck(tmp_path, falling(words, "run 1")), told)


@pytest.mark.parametrize(("change", "told"), [
    (("newton off", "newton on"), "impacts needs newton off"), (("fix motion all nve/sphere\n", ""), "needs fix nve/sphere"),
    (("atom_modify map array", "atom_modify map yes"), "")])
def test_what_it_cannot_judge_is_told(tmp_path: Path, change: Sequence[str], told: str) -> None:
    text = falling("speed 1 impacts 1", "run 1").replace(*change)
    if told:
        assert_one_line(run_deck(tmp_path, text), told)
    else:
        assert run_deck(tmp_path, text).code == 0


def assert_one_line(done: Run, told: str) -> None:
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert done.code != 0 and len(errors) == 1 and told in errors[0], done.output[-1500:]


def test_motion_is_not_touched(tmp_path: Path) -> None:
    text = falling("speed 1 impacts 1 every 5", "run 2000")
    bare = text.replace(f"{MONITOR}speed 1 impacts 1 every 5\n{THERMO}", "")
    assert "integration" not in bare
    for name, deck in (("watched", text), ("bare", bare)):
        assert run_deck(tmp_path / name, deck).code == 0
    assert (tmp_path / "watched/grains.dump").read_bytes() == (tmp_path / "bare/grains.dump").read_bytes()
