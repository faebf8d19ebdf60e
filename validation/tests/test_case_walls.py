"""[walls] of a case: read, checked, and resolved for a run."""

import pytest

from dembark.common.errors import DembarkError
from dembark.validation.case import folders, walls
from dembark.validation.case.tables import TableReader

CASES = ("silo", "plane_silo", "plug_flow", "gravity_channel", "column_collapse", "granular_collapse", "vibrated_layer", "drive_power")


@pytest.mark.parametrize("name", CASES)
def test_walls_of_a_run_are_numbers(name):
    case = folders.find(name)
    known = case.with_derived({key: one.value for key, one in case.parameters.items()}) | {"base": -0.002}
    for wall in walls.resolved(case, known).values():
        assert wall["kind"] in ("plane", "cylinder")
        values = [value if isinstance(value, list) else [value] for key, value in wall.items() if key not in ("kind", "motion")]
        assert all(isinstance(one, float) for value in values for one in value)


def test_expressions_are_resolved():
    case = folders.find("plug_flow")
    found = walls.resolved(case, {"channel_width": 0.08, "channel_depth": 0.025, "base_speed": 0.02, "settle_time": 0.5})
    assert found["right"] == {"kind": "plane", "origin": [0.08, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]}
    assert found["base"]["velocity"] == [0.0, 0.0, -0.02] and found["base"]["since"] == 0.5
    with pytest.raises(DembarkError, match=r"channel_width.*plug_flow, right"):
        walls.resolved(case, {"base_speed": 0.02, "settle_time": 0.5})


@pytest.mark.parametrize(("entry", "words"), [
    (3, "kind = "), ({"kind": "plan"}, "plane"), ({"kind": "cylinder"}, "radius"), ({"kind": "plane", "radius": 1.0}, "radius"),
    ({"kind": "plane", "normal": [1.0]}, "three numbers"), ({"kind": "plane", "since": "import os"}, "expression")])
def test_mistakes_name_the_wall(tmp_path, entry, words):
    (tmp_path / "case.toml").touch()
    with pytest.raises(DembarkError, match=rf"{words}") as caught:
        walls.read(TableReader(tmp_path / "case.toml"), {"side": entry})
    assert "walls.side" in str(caught.value)
