"""The measurements of the cases of logs pass for runs that are right and fail for runs that are not."""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dembark.input_decks.common.log_run import LogRun, TouchFrame, read_touches
from dembark.input_decks.log_pile.measure import before_impact, impact_values, loads, together
from dembark.input_decks.tests.measuring import Control, defaults, judged, logs, module, names
from dembark.postproc import DumpError
from dembark.postproc.measurement import Estimate, Value, number

log_pair, log_cradle = (module(name) for name in ("log_pair", "log_cradle"))


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
    history = {"step": np.array([frame[0] for frame in frames])[1:], "highest_force": np.array([frame[5] for frame in frames])[1:],
               "elastic_energy": elastic[1:], "dissipated_energy": (kinetic[0] - kinetic - elastic)[1:], "kinetic_energy": kinetic[1:],
               **{name: np.zeros(count - 1) for name in ("worst_certificate", "pivots_total", "pivots", "contacts")}}
    record = np.array([[1, 2, p.get("lead_time", 0.0), longest * tau, highest, impulse, 1.0, 0.0, 0, 0, 0]])
    pairs, zero = np.array([[i + 1, i + 2] for i in range(n - 1)]), np.zeros((n - 1, 3))
    touches = [TouchFrame(frame[0], pairs, zero - [1.0, 0.0, 0.0], np.zeros(n - 1), frame[4], zero, zero) for frame in frames]
    times = np.array([frame[0] for frame in frames]) * tau
    return LogRun(p, tau, times, vectors(1), velocities, np.zeros((count, n, 3)), vectors(3), mass, np.full(n, 0.1), history, record,
                  touches)


def unsolved(run):
    """The run, one of whose steps was left with an error of a millionth."""
    return replace(run, history=dict(run.history) | {"worst_certificate": 0.0 * run.history["worst_certificate"] + 1e-6})


def pair_run(**changes):
    p = defaults("log_pair", **changes)
    p["touch"] = p["radius_1"] + p["radius_2"]
    stiffness = np.array([p["stiffness_1"] * p["stiffness_2"] / (p["stiffness_1"] + p["stiffness_2"])])
    steps = math.ceil(p["duration"] / p["time_step"] / 200)
    place = [-p["touch"] - (p["velocity_1"] - p["velocity_2"]) * p["lead_time"], 0.0]
    return row_of_springs(p, np.array([p["mass_1"], p["mass_2"]]), stiffness, place, [p["velocity_1"], p["velocity_2"]], 200 * steps, steps)


def of_pair(run):
    return judged("log_pair", logs("log_pair", run))


@pytest.mark.parametrize("changes", [
    {}, {"theta": 0.5, "time_step": 1.58e-5}, {"mass_1": 20.0, "stiffness_2": 3e7, "velocity_1": 1.5, "velocity_2": -0.2},
    {"time_step": 3.1e-5}])
def test_a_pair_by_the_scheme_passes(changes):
    found = of_pair(pair_run(**changes))
    assert not names(found, "fail"), found
    assert {"peak_force", "contact_time", "velocity_1_after", "restitution", "momentum_error", "impulse"} <= names(found, "pass")


def test_a_damped_pair_has_the_exact_motion_as_reference_and_no_verdict():
    run = pair_run()
    found = of_pair(replace(run, parameters=run.parameters | {"contact_damping": 100.0}))
    for name in ("peak_force", "contact_time", "velocity_1_after", "restitution"):
        assert (found[name]["verdict"], found[name]["tolerance"]) == ("info", None)
        assert found[name]["reference"] is not None and "no formula" in found[name]["reason"]
    assert found["energy_change"]["reference"] is None and "impulse" not in found
    assert found["momentum_error"]["verdict"] == "pass"


@pytest.mark.parametrize("changes", [
    {"mass_1": 500.0, "mass_2": 500.0}, {"duration": 0.003}, {"duration": 0.003, "contact_damping": 100.0}])
def test_a_pair_that_still_touches_at_the_end_has_no_verdict_on_what_comes_after(changes):
    run = pair_run(**{name: one for name, one in changes.items() if name != "contact_damping"})
    found = of_pair(replace(run, parameters=run.parameters | changes))
    for name in ("peak_force", "contact_time", "velocity_1_after", "velocity_2_after", "restitution", "energy_change"):
        assert found[name]["verdict"] == "info" and "take a longer duration" in found[name]["reason"], name
    assert found["velocity_1_after"]["value"] is None and found["peak_force"]["value"] > 0.0 and "impulse" not in found
    assert found["momentum_error"]["verdict"] == "pass"


def orders(theta: float) -> list[dict]:
    """Points of the study by the scheme with `theta`."""
    runs = [pair_run(theta=theta, time_step=step) for step in (3.104558833061282e-5, 6.209117666122564e-5, 1.2418235332245128e-4)]
    return [{"parameters": run.parameters, "quantities": list(of_pair(run).values())} for run in runs]


@pytest.mark.parametrize(("theta", "order"), [(1.0, 1.0), (0.5, 2.0)])
def test_the_study_finds_the_order(theta, order):
    found = judged("log_pair", log_pair.study("any", orders(theta), "time_step"))
    assert found["order_peak_force"]["value"] == pytest.approx(order, abs=0.05)
    assert names(found, "pass") == {"order_peak_force", "order_velocity_curve_error"}


def cradle_run(**changes):
    p = defaults("log_cradle", **changes)
    chain = log_cradle.row(p)
    p["touch"] = 2.0 * p["radius"]
    place = np.arange(len(chain.masses)) * (p["touch"] + p["gap"])
    steps = math.ceil(p["duration"] / p["time_step"] / 200)
    return row_of_springs(p, chain.masses, chain.stiffness, place, chain.velocities, 200 * steps, steps)


def of_cradle(run):
    return judged("log_cradle", logs("log_cradle", run))


def test_a_cradle_by_the_scheme_passes():
    found = of_cradle(cradle_run(time_step=1e-5))
    assert not names(found, "fail"), found


@pytest.mark.parametrize("changes", [{"gap": 0.01}, {"log_count": 60}, {"duration": 0.004}])
def test_a_cradle_whose_impacts_outlast_the_run_has_no_verdict_on_what_comes_after(changes):
    found = of_cradle(cradle_run(**{"time_step": 1e-5} | changes))
    for name in ("velocity_1_after", "velocity_2_after", "scheme_deviation", "peak_force", "energy_kept"):
        assert found[name]["verdict"] == "info" and "take a longer duration" in found[name]["reason"], name
    assert found["velocity_2_after"]["value"] is None and found["momentum_error"]["verdict"] == "pass"
    assert not names(of_cradle(cradle_run(gap=0.01, duration=0.07, time_step=1e-5)), "fail")


def stack(*, lift=1.0, count=201, logs=4):
    """Logs of 50 kg that rest side by side on the ground, smooth and without friction; the ground carries `lift` of the weight."""
    p = defaults("log_pile", log_count=logs, friction=0.0)
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
    every = np.ones(count - 1)
    history = {"step": steps[1:], "kinetic_energy": 0.0 * every, "elastic_energy": 0.0 * every, "dissipated_energy": lost,
               "worst_certificate": 1e-16 * every, "pivots_total": steps[1:] * 1.0, "pivots": every, "contacts": 9.0 * every,
               "impacts": np.arange(count - 1), "highest_force": 1e4 * every}
    impacts = np.column_stack([np.full(30, 1), np.full(30, 2), np.linspace(0.1, 0.4, 30),
                               *np.random.default_rng(1).uniform(1.0, 2.0, (5, 30)), np.zeros((30, 3))])
    touches = [TouchFrame(int(step), ids, normals, np.zeros(len(ids)), forces, zero, zero) for step in steps]
    return LogRun(p, 5e-5, steps * 5e-5, positions, still, still, still, mass, np.full(logs, 0.1), history, impacts, touches)


def of_pile(run):
    return judged("log_pile", logs("log_pile", run))


def test_a_stack_at_rest_passes():
    found = of_pile(stack())
    assert not names(found, "fail"), found
    assert {"lift_over_weight", "ground_share", "log_balance", "contacts_per_log", "energy_balance"} <= names(found, "pass")


def test_logs_that_lie_alone_on_the_ground_rest_on_one_contact_each():
    run = stack()
    ground = run.touches[0].ids[:, 1] == -1
    names_of = ("ids", "normals", "gaps", "forces", "friction", "places")
    spread = [replace(one, **{name: getattr(one, name)[ground] for name in names_of}) for one in run.touches]
    found = of_pile(replace(run, touches=spread))["contacts_per_log"]
    assert (found["verdict"], found["value"], found["reference"]) == ("pass", 1.0, 1.0) and "4 that lie alone" in found["detail"]
    assert of_pile(run)["contacts_per_log"]["reference"] == 2.0


def test_impacts_until_the_stack_is_at_rest_are_counted():
    """The energy is dissipated evenly over 200 rows: 99 % after 198, and an impact begins in each row but the first."""
    found = of_pile(stack())
    assert found["impacts_to_rest"]["value"] == pytest.approx(197 / 4)
    assert found["time_to_rest"]["value"] == pytest.approx(198 * 100 * 5e-5)


def test_rough_stakes_may_carry_a_part_of_the_weight():
    run = stack()
    found = of_pile(replace(run, parameters=run.parameters | {"stake_friction": 0.4}))["ground_share"]
    assert (found["verdict"], found["reference"], found["tolerance"]) == ("info", None, None)


def test_the_beginning_is_the_state_before_the_eleventh_impact():
    run = stack()
    frame, logs, first = before_impact(run, 10)
    assert logs.tolist() == [0, 1] and len(first) == 10
    assert run.times[frame] < run.impacts[10, 2] <= run.times[frame + 1]
    shuffled = replace(run, impacts=run.impacts[::-1])
    assert before_impact(shuffled, 10)[0] == frame


def test_loads_are_the_sums_of_the_contacts():
    run = stack(lift=0.98)
    found, weight = loads(run, (-1, -2, -3)), 50.0 * run.parameters["gravity"]
    np.testing.assert_allclose(found.walls[0], [[0.0, 4 * 0.98 * weight], [100.0, 0.0], [-100.0, 0.0]])
    np.testing.assert_allclose(found.net[0], np.tile([0.0, 0.98 * weight], (4, 1)), atol=1e-12)
    assert found.contacts[0] == 9 and found.mobilised[0] == 0.0
    sliding = [replace(one, friction=0.3 * one.forces[:, None] * [0.0, 1.0, 0.0]) for one in run.touches]
    assert loads(replace(run, touches=sliding), (-1,)).mobilised == pytest.approx(0.3)


def cascades(rng, mean=20):
    """Impacts of a pile: cascades of 30 that are all about as hard as the first one."""
    peaks = np.repeat(rng.normal(2.0, 0.5, rng.poisson(mean)), 30)
    peaks += rng.normal(0.0, 0.1, len(peaks))
    return np.column_stack([np.ones((len(peaks), 4)), np.exp(peaks), np.exp(peaks), np.zeros((len(peaks), 5))])


def test_intervals_of_impacts_are_those_over_piles_and_hold_what_they_say():
    run, rng = stack(), np.random.default_rng(3)
    hits, naive = [], []
    for _ in range(800):
        piles = [cascades(rng) for _ in range(5)]
        found = {name: one.estimate for name, one in impact_values([replace(run, impacts=impacts) for impacts in piles]).items()}
        count, peak = found["impact_count"], found["impact_peak"]
        assert count.basis == peak.basis == "5 replicas"
        hits.append((abs(count.value - 600.0) <= count.half, abs(np.log(peak.value) - 2.0) <= peak.half / peak.value))
        # The negative control: impacts as so many independent ones.
        total = sum(map(len, piles))
        naive.append((abs(count.value - 600.0) <= 1.96 * np.sqrt(total) / 5,
                      abs(np.log(peak.value) - 2.0) <= 1.96 * 0.5 / np.sqrt(total)))
    assert (np.abs(np.mean(hits, axis=0) - 0.95) <= 0.02).all() and (np.mean(naive, axis=0) < 0.6).all()


def test_one_pile_does_not_tell_how_far_its_impacts_vary():
    run, rng = stack(), np.random.default_rng(4)
    alone = impact_values([replace(run, impacts=cascades(rng))])
    assert {one.estimate.half for one in alone.values()} == {np.inf}
    assert impact_values([run, replace(run, impacts=cascades(rng)[:1])]) == {}


def test_of_checks_without_an_interval_the_worst_pile_counts():
    sound, lossy = ({"energy_balance": number(error, 0.0), "push": Value(Estimate(0.2 + error, 0.01)),
                     "contacts": Value(Estimate(2.0, 0.1), number(1.5).estimate, verdict=verdict)}
                    for error, verdict in ((1e-9, "pass"), (-1e-3, "fail")))
    found = together([sound, lossy, sound])
    assert found["energy_balance"].estimate.value == -1e-3 and found["contacts"].verdict == "fail"
    assert found["push"].estimate.basis == "3 replicas" and found["push"].estimate.value == pytest.approx(0.2, abs=1e-3)
    assert together([sound]) == sound


def test_touches_are_read_and_other_files_refused(tmp_path):
    head = "ITEM: TIMESTEP\n7\nITEM: NUMBER OF ENTRIES\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ENTRIES "
    columns = " ".join(f"f_impacts[{i}]" for i in range(1, 14))
    (tmp_path / "contacts.dump").write_text(head + columns + "\n2 -1 0 1 0 -1e-5 500 3 0 0 0.1 0 0\n")
    (found,) = read_touches(tmp_path / "contacts.dump")
    assert (found.step, found.ids.tolist(), found.forces.tolist(), found.friction.tolist()) == (7, [[2, -1]], [500.0], [[3.0, 0.0, 0.0]])
    (tmp_path / "contacts.dump").write_text(head + "a b c\n1 2 3\n")
    with pytest.raises(DumpError, match="3 columns instead of 13"):
        read_touches(tmp_path / "contacts.dump")


def controls_log_cradle(_folder: Path) -> Iterator[Control]:
    run = cradle_run(time_step=1e-5)
    right, p = of_cradle(run), run.parameters
    # Runs by the scheme whose deck had another number than it was asked for.
    for name, wrong in (("springs half as stiff", {"stiffness": 0.5 * p["stiffness"]}),
                        ("log 1 a tenth faster", {"velocity": 1.1 * p["velocity"]})):
        yield Control(name, right, of_cradle(replace(cradle_run(time_step=1e-5, **wrong), parameters=p)))
    lossless = replace(run, parameters=p | {"theta": 0.5})
    yield Control("the dissipation of θ = 1 where θ = ½ was set",
                  of_cradle(cradle_run(time_step=1e-5, theta=0.5)), of_cradle(lossless))
    pushed = run.velocities.copy()
    pushed[-1, :, 0] += 0.01
    yield Control("an external push", right, of_cradle(replace(run, velocities=pushed)))
    yield Control("a step that is not solved", right, of_cradle(unsolved(run)))


def off_centre() -> LogRun:
    """An impact with an offset, its velocities those of the exact motion."""
    run = pair_run()
    p = run.parameters | {"offset": 0.1}
    moved = run.velocities.copy()
    moved[:, :, :2] = log_pair.pair(p).motion(run.times, p["lead_time"]).velocities
    return replace(run, parameters=p, velocities=moved)


def controls_log_pair(_folder: Path) -> Iterator[Control]:
    run = pair_run()
    right, p, history = of_pair(run), run.parameters, dict(run.history)
    softer = pair_run(stiffness_1=0.5 * p["stiffness_1"], stiffness_2=0.5 * p["stiffness_2"])
    yield Control("springs half as stiff", right, of_pair(replace(softer, parameters=p)))
    yield Control("log 1 a tenth faster", right, of_pair(replace(pair_run(velocity_1=1.1 * p["velocity_1"]), parameters=p)))
    yield Control("the dissipation of θ = 1 where θ = ½ was set",
                  of_pair(pair_run(theta=0.5)), of_pair(replace(run, parameters=p | {"theta": 0.5})))
    oblique = off_centre()
    along, rubbed = np.array([1.0, -1.0])[:, None], oblique.velocities.copy()
    # The direction across the line of centres at touch: the logs' smooth skins hold each other back along it by a hundredth.
    motion = log_pair.pair(oblique.parameters).motion(run.times, p["lead_time"])
    rubbed[-1, :, :2] += 0.01 * along * np.array([-motion.normal[1], motion.normal[0]])
    yield Control("friction between smooth logs", of_pair(oblique), of_pair(replace(oblique, velocities=rubbed)))
    pushed = run.velocities.copy()
    pushed[-1, 1] += [0.0, 1e-9, 0.0]
    yield Control("an external push", right, of_pair(replace(run, velocities=pushed)))
    lossy = history | {"dissipated_energy": history["dissipated_energy"] * (1.0 - 1e-6)}
    yield Control("a millionth of the dissipation missing from the account", right, of_pair(replace(run, history=lossy)))
    short = run.impacts * np.where(np.arange(11) == 5, 0.99, 1.0)
    yield Control("an impulse recorded a hundredth too small", right, of_pair(replace(run, impacts=short)))
    yield Control("a step that is not solved", right, of_pair(unsolved(run)))
    first, second = orders(1.0), [point | {"parameters": point["parameters"] | {"theta": 1.0}} for point in orders(0.5)]
    yield Control("a scheme of the other order",
                  *(judged("log_pair", log_pair.study("any", points, "time_step")) for points in (first, second)))


def controls_log_pile(_folder: Path) -> Iterator[Control]:
    run = stack()
    right, walls = of_pile(run), run.touches[0].ids[:, 1]

    def kept(contacts: NDArray[np.bool_]) -> LogRun:
        """The run without some of its contacts."""
        return replace(run, touches=[replace(one, **{name: getattr(one, name)[contacts] for name in ("ids", "normals", "gaps", "forces",
                                                                                                     "friction", "places")})
                                     for one in run.touches])

    yield Control("a ground that carries a fiftieth too little", right, of_pile(stack(lift=0.98)))
    yield Control("a lost contact with a stake", right, of_pile(kept(walls != -3)))
    yield Control("half of the contacts lost", right, of_pile(kept(walls != -1)))
    yield Control("logs that creep", right, of_pile(replace(run, velocities=run.velocities + np.array([0.1, 0.0, 0.0]))))
    lossy = dict(run.history) | {"dissipated_energy": 0.9 * run.history["dissipated_energy"]}
    yield Control("a tenth of the dissipation missing from the account", right, of_pile(replace(run, history=lossy)))
    yield Control("a step that is not solved", right, of_pile(unsolved(run)))
