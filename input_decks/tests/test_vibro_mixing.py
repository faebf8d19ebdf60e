"""vibro_mixing: mixtures that are known are measured as they are, wrong ones fail; the set-up makes the large grains it is asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.momentum import unexplained_energy
from dembark.input_decks.common.setup import friction
from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

mixing = module("vibro_mixing")
D, STRIDE = 0.005, 10
SITES = np.array([((i + 0.5) * D, 0.0, (k + 0.5) * D) for i in range(20) for k in range(12)])


def shaken(*, swaps: int = 10, rising: float = 0.0, drift: float = 0.0, lost: float = 0.0, single: int = 9 * 12, seed: int = 3,
           **changes: Any) -> Any:
    """A run in which `swaps` pairs of grains change places in each period. `rising`: way (d) of the grains of the second sort in a period;
    `drift`: vertical way of the grains at the walls in a period; `single`: site of a single large grain."""
    given = defaults("vibro_mixing", **{"periods": 20, "grain_count": len(SITES)} | changes)
    random, count = np.random.default_rng(seed), len(SITES)
    large = np.zeros(count, bool)
    if given["mixture"] == "two_sorts":
        large[random.permutation(count)[:40]] = True
    elif given["mixture"] == "intruder":
        large[single] = True
    radii = 0.5 * D * np.where(large, given["size_ratio"], 1.0)
    masses = given["grain_density"] * np.where(large, given["density_ratio"], 1.0) * 4.0 / 3.0 * np.pi * radii**3
    place, near = np.arange(count), np.minimum(SITES[:, 0], 0.1 - SITES[:, 0]) < 2.0 * D
    frames = []
    for number in range(given["periods"] * PHASES + 1):
        if number % PHASES == 1:
            pairs = random.permutation(count)[: 2 * swaps].reshape(2, -1)
            place[pairs] = place[pairs[::-1]]
        at = SITES[place] + [0.0, 0.0, 0.5 * D * math.sin(2.0 * math.pi * number / PHASES)]
        at[:, 2] += D * (number / PHASES) * (rising * large + drift * near)
        one = SimpleNamespace(step=STRIDE * number, positions=at, radii=radii, masses=masses, types=np.ones(count), ids=np.arange(count),
                              where="")
        one.select = lambda _, same=one: same
        frames.append(one)
    rows = {name: np.zeros(300) for name in ("other", "imposed")} | {"balance": np.full(300, lost), "scale": np.ones(300)}
    derived = {"period_steps": STRIDE * PHASES, **friction(SimpleNamespace(**given))}
    return SimpleNamespace(folder="run", parameters=given, derived=derived, time_step=1e-4, grains=lambda: frames, times=lambda: rows)


def verdicts(packings: int = 1, **changes: Any) -> dict[str, Any]:
    return judged("vibro_mixing", mixing.measure([shaken(seed=3 + k, **changes) for k in range(packings)]))


DENSE = {"mixture": "two_sorts", "size_ratio": 1.0, "density_ratio": 3.0}


def test_equal_grains_mix() -> None:
    found = verdicts()
    assert found["wall_drift"]["verdict"] == "info" and "holds 0" in found["wall_drift"]["reason"]
    assert {"energy_balance", "index_separated", "index_random", "segregation_labels"} == names(found, "pass")
    assert not names(found, "fail") and found["index_sides"]["value"] > 0.5
    # A grain changes its place in one of twelve periods; then it is anywhere.
    assert found["mixing_rate_sides"]["value"] == pytest.approx(2.0 * -math.log1p(-1.0 / 12.0), rel=0.5)


def test_grains_that_stay_do_not_mix() -> None:
    found = verdicts(swaps=0)
    assert found["index_sides"]["value"] < 0.1 and found["index_layers"]["value"] < 0.1
    assert "wall_drift_smooth" not in found


def test_walls_are_smooth_by_the_friction_that_acts() -> None:
    """A static_friction replaces that of the walls."""
    assert "wall_drift_smooth" in verdicts(static_friction=0.0)
    assert "wall_drift_smooth" not in verdicts(wall_friction=0.0, static_friction=0.5)


def test_a_large_grain_rises_at_its_speed() -> None:
    found = verdicts(swaps=0, mixture="intruder", rising=0.2)
    assert found["rise_rate"]["value"] == pytest.approx(0.2, rel=0.05) and found["rise"]["value"] == pytest.approx(4.0, rel=0.05)


def test_large_grains_that_rise_segregate() -> None:
    found = verdicts(swaps=0, mixture="two_sorts", rising=0.1)
    assert found["segregation_rate"]["value"] > 0.003 and found["segregation_end"]["value"] > found["segregation_start"]["value"] + 0.05
    assert "segregation_change" not in found


def test_dense_grains_are_told_from_light_ones_of_their_size() -> None:
    found = verdicts(3, swaps=0, rising=-0.1, **DENSE)
    assert found["segregation_end"]["verdict"] == "pass" and found["segregation_end"]["value"] < -0.05


def test_one_packing_says_nothing_of_the_sign() -> None:
    assert verdicts(swaps=0, rising=-0.1, **DENSE)["segregation_end"]["verdict"] == "info"
    assert verdicts(3, swaps=0, rising=-0.1, **DENSE, motion_gamma=0.8)["segregation_end"]["verdict"] == "info"


def test_large_and_dense_grains_have_no_source() -> None:
    assert verdicts(3, swaps=0, rising=-0.1, **DENSE | {"size_ratio": 2.0})["segregation_end"]["verdict"] == "info"


def trend(along: str, quantity: str, values: tuple[float, ...], half: float = 0.02) -> dict[str, Any]:
    """The study along `along` of runs with these `values` of a quantity, at ratios of 1.5, 2, 3 ... ."""
    points = [point({along: ratio}, {quantity: value}, half) for ratio, value in zip((1.5, 2.0, 3.0), values, strict=True)]
    name = {"size_ratio": "size", "density_ratio": "density"}[along]
    return judged("vibro_mixing", mixing.study(name, points[::-1], along))


def test_large_grains_that_rise_faster_have_a_trend() -> None:
    found = trend("size_ratio", "rise_rate", (0.05, 0.10, 0.20))["size_trend"]
    assert found["verdict"] == "pass" and found["value"] == pytest.approx(0.1) and "0.050 ± 0.020 at 1.5" in found["detail"]
    # Within the intervals; and with means that are not in order.
    assert trend("size_ratio", "rise_rate", (0.10, 0.10, 0.11))["size_trend"]["verdict"] == "info"
    disordered = trend("size_ratio", "rise_rate", (0.10, 0.09, 0.30))["size_trend"]
    assert disordered["verdict"] == "info" and "order" in disordered["reason"]


def test_dense_grains_that_sink_deeper_have_a_trend() -> None:
    found = trend("density_ratio", "segregation_end", (-0.05, -0.15, -0.2))["density_trend"]
    assert found["verdict"] == "pass" and found["value"] < 0.0


def test_the_dense_grains_of_a_set_up() -> None:
    case = find("vibro_mixing")
    packed = deck.prepare(case, resolve(case, "quick", "densities")).packing
    assert packed is not None
    dense = packed.densities > 5000.0
    assert dense.sum() == 100 and set(packed.densities) == {2500.0, 7500.0} and np.ptp(packed.diameters) < 0.3 * D
    # At any place.
    assert abs(np.corrcoef(dense, packed.positions[:, 2])[0, 1]) < 0.3


@pytest.mark.parametrize(("variant", "large"), [("halves", 0), ("sizes", 40), ("intruder", 1)])
def test_the_large_grains_of_a_set_up(variant: str, large: int) -> None:
    case = find("vibro_mixing")
    packed = deck.prepare(case, resolve(case, "quick", variant)).packing
    assert packed is not None
    assert (packed.diameters > 1.5 * D).sum() == large
    assert np.ptp(packed.positions[:, 1]) == 0.0
    apart = np.linalg.norm(packed.positions[:, None] - packed.positions, axis=2) - 0.5 * (packed.diameters[:, None] + packed.diameters)
    assert (apart[~np.eye(len(apart), dtype=bool)] > 0.0).all()
    if variant == "intruder":
        assert packed.positions[np.argmax(packed.diameters), 2] < 3.0 * D


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_vessel_moves_as_a_whole_and_keeps_its_grains(engine: str, simulate: Any) -> None:
    """Monolayers stay in their plane, and all work is accounted for."""
    run = simulate("vibro_mixing", engine, {"grain_count": 60, "vessel_width": 0.05, "settle_time": 0.1, "motion_ramp": 2, "periods": 10,
                                            "mixture": "intruder", "motion_frequency": 20.0})
    assert unexplained_energy(run.times()) < 1e-10
    for frame in run.grains():
        # To the bit: round-off grows, and in a minute's run grains leave their plane.
        assert len(frame.ids) == 60 and np.ptp(frame.positions[:, 1]) == 0.0 and (frame.velocities[:, 1] == 0.0).all()
        assert (frame.positions[:, 0] > 0.9 * frame.radii).all() and (frame.positions[:, 0] < 0.05 - 0.9 * frame.radii).all()
    assert judged("vibro_mixing", mixing.measure([run]))["energy_balance"]["verdict"] == "pass"


def controls_vibro_mixing(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a billionth of the works that nothing explains", right, verdicts(lost=1e-9))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mixing, "sample_numbers", lambda frame, _: np.arange(len(frame)) % 7)
        yield Control("samples of grains from everywhere", right, verdicts())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mixing, "random_labels", lambda _, kinds: kinds)
        yield Control("labels that follow the place", right, verdicts(swaps=0))
    weak = {"swaps": 0, "mixture": "two_sorts", "motion_gamma": 0.8}
    yield Control("large grains that rise in a vessel that never throws them", verdicts(**weak), verdicts(**weak, rising=0.02))
    yield Control("sorts that change places", verdicts(3, swaps=0, mixture="two_sorts", rising=0.1),
                  verdicts(3, swaps=0, mixture="two_sorts", rising=-0.1))
    yield Control("sorts that change places", verdicts(3, swaps=0, **DENSE, rising=-0.1), verdicts(3, swaps=0, **DENSE, rising=0.1))
    middle = {"swaps": 0, "mixture": "intruder", "single": 9 * 12 + 6}
    yield Control("a large grain that sinks", verdicts(**middle, rising=0.05), verdicts(**middle, rising=-0.05))
    yield Control("walls that drag upwards", verdicts(swaps=0, drift=-0.1), verdicts(swaps=0, drift=0.1))
    smooth = {"swaps": 0, "wall_friction": 0.0}
    yield Control("smooth walls that drag", verdicts(**smooth), verdicts(**smooth, drift=-0.1))
    yield Control("large grains that rise the slower the larger they are", trend("size_ratio", "rise_rate", (0.05, 0.10, 0.20)),
                  trend("size_ratio", "rise_rate", (0.20, 0.10, 0.05)))
    yield Control("dense grains that end the higher the denser they are", trend("density_ratio", "segregation_end", (-0.05, -0.1, -0.2)),
                  trend("density_ratio", "segregation_end", (-0.2, -0.1, -0.05)))
