"""From a campaign to its runs: names of folders, the hash of the inputs, points that several sweeps share."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness import decks, stand_in  # noqa: F401
from hypothesis import given
from hypothesis import strategies as st

from dembark.common.errors import DembarkError
from dembark.validation.campaigns import expand
from dembark.validation.campaigns.expand import LONGEST_NAME, campaign, points, variant_name
from dembark.validation.campaigns.plan import of_profile
from dembark.validation.campaigns.spec import read

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

HEAD = '[campaign]\nname = "boxes"\nprofile = "quick"\n'


def spec_of(tmp_path: Path, text: str):
    path = tmp_path / "campaign.toml"
    path.write_text(HEAD + text)
    return read(path)


values = st.one_of(st.none(), st.integers(-10**9, 10**9), st.floats(allow_nan=False), st.text(max_size=30))


@given(st.dictionaries(st.from_regex(r"[a-z_]{1,12}", fullmatch=True), values, max_size=12))
def test_any_point_has_a_name_that_is_safe_as_a_folder(point: dict[str, object]) -> None:
    name = variant_name("dry", point)
    assert len(name) <= LONGEST_NAME and "/" not in name and name.isprintable() and not set(name) & set(" '\"$`\\*?[]{}()<>|;&\n")


@given(st.floats(allow_nan=False), st.floats(allow_nan=False), st.integers(0, 12))
def test_different_numbers_have_different_names(one: float, other: float, length: int) -> None:
    padding = {f"a_long_parameter_{k}": k for k in range(length)}
    same = variant_name("dry", padding | {"x": one}) == variant_name("dry", padding | {"x": other})
    assert same == (one == other and str(one) == str(other))


def test_names_are_readable(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, """
[[sweeps]]
case = "box"
variants = ["dry", "wet"]
grid = { grain_diameter = ["4 mm", 0.0125], strength = ["2 MPa"] }
""")
    found = points(spec)
    assert [point.variant for point in found] == [
        "dry_grain_diameter=0.004_strength=2e+06", "dry_grain_diameter=0.0125_strength=2e+06",
        "wet_grain_diameter=0.004_strength=2e+06", "wet_grain_diameter=0.0125_strength=2e+06"]
    assert found[2].values == {"variant": "wet", "grain_diameter": 0.004, "strength": 2e6}
    assert found[2].resolved["contact_angle"] == 0.1 and found[0].resolved["contact_angle"] == 0.35


def test_a_point_that_a_profile_runs_has_the_same_inputs(tmp_path: Path) -> None:
    ordinary = {run.inputs: run for one in of_profile("standard") for run in one.runs}
    spec = spec_of(tmp_path, """
[[sweeps]]
case = "box"
profile = "standard"
replicas = 3
grid = { grain_count = [10, 20] }
""")
    mine = {run.inputs: run for one in campaign(spec).series for run in one.runs}
    shared = ordinary.keys() & mine.keys()
    assert len(mine) == 2 * len(ordinary) and shared == ordinary.keys()
    assert {mine[key].variant for key in shared} == {"dry_grain_count=20"}
    assert all(mine[key].values == ordinary[key].values for key in shared)


def test_a_point_of_two_sweeps_is_run_once(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, """
[[sweeps]]
case = "box"
engines = ["liggghts"]
grid = { grain_count = [10, 20] }
[[sweeps]]
case = "box"
grid = { grain_diameter = [0.005, 0.004] }
""")
    whole = campaign(spec)
    assert sorted(str(one.place) for one in whole.series) == [
        "box/dry_grain_count=10/liggghts", "box/dry_grain_count=10/yade", "box/dry_grain_count=20/liggghts",
        "box/dry_grain_diameter=0.004/liggghts", "box/dry_grain_diameter=0.004/yade"]
    assert [[point["variant"] for point in sweep["points"]] for sweep in whole.facts["sweeps"]] == [
        ["dry_grain_count=10", "dry_grain_count=20"], ["dry_grain_count=10", "dry_grain_diameter=0.004"]]
    inputs = [run.inputs for one in whole.series for run in one.runs]
    assert len(set(inputs)) == len(inputs)


def test_sweeps_of_the_same_points_with_different_numbers_take_a_name(tmp_path: Path) -> None:
    text = '[[sweeps]]\ncase = "box"\ngrid = {{ grain_count = [10] }}\nfixed = {{ contact_angle = {} }}\n{}\n'
    with pytest.raises(DembarkError, match="give one of them a name"):
        points(spec_of(tmp_path, text.format(0.1, "") + text.format(0.2, "")))
    found = points(spec_of(tmp_path, text.format(0.1, "") + text.format(0.2, 'name = "flat"')))
    assert [point.variant for point in found] == ["dry_grain_count=10", "flat_dry_grain_count=10"]


ORDERS = """
[[sweeps]]
case = "log_pair"
engines = ["liggghts"]
variants = ["steps_40"]
grid = { theta = [0.5, 1.0], time_step = [1e-5, 2e-5] }
"""


def test_the_formal_order_is_that_of_the_scheme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The case's study says it, the sweep may say another, and neither is needed."""
    monkeypatch.delenv("DEMBARK_DECKS")
    for text, due in ((ORDERS, [2.0, 2.0, 1.0, 1.0]), (ORDERS + "formal_order = 1.5\n", [1.5] * 4)):
        (sweep,) = campaign(spec_of(tmp_path, text)).facts["sweeps"]
        assert [point["formal_orders"] for point in sweep["points"]] == [{"time_step": order} for order in due]
    text = ORDERS.replace("log_pair", "log_pile").replace("steps_40", "smooth_logs")
    assert {point["formal_orders"]["time_step"] for point in campaign(spec_of(tmp_path, text)).facts["sweeps"][0]["points"]} == {1.0}
    for order in ("0", '"theta - 2"'):
        with pytest.raises(DembarkError, match=r"formal_order = .* is .*, point .*, give a positive number"):
            campaign(spec_of(tmp_path, f"{ORDERS}formal_order = {order}\n"))
    with pytest.raises(DembarkError, match="unknown parameter 'thet'"):
        spec_of(tmp_path, ORDERS + 'formal_order = "2 * thet"\n')


def test_derived_parameters_follow_from_the_others(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, """
[[sweeps]]
case = "box"
grid = { grain_diameter = [0.005, 0.01] }
fixed = { contact_angle = 0.5 }
[sweeps.derived]
grain_count = "10 * (0.01 / grain_diameter)**3 + 0.3"
static_friction = "contact_angle / 2"
kinetic_friction = "static_friction"
""")
    assert [(point.resolved["grain_count"], point.resolved["kinetic_friction"]) for point in points(spec)] == [(80, 0.25), (10, 0.25)]
    assert points(spec)[0].variant == "dry_grain_diameter=0.005" and points(spec)[0].values == {"grain_diameter": 0.005}


@pytest.mark.parametrize(("derived", "expected"), [
    ('{ contact_angle = 3 }', "write an expression in a text"),
    ('{ contact_angle = "import os" }', "is not an expression"),
    ('{ contact_angle = "grain_cuont" }', "did you mean grain_count or grain_diameter"),
    ('{ grain_count = "5" }', "grain_count is derived and given"),
    ('{ contact_angle = "1 / (20 - grain_count)" }', "point dry_grain_count=20"),
    ('{ contact_angle = "grain_count" }', "point dry_grain_count=10"),
    ('{ contact_angle = "grain_count > 3" }', "is not a number"),
    ('{ replicas = "2" }', "replicas is not a parameter of a sweep"),
])
def test_mistakes_in_derived_parameters(derived: str, expected: str, tmp_path: Path) -> None:
    with pytest.raises(DembarkError) as error:
        points(spec_of(tmp_path, f'[[sweeps]]\ncase = "box"\ngrid = {{ grain_count = [10, 20] }}\nderived = {derived}\n'))
    assert expected in str(error.value) and "sweeps 1" in str(error.value) and "campaign.toml" in str(error.value)


def test_only_what_is_chosen(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, '[[sweeps]]\ncase = "box"\ngrid = { grain_count = [10, 20] }\n[resources.yade]\nthreads = 2\n')
    whole, chosen = campaign(spec), campaign(spec, only_engines=["yade"])
    assert {one.place.name for one in chosen.series} == {"yade"} and len(campaign(spec, ["box"]).series) == 4
    assert {one.place.name: whole.resources[one.place].threads for one in whole.series} == {"liggghts": 1, "yade": 2}
    assert [one.place.name for one in whole.series] == ["yade", "yade", "liggghts", "liggghts"]  # the longest first
    assert whole.facts["sweeps"][0]["axes"] == ["grain_count"] and whole.label == "boxes"
    with pytest.raises(DembarkError, match="did you mean box"):
        campaign(spec, ["bxo"])


def test_the_plan_of_a_profile() -> None:
    planned = expand.profile("quick")
    assert planned.facts == {"profile": "quick"} and planned.label == "quick"
    assert expand.profile("quick", ["box"], ["yade"]).facts == {"profile": "quick", "cases": ["box"]}
    written = planned.as_json({one.place: 5.0 for one in planned.series})
    assert {run["folder"]: run["inputs"] for run in written["runs"]} == {place: run.inputs for place, run in planned.folders.items()}
    assert {run["estimate"] for run in written["runs"]} == {5.0}
