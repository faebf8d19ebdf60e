"""The rule of carried liquid as Python calls it: shares, grants, bridges; conservation over random sequences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.physics import LIQUID_RETURNS, LIQUID_SHARES, liquid_bridge, liquid_grant, liquid_share

radii = st.floats(1e-6, 1e-1)
volumes = st.floats(0.0, 1e-9)
tiny = 1e-300  # m^3: below, numbers have fewer digits


@given(radii, radii)
def test_share_of_the_facing_cap(radius, other):
    # 1 - cosine = 2 sine^2 of half the angle, which does not cancel.
    half = 0.5 * np.arcsin(min(other / (radius + other), 1.0))
    assert liquid_share(radius, other) == pytest.approx(np.sin(half) ** 2, rel=1e-7, abs=0.0)
    assert liquid_share(radius, other, factor=2.0) == 2.0 * liquid_share(radius, other)
    assert 0.0 < liquid_share(radius, other) < liquid_share(radius, np.inf) == 0.5
    assert liquid_share(radius, other, share="fraction", factor=0.05) == 0.05


@given(volumes, st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_no_more_is_given_than_there_is(liquid, shares):
    given_in_all = float(np.sum(np.array(shares) * liquid_grant(liquid, sum(shares))))
    assert given_in_all <= liquid * (1.0 + 1e-14) + tiny
    assert given_in_all == pytest.approx(liquid * min(1.0, sum(shares)), rel=1e-13, abs=tiny)


@given(volumes, volumes, radii, radii | st.just(np.inf), st.sampled_from(LIQUID_RETURNS), st.floats(0.0, 1.0), st.floats(1e-15, 1e-8))
def test_a_bridge_gives_back_what_it_holds(given_i, given_j, radius_i, radius_j, split, wall_part, largest):
    bridge = liquid_bridge(given_i, given_j, radius_i, radius_j, split=split, wall_part=wall_part, largest=largest)
    assert bridge.volume == pytest.approx(min(given_i + given_j, largest), rel=1e-14, abs=tiny)
    assert bridge.from_i + bridge.from_j == pytest.approx(bridge.volume, rel=1e-14, abs=tiny)
    assert bridge.back_i + bridge.back_j == pytest.approx(bridge.volume, rel=1e-14, abs=tiny)
    if split == "taken":
        assert bridge.back_i == pytest.approx(bridge.from_i, rel=1e-13, abs=1e-15 * bridge.volume + tiny)
    elif np.isinf(radius_j):
        assert bridge.back_j == pytest.approx(wall_part * bridge.volume, rel=1e-13, abs=1e-15 * bridge.volume + tiny)
    else:
        part = 0.5 if split == "equal" else radius_i / (radius_i + radius_j)
        assert bridge.back_i == pytest.approx(part * bridge.volume, rel=1e-12, abs=1e-15 * bridge.volume + tiny)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(LIQUID_SHARES), st.sampled_from(LIQUID_RETURNS))
def test_random_steps_conserve_in_any_order(seed, share, split):
    """Contacts of a step, asked in any order, leave the same liquid; the total stays to rounding."""
    random = np.random.default_rng(seed)
    n = 12
    radius, liquid = 10.0 ** random.uniform(-5, -2, n), random.uniform(0.0, 1e-10, n)
    total = liquid.sum()
    bridges: list[tuple[int, int, float, float]] = []
    for _ in range(20):
        pairs = np.array([pair for pair in random.integers(0, n, (10, 2)) if pair[0] != pair[1]])
        orders = [pairs, random.permutation(pairs)[:, ::-1]]
        after = []
        for order in orders:
            i, j = order.T
            share_i, share_j = (liquid_share(radius[a], radius[b], share=share) for a, b in ((i, j), (j, i)))
            demand = np.bincount(i, share_i, n) + np.bincount(j, share_j, n)
            grant = liquid_grant(liquid, demand)
            new = liquid_bridge(share_i * grant[i], share_j * grant[j], radius[i], radius[j], split=split)
            after.append((liquid - np.bincount(i, new.from_i, n) - np.bincount(j, new.from_j, n), new, i, j))
        np.testing.assert_allclose(after[1][0], after[0][0], atol=1e-14 * total)
        liquid, new, i, j = after[0]
        assert liquid.min() >= -1e-14 * total
        liquid = np.maximum(liquid, 0.0)
        bridges += zip(i.tolist(), j.tolist(), new.back_i.tolist(), new.back_j.tolist(), strict=True)
        while len(bridges) > 15:
            a, b, back_a, back_b = bridges.pop(int(random.integers(len(bridges))))
            liquid[a] += back_a
            liquid[b] += back_b
        assert liquid.sum() + sum(x[2] + x[3] for x in bridges) == pytest.approx(total, rel=1e-13, abs=0.0)


def test_broadcasting_and_scalars():
    assert liquid_share([[1e-3], [2e-3]], [1e-3, np.inf]).shape == (2, 2)
    assert isinstance(liquid_grant(1e-12, 2.0), float)
    assert liquid_bridge([0.0, 1e-12], 0.0, 1e-3, 1e-3).volume.tolist() == [0.0, 1e-12]


@pytest.mark.parametrize(("call", "told"), [
    (lambda: liquid_share(1e-3, 1e-3, share="film"), "cap, fraction"),
    (lambda: liquid_share(1e-3, 1e-3, factor=2.5), "must lie in"),
    (lambda: liquid_share(1e-3, 1e-3, share="fraction", factor=np.nan), "must lie in"),
    (lambda: liquid_share(0.0, 1e-3), "radius must be > 0"),
    (lambda: liquid_share(np.inf, 1e-3), "radius must be > 0 m and finite"),
    (lambda: liquid_grant(-1e-12, 1.0), "liquid must be >= 0"),
    (lambda: liquid_grant(np.nan, 1.0), "liquid must be >= 0"),
    (lambda: liquid_bridge(1e-12, 0.0, 1e-3, 1e-3, split="half"), "equal, radius, taken"),
    (lambda: liquid_bridge(1e-12, 0.0, 1e-3, np.inf, wall_part=1.5), "wall_part must be between 0 and 1"),
    (lambda: liquid_bridge(1e-12, 0.0, 1e-3, 1e-3, largest=0.0), "largest must be > 0"),
])
def test_mistakes(call, told):
    with pytest.raises(ValueError, match=r"\S") as caught:
        call()
    assert told in str(caught.value) and "\n" not in str(caught.value)
