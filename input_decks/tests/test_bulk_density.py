"""bulk_density: beds of a known solid fraction are measured as they are, wrong ones fail; the real decks tap their grains."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.physics import WallMotion
from dembark.validation.case.deck import derived, prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

bulk_density = module("bulk_density")
D, SIDE, LAYERS = 0.005, 6, 14
FIRST, STRIDE = 1000, 500


def tapped(fractions: Sequence[float] = (0.59, 0.60, 0.605), heavier: float = 1.0, **changes: Any) -> Any:
    """A run whose bed, a cubic lattice, has one of these solid fractions after the other; `heavier`: gravity over what the run says."""
    p = defaults("bulk_density", **{"taps": len(fractions) - 1, "grain_friction": 0.3} | changes)
    lattice = np.array([(i, j, k) for k in range(LAYERS) for j in range(SIDE) for i in range(SIDE)], float) + 0.5
    # A cell of the first bed; later ones are lower.
    cell, frames = D * np.cbrt(np.pi / 6.0 / fractions[0]), []
    for number, fraction in enumerate(fractions):
        places = cell * lattice * [1.0, 1.0, fractions[0] / fraction]
        frames.append(SimpleNamespace(step=FIRST + number * STRIDE, positions=places, radii=np.full(len(places), 0.5 * D),
                                      velocities=np.zeros_like(places),
                                      masses=np.full(len(places), 2500.0 * np.pi / 6.0 * D**3)))
    steps = np.arange(10, FIRST + STRIDE * len(fractions), 10)
    weight = frames[0].masses.sum() * 9.81 * heavier
    return SimpleNamespace(parameters=p, time_step=1e-5, grains=lambda: frames,
                           times=lambda: {"step": steps, "plate_jz": weight * 1e-5 * steps},
                           derived={"first": FIRST, "stride": STRIDE, "area": (SIDE * cell) ** 2, "grain_static": p["grain_friction"]})


def verdicts(*fractions: Sequence[float], **changes: Any) -> dict[str, dict[str, Any]]:
    """Of three packings."""
    runs = fractions or ((0.590, 0.600), (0.592, 0.602), (0.594, 0.604))
    return judged("bulk_density", bulk_density.measure([tapped(each, **changes) for each in runs]))


def controls_bulk_density(_: Path) -> Iterator[Control]:
    yield Control("a packing that is a tenth looser", verdicts(), verdicts(*((0.9 * one, 0.6) for one in (0.590, 0.592, 0.594))))
    yield Control("gravity 5 % too weak", verdicts(), verdicts(heavier=0.95))


def test_known_densities_are_found() -> None:
    found = verdicts()
    assert found["poured_fraction"]["value"] == pytest.approx(0.592, rel=0.01)
    assert found["tapped_density"]["value"] == pytest.approx(2500.0 * 0.602, rel=0.01)
    assert found["hausner_ratio"]["value"] == pytest.approx(0.602 / 0.592, rel=0.01)
    assert names(found, "pass") == {"poured_fraction", "fraction_in_limits", "impulse_error"}


def test_only_what_was_published_is_compared() -> None:
    assert verdicts(grain_friction=0.5)["poured_fraction"]["reference"] is None
    assert verdicts(bridge_volume=8e-11)["fraction_in_limits"]["reason"] == "liquid bridges"


def test_the_plate_is_back_and_at_rest_before_each_tap() -> None:
    case = find("bulk_density")
    p = resolve(case, "quick", "dry")
    made = prepare(case, p)
    numbers, motion = derived(made), WallMotion(" ".join(made.tables["motion_words"]))
    rests = (numbers["first"] + numbers["stride"] * np.arange(p["taps"] + 1)) * made.time_step
    assert np.abs(motion.displacement(rests)).max() < 1e-12 and np.abs(motion.velocity(rests)).max() < 1e-9
    during = np.linspace(rests[0], rests[1], 2000)
    assert np.abs(motion.acceleration(during)[:, 2]).max() == pytest.approx(3.0 * 9.81, rel=1e-3)
    # Twice the way of a pulse that ends with 2/pi A T: A T²/pi up to that speed, as much to rest.
    assert motion.displacement(during)[:, 2].max() == pytest.approx(2.0 / np.pi * 3.0 * 9.81 * 0.008**2, rel=1e-3)


TINY = {"grain_count": 200, "cell_length": 0.025, "cell_width": 0.025, "settle_time": 0.4, "taps": 2}


@pytest.mark.parametrize("engine", ["liggghts", *(pytest.param(one, marks=pytest.mark.full) for one in ("lammps", "yade"))])
def test_a_bed_is_poured_and_tapped(engine: str, simulate: Any) -> None:
    found = judged("bulk_density", bulk_density.measure([simulate("bulk_density", engine, TINY)]))
    assert 0.5 < found["poured_fraction"]["value"] < 0.65 and 0.97 < found["hausner_ratio"]["value"] < 1.1
    assert found["impulse_error"]["value"] < 1e-3
