"""Numbers of a study from the results of its points."""

import math

import numpy as np
import pytest

from dembark.postproc.studies import fitted_exponent, measured, propagated


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
