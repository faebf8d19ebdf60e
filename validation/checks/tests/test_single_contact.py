"""The solutions that single contacts are held against obey closed formulas and limits; the checks fail for runs that are not right."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dembark.validation.checks import impact_exact, single_contact
from dembark.validation.checks.impact_exact import exact, hertz_force, impacts, partial_slip, sliding_throughout, stepped
from dembark.validation.checks.single_contact import Flight
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

CASE = tomllib.loads((Path(__file__).resolve().parents[3] / "input_decks/single_contact/case.toml").read_text(encoding="utf-8"))


def parameters(variant, **changes):
    return {name: table.get("value") for name, table in CASE["parameters"].items()} | CASE["variants"][variant] | changes


def patch(one, after):
    return (after.slide + one.radius * after.spin) / one.closing


@settings(max_examples=5, deadline=None)
@given(e=st.floats(0.1, 1.0), poisson=st.floats(0.0, 0.5), youngs=st.floats(6.0, 12.0), speed=st.floats(-2.0, 2.0))
@example(e=1.0, poisson=0.0, youngs=7.0, speed=1.0)
def test_head_on_the_restitution_coefficient_comes_out(e, poisson, youngs, speed):
    """Whatever the material: the damping is made for it."""
    p = parameters("test_2", restitution=e, poisson_ratio_a=poisson, youngs_modulus_a=10.0**youngs, speed=10.0**speed)
    one = impacts(p)
    assume((one.peak_overlap < 0.5 * one.radius).all())  # a grain whose centre goes through the plate does not come back
    after = exact(one, 200)
    np.testing.assert_allclose(after.normal / one.closing, e, atol=2e-7)
    assert after.slide.tolist() == after.spin.tolist() == [0.0, 0.0]


def test_an_elastic_impact_is_that_of_hertz():
    one = impacts(parameters("test_1"))
    after = exact(one, 300)
    np.testing.assert_allclose(after.duration, one.duration, rtol=1e-6)
    np.testing.assert_allclose(after.overlap, one.peak_overlap, rtol=1e-5)
    np.testing.assert_allclose(after.force, one.peak_force, rtol=2e-5)
    # Work of the force up to the largest overlap, 2/5 F d, is the energy of the approach.
    np.testing.assert_allclose(0.4 * one.peak_force * one.peak_overlap, 0.5 * one.reduced_mass * one.closing**2)


@pytest.mark.parametrize("variant", ["test_5", "test_6", "test_8_b"])
def test_the_scheme_converges_to_the_exact_solution(variant):
    p = parameters(variant, points=3)
    one = impacts(p)
    due = patch(one, exact(one, 300))
    length = 1.5 * one.duration.max()
    errors = [np.abs(patch(one, stepped(one, step * one.duration.min(), 0.37, length)) - due).max() for step in (2e-2, 4e-3)]
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.01 * np.abs(due).max()


def test_sliding_throughout_is_approached_at_a_grazing_angle_of_stiff_spheres():
    """Without damping, and with an overlap that vanishes beside the radius, the law slides like rigid bodies do."""
    one = impacts(parameters("test_5", sweep_from=80.0, sweep_to=85.0, points=2, speed=1e-3))
    np.testing.assert_allclose(patch(one, exact(one, 300)), patch(one, sliding_throughout(one)), atol=1e-4)
    np.testing.assert_allclose(patch(one, partial_slip(one)), patch(one, sliding_throughout(one)), atol=2e-4)


def test_partial_slip_is_linear_without_slip_and_gives_less_back_than_it_takes():
    one = impacts(parameters("test_5", friction=1e6, points=4, sweep_to=60.0))
    ratio = patch(one, partial_slip(one)) / (one.sliding / one.closing)
    np.testing.assert_allclose(ratio[:4], ratio[0], rtol=1e-3)
    one = impacts(parameters("test_5", points=9))
    after = partial_slip(one)
    before = 0.5 * one.mass * (one.slide**2 + 0.4 * (one.radius * one.spin) ** 2)
    assert (0.5 * one.mass * (after.slide**2 + 0.4 * (one.radius * after.spin) ** 2) < before).all()
    np.testing.assert_allclose(after.normal, one.closing, rtol=1e-3)


def test_partial_slip_does_not_depend_on_its_resolution():
    one = impacts(parameters("test_4", points=5))
    np.testing.assert_allclose(patch(one, partial_slip(one, 200, 1000)), patch(one, partial_slip(one, 400, 2000)), atol=3e-3)


def flown(p, phase=None):
    """A run by the scheme that was written down again."""
    one = impacts(p)
    after = stepped(one, p["time_step"], p["lead_steps"] % 1.0 if phase is None else phase, p["duration"])
    depth = np.concatenate([np.linspace(-0.2, 1.0, 201), np.linspace(1.0, -0.2, 200)])[:, None] * one.peak_overlap
    times = np.arange(len(depth)) * p["time_step"]
    after = replace(after, overlap=one.peak_overlap, force=one.peak_force)
    return Flight(times, depth, hertz_force(one, depth), after, None if p["partner"] == "plane" else 0.0)


def verdicts(p, flight):
    return {one.name: one.judged()[0] for one in single_contact.measured(p, flight)[0]}


@pytest.mark.parametrize("variant", ["test_1", "test_3", "test_4", "test_7", "test_8_b"])
def test_what_the_scheme_does_passes_and_what_is_wrong_is_seen(variant):
    p = parameters(variant)
    p |= {"points": min(p["points"], 5), "time_step": 8.0 * p["time_step"]}
    flight = flown(p)
    found = verdicts(p, flight)
    assert "fail" not in found.values(), found
    assert sum(one == "pass" for one in found.values()) >= 4
    slow = replace(flight, after=replace(flight.after, normal=0.99 * flight.after.normal))
    assert {"fail"} <= {verdict for name, verdict in verdicts(p, slow).items() if "restitution" in name}
    assert verdicts(p, slow)["scheme_deviation"] == "fail"
    if variant not in ("test_1", "test_3"):
        turned = replace(flight, after=replace(flight.after, spin=flight.after.spin + 0.1 * impacts(p).closing / impacts(p).radius))
        assert {"fail"} <= {verdict for name, verdict in verdicts(p, turned).items() if "spin" in name}


def test_a_wrong_force_at_its_overlap_is_seen():
    p = parameters("test_1")
    p |= {"time_step": 8.0 * p["time_step"]}
    flight = flown(p)
    wrong = verdicts(p, replace(flight, forces=1.001 * flight.forces))
    assert wrong["force_law_error_a"] == wrong["force_law_error_b"] == "fail"


def test_the_time_of_hertz_is_the_known_number():
    assert impact_exact.HERTZ_TIME == pytest.approx(2.94328, abs=1e-5)
