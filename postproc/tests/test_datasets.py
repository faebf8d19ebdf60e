"""Datasets by the CF conventions, and their files."""

import numpy as np
import pytest
import xarray

from dembark.postproc.output import cf_dataset, variable, with_interval, write_netcdf
from dembark.postproc.statistics import Estimate


def test_fields_are_written_whole_or_not_at_all(tmp_path):
    dataset = cf_dataset({"a": variable(["x"], np.arange(3.0), "m", "a length")}, {}, kind="none")
    path = write_netcdf(tmp_path / "fields.nc", dataset)
    assert [one.name for one in tmp_path.iterdir()] == ["fields.nc"]
    assert xarray.load_dataset(path, engine="h5netcdf").a.attrs == {"units": "m", "long_name": "a length"}
    with pytest.raises((TypeError, ValueError)):
        write_netcdf(tmp_path / "fields.nc", cf_dataset({"a": (("x",), np.array([object()]), {})}, {}))
    assert [one.name for one in tmp_path.iterdir()] == ["fields.nc"]


def test_estimates_become_a_variable_and_its_half_width():
    rows = [[Estimate(1.0, 0.1), Estimate(2.0, 0.2)], [Estimate(3.0, 0.3), Estimate(4.0, np.inf)]]
    found = cf_dataset(with_interval("k", ["band", "radius"], rows, "1", "a ratio"), {}, kind="none")
    np.testing.assert_array_equal(found.k, [[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(found.k_half, [[0.1, 0.2], [0.3, np.inf]])
    assert found.k.attrs == {"units": "1", "long_name": "a ratio"} and found.k_half.dims == ("band", "radius")
