"""Units that are known without the library are units of the library, too."""

import itertools

from dembark.common import units

SYMBOLS = ("m", "s", "kg", "N", "Pa", "J", "W", "rad", "K")


def test_units_that_are_known_without_the_library_are_known_to_it() -> None:
    for one, other in itertools.product(SYMBOLS, SYMBOLS):
        for text in (one, f"{one}^2", f"{one}*{other}", f"{one}/{other}^2", f"{one} {other}"):
            assert units._PLAIN.fullmatch(text) and units._registry().Unit(text) is not None


def test_other_units_are_left_to_the_library() -> None:
    assert not any(map(units._PLAIN.fullmatch, ("", "m/", "mm", "m^", "deg", "m**2", "x*m")))
    assert units.known_unit("mm^2") and units.known_unit("deg") and not units.known_unit("nonsense") and not units.known_unit("m/")


def test_scales_of_quantities_are_no_units_of_parameters() -> None:
    assert units.known_unit("d") and units.known_unit("R") and not units.si_unit("d") and not units.si_unit("R")
    assert all(map(units.si_unit, ("1", "m", "N*s/m", "kg/m^3", "1/s", "Hz", "rad")))
    assert not any(map(units.si_unit, ("mm", "deg", "g", "rpm", "°C")))
