"""Units that are known without the library are units of the library, too."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.common import units
from dembark.common.errors import DembarkError
from dembark.common.units import seconds, size_text

SYMBOLS = ("m", "s", "kg", "N", "Pa", "J", "W", "rad", "K")


def test_units_that_are_known_without_the_library_are_known_to_it() -> None:
    for one, other in itertools.product(SYMBOLS, SYMBOLS):
        for text in (one, f"{one}^2", f"{one}*{other}", f"{one}/{other}^2", f"{one} {other}"):
            assert units._PLAIN.fullmatch(text) and units._registry().Unit(text) is not None


def test_other_units_are_left_to_the_library() -> None:
    assert not any(map(units._PLAIN.fullmatch, ("", "m/", "mm", "m^", "deg", "m**2", "x*m")))
    assert units.known_unit("mm^2") and units.known_unit("deg") and not units.known_unit("nonsense") and not units.known_unit("m/")


def test_signs_that_the_library_may_overlook_are_no_units() -> None:
    """Up to Python 3.11 its tokeniser drops them: √(L/g) would be a litre over a gram."""
    assert not any(map(units.known_unit, ("√(L/g)", "√(g d)", "m, s", "$m", "m?")))
    assert all(map(units.known_unit, ("µm", "°C", "kg·m", "1/s", "m**2", "N*s/m", "m^0.5")))


def test_scales_of_quantities_are_no_units_of_parameters() -> None:
    assert units.known_unit("d") and units.known_unit("R") and not units.si_unit("d") and not units.si_unit("R")
    assert all(map(units.si_unit, ("1", "m", "N*s/m", "kg/m^3", "1/s", "Hz", "rad")))
    assert not any(map(units.si_unit, ("mm", "deg", "g", "rpm", "°C")))


@given(st.integers(0, 400), st.integers(0, 23), st.integers(0, 59), st.integers(0, 59))
def test_durations_add_up(days: int, hours: int, minutes: int, rest: int) -> None:
    wanted = 86400 * days + 3600 * hours + 60 * minutes + rest
    text = f"{days} d {hours}h {minutes} min {rest} s"
    if wanted:
        assert seconds(text) == wanted
    else:
        with pytest.raises(DembarkError):
            seconds(text)


@pytest.mark.parametrize("text", ["", " ", "s", "1", "1 m", "1 h 2", "1 h, 2 min", "nan s", "inf s", "1e3 s", "0 s"])
def test_texts_that_are_no_duration(text: str) -> None:
    with pytest.raises(DembarkError, match="not a duration"):
        seconds(text)


@given(st.floats(1.0, 1e15))
def test_sizes_are_written_as_they_are(count: float) -> None:
    number, unit = size_text(count).split()
    assert float(number) * {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9, "TB": 1e12}[unit] == pytest.approx(count, rel=0.006, abs=0.5)
