"""fix integration/monitor: chains with exact solutions, warnings, adapted steps, ranks, exact restarts, mistakes."""

import re
from dataclasses import replace

import numpy as np
import pytest
from rig import fluid, liggghts_driver
from rig.chains import MATERIAL, RADIUS, CompressedChain, solitary_wave
from rig.liggghts_driver import read_dump, run_deck
from rig.monitor import BED, MONITOR, POSITION, SPIN, THERMO, VELOCITY, assert_estimates_are_true, figures, line_of_grains, oblique_impact
from rig.packing import CREATE, STATE, packing


def compressed(folder, chain, steps, words="speed 1 limit 1e9 every 1"):
    places = chain.places.copy()
    places[1:-1] = chain.positions(0)
    return run_deck(folder, line_of_grains(liggghts_driver, places, 0 * places, MATERIAL, chain.step, f"""\
group free id 2:{chain.count + 1}
fix motion free nve/sphere
{MONITOR}{words} length 1
dump grains all custom {steps} grains.dump id x
dump_modify grains sort id format "%d %.17g"
{THERMO}thermo {steps}
run {steps}"""))


def test_a_compressed_chain_follows_the_exact_solution_of_the_scheme(tmp_path):
    """After 1e5 steps the phase, 3e4, is right to 1e-9 of itself."""
    chain, steps = CompressedChain(0.3), 100_000
    assert compressed(tmp_path, chain, steps, "speed 1 limit 1e9").code == 0
    x = read_dump(tmp_path / "grains.dump")[1][-1][1:-1, 1]
    phase = 2 * np.arcsin(0.5 * chain.phase) * steps
    off = np.abs(x - chain.positions(steps)).max() / chain.amplitude
    assert off < 1e-9 * phase


@pytest.mark.parametrize("phase", [0.05, 0.2])
def test_the_estimates_are_the_true_local_errors(tmp_path, phase):
    chain = CompressedChain(phase)
    assert_estimates_are_true(compressed(tmp_path, chain, 4000), chain, 4000)


def test_a_struck_chain_has_the_speed_of_the_solitary_wave(tmp_path):
    """V = 0.9055 d k^(1/3) F^(1/6) m^(-1/2) for the peak force F; V. F. Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733."""
    count, step, stride = 60, 2e-6, 5
    material = replace(MATERIAL, normal_law="hertz")
    speeds = np.zeros(count)
    speeds[0] = 0.5
    done = run_deck(tmp_path, line_of_grains(liggghts_driver, 2 * RADIUS * np.arange(count), speeds, material, step, f"""\
fix motion all nve/sphere
{MONITOR}speed 0.5
dump grains all custom {stride} grains.dump id x
dump_modify grains sort id format "%d %.17g"
{THERMO}thermo 1000
run 12000"""))
    assert figures(done)[-1, 1:][POSITION][3] == 0.0
    assert "WARNING: fix integration" not in done.output
    steps, frames = read_dump(tmp_path / "grains.dump")
    speed, theory = solitary_wave(np.array(frames)[:, :, 1], step * steps, 20, 40)
    assert speed == pytest.approx(theory, rel=5e-3)


def bed(words, run_command="run 100", *, step="1e-5", ranks=1, every=1500, create=CREATE, state=STATE):
    text = packing(BED, f"{MONITOR}{words}\n{THERMO}{run_command}", every=every, create=create, state=state)
    text = text.replace("timestep 1e-5", f"timestep {step}").replace("thermo 1000", "thermo 100")
    return text if ranks == 2 else text.replace("processors 2 1 1\n", "")


def test_a_step_that_is_too_long_is_told_and_a_right_one_is_not(tmp_path):
    right = compressed(tmp_path / "right", CompressedChain(0.2), 100_000, "speed 1")
    assert "WARNING: fix integration" not in right.output
    assert figures(right)[-1, 1:][13] > 10
    long = compressed(tmp_path / "long", CompressedChain(1.0), 100, "speed 1")
    warned = re.findall(r"WARNING: fix integration/monitor \(id watch\): at step (\d+) (.*)", long.output)
    assert warned and all(int(step) <= 100 for step, _ in warned), long.output[-2000:]
    assert sum("lasts 4.38 steps, less than 10; take a shorter time step" in line for _, line in warned) == 1
    assert sum("the error of the velocity of atom" in line for _, line in warned) == 1
    stopped = compressed(tmp_path / "stop", CompressedChain(1.0), 100, "speed 1 action stop")
    assert stopped.code != 0 and "take a shorter time step" in stopped.error
    report = compressed(tmp_path / "report", CompressedChain(1.0), 100, "speed 1 action report")
    assert "WARNING: fix" not in report.output and figures(report)[-1, 1:][13] < 10


def test_a_bed_with_a_right_step_is_silent(tmp_path):
    done = run_deck(tmp_path, bed("speed 1 impacts 1", "run 20000"))
    assert "WARNING: fix integration" not in done.output
    found = figures(done)[-1, 1:]
    assert found[POSITION][0] > 0 and found[VELOCITY][0] > 0 and found[SPIN][0] > 0
    assert found[13] > 50 and found[20] > 0
    assert found[15] == -2 or found[15] > found[14] > 0


def test_the_step_is_adapted_at_rows_whose_times_stay(tmp_path):
    """Two spheres that bounce between two held ones, with six steps a contact at first, and the energy with which they go on."""
    places = 2 * RADIUS * np.array([-2.2, 0.0, 1.2, 3.4])
    material = replace(MATERIAL, normal_law="hertz")
    speeds = {}
    for name, words in (("adapt", "speed 1 action adapt rows 4 every 1"), ("long", "speed 1 action report")):
        rows = "variable next equal f_watch[20]\ndump_modify grains every v_next first yes\n" if name == "adapt" else ""
        done = run_deck(tmp_path / name, line_of_grains(liggghts_driver, places, np.array([0.0, 1.0, -1.0, 0.0]), material, 1e-4, f"""\
group free id 2 3
fix motion free nve/sphere
{MONITOR}{words}
variable n equal step
variable h equal dt
variable now equal time
fix times all print 1 "${{n}} ${{h}} ${{now}}" file times.txt screen no
dump grains all custom 4 grains.dump id x vx
dump_modify grains sort id format "%d %.17g %.17g"
{rows}{THERMO}thermo 100
run 8000"""))
        assert done.code == 0, done.error
        speeds[name] = np.array([frame[1:3, 2] for frame in read_dump(tmp_path / name / "grains.dump")[1]])
    steps, lengths, now = np.loadtxt(tmp_path / "adapt" / "times.txt").T
    assert lengths.min() < 1e-4 / 2 * 1.001
    # What is printed at the end of a step is the length of the next one.
    times = np.concatenate([[0.0], np.cumsum(np.concatenate([[1e-4], lengths[:-1]]))])
    at_rows = times[read_dump(tmp_path / "adapt" / "grains.dump")[0]]
    np.testing.assert_allclose(np.diff(at_rows), 4 * 1e-4, rtol=1e-9)
    assert steps[-1] == 8000
    # And the clock, to its six digits in the file.
    np.testing.assert_allclose(now, times[1:], rtol=1e-5, atol=1e-9)

    def change_of_speed(rows):
        """From flight to flight, rms of the later half."""
        resting = (rows[1:] == rows[:-1]).all(axis=1)
        flights = np.abs(rows[1:][resting][:, 0])
        flights = flights[np.concatenate([[True], flights[1:] != flights[:-1]])]
        flights = flights[len(flights) // 2 :]
        assert len(flights) > 10
        return np.sqrt(np.mean((flights[1:] / flights[:-1] - 1.0) ** 2))

    # What velocity Verlet errs by at ten steps a Hertz contact.
    assert change_of_speed(speeds["adapt"]) < 2.7e-3 < change_of_speed(speeds["long"])


def test_two_ranks_see_what_one_sees(tmp_path):
    one, two = (figures(run_deck(tmp_path / str(ranks), bed("speed 1 impacts 1 every 3", "run 3000", ranks=ranks), ranks=ranks))
                for ranks in (1, 2))
    assert one[-1, 21] > 2
    np.testing.assert_allclose(one, two, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_a_resumed_run_has_the_same_figures_to_the_bit(tmp_path, ranks):
    states = "fix state all resume/exact 709 bed cut grains.dump\n"
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    words = "speed 1 impacts 1 every 5"
    done = [run_deck(folder, bed(words, f"{states}run {steps}", ranks=ranks), ranks=ranks)
            for folder, steps in ((whole, 3000), (broken, 1600))]
    again = run_deck(broken, bed(words, f"{states}run 3000 upto", ranks=ranks, create="resume_state bed", state="").replace(
        "dump_modify grains sort id", "dump_modify grains append yes sort id"), ranks=ranks)
    assert "dembark: resumed at step 1418 exactly" in again.output, again.error
    expected, found = figures(done[0]), figures(again)
    assert expected[-1, 0] == found[-1, 0] == 3000
    np.testing.assert_array_equal(expected[-1], found[-1])
    assert (whole / "bed.2836.restart").read_bytes() == (broken / "bed.2836.restart").read_bytes()


def test_impacts_show_the_lag_of_damping(tmp_path):
    """Of first order in the step; sixteen pairs touch at as many times between two steps."""
    found, material, pairs = {}, replace(MATERIAL, normal_law="hertz", restitution=0.6), 16
    for step in (2.4e-5, 1.5e-6):
        gaps = 1e-5 + 0.6 * step * (np.arange(pairs) + 0.5) / pairs
        places = (8 * RADIUS * np.arange(pairs)[:, None] + np.array([0.0, 1.0]) * (2 * RADIUS + gaps)[:, None]).ravel()
        text = line_of_grains(liggghts_driver, places, np.tile([0.3, -0.3], pairs), material, step, f"""\
fix motion all nve/sphere
{MONITOR}speed 1 every 1 impacts 1
{THERMO}thermo 100
run {round(2.4e-3 / step)}""")
        found[step] = figures(run_deck(tmp_path / str(step), text))[-1, 1:]
        assert found[step][20] == pairs
    assert np.log2(found[2.4e-5][22] / found[1.5e-6][22]) / 4 == pytest.approx(1.0, abs=0.3)


@pytest.mark.parametrize(("dimension", "motion"), [(3, "nve/sphere"), (2, "nve/sphere"), (3, "nve"), (2, "nve")])
def test_impacts_are_those_of_discs_in_the_plane_and_of_grains_that_do_not_turn(tmp_path, dimension, motion):
    """The reference has the moments of inertia with which the engine turns the grains."""
    step = 2e-6 if dimension == 3 else 2e-5  # short enough for 1e-3
    found = figures(run_deck(tmp_path, oblique_impact(liggghts_driver, dimension, motion, step)))[-1, 1:]
    assert found[20] == 1 and found[21] < 5e-3


def test_contacts_of_a_hybrid_are_judged(tmp_path):
    chain, steps = CompressedChain(0.2), 200
    alone = figures(compressed(tmp_path / "alone", chain, steps))[-1]
    assert alone[14] > 10
    text = (tmp_path / "alone" / "case.in").read_text()
    for k, style in enumerate(("hybrid", "hybrid/overlay")):
        styled = text.replace("pair_style gran", f"pair_style {style} gran").replace("pair_coeff * *", "pair_coeff * * gran")
        np.testing.assert_array_equal(figures(run_deck(tmp_path / str(k), styled))[-1], alone)


def test_a_fluid_alone_has_no_contacts_to_judge(tmp_path):
    watch = "group nobody type 99\nfix motion nobody nve/sphere\nfix watch nobody integration/monitor speed 1 length 1 every 1"
    hybrid = (("pair_style sph", "pair_style hybrid/overlay sph"), ("pair_coeff * *", "pair_coeff * * sph/coupled"))
    for k, changes in enumerate(((), hybrid)):
        done = run_deck(tmp_path / str(k), fluid.deck(fluid.dam(), 2, extra=watch, changes=changes))
        assert done.code == 0, done.error or done.output[-1500:]


@pytest.mark.parametrize(("words", "told"), [
    ("", "it needs 'speed'"), ("speed", "speed: the value is missing"),
    ("speed fast", "speed: the value must be a number, not 'fast'"), ("speed 0", "it needs 'speed'"),
    ("speed -1", "speed (m/s) must be a number > 0"), ("speed 1 length 0", "length (m) must be a number > 0"),
    ("speed 1 limit 0", "limit must be > 0"), ("speed 1 every 0", "every must be 1 step or more"),
    ("speed 1 every 2.5", "every: the value must be an integer, not 2.5"),
    ("speed 1 contact_steps 0", "contact_steps must be a number > 0"),
    ("speed 1 action shout", "action 'shout' is unknown; it can be report, warn, stop or adapt"),
    ("speed 1 action adapt", "action 'adapt' needs 'rows'"), ("speed 1 rows 5", "rows belongs to action adapt"),
    ("speed 1 sped 2", "keyword 'sped' is unknown; it can be speed, length"), ("speed 1 impacts -1", "impacts must be 0 (none) or more"),
    ("speed 1\nfix more all integration/monitor speed 1", "there can be one such fix only, and there is fix watch"),
])
def test_mistakes_are_told_in_one_line(tmp_path, words, told):
    done = run_deck(tmp_path, bed(words, "run 1"))
    assert done.code != 0
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert len(errors) == 1 and told in errors[0], done.output[-1500:]


def test_walls_of_another_normal_model_are_refused(tmp_path):
    text = bed("speed 1")
    wall = next(line for line in text.splitlines() if "wall/gran" in line)
    assert "model hertz" in wall
    done = run_deck(tmp_path, text.replace(wall, wall.replace("model hertz", "model hooke")))
    assert done.code != 0 and "walls with the normal model of the pair style only" in done.error, done.output[-1500:]


def test_what_it_cannot_judge_is_told(tmp_path):
    soft = re.sub("pair_style gran.*\n.*", "pair_style soft 0.005\npair_coeff * * 1", bed("speed 1"))
    stock = bed("speed 1 impacts 1").replace("tangential finnie_rabinowicz", "tangential history").replace(" presliding linear", "")
    for k, (text, told) in enumerate(((stock, "tangential finnie_rabinowicz only"),
                                      (bed("speed 1").replace("fix motion all nve/sphere\n", ""), "needs fix nve/sphere"),
                                      (soft, "contacts of one pair_style gran, alone or in a hybrid; there is pair_style soft"))):
        done = run_deck(tmp_path / str(k), text)
        assert done.code != 0 and told in done.error, done.output[-1500:]


def test_motion_is_not_touched(tmp_path):
    watched, bare = tmp_path / "watched", tmp_path / "bare"
    text = bed("speed 1 impacts 1 every 5", "run 2000")
    unwatched = text.replace(f"{MONITOR}speed 1 impacts 1 every 5\n{THERMO}", "")
    assert "integration" not in unwatched
    for folder, deck in ((watched, text), (bare, unwatched)):
        assert run_deck(folder, deck).code == 0
    assert (watched / "grains.dump").read_bytes() == (bare / "grains.dump").read_bytes()
