"""Fields of the cases find what was put into synthetic runs, and conserve what they must."""

import json

import numpy as np
import pytest
import xarray
from dembark.postproc import ContactFrame
from dembark.postproc.fields.coarse_graining import WallContacts
from dembark.validation.checks import fields_axial as axial
from dembark.validation.checks.fields_axial import Rings
from dembark.validation.checks.fields_channel import free_grains
from dembark.validation.checks.fields_result import labelled, variable, write
from dembark.validation.checks.run import once
from dembark.validation.metrics import measure, replicas
from dembark.validation.verification import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import DIAMETER, plug_flow, silo


@pytest.fixture(scope="module")
def measured_silo(tmp_path_factory):
    folder = silo(tmp_path_factory.mktemp("silo"), k=0.8, friction=0.25, noise=0.02)
    return {one["name"]: one for one in measure(folder)["quantities"]}, xarray.load_dataset(folder / "fields.nc", engine="h5netcdf")


def test_silo_has_its_fields_beside_its_metrics(measured_silo):
    found, fields = measured_silo
    assert fields.attrs["kind"] == "silo" and fields.attrs["width"] == DIAMETER
    assert {fields[name].attrs["units"] for name in ("stress_zz", "stress_rr", "stress_zr")} == {"Pa"}
    # The whole mass is in the rings, and the field's section carries what Janssen's law says.
    volume = np.pi * np.diff(fields.radius_bounds.values**2).ravel()[:, None] * np.diff(fields.height_bounds.values).ravel()
    assert float((fields.density.values * volume).sum()) == pytest.approx(found["filled_mass"]["value"], rel=1e-12)
    lower = (fields.height.values > 2 * DIAMETER) & (fields.height.values < 0.5 * fields.attrs["filling_height"])
    np.testing.assert_allclose(fields.stress_zz_section.values[lower], fields.janssen.values[lower], rtol=0.03)
    assert found["field_janssen_deviation"]["verdict"] == "pass"


def test_silo_wall_patches_carry_the_engines_wall_force(measured_silo):
    found, fields = measured_silo
    assert found["wall_force_deviation"]["verdict"] == "pass"
    assert abs(found["wall_force_deviation"]["value"]) < 1e-6
    held = np.isfinite(fields.wall_normal.values)
    assert fields.wall_shear.values[held].sum() == pytest.approx(0.25 * fields.wall_normal.values[held].sum(), rel=1e-6)


def test_silo_whose_wall_force_is_lost_in_the_history_does_not_pass(tmp_path):
    found = {one["name"]: one for one in measure(silo(tmp_path, lost_wall_force=0.02))["quantities"]}
    assert found["wall_force_deviation"]["verdict"] == "fail"


def test_channel_gives_back_velocity_slope_and_temperature(tmp_path):
    folder = plug_flow(tmp_path, slip=0.4, decay=2.0, noise=0.02)
    found = {one["name"]: one for one in measure(folder)["quantities"]}
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


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.5), st.floats(0.03, 0.4))
def test_rings_conserve_mass_wherever_grains_are(seed, width, spacing):
    random = np.random.default_rng(seed)
    place = random.uniform(-1.2, 1.2, (30, 3))
    frame = scenes.grains(place, random.uniform(0.01, 0.1, 30), low=-np.ones(3), high=np.ones(3))
    rings = Rings.around(1.0, 1.0, width, spacing)
    none = np.zeros((0, 3))
    links = ContactFrame(0, none, none, none, np.zeros((0, 2), np.int64))
    fields, _ = axial.coarse_grain(frame, links, [WallContacts(none, none, none)], rings, np.ones((len(rings.heights), 1)),
                                   lambda places: np.ones((len(places), 1)))
    assert fields.mass.sum() == pytest.approx(frame.masses.sum(), rel=1e-12)


def test_rings_average_a_column_of_pressure():
    """Many vertical lines spread evenly over a cylinder: sigma_zz is uniform in it, and nothing else is there."""
    random = np.random.default_rng(3)
    count, radius = 1000, 1.0
    r, turn = radius * np.sqrt((np.arange(count) + 0.5) / count), random.uniform(0.0, 2.0 * np.pi, count)
    first = np.column_stack([r * np.cos(turn), r * np.sin(turn), np.zeros(count)])
    branch, forces = np.tile([0.0, 0.0, 1.0], (count, 1)), np.tile([0.0, 0.0, -1.0], (count, 1))
    frame = scenes.grains(first[:1], np.array([0.1]), low=-np.ones(3), high=np.ones(3))
    links = ContactFrame(0, first, branch, forces, np.zeros((count, 2), np.int64))
    rings = Rings.around(radius, 1.0, 0.1, 0.1)
    none = np.zeros((0, 3))
    fields, _ = axial.coarse_grain(frame, links, [WallContacts(none, none, none)], rings, np.ones((len(rings.heights), 1)),
                                   lambda places: np.ones((len(places), 1)))
    inside = np.ix_(rings.radii < 0.6, (rings.heights > 0.4) & (rings.heights < 0.6))
    np.testing.assert_allclose(fields.mean("zz", rings)[inside], count / np.pi, rtol=5e-3)
    np.testing.assert_allclose(fields.mean("rr", rings), 0.0, atol=1e-12)
    # Over what the kernel sees inside, it is uniform up to the wall.
    edge = rings.radii < radius
    np.testing.assert_allclose((fields.mean("zz", rings) / rings.coverage)[edge][:, inside[1].ravel()], count / np.pi, rtol=0.01)


def test_grains_glued_to_a_wall_are_the_wall():
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    frame = scenes.grains(place, np.full(3, 0.5), low=-np.ones(3), high=np.full(3, 3.0))
    frame.types[0] = 2
    pairs = np.array([[0, 1], [1, 2]])
    links = scenes.contacts(place[pairs[:, 0]], np.tile([1.0, 0.0, 0.0], (2, 1)), np.array([[-3.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]), pairs)
    free, kept, (wall,) = free_grains(frame, links)
    assert free.ids.tolist() == [2, 3] and kept.ids.tolist() == [[2, 3]]
    np.testing.assert_allclose(wall.points, [[0.5, 0.0, 0.0]])
    np.testing.assert_allclose(wall.positions, [[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(wall.forces, [[3.0, 0.0, 0.0]])


def test_fields_are_written_whole_or_not_at_all(tmp_path):
    dataset = labelled({"a": variable(["x"], np.arange(3.0), "m", "a length")}, {}, kind="none")
    path = write(tmp_path, dataset)
    assert [one.name for one in tmp_path.iterdir()] == ["fields.nc"]
    assert xarray.load_dataset(path, engine="h5netcdf").a.attrs == {"units": "m", "long_name": "a length"}
    with pytest.raises((TypeError, ValueError)):
        write(tmp_path, labelled({"a": (("x",), np.array([object()]), {})}, {}))
    assert [one.name for one in tmp_path.iterdir()] == ["fields.nc"]


def test_a_run_is_read_once(tmp_path):
    (replica,) = replicas(silo(tmp_path))
    calls = []
    read = once(lambda one: calls.append(one) or len(calls))
    assert read(replica) == read(replica) == 1
    assert json.loads((replica.folder / "run.json").read_text())["replica"] == 1


@pytest.mark.parametrize("height", [0.01, 0.0118])
def test_what_flows_through_the_borders_is_what_the_layers_gain(height):
    """Also in the outermost layers, which hold all that the kernel carries beyond them."""
    width = 0.005
    rings = Rings.around(0.02, height, width, 0.5 * width)
    node, weight = np.polynomial.legendre.leggauss(40)
    for low, high in ((0.0, 0.5 * width), (height, height + width)):
        before, after = (rings.along(np.array([place]))[0][0] for place in (low, high))
        places, weights = low + 0.5 * (high - low) * (node + 1.0), 0.5 * (high - low) * weight
        flow = weights @ rings.along(places)[1]
        np.testing.assert_allclose(after - before, -np.diff(flow), rtol=0.0, atol=1e-9)
    assert (rings.across(np.array([0.019]))[3][:, -1] == 0.0).all()
