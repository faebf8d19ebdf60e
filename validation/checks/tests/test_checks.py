"""The cases' checks find what was put into synthetic runs, and do not pass what is wrong."""

import json
import math
import types

import numpy as np
import pytest
from dembark.common.errors import DembarkError, RunError
from dembark.physics import capillary_force
from dembark.validation.checks import find
from dembark.validation.checks.column import _wall_pull, janssen, two_parameter
from dembark.validation.checks.filling import apparent_mass_with_onset
from dembark.validation.checks.quantity import Quantity, judge
from dembark.validation.checks.silo import _moving_mean
from dembark.validation.checks.vessel import Cylinder
from dembark.validation.compare import compare, pair
from dembark.validation.metrics import measure
from dembark.postproc.statistics import Estimate, over_replicas
from synthetic import DIAMETER, plug_flow, silo


def by_name(content):
    return {quantity["name"]: quantity for quantity in content["quantities"]}


def test_silo_that_follows_janssen_passes(tmp_path):
    folder = silo(tmp_path, k=0.8, friction=0.25, noise=0.1)
    content = measure(folder)
    found = by_name(content)
    assert found["stress_ratio_k"]["value"] == pytest.approx(0.8, rel=0.02)
    assert found["wall_mobilisation"]["value"] == pytest.approx(0.25, rel=0.01)
    assert found["janssen_length_predicted"]["value"] == pytest.approx(2.5, rel=0.02)
    assert found["janssen_length_measured"]["value"] == pytest.approx(2.5, rel=0.03)
    assert found["two_parameter_gain"]["value"] < 1.0
    assert {
        found[name]["verdict"]
        for name in (
            "janssen_profile_deviation",
            "janssen_length_predicted",
            "apparent_mass_ratio",
            "force_balance_error",
            "field_balance_deviation",
        )
    } == {"pass"}
    assert abs(found["field_balance_deviation"]["value"]) < 1e-9
    assert json.loads((folder / "metrics.json").read_text()) == content


@pytest.mark.parametrize("bands", range(1, 9))
def test_moving_mean_keeps_one_value_a_band(bands):
    # A column of 100 grains has four bands, fewer than the mean spans.
    assert _moving_mean(np.full(bands, 3.0)) == pytest.approx(np.full(bands, 3.0))
    assert _moving_mean(np.arange(float(bands)))[bands // 2] == pytest.approx(np.arange(bands)[max(0, bands // 2 - 2):bands // 2 + 3].mean())


def test_wet_silo_follows_janssen_with_the_adhesion_that_hangs_on_the_wall(tmp_path):
    found = by_name(measure(silo(tmp_path, k=0.8, friction=0.25, noise=0.02, bridge_volume=8e-11)))
    bridge = float(capillary_force(0.5 * DIAMETER, np.inf, 0.0, 8e-11, 0.072, 0.35))
    assert found["wall_adhesion"]["value"] == pytest.approx(24 * bridge / (2 * np.pi * 0.025 * DIAMETER), rel=5e-3)  # bands of the measured height
    assert found["stress_ratio_k"]["value"] == pytest.approx(0.8, rel=0.02)
    assert found["wall_mobilisation"]["value"] == pytest.approx(0.25, rel=0.01)
    assert found["janssen_length_predicted"]["value"] == pytest.approx(2.5, rel=0.02)
    assert found["janssen_length_measured"]["value"] == pytest.approx(2.5, rel=0.03)
    assert {found[name]["verdict"] for name in ("janssen_profile_deviation", "janssen_length_predicted", "apparent_mass_ratio")} == {"pass"}


def test_a_grain_off_the_wall_counts_with_the_bridge_it_has(tmp_path):
    radii, vessel = np.array([0.0025, 0.0025, 0.0025]), Cylinder(0.025)
    place = np.array([[0.0226, 0.0, 0.0], [0.0, 0.0224, 0.0], [0.0, -0.0224, 0.0]])  # touching; off with a bridge; off without
    side = np.array([[-0.1, 0.0, 0.0], [0.0, 3e-4, 1e-5], [0.0, 0.0, 0.0]])
    grains = types.SimpleNamespace(positions=place, radii=radii)
    pull = _wall_pull(grains, side, vessel, lambda found: np.full(len(found), 7e-4))
    np.testing.assert_allclose(pull, [7e-4, 3e-4, 0.0], atol=1e-18)
    assert not _wall_pull(grains, side, vessel, None).any()


def filling_points(length, per_radius=0.07, radii=(1.0, 2.0, 4.0), hydrostatic=0.0, half=0.0):
    saturation = length * per_radius
    for height in radii:
        mass = per_radius * height
        apparent = float(apparent_mass_with_onset(np.array([mass]), saturation, hydrostatic)[0])
        values = {"filled_mass": mass, "filling_height": height, "apparent_mass_ratio": apparent / mass, "janssen_length_predicted": length}
        yield {"quantities": [{"name": name, "value": value, "interval": [value - half, value + half]} for name, value in values.items()]}


def test_filling_curve_gives_back_its_length():
    found, (curve,), _ = find("silo").study("filling", list(filling_points(2.1, half=0.01)), "grain_count")
    quantity = {one.name: one for one in found}
    assert quantity["filling_length"].estimate.value == pytest.approx(2.1, rel=1e-6)
    assert 0.0 < quantity["filling_length"].estimate.half < 0.2
    assert quantity["filling_length"].judged()[0] == quantity["largest_apparent_mass"].judged()[0] == "pass"
    np.testing.assert_allclose(curve["value"], curve["reference"], rtol=1e-6)


def test_filling_curve_with_another_length_than_the_walls_fails_and_a_hydrostatic_zone_is_found():
    points = list(filling_points(2.1, half=0.001))
    for point in points:
        point["quantities"][-1] |= {"value": 3.0, "interval": [2.99, 3.01]}
    found, _, _ = find("silo").study("filling", points, "grain_count")
    assert found[0].judged()[0] == "fail"
    found, _, _ = find("silo").study("filling", list(filling_points(1.5, radii=(0.5, 1.0, 2.0, 3.0, 5.0), hydrostatic=0.07)), "grain_count")
    assert found[2].estimate.value > 0.95


def test_solid_fraction_counts_up_to_the_wall(tmp_path):
    found = by_name(measure(silo(tmp_path)))
    assert found["solid_fraction"]["value"] == pytest.approx(24.0 * np.pi / 6.0 * DIAMETER**2 / (np.pi * 0.025**2), rel=2e-3)


def test_missing_wall_force_is_a_failed_balance(tmp_path):
    found = by_name(measure(silo(tmp_path, noise=0.01, lost_wall_force=0.01)))["force_balance_error"]
    assert found["value"] == pytest.approx(-0.01 * 0.75, rel=0.3)
    assert found["verdict"] == "fail"


def test_three_replicas_give_an_interval_over_replicas(tmp_path):
    for replica, k in ((1, 0.78), (2, 0.8), (3, 0.83)):
        folder = silo(tmp_path, replica=replica, k=k, noise=0.1, seed=replica)
    found = by_name(measure(folder))["stress_ratio_k"]
    assert found["basis"] == "3 replicas"
    low, high = found["interval"]
    assert low < 0.8 < high
    assert high - low == pytest.approx(2 * 4.303 * np.std([0.78, 0.8, 0.83], ddof=1) / np.sqrt(3), rel=0.1)


def test_laws_of_the_silo():
    depth = np.array([0.0, 1e-6, 0.1, 10.0])
    np.testing.assert_allclose(janssen(depth, 0.05, 1000.0)[:2], [0.0, 1e-3], rtol=1e-4)
    assert janssen(depth, 0.05, 1000.0)[-1] == pytest.approx(50.0)
    np.testing.assert_allclose(two_parameter(depth, 0.05, 0.0, 1000.0), janssen(depth, 0.05, 1000.0))
    assert two_parameter(np.array([0.02]), 0.05, 0.03, 1000.0)[0] == 20.0


def test_plug_flow_with_a_known_profile(tmp_path):
    found = by_name(measure(plug_flow(tmp_path, slip=0.4, decay=2.0)))
    assert found["shear_zone_width"]["value"] == pytest.approx(2.0, rel=0.12)
    assert found["shear_zone_width_90"]["value"] == pytest.approx(0.5 + 2.0 * np.log(10.0), rel=0.12)
    assert found["wall_mobilisation"]["value"] == pytest.approx(0.3, rel=1e-6)
    assert found["solid_fraction"]["value"] == pytest.approx(np.pi / 6.0, rel=0.02)
    assert found["core_fluctuation"]["value"] == pytest.approx(0.02, rel=0.2)
    assert abs(found["flux_error"]["value"]) < 0.02
    assert found["flux_error"]["verdict"] == "pass"
    assert found["force_balance_error"]["verdict"] == "pass"
    assert found["inertial_number"]["verdict"] == "pass"


def test_flat_core_passes_and_a_tilted_one_fails(tmp_path):
    assert by_name(measure(plug_flow(tmp_path / "flat", slip=0.3, decay=0.8)))["core_flatness"]["verdict"] == "pass"
    found = by_name(measure(plug_flow(tmp_path / "tilted", slip=0.3, decay=0.8, tilt=0.2)))["core_flatness"]
    assert found["value"] == pytest.approx(0.2 * 0.225, rel=0.15)
    assert found["verdict"] == "fail"


def test_no_shear_zone_is_said_and_not_measured(tmp_path):
    found = by_name(measure(plug_flow(tmp_path, slip=0.0)))["shear_zone_width"]
    assert found["verdict"] == "info"
    assert "no shear zone" in found["reason"]


def three_packings(folder, engine, **values):
    for replica in (1, 2, 3):
        made = silo(folder, engine=engine, replica=replica, noise=0.1, seed=10 * len(engine) + replica, **values)
    return measure(made)


def test_engines_that_agree_and_engines_that_do_not(tmp_path):
    for engine in ("liggghts", "yade"):
        three_packings(tmp_path, engine, k=0.8)
    found = by_name(compare(tmp_path / "silo" / "dry"))
    assert found["stress_ratio_k"]["verdict"] == "pass"
    for engine, k in (("liggghts", 0.8), ("yade", 1.0)):
        three_packings(tmp_path, engine, variant="wet", k=k)
    found = by_name(compare(tmp_path / "silo" / "wet"))
    assert found["stress_ratio_k"]["verdict"] == "fail"
    assert found["stress_ratio_k"]["deviation"] == pytest.approx(0.25, rel=0.05)


def test_height_of_one_packing_has_no_interval_and_decides_nothing(tmp_path):
    height = by_name(measure(silo(tmp_path, noise=0.1)))["filling_height"]
    assert height["interval"] is None
    found = pair(height, height | {"value": 1.003 * height["value"]}, "liggghts", "yade")
    assert found["verdict"] == "info"
    assert "other packings" in found["reason"]


def entry(value, half, basis="5 replicas"):
    return {
        "basis": basis,
        "name": "q",
        "label": "q",
        "unit": "1",
        "value": value,
        "interval": None if half is None else [value - half, value + half],
    }


@pytest.mark.parametrize(
    ("one", "other", "verdict"),
    [
        ((1.0, 0.04), (1.05, 0.04), "pass"),
        ((1.0, 0.01), (1.05, 0.01), "fail"),
        ((1.0, 0.2), (1.15, 0.2), "info"),
        ((1.0, 0.05), (1.3, 0.05), "fail"),
        ((1.0, None), (1.0, 0.1), "info"),
        ((0.0, 0.1), (1.0, 0.1), "fail"),
    ],
)
def test_verdict_of_a_pair(one, other, verdict):
    assert pair(entry(*one), entry(*other), "liggghts", "yade")["verdict"] == verdict


@pytest.mark.parametrize("other", [1.0, 1.05, 1.5])
@pytest.mark.parametrize("packings", ["1 replica", "2 replicas"])
def test_intervals_within_fewer_than_three_packings_leave_a_comparison_open(other, packings):
    single = f"within {packings}: jackknife over 8 sectors or bands"
    found = pair(entry(1.0, 0.01, single), entry(other, 0.01), "liggghts", "yade")
    assert found["verdict"] == "info"
    assert f"within {packings.split()[0]} packing" in found["reason"]


def test_one_of_many_comparisons_may_lie_beyond_its_interval():
    """Five packings in each engine of one and the same truth: all comparisons of a page together fail once in a hundred pages."""
    random = np.random.default_rng(7)
    samples = random.standard_normal((500, 20, 2, 5)) * 0.01 + 1.0
    verdicts = []
    for page in samples:
        estimates = [[over_replicas([Estimate(value, 0.0) for value in engine]) for engine in quantity] for quantity in page]
        verdicts.append({pair(*(entry(one.value, one.half, one.basis) for one in two), "liggghts", "yade", 20)["verdict"] for two in estimates})
    assert sum("fail" in page for page in verdicts) <= 12
    assert sum("info" in page for page in verdicts) > 100
    assert pair(entry(1.0, 0.01), entry(1.05, 0.01), "liggghts", "yade", 20)["verdict"] == "fail"


@pytest.mark.parametrize(
    ("deviation", "half", "verdict"),
    [
        (0.05, 0.02, "pass"),
        (-0.1, 0.1, "pass"),
        (0.11, 0.02, "fail"),
        (0.0, 0.2, "info"),
        (0.5, float("inf"), "info"),
        (0.0, float("nan"), "info"),
    ],
)
def test_verdict_needs_an_interval_narrower_than_the_tolerance(deviation, half, verdict):
    assert judge(deviation, half, 0.1)[0] == verdict


def test_nan_fails():
    broken = Quantity("q", "q", "1", Estimate(float("nan"), 0.1), reference=Estimate(1.0, 0.0), tolerance=0.1)
    assert broken.judged()[0] == "fail"
    assert broken.as_json()["value"] is None


def test_compare_needs_two_engines(tmp_path):
    measure(silo(tmp_path))
    with pytest.raises(RunError, match="liggghts only"):
        compare(tmp_path / "silo" / "dry")


def test_truncated_dump_is_one_clear_line(tmp_path):
    folder = silo(tmp_path)
    path = folder / "replica-1" / "contacts.dump"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(RunError, match="truncated") as caught:
        measure(folder)
    assert "\n" not in str(caught.value)
    assert not (folder / "metrics.json").exists()


def test_no_replica_is_told(tmp_path):
    with pytest.raises(RunError, match="nothing to measure"):
        measure(tmp_path)


def test_a_case_may_bring_its_own_checks(tmp_path):
    (tmp_path / "checks.py").write_text("REFERENCES = ()\nquantities = picture = None\n")
    assert find("drum", tmp_path).REFERENCES == ()
    with pytest.raises(DembarkError, match="no checks"):
        find("drum")


def test_a_bound_that_is_not_finite_is_none_in_the_file() -> None:
    """A column too small for an interval allows anything; JSON has no number for that."""
    entry = Quantity("field_balance", "balance", "1", Estimate(0.1, math.inf), reference=Estimate(0.0, 0.0), tolerance=math.inf,
                     absolute=True).as_json()
    assert entry["tolerance"] is None and entry["interval"] is None
    json.dumps(entry, allow_nan=False)
