"""The checks of the cases of logs pass for runs that are right and fail for runs that are not; engines are compared by a stated bound."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dembark.postproc import DumpError
from dembark.validation.checks import log_cradle, log_pair, log_pile
from dembark.validation.checks.logs import LogRun, TouchFrame, exact, read_touches
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica
from dembark.validation.compare import pair

DECKS = Path(__file__).resolve().parents[3] / "input_decks"


def parameters(case, **changes):
    tables = tomllib.loads((DECKS / case / "case.toml").read_text(encoding="utf-8"))["parameters"]
    return {name: table.get("value") for name, table in tables.items()} | changes


def row_of_springs(p, mass, stiffness, place, velocity, steps, stride):
    """The scheme for logs in a row, theta-weighted leapfrog, one contact at a time solved by bisection on the active set: a LogRun."""
    tau, theta, n = p["time_step"], p["theta"], len(mass)
    x, v = np.array(place, float), np.array(velocity, float)
    difference = np.diff(np.eye(n), axis=0)
    rest = np.full(n - 1, p["touch"])
    matrix = np.diag(1.0 / stiffness) + theta * tau**2 * difference @ np.diag(1.0 / mass) @ difference.T
    frames, highest, impulse, longest = [], 0.0, 0.0, 0
    force = np.zeros(n - 1)
    for step in range(steps + 1):
        known = difference @ x - rest + (2.0 * theta - 1.0) * tau * (difference @ v)
        active = known < 0.0
        for _ in range(4 * n):
            force = np.zeros(n - 1)
            if active.any():
                force[active] = np.linalg.solve(matrix[np.ix_(active, active)], -known[active])
            again = (force > 0.0) | (~active & (matrix @ force + known < 0.0))
            if (again == active).all():
                break
            active = again
        highest, impulse, longest = max(highest, force.max()), impulse + tau * force.sum(), longest + bool(force.any())
        push = difference.T @ force
        if step % stride == 0:
            frames.append((step, x.copy(), v + 0.5 * tau * push / mass, push, force.copy(), highest, impulse))
        v = v + (0.5 if step == 0 else 1.0) * tau * push / mass
        x = x + tau * v
    count = len(frames)

    def vectors(index):
        table = np.zeros((count, n, 3))
        table[:, :, 0] = [frame[index] for frame in frames]
        return table

    velocities = vectors(2)
    kinetic = 0.5 * (velocities**2).sum(axis=2) @ mass
    elastic = np.array([0.5 * (frame[4] ** 2 / stiffness).sum() for frame in frames])
    history = {
        "step": np.array([frame[0] for frame in frames])[1:],
        "highest_force": np.array([frame[5] for frame in frames])[1:],
        "elastic_energy": elastic[1:],
        "dissipated_energy": (kinetic[0] - kinetic - elastic)[1:],
        "kinetic_energy": kinetic[1:],
        **{name: np.zeros(count - 1) for name in ("worst_certificate", "pivots_total", "pivots", "contacts")},
    }
    record = np.array([[1, 2, p.get("lead_time", 0.0), longest * tau, highest, impulse, 1.0, 0.0, 0, 0, 0]])
    touches = [
        TouchFrame(
            frame[0],
            np.array([[i + 1, i + 2] for i in range(n - 1)]),
            np.tile([-1.0, 0.0, 0.0], (n - 1, 1)),
            np.zeros(n - 1),
            frame[4],
            np.zeros((n - 1, 3)),
            np.zeros((n - 1, 3)),
        )
        for frame in frames
    ]
    times = np.array([frame[0] for frame in frames]) * tau
    return LogRun(
        p, tau, times, vectors(1), velocities, np.zeros((count, n, 3)), vectors(3), mass, np.full(n, 0.1), history, record, touches
    )


def pair_run(**changes):
    p = parameters("log_pair", **changes)
    p["touch"] = p["radius_1"] + p["radius_2"]
    stiffness = np.array([p["stiffness_1"] * p["stiffness_2"] / (p["stiffness_1"] + p["stiffness_2"])])
    steps = math.ceil(p["duration"] / p["time_step"] / 200)
    place = [-p["touch"] - (p["velocity_1"] - p["velocity_2"]) * p["lead_time"], 0.0]
    return row_of_springs(p, np.array([p["mass_1"], p["mass_2"]]), stiffness, place, [p["velocity_1"], p["velocity_2"]], 200 * steps, steps)


def verdicts(found):
    return {one.name: one.judged()[0] for one in found[0]}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"theta": 0.5, "time_step": 1.58e-5},
        {"mass_1": 20.0, "stiffness_2": 3e7, "velocity_1": 1.5, "velocity_2": -0.2},
        {"time_step": 3.1e-5},
    ],
)
def test_a_pair_by_the_scheme_passes(changes):
    found = verdicts(log_pair.measured(pair_run(**changes)))
    assert "fail" not in found.values(), found
    assert {"peak_force", "contact_time", "velocity_1_after", "restitution", "momentum_error", "impulse"} <= {
        name for name, v in found.items() if v == "pass"
    }


def test_what_is_wrong_with_a_pair_is_seen():
    run = pair_run()
    bent = replace(run, velocities=run.velocities * (1.0 + np.linspace(0.0, 0.01, len(run.times)))[:, None, None])
    found = verdicts(log_pair.measured(bent))
    assert {"velocity_2_after", "restitution", "momentum_error", "impulse"} <= {name for name, v in found.items() if v == "fail"}
    # The loss of theta = 1 in a run that says it has none.
    lossy = replace(run, parameters=run.parameters | {"theta": 0.5})
    assert {"peak_force", "restitution", "velocity_1_after"} <= {
        name for name, v in verdicts(log_pair.measured(lossy)).items() if v == "fail"
    }
    late = replace(run, impacts=run.impacts * np.where(np.arange(11) == 3, 1.01, 1.0))
    assert verdicts(log_pair.measured(late))["contact_time"] == "fail"


@pytest.mark.parametrize(("theta", "order"), [(1.0, 1.0), (0.5, 2.0)])
def test_the_study_finds_the_order(theta, order):
    points = []
    for step in (3.104558833061282e-5, 6.209117666122564e-5, 1.2418235332245128e-4):
        run = pair_run(theta=theta, time_step=step)
        points.append({"parameters": run.parameters, "quantities": [one.as_json() for one in log_pair.measured(run)[0]]})
    found = {one.name: one for one in log_pair.study("any", points, "time_step")[0]}
    assert found["order_peak_force"].estimate.value == pytest.approx(order, abs=0.05)
    assert all(one.judged()[0] == "pass" for one in found.values())
    wrong = [point | {"parameters": point["parameters"] | {"theta": 1.5 - theta}} for point in points]
    assert all(one.judged()[0] == "fail" for one in log_pair.study("any", wrong, "time_step")[0])


def cradle_run(**changes):
    p = parameters("log_cradle", **changes)
    mass, stiffness, gaps, velocity = log_cradle.row(p)
    p["touch"] = 2.0 * p["radius"]
    place = np.arange(len(mass)) * (p["touch"] + p["gap"])
    steps = math.ceil(p["duration"] / p["time_step"] / 200)
    return row_of_springs(p, mass, stiffness, place, velocity, 200 * steps, steps)


def test_a_cradle_by_the_scheme_passes_and_another_does_not():
    run = cradle_run(time_step=1e-5)
    found = verdicts(log_cradle.measured(run))
    assert "fail" not in found.values(), found
    bent = run.velocities.copy()
    bent[-1, 1] += 0.01
    found = verdicts(log_cradle.measured(replace(run, velocities=bent)))
    assert {"velocity_2_after", "scheme_deviation", "momentum_error"} <= {name for name, v in found.items() if v == "fail"}
    softer = replace(run, parameters=run.parameters | {"stiffness": 1.5e7})
    assert verdicts(log_cradle.measured(softer))["peak_force"] == "fail"


def stack(*, lift=1.0, count=201, logs=4):
    """Logs of 50 kg that rest side by side on the ground, smooth and without friction; the ground carries `lift` of the weight."""
    p = parameters("log_pile", log_count=logs, friction=0.0)
    mass, weight = np.full(logs, 50.0), 50.0 * p["gravity"]
    ids = np.array([[i + 1, -1] for i in range(logs)] + [[1, -2], [logs, -3]] + [[i + 1, i + 2] for i in range(logs - 1)])
    normals = np.array([[0.0, 1.0, 0.0]] * logs + [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]] + [[-1.0, 0.0, 0.0]] * (logs - 1))
    forces = np.array([lift * weight] * logs + [100.0] * (logs + 1))
    zero = np.zeros((len(ids), 3))
    positions = np.zeros((count, logs, 3))
    positions[:, :, 1] = np.linspace(1.0, 0.1, count)[:, None]
    still = np.zeros((count, logs, 3))
    lost = (mass.sum() * p["gravity"]) * (positions[0, 0, 1] - positions[1:, 0, 1])
    steps = np.arange(count) * 100
    history = {
        "step": steps[1:],
        "kinetic_energy": np.zeros(count - 1),
        "elastic_energy": np.zeros(count - 1),
        "dissipated_energy": lost,
        "worst_certificate": np.full(count - 1, 1e-16),
        "pivots_total": steps[1:] * 1.0,
        "pivots": np.ones(count - 1),
        "contacts": np.full(count - 1, 9.0),
        "impacts": np.arange(count - 1),
        "highest_force": np.full(count - 1, 1e4),
    }
    rng = np.random.default_rng(1)
    impacts = np.column_stack(
        [np.full(30, 1), np.full(30, 2), np.linspace(0.1, 0.4, 30), *rng.uniform(1.0, 2.0, (5, 30)), np.zeros((30, 3))]
    )
    touches = [TouchFrame(int(step), ids, normals, np.zeros(len(ids)), forces, zero, zero) for step in steps]
    return LogRun(p, 5e-5, steps * 5e-5, positions, still, still, still, mass, np.full(logs, 0.1), history, impacts, touches)


def test_a_stack_at_rest_passes_and_one_that_floats_does_not():
    found = verdicts(log_pile.measured(stack()))
    assert "fail" not in found.values(), found
    assert {"lift_over_weight", "ground_share", "log_balance", "contacts_per_log", "energy_balance"} <= {
        name for name, v in found.items() if v == "pass"
    }
    light = verdicts(log_pile.measured(stack(lift=0.98)))
    assert {"lift_over_weight", "ground_share", "log_balance"} <= {name for name, v in light.items() if v == "fail"}
    run = stack()
    creeping = replace(run, velocities=run.velocities + np.array([0.1, 0.0, 0.0]))
    assert verdicts(log_pile.measured(creeping))["residual_speed"] == "fail"
    lossy = replace(run, history=dict(run.history) | {"dissipated_energy": 0.9 * run.history["dissipated_energy"]})
    assert verdicts(log_pile.measured(lossy))["energy_balance"] == "fail"


def test_the_beginning_is_the_state_before_the_eleventh_impact():
    run = stack()
    frame, logs, first = log_pile.beginning(run)
    assert logs.tolist() == [0, 1] and len(first) == 10
    assert run.times[frame] < run.impacts[10, 2] <= run.times[frame + 1]
    shuffled = replace(run, impacts=run.impacts[::-1])
    assert log_pile.beginning(shuffled)[0] == frame


def entry(value, agreement, half=0.0):
    return Quantity("speed", "speed", "m/s", exact(value, half), agreement=agreement).as_json()


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        (1.0, 1.0 + 5e-10, "pass"),
        (1.0, 1.0 + 2e-9, "fail"),
        (0.0, 5e-10, "pass"),
        (0.0, 2e-9, "fail"),
        (math.nan, 1.0, "fail"),
        (1.0, math.nan, "fail"),
    ],
)
def test_deterministic_numbers_agree_within_their_bound(one, other, verdict):
    found = pair(entry(one, 1e-9), entry(other, 1e-9), "liggghts", "yade")
    assert found["verdict"] == verdict
    if verdict == "pass":
        assert found["deviation_kind"] == "absolute" and found["tolerance"] == 1e-9


def test_numbers_without_a_bound_are_compared_by_their_intervals():
    assert "agreement" not in entry(1.0, None)
    assert pair(entry(1.0, None, 0.06), entry(1.05, None, 0.06), "liggghts", "yade")["verdict"] == "pass"
    assert pair(entry(1.0, None), entry(1.05, None), "liggghts", "yade")["verdict"] == "fail"


def test_touches_are_read_and_foreign_files_refused(tmp_path):
    head = "ITEM: TIMESTEP\n7\nITEM: NUMBER OF ENTRIES\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ENTRIES "
    columns = " ".join(f"f_impacts[{i}]" for i in range(1, 14))
    (tmp_path / "contacts.dump").write_text(head + columns + "\n2 -1 0 1 0 -1e-5 500 3 0 0 0.1 0 0\n")
    (found,) = read_touches(tmp_path / "contacts.dump")
    assert (found.step, found.ids.tolist(), found.forces.tolist(), found.friction.tolist()) == (7, [[2, -1]], [500.0], [[3.0, 0.0, 0.0]])
    (tmp_path / "contacts.dump").write_text(head + "a b c\n1 2 3\n")
    with pytest.raises(DumpError, match="3 columns instead of 13"):
        read_touches(tmp_path / "contacts.dump")
