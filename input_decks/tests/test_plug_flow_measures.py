"""What is measured of the plug flow finds what was put into synthetic runs, and does not pass what is wrong."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray

from dembark.common.errors import RunError
from dembark.input_decks.plug_flow.channel import free_grains
from dembark.input_decks.tests.measuring import Control, dried, measured, names
from dembark.input_decks.tests.synthetic import DIAMETER, plug_flow, restated
from dembark.postproc.tests.packings import contacts_of, frame_of


def test_plug_flow_with_a_known_profile(tmp_path):
    found = measured(plug_flow(tmp_path, slip=0.4, decay=2.0))
    assert found["shear_zone_width"]["value"] == pytest.approx(2.0, rel=0.12)
    assert found["shear_zone_width_90"]["value"] == pytest.approx(0.5 + 2.0 * np.log(10.0), rel=0.12)
    assert found["wall_mobilisation"]["value"] == pytest.approx(0.3, rel=1e-6)
    assert found["solid_fraction"]["value"] == pytest.approx(np.pi / 6.0, rel=0.02)
    assert found["core_fluctuation"]["value"] == pytest.approx(0.02, rel=0.2)
    assert abs(found["flux_error"]["value"]) < 0.02
    assert names(found, "pass") >= {"flux_error", "force_balance_error", "inertial_number"}


def test_no_shear_zone_is_said_and_not_measured(tmp_path):
    found = measured(plug_flow(tmp_path, slip=0.0))["shear_zone_width"]
    assert found["verdict"] == "info" and not found["compared"]
    assert "no shear zone" in found["reason"]


def test_channel_gives_back_velocity_slope_and_temperature(tmp_path):
    folder = plug_flow(tmp_path, slip=0.4, decay=2.0, noise=0.02)
    found = measured(folder)
    fields = xarray.load_dataset(folder / "fields.nc", engine="h5netcdf")
    place = fields.x.values / DIAMETER
    core = np.abs(place - 10.0) < 4.0
    np.testing.assert_allclose(fields.velocity_profile.values[core], found["core_velocity"]["value"], rtol=0.02)
    # The grains' vertical velocity scatters by 0.02 v0 in one of three directions.
    assert found["temperature_core"]["value"] == pytest.approx(0.02**2 / 3.0, rel=0.15)
    # v / v_core = 1 - 0.4 exp(-s / 2): slope 0.2 exp(-s / 2) / d, smoothed over half a diameter.
    due = 0.2 * np.exp(-2.0 / 2.0) * found["core_velocity"]["value"]
    assert np.interp(2.0, place, fields.shear_rate_profile.values) == pytest.approx(due, rel=0.1)
    assert np.interp(18.0, place, fields.shear_rate_profile.values) == pytest.approx(-due, rel=0.1)


def test_a_window_that_hardly_stays_filled_is_refused(tmp_path):
    with pytest.raises(RunError, match="of its height stay filled while the plate sinks, use more grains or less travel"):
        measured(restated(plug_flow(tmp_path), grain_diameter=5.0 * DIAMETER))


def test_grains_glued_to_a_wall_are_the_wall():
    frame = frame_of(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), 0.5)
    frame.types[0] = 2
    free, kept, (wall,) = free_grains(frame, contacts_of(frame, [1, 2], [2, 3], [[-3.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]))
    assert free.ids.tolist() == [2, 3] and kept.ids.tolist() == [[2, 3]]
    np.testing.assert_allclose([wall.points[0], wall.positions[0], wall.forces[0]], [[0.5, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])


def controls_plug_flow(folder: Path) -> Iterator[Control]:
    flat = {"slip": 0.3, "decay": 0.8}
    right = measured(plug_flow(folder / "right", **flat))
    for name, change in {"a core that shears": {"tilt": 0.5}, "gravity 1 % too weak": {"lift": 0.99},
                         "velocities a twentieth above the displacements": {"faster": 1.05}}.items():
        yield Control(name, right, measured(plug_flow(folder / name, **flat, **change)))
    fast = restated(plug_flow(folder / "plate", **flat), base_speed=0.018)
    yield Control("a plate a tenth faster than prescribed", right, measured(fast))
    yield dried("plug_flow")
