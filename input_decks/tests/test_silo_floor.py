"""Forces of single grains on the floor of a silo at rest: known distributions are found, and a real bed has a floor layer."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.input_decks.silo import floor
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

SILO = module("silo")
D = 0.005


def published(count: int, alpha: float = floor.ALPHA, beta: float = floor.BETA) -> np.ndarray:
    """Forces (count,) spread evenly over the law f^alpha, exp(-beta f) joined at f = 1, by the inverse of its integral."""
    share, below = (np.arange(count) + 0.5) / count, 1.0 / (1.0 + alpha)
    height = 1.0 / (below + 1.0 / beta)
    small = np.minimum(share / (height * below), 1.0) ** below
    return np.where(share < height * below, small, 1.0 - np.log(beta * (1.0 - share) / height) / beta)


def bed(forces: np.ndarray, seed: int = 1, own: float = 0.01, changed: float = 1.0, ordered: bool = False) -> Any:
    """A replica whose grains on the floor have these `forces` (N) at random, or rising from one side to the other; `own` is their weight
    (N), `changed` the forces of the first frame over those of the last."""
    side = np.arange(-60, 61) * 1.05 * D
    place = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    radius = 1.05 * D * (np.sqrt(len(forces) / np.pi) + floor.MARGIN + 2.0)
    inner = place[np.argsort(np.hypot(*place.T), kind="stable")[: len(forces)]]
    push = np.random.default_rng(seed).permutation(forces)
    if ordered:
        push = np.sort(forces)[np.argsort(np.argsort(inner[:, 0], kind="stable"))]
    # A second layer, which does not touch the floor, and grains next to the side wall, whose forces are not counted.
    turn = np.linspace(0.0, 6.0, 50)
    ring = 0.99 * radius * np.column_stack([np.cos(turn), np.sin(turn)])
    places = np.pad(np.vstack([inner, inner, ring]), ((0, 0), (0, 1)))
    places[len(inner) : 2 * len(inner), 2] = D
    base = np.zeros_like(places)
    base[: len(push), 2], base[-50:, 2] = push, 1e3

    def frame(factor: float) -> Any:
        return SimpleNamespace(positions=places, radii=np.full(len(places), 0.5 * D), masses=np.full(len(places), own / 9.81),
                               wall_forces={"base": factor * base})

    given_here = defaults("silo", wall_speed=0.0, cylinder_radius=radius, grain_diameter=D, gravity=9.81)
    return SimpleNamespace(parameters=given_here, grains=lambda: [frame(changed), frame(1.0)])


def verdicts(*forces: np.ndarray, **how: Any) -> dict[str, Any]:
    return judged("silo", SILO.measure([bed(one, seed, **how) for seed, one in enumerate(forces, 1)]))


def test_the_published_law_is_one_distribution_and_passes() -> None:
    forces = published(3000)
    assert forces.mean() == pytest.approx(0.98, abs=0.005)
    f = np.linspace(0.0, 12.0, 120001)
    assert np.trapezoid(floor.law(f), f) == pytest.approx(1.0, abs=1e-4)
    assert floor.exponential_slope(forces) == pytest.approx(1.8, rel=0.01)
    assert floor.power_exponent(forces) == pytest.approx(0.3, abs=0.01)
    # Three packings: the interval within one and what inputs change are together more than is allowed.
    found = verdicts(forces, published(2999), published(3001))
    assert {"floor_beta", "floor_beta_loaded", "floor_alpha"} <= names(found, "pass"), found
    assert found["floor_idle"]["value"] == pytest.approx(np.mean(forces < 0.0101)) and found["floor_cover"]["value"] > 0.5
    assert abs(found["floor_correlation"]["value"]) < 0.05


@given(beta=st.floats(0.5, 4.0), power=st.floats(-0.8, 3.0))
def test_the_exponents_of_any_law_are_found(beta: float, power: float) -> None:
    share = (np.arange(20000) + 0.5) / 20000
    tail = 1.0 - np.log(1.0 - share) / beta
    low = floor.LOW ** (power + 1.0)
    small = (low + share * (1.0 - low)) ** (1.0 / (power + 1.0))
    assert floor.exponential_slope(tail) == pytest.approx(beta, rel=2e-3)
    assert floor.power_exponent(small) == pytest.approx(power, abs=2e-3)


def test_a_uniform_distribution_has_the_exponent_zero() -> None:
    """There the formula for the mean of ln f is 0 over 0 when f^-1 is asked for."""
    assert floor.power_exponent(np.linspace(floor.LOW, 1.0, 100001)[1:-1]) == pytest.approx(0.0, abs=1e-3)
    assert floor.power_exponent(floor.LOW ** np.linspace(0.0, 1.0, 100001)[1:-1]) == pytest.approx(-1.0, abs=1e-3)
    assert all(np.isnan(floor.power_exponent(np.array(few))) for few in ([2.0, 3.0], [0.999, 0.9995], [0.2001]))
    assert np.isnan(floor.exponential_slope(np.array([0.5, 0.9])))


def test_grains_that_carry_no_other_are_counted_and_left_out() -> None:
    forces = np.concatenate([published(2400), np.full(600, 0.05)])
    found = verdicts(forces, own=0.05)
    assert found["floor_idle"]["value"] == pytest.approx(0.2, abs=0.01)
    # They lower the mean, and with it the exponent by as much.
    assert found["floor_beta_loaded"]["value"] == pytest.approx(1.8, rel=0.02) and found["floor_beta"]["value"] < 1.65


def test_forces_of_neighbours_that_are_alike_are_correlated() -> None:
    assert verdicts(published(3000), ordered=True)["floor_correlation"]["value"] > 0.8


def test_a_bed_that_is_not_at_rest_shows_it() -> None:
    assert verdicts(published(500), changed=1.1)["floor_change"]["value"] > 0.1
    assert verdicts(published(500))["floor_change"]["value"] == 0.0


def test_three_packings_give_an_interval_over_packings() -> None:
    found = verdicts(*(published(500) ** power for power in (0.9, 1.0, 1.1)))["floor_beta"]
    assert found["basis"] == "3 replicas" and found["interval"][0] < 1.8 < found["interval"][1]


def test_the_variant_is_of_equal_grains_between_walls_at_rest() -> None:
    values = resolve(find("silo"), "standard", "floor")
    assert values["wall_speed"] == 0.0 and values["grain_diameter_spread"] == 0.0


@pytest.mark.parametrize("engine", find("silo").engines)
def test_a_small_bed_lies_on_its_floor(engine: str, simulate: Any) -> None:
    """Between walls at rest. The forces on the floor and the friction of the side wall carry the weight."""
    one = simulate("silo", engine, {"grain_count": 400, "cylinder_radius": 0.04, "settle_time": 0.5, "measure_time": 0.02}, "floor")
    found, frame = floor.read(one), one.grains()[1]
    assert len(one.grains()) == 2 and 10 < len(found.forces) < 60 and found.change < 0.05
    assert 0.4 < found.cover < 0.95 and (found.forces > 0.9 * found.weights).mean() > 0.8
    carried = frame.wall_forces["base"][:, 2].sum() + frame.wall_forces["side"][:, 2].sum()
    assert carried == pytest.approx(frame.masses.sum() * 9.81, rel=0.01)


def floor_controls() -> Iterator[Control]:
    """Of `controls_silo`."""
    even, few = np.maximum(1.0 + 0.3 * np.random.default_rng(3).standard_normal(3000), 0.05), published(3000) ** 3
    right = verdicts(*(published(3000) ** power for power in (0.998, 1.0, 1.002)))
    yield Control("grains on the floor that carry almost alike", right, verdicts(even))
    for one in (right, verdicts(published(3000, alpha=0.0))):
        yield Control("few grains on the floor that carry almost all", one, verdicts(few))
