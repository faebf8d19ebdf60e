"""IntegrationMonitor in YADE: chains with exact solutions, warnings, adapted steps, saved scenes, threads, mistakes."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from rig.chains import CompressedChain, solitary_wave

SCENES = "chains warned adapted saved on_a_wall lag messages".split()
SCRIPT = "monitor_scenes.py"


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes(*SCENES, script=SCRIPT)


def test_a_compressed_chain_follows_the_exact_solution_of_the_scheme(yade):
    """After 1e5 steps the phase, 3e4, is right to 1e-9 of itself."""
    chain, steps = CompressedChain(0.3), 100_000
    phase = 2 * np.arcsin(0.5 * chain.phase) * steps
    positions = np.array(yade.scenes("long_chain", script=SCRIPT)["long_chain"]["positions"])
    assert np.abs(positions - chain.positions(steps)).max() < 1e-9 * phase * chain.amplitude


@pytest.mark.parametrize(("number", "phase"), [(0, 0.05), (1, 0.2)])
def test_the_estimates_are_the_true_local_errors(found, number, phase):
    figures, (along, speed) = found["chains"][number]["figures"], CompressedChain(phase).true_errors()
    assert figures["position_rms"] == pytest.approx(along, rel=0.02)
    assert figures["velocity_rms"] == pytest.approx(speed, rel=0.02)
    assert figures["spin"] == 0.0
    assert figures["contact_steps"] == pytest.approx(np.pi * np.sqrt(2) * np.sin(8 * np.pi / 18) / phase, rel=1e-9)


def test_a_struck_chain_has_the_speed_of_the_solitary_wave(yade):
    """V = 0.9055 d k^(1/3) F^(1/6) m^(-1/2) for the peak force F; V. F. Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733."""
    rows = np.array(yade.scenes("struck", script=SCRIPT)["struck"]["rows"])
    speed, theory = solitary_wave(rows, 4e-6 * 3 * np.arange(1, len(rows) + 1), 15, 28)
    assert speed == pytest.approx(theory, rel=5e-3)


def test_a_step_that_is_too_long_is_told_and_a_right_one_is_not(found):
    long, right, stopped = found["warned"]
    assert long["figures"]["contact_steps"] < 10 <= right["figures"]["contact_steps"]
    assert stopped["line"].startswith("dembark: IntegrationMonitor: at step ")
    assert stopped["line"].endswith("take a shorter time step")
    bed = found["saved"][0]
    assert bed["contact_steps"] > 10
    assert 0 < max(bed[name] for name in ("position", "velocity", "spin")) < 0.01


def test_warnings_come_once(yade):
    done = yade(Path(__file__).parent / SCRIPT, str(yade.folder / "warned.json"), "warned")
    *_, part = done.stderr.partition("scene: warned 1.0 warn")
    long, _, rest = part.partition("scene: warned 0.2 warn")
    warnings = [line for line in long.splitlines() if line.startswith("WARNING: dembark: IntegrationMonitor: at step ")]
    assert 1 <= len(warnings) <= 3, done.stderr[-2000:]
    assert sum("lasts 4.38 steps, less than 10; take a shorter time step" in line for line in warnings) == 1
    assert "WARNING: dembark" not in rest


def test_the_step_is_adapted_at_rows_whose_times_stay(found):
    rows = np.array(found["adapted"]["adapt"]["rows"])
    assert rows[:, 2].min() < 1e-4 / 2 * 1.001
    # A row ends where the next one begins: between the forces of its step and the motion, at the time before that of the same line.
    ends = np.flatnonzero(np.diff(rows[:, 3])) + 1
    at = rows[ends, 1] - rows[ends, 2]
    np.testing.assert_allclose(np.diff(at), 4e-4, rtol=1e-9)
    assert len(at) > 100


def test_a_scene_that_was_saved_has_the_same_figures_to_the_bit(found):
    one, *others = found["saved"]
    assert others == [one] * 3
    assert one["impacts"] > 2


def test_so_has_one_whose_shortest_contact_is_that_of_a_wall(found):
    one, *others = found["on_a_wall"]
    assert (one["contact_body_1"], one["contact_body_2"]) == (1, -2)
    assert others == [one] * 2


def test_threads_make_no_difference(yade, found):
    np.testing.assert_allclose(list(yade.scenes("saved", script=SCRIPT, threads=2)["saved"][0].values()), list(found["saved"][0].values()),
                               rtol=1e-6, atol=1e-12)


def test_impacts_show_the_lag_of_damping(found):
    """Of first order in the step, but for how the touch lies between two steps."""
    coarse, fine = found["lag"]
    assert coarse["impacts"] == fine["impacts"] == 1
    assert 4.0 < coarse["impact"] / fine["impact"] < 64.0


def test_mistakes_are_told_in_one_line(found):
    told = ["needs 'speed'", "speed (m/s) must be a number > 0", "every must be 1 step or more", "limit must be > 0",
            "contact_steps must be a number > 0", "'shout' is unknown; it can be report, warn, stop or adapt", "'adapt' needs 'rows'",
            "length", "impacts must be 0 (none) or more, not -1", "after InteractionLoop and before NewtonIntegrator", "give 'length' (m)"]
    assert len(told) == len(found["messages"])
    for line, words in zip(found["messages"], told, strict=True):
        assert line.startswith("dembark: IntegrationMonitor") and words in line and "\n" not in line, line
