"""Richardson extrapolation and the grid convergence index on series with a known answer."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.postproc.convergence import SAFETY, SAFETY_UNSEEN_ORDER, convergence, observed_order, refinement


@given(st.floats(0.3, 4.0), st.floats(-3.0, 3.0).filter(lambda a: abs(a) > 1e-2), st.floats(1.2, 3.0), st.floats(1.2, 3.0),
       st.floats(-5.0, 5.0))
def test_an_error_of_one_power_is_found_exactly(order: float, factor: float, one: float, two: float, limit: float) -> None:
    h = [0.1, 0.1 * one, 0.1 * one * two]
    values = [limit + factor * size**order for size in h]
    found = convergence(h, values, formal_order=order)
    assert found.kind == "monotone"
    assert found.order == pytest.approx(order, rel=1e-6)
    scale = abs(values[2] - values[0])
    assert found.extrapolated == pytest.approx(limit, abs=1e-6 * scale)
    assert found.uncertainty == pytest.approx(SAFETY * abs(values[0] - limit), rel=1e-5, abs=1e-9)


def test_order_of_three_equal_refinements_is_the_textbook_one() -> None:
    assert observed_order([1.0, 2.0, 4.0], [1.0, 2.0, 6.0]) == pytest.approx(math.log(4.0) / math.log(2.0))


def test_only_the_finest_three_count_in_any_order() -> None:
    h = [4.0, 1.0, 8.0, 2.0]
    values = [1.0 + 0.1 * size**2 for size in h]
    values[2] = 99.0
    assert convergence(h, values).order == pytest.approx(2.0)


def test_a_change_within_its_interval_gives_a_bound_and_no_order() -> None:
    found = convergence([1.0, 2.0, 4.0], [1.0, 1.01, 1.2], [0.05, 0.05, 0.05])
    assert (found.kind, found.order, found.extrapolated) == ("scatter", None, None)
    assert found.uncertainty == pytest.approx(SAFETY_UNSEEN_ORDER * (0.01 + math.hypot(0.05, 0.05)))


@given(coarse=st.floats(1.1, 3.0), fine=st.floats(-2.0, 2.0))
def test_equal_values_do_not_show_that_the_error_is_nothing(coarse: float, fine: float) -> None:
    """Of a parabola with two equal values at 1 and 2: f(h) = fine + c (h - 1)(h - 2), whose limit is fine + 2 c."""
    found = convergence([1.0, 2.0, 4.0], [fine, fine, fine + 6.0 * (coarse - 1.0)])
    assert found.kind == "scatter" and found.uncertainty is not None
    assert found.uncertainty == pytest.approx(SAFETY_UNSEEN_ORDER * 6.0 * (coarse - 1.0)) and found.uncertainty > 2.0 * (coarse - 1.0)
    assert convergence([1.0, 2.0, 4.0], [fine] * 3).uncertainty == 0.0


def test_oscillation_and_divergence_are_named() -> None:
    assert convergence([1.0, 2.0, 4.0], [1.0, 1.2, 0.9]).kind == "oscillating"
    away = convergence([1.0, 2.0, 4.0], [1.0, 2.0, 2.1])
    assert (away.kind, away.uncertainty) == ("diverging", None)


def test_two_refinements_take_the_formal_order() -> None:
    found = convergence([1.0, 2.0], [1.0, 1.3], formal_order=2.0)
    assert found.kind == "bound" and found.order is None and found.uncertainty == pytest.approx(SAFETY_UNSEEN_ORDER * 0.3 / 3.0) == 0.3


@pytest.mark.parametrize(("order", "counted", "safety"), [
    (9.0, 2.0, 3.0), (4.0, 2.0, 3.0), (2.5, 2.0, 3.0), (2.19, 2.0, 1.25), (1.81, 2.0, 1.25), (1.5, 1.5, 3.0), (0.3, 0.5, 3.0)])
def test_only_the_formal_order_is_trusted(order: float, counted: float, safety: float) -> None:
    values = [1.0 + 0.1 * size**order for size in (1.0, 2.0, 4.0)]
    found = convergence([1.0, 2.0, 4.0], values, formal_order=2.0)
    assert found.order == pytest.approx(min(order, 8.0)) and found.extrapolated == pytest.approx(1.0, rel=1e-6 if order < 8.0 else 0.3)
    assert found.uncertainty == pytest.approx(safety * (values[1] - values[0]) / (2.0**counted - 1.0))


def test_one_refinement_is_refused() -> None:
    with pytest.raises(ValueError, match="two refinements or more"):
        convergence([1.0], [1.0])
    with pytest.raises(ValueError, match="all positive and different"):
        convergence([1.0, 1.0, 2.0], [1.0, 2.0, 3.0])


def test_stiffness_refines_as_the_overlap_of_hertz() -> None:
    assert refinement("youngs_modulus", 8.0) == pytest.approx(0.25)
    assert refinement("time_step_fraction", 0.2) == 0.2
