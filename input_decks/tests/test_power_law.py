"""Exponents of what grows along a parameter, their intervals, and the curves with a power law."""

import numpy as np
import pytest

from dembark.input_decks.common.power_law import PowerLawFit, ordered


def points(widths, exponent, half):
    """Results of a study whose quantity is 3 x^exponent, known to `half` of it."""
    return [{"parameters": {"width": width}, "quantities": [{
        "name": "speed", "value": 3.0 * width**exponent, "interval": [(3.0 - half) * width**exponent, (3.0 + half) * width**exponent]}]}
        for width in widths]


def test_the_exponent_has_the_interval_that_those_of_the_values_give_it():
    rising, place = ordered(points([4.0, 1.0, 2.0], 0.7, 0.03), "width")
    assert place.tolist() == [1.0, 2.0, 4.0] and [one["parameters"]["width"] for one in rising] == place.tolist()
    found = PowerLawFit.of(rising, "speed", place).exponent
    assert found.value == pytest.approx(0.7)
    assert found.half == pytest.approx(0.01 * np.sqrt(2.0) / np.log(4.0))


def test_factors_scale_values_and_intervals():
    rising, place = ordered(points([1.0, 2.0, 4.0], 0.5, 0.3), "width")
    found = PowerLawFit.of(rising, "speed", place, np.sqrt(place))
    np.testing.assert_allclose(found.values, 3.0 * place)
    np.testing.assert_allclose(found.halves, 0.3 * place)
    assert found.exponent.value == pytest.approx(1.0)


def test_a_curve_lies_on_the_law_that_it_follows_and_not_on_another():
    rising, place = ordered(points([1.0, 2.0, 4.0], 2.0, 0.3), "width")
    one = PowerLawFit.of(rising, "speed", place)
    drawn = one.curve("speed", "Speed", "width", "u", 2.0, "proportional to W²")
    assert drawn["reference"] == pytest.approx(drawn["value"]) and drawn["low"] == pytest.approx(2.7 * place**2)
    assert one.curve("speed", "Speed", "width", "u", 1.0)["reference"] != pytest.approx(drawn["value"], rel=0.1)
    assert "reference" not in one.curve("speed", "Speed", "width", "u")
    errors = one.convergence("errors", "Error", "W", 2.0)
    assert errors["reference"] == pytest.approx(errors["value"]) and errors["place"] == pytest.approx(np.log10(place))


def test_without_an_interval_the_exponent_has_none():
    given = points([1.0, 2.0, 4.0], 0.5, 0.3)
    given[1]["quantities"][0]["interval"] = None
    rising, place = ordered(given, "width")
    assert PowerLawFit.of(rising, "speed", place).exponent.half == np.inf
