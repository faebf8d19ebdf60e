"""Adams' predictor-corrector beside an integrator of another kind (SciPy's DOP853) and beside exact solutions; Verlet's local error."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dembark import physics


def pendulum(t, y):
    return np.array([y[1], -np.sin(y[0]) + 0.3 * np.cos(2.0 * t)])


def test_a_driven_pendulum_follows_dop853():
    oracle = solve_ivp(pendulum, (0.0, 10.0), [1.0, 0.2], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    errors = [np.abs(physics.integrate_adams(pendulum, [1.0, 0.2], 10.0, h).state[-1] - oracle).max() for h in (0.02, 0.01, 0.005)]
    assert errors[-1] < 1e-8
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4.0, abs=0.3)


def bouncing(restitution_damping):
    """A grain under gravity on a damped Hertz plane, the contact as long as it presses."""
    def derivative(t, y):
        overlap = max(-y[0], 0.0)
        force = 1e4 * overlap**1.5 - restitution_damping * np.sqrt(overlap) * y[1] if overlap else 0.0
        return [y[1], force - 9.81]
    return derivative


def test_impacts_with_located_touches_follow_dop853_with_events():
    derivative = bouncing(20.0)

    def touch(t, y):
        return y[0]

    oracle = solve_ivp(derivative, (0.0, 1.0), [0.1, 0.0], method="DOP853", rtol=1e-11, atol=1e-13, events=touch, max_step=1e-3)
    errors = []
    for step in (2e-4, 1e-4):
        ours = physics.integrate_adams(derivative, [0.1, 0.0], 1.0, step, events=lambda t, y: [y[0]])
        assert len(ours.events) == len(oracle.t_events[0]) >= 4
        assert ours.state[-1] == pytest.approx(oracle.y[:, -1], abs=5e-5)
        errors.append(np.abs(np.array([e.time for e in ours.events]) - oracle.t_events[0]).max())
    # The damping grows as the root of the overlap: order 1.5 at the touch.
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.5, abs=0.2)
    assert errors[1] < 2e-6


def test_the_estimate_is_the_local_error_and_the_signal_tells_a_step_too_long():
    h = 0.04
    run = physics.integrate_adams(lambda t, y: [y[1], -y[0]], [1.0, 0.0], 6.0, h, tolerance=1e-5)
    x, v = run.state[3:-2].T
    exact = np.stack([x * np.cos(h) + v * np.sin(h), v * np.cos(h) - x * np.sin(h)], axis=1)
    true = exact - run.state[4:-1]
    assert np.linalg.norm(run.error[4:-1]) == pytest.approx(np.linalg.norm(true), rel=0.02)
    assert not run.signal.any()
    long = physics.integrate_adams(lambda t, y: [y[1], -y[0]], [1.0, 0.0], 60.0, 0.4, tolerance=1e-5)
    assert long.signal[4:-1].all()


def test_an_event_may_change_the_system_and_end_the_run():
    """A block that slides under dry friction and stops: at the event the caller takes the force away."""
    sliding = {"on": True}

    def derivative(t, y):
        return [y[1], -2.0 if sliding["on"] else 0.0]

    def stop(event):
        sliding["on"] = False

    run = physics.integrate_adams(derivative, [0.0, 1.0], 1.0, 0.03, events=lambda t, y: y[1:], at_event=stop)
    assert [(e.number, pytest.approx(e.time, abs=1e-14)) for e in run.events] == [(0, 0.5)]
    assert run.state[-1] == pytest.approx([0.25, 0.0], abs=1e-14)
    assert run.time[-1] == 1.0
    sliding["on"] = True
    assert physics.integrate_adams(derivative, [0.0, 1.0], 1.0, 0.03, events=lambda t, y: y[1:],
                                   at_event=lambda e: True).time[-1] == pytest.approx(0.5)


@pytest.mark.parametrize(("change", "line"), [
    ({"step": 0.0}, "step must be > 0 s and finite, not 0"),
    ({"step": float("nan")}, "step must be > 0 s and finite, not nan"),
    ({"end": -1.0}, "end must be >= start = 0 s, not -1"),
    ({"corrections": 0}, "corrections must be 1 or more"),
    ({"scale": [1.0, 1.0, 1.0]}, r"scale must be one number or have the shape of the state, \(2,\), not \(3,\)"),
    ({"state": [[1.0, 0.0]]}, r"state must have shape \(k,\), not \(1, 2\)"),
    ({"derivative": lambda t, y: [1.0]}, "derivative must return 2 numbers, not 1"),
    ({"derivative": lambda t, y: [np.nan, 0.0]}, "derivative returned a number that is not finite at t = 0"),
])
def test_wrong_input_gets_one_line(change, line):
    given = {"derivative": pendulum, "state": [1.0, 0.0], "end": 1.0, "step": 0.1} | change
    with pytest.raises(ValueError, match=line) as caught:
        physics.integrate_adams(**given)
    assert "\n" not in str(caught.value)


def test_an_error_in_the_users_function_is_the_users_error():
    def derivative(t, y):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        physics.integrate_adams(derivative, [1.0], 1.0, 0.1)


def test_local_errors_of_verlet_are_what_a_step_misses():
    h, n = 0.1, 400
    x, v = np.array([1.0, 0.3]), np.array([0.0, -0.2])
    accelerations, missed = [-x], []
    for _ in range(n):
        exact = x * np.cos(h) + v * np.sin(h), v * np.cos(h) - x * np.sin(h)
        a = -x
        x = x + h * v + h * h / 2 * a
        v = v + h / 2 * (a - x)
        accelerations.append(-x)
        missed.append((exact[0] - x, exact[1] - v))
    told = physics.local_errors(accelerations, h)
    true = np.array(missed[2:])
    assert told.position.shape == told.velocity.shape == (n - 2, 2)
    for estimate, exact in ((told.position, true[:, 0]), (told.velocity, true[:, 1])):
        assert np.sqrt(np.mean(estimate**2) / np.mean(exact**2)) == pytest.approx(1.0, abs=0.02)
        assert np.corrcoef(estimate.ravel(), exact.ravel())[0, 1] > 0.99  # the sign, too


def test_local_errors_refuse_too_few_rows():
    with pytest.raises(ValueError, match=r"accelerations must have shape \(n, k\) with n >= 4, not \(3, 2\)"):
        physics.local_errors(np.zeros((3, 2)), 1e-5)
