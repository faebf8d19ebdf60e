"""Numbers of a study from the results of its points."""

import math

import numpy as np
import pytest

from dembark.postproc.statistics import Estimate
from dembark.postproc.studies import compared, fitted_exponent, measured, numerical, propagated


def point(value, interval):
    return {"quantities": [{"name": "other", "value": 1.0, "interval": None}, {"name": "force", "value": value, "interval": interval}]}


def test_measured_scales_value_and_interval():
    one = measured(point(2000.0, [1900.0, 2100.0]), "force", 1e-3)
    assert (one.value, one.half) == (pytest.approx(2.0), pytest.approx(0.1))
    assert measured(point(2000.0, None), "force").half == math.inf


def test_propagated_is_exact_for_a_sum():
    one = propagated(lambda y: float(y.sum()), np.array([1.0, 2.0]), np.array([0.3, 0.4]), "two forces")
    assert (one.value, one.half, one.basis) == (3.0, pytest.approx(0.5), "propagated from two forces")
    assert propagated(lambda y: float(y.sum()), np.array([1.0, 2.0]), np.array([0.3, math.inf])).half == math.inf


def test_fitted_exponent():
    x = np.array([1.0, 2.0, 5.0])
    assert fitted_exponent(x, 3.0 * x**-1.5) == pytest.approx(-1.5)


def test_compared_tells_error_and_every_part():
    error = compared(3.0, Estimate(1.0, 0.3), num=0.4, input=1.2)
    assert (error.error, error.uncertainty) == (2.0, pytest.approx(1.3))
    assert error.text == "E = 2 exceeds U_val = 1.3; U_num = 0.4, U_input = 1.2, U_D = 0.3"
    near = compared(0.0, Estimate(1.0, 1.0), sim=math.inf)
    assert near.text.startswith("E = -1 is within U_val = inf")


def test_a_numerical_uncertainty_is_known_with_and_without_an_order() -> None:
    # 1 + h, whose order is the formal one, and values that run away from each other.
    assert numerical([0.1, 0.2, 0.4], [1.1, 1.2, 1.4]) == pytest.approx(1.25 * 0.1)
    assert numerical([0.1, 0.2, 0.4], [1.0, 2.0, 2.5]) == pytest.approx(3.0 * 1.5)
