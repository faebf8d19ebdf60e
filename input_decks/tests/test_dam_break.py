"""dam_break: a front that is known is measured as it is, wrong ones fail, and both engines let the same column run."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import defaults, judged, module, names
from dembark.postproc.tests.scenes import frame_of

dam = module("dam_break")
A, G, DT, STRIDE, SPACING = 0.05715, 9.81, 5e-5, 50, 0.05715 / 20


def run(faster: float = 1.0, leaked: int = 0, made: float = 0.0) -> Any:
    """A front that is that of the table, `faster` by a factor from T = 1.19 on; `leaked` particles below the floor; the part `made` of the
    energy comes from nowhere."""
    times, fronts = dam.published("table")
    unit = math.sqrt(A / (2.0 * G))

    def frame(k: int) -> Any:
        now = k * STRIDE * DT / unit
        place = np.interp(1.19 + (now - 1.19) * faster if now > 1.19 else now, [0.0, *times], [1.0, *fronts])
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


def study(apart: float) -> dict[str, dict[str, Any]]:
    """Fronts at three spacings, the two finest `apart`."""
    points = [{"parameters": {"resolution": number}, "quantities": [{"name": "front_at_3", "value": value, "interval": [value, value]}]}
              for number, value in ((10, 3.9), (20, 4.0), (40, 4.0 + apart))]
    return judged("dam_break", dam.study("spacing", points, "resolution"))


def test_the_front_of_the_experiment_passes() -> None:
    found = verdicts()
    assert {"front", "passage", "energy_growth", "leaked"} <= names(found, "pass"), found
    assert found["front"]["value"] == pytest.approx(1.0, abs=2e-3) and found["passage"]["value"] == pytest.approx(2.14, abs=0.01)


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_the_column_breaks_in_an_engine(engine: str, simulate: Any) -> None:
    one = simulate("dam_break", engine, {"resolution": 10, "frames": 38})
    found = judged("dam_break", dam.measure([one]))
    assert {"passage", "energy_growth", "leaked"} <= names(found, "pass"), found
    assert 3.7 < found["front_at_3"]["value"] < 4.3
    rows = one.times()
    # Water leaves the place where it was, and the tank carries it.
    assert rows["potential_energy"][-1] < 0.5 * rows["potential_energy"][0] and rows["tank_fy"].mean() < 0.0
