"""What is measured of the plug flow finds what was put into synthetic runs, and does not pass what is wrong."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.common.errors import RunError
from dembark.input_decks.plug_flow import fluctuations
from dembark.input_decks.plug_flow.channel import Channel, Course, free_grains, read, unsteady
from dembark.input_decks.plug_flow.fluctuations import Motion, Seen
from dembark.input_decks.tests.measuring import Control, dried, measured, names
from dembark.input_decks.tests.synthetic import DIAMETER, plug_flow, restated
from dembark.postproc.replica import Replica
from dembark.postproc.tests.packings import contacts_of, frame_of
from dembark.validation.case.folders import find


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


def courses(seed: int, drift: float) -> list[Course]:
    """Of five packings, with a memory of ten rows and a standard deviation of 1: the mean changes by `drift` from the first row to the last
    one."""
    chance, rows = np.random.default_rng(seed), np.arange(200)
    found = []
    for _ in range(5):
        series = [chance.normal()]
        for _ in rows[1:]:
            series.append(0.9 * series[-1] + np.sqrt(0.19) * chance.normal())
        found.append(Course(100.0 + np.array(series) + drift * rows / 200.0, rows, np.arange(0, 200, 4)))
    return found


def test_the_mean_over_packings_decides_whether_the_flow_is_steady():
    """Of steady flow one of five packings seems to drift more often than their mean; a drift of twice the standard deviation shows in the
    mean more than twice as often as in one packing."""
    runs = {drift: [courses(seed, drift) for seed in range(100)] for drift in (0.0, 2.0)}
    alone = {drift: np.mean([bool(one[0].steady_part()[1]) for one in found]) for drift, found in runs.items()}
    any_alone = np.mean([any(one.steady_part()[1] for one in found) for found in runs[0.0]])
    together = {drift: np.mean([bool(unsteady(found)) for found in of_drift]) for drift, of_drift in runs.items()}
    assert together[0.0] < 0.5 * any_alone and together[2.0] > 2.0 * alone[2.0]


# Steps from frame to frame, in d: streamwise and transverse.
WALK = (0.0092, 0.004)


def walked(folder: Path, **change: Any) -> Path:
    """Three replicas whose grains walk at a front and a rear wall; the engine's folder."""
    written = [plug_flow(folder, replica=number, seed=number, **{"slip": 0.2, "walk": WALK} | change) for number in (1, 2, 3)]
    return written[-1]


def test_grains_behind_glass_wander_as_they_were_made_to(tmp_path):
    found = measured(walked(tmp_path))
    for name in ("anisotropy", "anisotropy_core", "anisotropy_layer"):
        assert found[name]["value"] == pytest.approx(2.3, rel=0.05)
    # Coefficients are in the ratio of the squares.
    assert found["diffusion_ratio"]["value"] == pytest.approx(2.0 * np.log10(2.3), abs=0.1)
    assert found["core_variance"]["value"] == pytest.approx(1.0, rel=0.3)
    assert names(found, "pass") >= {"anisotropy", "diffusion_ratio", "distribution_difference", "tail_growth"}


def channel_in(folder: Path) -> Channel:
    """That of the one replica in the engine's `folder`."""
    replica = folder / "replica-1"
    return read(Replica(replica, json.loads((replica / "run.json").read_text())))


def test_the_shear_of_the_mean_flow_is_no_fluctuation(tmp_path):
    still = Motion.of(channel_in(plug_flow(tmp_path, slip=0.9, walk=(0.0, 0.0))))
    assert np.abs(still.moved[:, still.visible.all(axis=0)]).max() < 1e-3


def test_grains_inside_are_not_seen(tmp_path):
    """Of two layers, the second is inside when the rear wall is farther away."""
    one = channel_in(plug_flow(tmp_path, walk=WALK))
    near, far = (Motion.of(replace(one, depth=depth * DIAMETER)).visible.sum() for depth in (2.0, 6.0))
    assert far == pytest.approx(0.5 * near, rel=0.02) and far > 0


def test_a_run_shorter_than_diffusion_is_refused(tmp_path):
    one = Motion.of(channel_in(plug_flow(tmp_path, walk=WALK)))
    with pytest.raises(RunError, match="covers less than 9 d of the plate's travel, use more travel"):
        one.seen(9.0)


def test_a_channel_that_is_periodic_has_nothing_to_look_through(tmp_path):
    assert "anisotropy" not in measured(plug_flow(tmp_path))


def drawn(moves: Any, places: int = 10) -> Seen:
    """Displacements `moves` (k, 2) at random places of a channel 20 d wide."""
    random = np.random.default_rng(1)
    return Seen(moves, np.arange(len(moves)), 20.0 * random.integers(places, size=len(moves)) / places + 0.5, 20.0)


@pytest.mark.parametrize(("draw", "growth"), [
    (lambda random, shape: random.choice([-1.0, 1.0], shape) * random.random(shape) ** (-1.0 / 3.0), 1.0),
    (lambda random, shape: random.laplace(size=shape), 2.0)])
def test_tails_of_known_distributions(draw, growth):
    moves = draw(np.random.default_rng(0), (1_000_000, 2))
    assert fluctuations.tail_growth(drawn(moves)) == pytest.approx(growth, abs=0.1)


def test_the_tail_of_a_gaussian_distribution_is_no_power_law():
    assert fluctuations.tail_growth(drawn(np.random.default_rng(0).standard_normal((100_000, 2)))) > 3.0


@settings(max_examples=30, deadline=None)
@given(st.floats(1e-4, 1e2), st.floats(0.5, 4.0))
def test_scales_across_the_channel_change_no_distribution(size, ratio):
    random = np.random.default_rng(2)
    one = drawn(random.standard_t(3.0, (5_000, 2)))
    # Every cell has a size of its own, as where the shear varies.
    other = Seen(one.moves * (size * (1.0 + np.floor(one.place)))[:, None] * (ratio, 1.0), one.start, one.place, one.width)
    assert fluctuations.tail_growth(other) == pytest.approx(fluctuations.tail_growth(one), rel=1e-6)
    assert fluctuations.distribution_difference(other) == pytest.approx(fluctuations.distribution_difference(one), abs=1e-4)
    same = Seen(one.moves * size * (ratio, 1.0), one.start, one.place, one.width)
    assert fluctuations.anisotropy(same) == pytest.approx(ratio * fluctuations.anisotropy(one), rel=1e-9)


WALLED = {"grain_count": 120, "grain_diameter_spread": 0.1, "channel_width": 0.03, "channel_depth": 0.02, "ends": "walls",
          "wall_roughness": "rough", "settle_time": 0.3, "run_in": 0.2, "travel": 0.2, "base_speed": 0.02, "frames": 3}


@pytest.mark.parametrize("engine", find("plug_flow").engines)
def test_front_and_rear_walls_hold_the_grains(engine, simulate):
    one = simulate("plug_flow", engine, WALLED)
    for frame in one.grains():
        inside = frame.positions[:, 1] - 0.95 * frame.radii, WALLED["channel_depth"] - frame.positions[:, 1] - 0.95 * frame.radii
        assert min(side.min() for side in inside) > 0.0 and not frame.periodic[1]
    rows = one.times()
    rest = (rows["time"] > 0.25) & (rows["time"] < 0.3)
    front, rear = (rows[f"{name}_fy"][rest].mean() for name in ("front", "rear"))
    assert front > 0.0 and front == pytest.approx(-rear, rel=0.1)


def controls_plug_flow(folder: Path) -> Iterator[Control]:
    flat = {"slip": 0.3, "decay": 0.8}
    right = measured(plug_flow(folder / "right", **flat))
    for name, change in {"a core that shears": {"tilt": 0.5}, "gravity 1 % too weak": {"lift": 0.99},
                         "velocities a twentieth above the displacements": {"faster": 1.05}}.items():
        yield Control(name, right, measured(plug_flow(folder / name, **flat, **change)))
    fast = restated(plug_flow(folder / "plate", **flat), base_speed=0.018)
    yield Control("a plate a tenth faster than prescribed", right, measured(fast))
    seen = measured(walked(folder / "seen"))
    for name, change in {"isotropic fluctuations": {"walk": (WALK[0], WALK[0])},
                         "Gaussian fluctuations": {"gaussian": np.inf},
                         "Gaussian fluctuations in the layers alone": {"gaussian": 3.0}}.items():
        yield Control(name, seen, measured(walked(folder / name, **change)))
    yield dried("plug_flow")
