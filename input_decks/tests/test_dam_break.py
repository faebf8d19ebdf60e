"""dam_break: a front that is known is measured as it is, wrong ones fail, and both engines let the same column run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case.folders import find

dam = module("dam_break")
A, G, DT, STRIDE, SPACING = 0.05715, 9.81, 5e-5, 50, 0.05715 / 20


def run(faster: float = 1.0, late: float = 0.0, leaked: int = 0, made: float = 0.0, source: str = "martin_moyce") -> Any:
    """A front that is that of an experiment, whose water is free at T = 0.2 + `late`, `faster` by a factor; `leaked` particles below the
    floor; the part `made` of the energy comes from nowhere."""
    times, fronts = dam.published(source)
    unit = math.sqrt(A / (2.0 * G))

    def frame(k: int) -> Any:
        now = 0.2 + late + k * STRIDE * DT / unit * faster
        place = np.interp(now, [0.0, *times, times[-1] + 1.0], [1.0, *fronts, fronts[-1] + 1.5])
        places = np.zeros((800, 3))
        places[:, :2] = 0.5 * SPACING
        places[0, 0] = place * A - 0.5 * SPACING
        places[:leaked, 1] = -2.0 * SPACING
        return frame_of(places, 0.5 * SPACING, {}, step=k * STRIDE)

    frames = [frame(k) for k in range(1, int(3.6 * unit / (STRIDE * DT)))]
    rest = np.ones(10)
    rows = {"kinetic_energy": np.linspace(0.0, 1.0, 10), "potential_energy": np.linspace(5.0, 4.0, 10), "compression_energy": 0.0 * rest}
    rows["kinetic_energy"][5:] += made * 1000.0 * G * 2.0 * A**3
    return SimpleNamespace(parameters=defaults("dam_break"), derived={"spacing": SPACING, "grain_count": 800}, time_step=DT,
                           grains=lambda: frames, times=lambda: rows)


def verdicts(**changes: Any) -> dict[str, dict[str, Any]]:
    return judged("dam_break", dam.measure([run(**changes)]))


def study(apart: float = 0.0, **changes: Any) -> dict[str, dict[str, Any]]:
    """The study of a front that has no error of spacing but that at T = 3 the two finest are `apart`."""
    found = verdicts(**changes)
    points = [{"parameters": {"resolution": number}, "quantities": [
        *(one for name, one in found.items() if name != "front_at_3"),
        {"name": "front_at_3", "value": None if math.isnan(value) else value, "interval": [value, value]}]}
        for number, value in ((10, 3.9), (20, 4.0), (40, 4.0 + apart))]
    return judged("dam_break", dam.study("spacing", points, "resolution"))


def test_the_front_of_the_experiment_passes_wherever_its_zero_is() -> None:
    for late in (-0.1, 0.0, 0.1):
        found = study(late=late)
        assert {"speed_martin_moyce", "delay_martin_moyce", "front_converged"} <= names(found, "pass"), found
        assert found["speed_martin_moyce"]["value"] == pytest.approx(1.0, abs=5e-3)
        assert found["delay_martin_moyce"]["value"] == pytest.approx(0.2 + late, abs=5e-3)


def test_a_delay_is_no_longer_than_water_stands_still() -> None:
    assert "delay_martin_moyce" in names(study(late=0.4), "fail")
    assert "delay_martin_moyce" in names(study(late=-0.4), "fail")
    for name, one in find("dam_break").quantities.items():
        if name.startswith("delay"):
            assert one.tolerance == pytest.approx(0.5 * dam.published(name.removeprefix("delay_"))[0][0], abs=1e-3)


def test_the_two_experiments_contradict_each_other_and_the_two_sizes_of_the_first_do_not() -> None:
    """The figures of reference/README.md."""
    own = dam.published("martin_moyce")
    speed, delay = dam.pace(own, "martin_moyce_half")
    assert abs(speed.value - 1.0) < speed.half < 0.1 and abs(delay.value) < delay.half
    other = dam.pace(own, "koshizuka_oka")[0]
    assert other.value == pytest.approx(1.195, abs=2e-3) and other.value - other.half > 1.05
    # So the later one cannot decide 5 %.
    found = study()
    assert found["speed_koshizuka_oka"]["verdict"] == "info" and "wider" in found["speed_koshizuka_oka"]["reason"]


def test_there_is_no_front_at_a_time_that_is_not_in_the_run_or_behind_the_end_of_the_tank() -> None:
    short, small = run(), run()
    frames = short.grains()
    short.grains = lambda: frames[: len(frames) // 2]
    small.parameters["tank_length"] = 3.0
    for one in (small, short):
        found = judged("dam_break", dam.measure([one]))["front_at_3"]
        assert (found["verdict"], found["value"]) == ("info", None) and "T = 3" in found["reason"]
    assert verdicts()["front_at_3"]["value"] == pytest.approx(3.9, abs=0.3)
    found = study(apart=np.nan)["front_converged"]
    assert found["verdict"] == "info" and "no front" in found["reason"]


def test_a_front_that_does_not_get_there_fails() -> None:
    assert {"speed_martin_moyce", "delay_martin_moyce"} <= names(study(faster=0.3), "fail")


@pytest.mark.parametrize("number", [20, 40, 80])
def test_a_thin_tip_moves_the_foremost_particle_and_not_the_front_behind_it(number: int) -> None:
    """Water whose depth is (2 − x/a)² a, so that x/a = 2 − (3 · 0.01)^(1/3) has a hundredth of a² before it. Particles are as thin."""
    spacing = A / number
    across = (np.arange(2 * number) + 0.5) / number
    x = np.concatenate([np.full(round((2.0 - place) ** 2 * number), place * A) for place in across])
    still = frame_of(np.stack([x, 0.0 * x, 0.0 * x], axis=1), 0.5 * spacing, {}, step=100)
    wedge = SimpleNamespace(parameters=defaults("dam_break") | {"resolution": number}, time_step=DT, grains=lambda: [still])
    assert dam.thick_front(wedge)[1][-1] == pytest.approx(2.0 - 0.03 ** (1.0 / 3.0), abs=1.5 / number)
    # A column half a particle high is the last that has one.
    assert dam.front(wedge)[1][-1] == pytest.approx(2.0 - math.sqrt(0.5 / number), abs=1.0 / number)


def test_a_run_without_spacings_to_study_is_judged_by_itself() -> None:
    alone = run(faster=8.0 / 7.0)
    alone.parameters["no_slip"] = "yes"
    assert "speed_martin_moyce" in names(judged("dam_break", dam.measure([alone])), "fail")
    assert "speed_martin_moyce" in names(verdicts(faster=8.0 / 7.0), "info")


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_the_column_breaks_in_an_engine(engine: str, simulate: Any) -> None:
    one = simulate("dam_break", engine, {"resolution": 10, "frames": 38})
    found = judged("dam_break", dam.measure([one]))
    assert {"energy_growth", "leaked"} <= names(found, "pass"), found
    assert found["speed_martin_moyce"]["value"] == pytest.approx(1.0, abs=0.05)
    assert found["delay_martin_moyce"]["value"] == pytest.approx(0.17, abs=0.05)
    assert 3.7 < found["front_at_3"]["value"] < 4.3
    rows = one.times()
    # Water leaves the place where it was, and the tank carries it.
    assert rows["potential_energy"][-1] < 0.5 * rows["potential_energy"][0] and rows["tank_fy"].mean() < 0.0


def controls_dam_break(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a scheme that makes energy", right, verdicts(made=0.05))
    yield Control("a particle that leaks out", right, verdicts(leaked=1))
    yield Control("a front that spacing decides", study(0.01), study(0.2))
    # The second experiment contradicts the first by more than what is allowed: one that does not, of the same front.
    own = dam.published("martin_moyce")
    with patch.object(dam, "published", lambda _: own):
        agreed = study()
        yield Control("water that is a seventh faster", agreed, study(faster=8.0 / 7.0))
        yield Control("water that starts late", agreed, study(late=0.4))
