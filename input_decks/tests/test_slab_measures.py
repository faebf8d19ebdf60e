"""What is measured of plane silo and gravity-driven channel finds what was put into synthetic runs, and does not pass what is wrong."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from dembark.input_decks.tests.measuring import Control, judged, measure, measured, module, names
from dembark.input_decks.tests.synthetic import restated
from dembark.input_decks.tests.synthetic_slabs import gravity_channel, plane_silo
from dembark.postproc.measurement import Measurement

CHANNEL = module("gravity_channel")


def test_plane_silo_that_follows_janssen_passes(tmp_path):
    content = measure(plane_silo(tmp_path, k=0.7, friction=0.2, noise=0.1))
    found = {one["name"]: one for one in content["quantities"]}
    assert found["stress_ratio_k"]["value"] == pytest.approx(0.7, rel=0.02)
    assert found["wall_mobilisation"]["value"] == pytest.approx(0.2, rel=0.01)
    assert found["janssen_length_predicted"]["value"] == pytest.approx(1.0 / (2 * 0.7 * 0.2), rel=0.02)
    assert found["janssen_length_measured"]["value"] == pytest.approx(1.0 / (2 * 0.7 * 0.2), rel=0.03)
    assert found["stress_ratio_k_contacts"]["value"] == pytest.approx(0.7, rel=0.02)
    assert found["solid_fraction"]["value"] == pytest.approx(np.pi / 6.0, rel=2e-3)
    assert names(found, "pass") >= {"janssen_profile_deviation", "janssen_length_predicted", "apparent_mass_ratio", "sliding_friction",
                                    "force_balance_error", "field_balance_deviation"}
    assert abs(found["field_balance_deviation"]["value"]) < 1e-9
    assert found["janssen_length_predicted"]["unit"] == "W"
    assert "sigma_xx" in {one["name"] for one in content["profiles"]}


def test_both_walls_of_the_plane_silo_count(tmp_path):
    even, tilted = (measured(plane_silo(tmp_path / str(tilt), tilt=tilt)) for tilt in (0.0, 0.3))
    assert tilted["stress_ratio_k"]["value"] == pytest.approx(even["stress_ratio_k"]["value"], rel=1e-6)
    # What differs from wall to wall is what the packing's disorder may do, so the interval is wider.
    widths = [one["stress_ratio_k"]["interval"][1] - one["stress_ratio_k"]["interval"][0] for one in (even, tilted)]
    assert widths[1] > 10.0 * widths[0]


def test_channel_with_a_known_profile(tmp_path):
    found = measured(gravity_channel(tmp_path, greatest=3.0, slip=2.0, decay=1.5))
    assert found["greatest_velocity"]["value"] == pytest.approx(3.0, rel=0.01)
    assert found["slip_velocity"]["value"] == pytest.approx(2.0, rel=0.03)
    assert found["velocity_ratio"]["value"] == pytest.approx(1.5, rel=0.03)
    assert found["shear_zone_thickness"]["value"] == pytest.approx(1.5, rel=0.12)
    assert found["wall_mobilisation"]["value"] == pytest.approx(0.3, rel=1e-6)
    assert found["mean_solid_fraction"]["value"] == pytest.approx(np.pi / 6.0, rel=1e-6)
    assert found["core_fluctuation"]["value"] == pytest.approx(0.02, rel=0.3)
    assert {found[name]["verdict"] for name in ("core_flatness", "force_balance_error")} == {"pass"}


def test_acceleration_explains_friction_that_is_missing(tmp_path):
    missing, explained = (measured(gravity_channel(tmp_path / str(k), **change))["force_balance_error"]
                          for k, change in enumerate(({"friction": 0.9}, {"acceleration": 0.1})))
    assert missing["value"] == pytest.approx(-0.1, abs=0.02) and missing["verdict"] == "fail"
    assert explained["value"] == pytest.approx(0.0, abs=0.02) and explained["verdict"] == "pass"


@pytest.mark.parametrize("friction", [1.0, 0.9])
def test_friction_that_swings_too_much_to_be_judged_leaves_the_balance_open(tmp_path, friction):
    """The tolerance does not grow with the noise."""
    found = measured(gravity_channel(tmp_path, friction=friction, swing=10.0))["force_balance_error"]
    assert (found["tolerance"], found["verdict"]) == (0.05, "info") and "wider than the tolerance" in found["reason"]


def test_a_flow_that_still_accelerates_or_that_jams_has_no_verdict(tmp_path):
    growing = measured(gravity_channel(tmp_path / "growing", drift=2.0))["core_flatness"]
    assert growing["verdict"] == "info" and "no steady part" in growing["reason"]
    jammed = measured(gravity_channel(tmp_path / "jammed", greatest=1e-4, slip=1e-4, noise=0.0))["greatest_velocity"]
    assert "jammed" in jammed["reason"]


def widths(folder: Path, slips: tuple[float, ...]) -> Measurement:
    """The study of three widths with these velocities at the wall."""
    points = [measure(gravity_channel(folder, cells=cells, variant=f"w{cells}", slip=slip, decay=0.1 * cells, noise=0.005, seed=cells))
              for cells, slip in zip((40, 30, 20), reversed(slips), strict=True)]
    return CHANNEL.study("width", points, "channel_width")


def test_widths_that_grow_as_published(tmp_path):
    found = widths(tmp_path, (2.0, 2.0, 2.0))
    value, drawn = judged("gravity_channel", found), found.profiles
    assert value["exponent_greatest_velocity"]["value"] == pytest.approx(0.5, abs=0.03)
    assert value["exponent_slip_velocity"]["value"] == pytest.approx(0.5, abs=0.05)
    assert value["exponent_thickness"]["value"] == pytest.approx(1.0, abs=0.15)
    assert value["ratio_spread"]["verdict"] == "pass"
    assert value["profile_collapse"]["value"] < 0.1 and value["profile_collapse"]["verdict"] == "info"
    assert value["exponent_thickness"]["verdict"] == "info"
    assert [one["place"] for one in drawn[:3]] == [pytest.approx([20.0, 30.0, 40.0])] * 3


def test_the_common_exponential_of_curves():
    place = np.linspace(0.5, 4.0, 20)
    assert CHANNEL.common_exponential([(place, 1.3 * np.exp(-place)), (2 * place, 1.3 * np.exp(-2 * place))]) == pytest.approx((1.3, 0.0))
    assert CHANNEL.common_exponential([(place, 1.3 * np.exp(-place)), (place, np.exp(-2 * place))])[1] > 0.1


def controls_gravity_channel(folder: Path) -> Iterator[Control]:
    right = measured(gravity_channel(folder / "right"))
    yield Control("the parabolic profile of a fluid", right, measured(gravity_channel(folder / "fluid", slip=0.0, decay=6.0)))
    yield Control("walls with nine tenths of the friction", right, measured(gravity_channel(folder / "walls", friction=0.9)))
    yield Control("a slip that does not grow with the width", *(judged("gravity_channel", widths(folder / str(slips[0]), slips))
                                                               for slips in ((2.0, 2.0, 2.0), (2.4, 2.0, 1.6))))


def controls_plane_silo(folder: Path) -> Iterator[Control]:
    right = measured(plane_silo(folder / "right", noise=0.01))
    for name, change in {"an almost liquid: hardly any friction of the wall": {"friction": 0.004, "stated": 0.2},
                         "a wall ten times as smooth in its lower half": {"smooth": 0.1},
                         "a lost contact in each layer": {"lost_contacts": 1},
                         "a fiftieth of the wall's force lost": {"lost_wall_force": 0.02}}.items():
        yield Control(name, right, measured(plane_silo(folder / name, noise=0.01, **change)))
    yield Control("gravity doubled", right, measured(restated(plane_silo(folder / "gravity", noise=0.01), gravity=2.0 * 9.81)))
    # A column deep enough to feel K.
    deep = measured(plane_silo(folder / "deep", noise=0.01, friction=0.5))
    for name, inner in (("K of the contacts 20 % too high", 1.2), ("K of the contacts 20 % too low", 0.8)):
        yield Control(name, deep, measured(plane_silo(folder / name, noise=0.01, friction=0.5, inner=inner)))
