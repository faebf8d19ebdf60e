"""Fields, walls and grains as files: NetCDF for analysis with xarray, VTK files for ParaView."""

from .netcdf import cf_dataset, dataset, joined, variable, wall_dataset, with_interval, write_netcdf
from .paraview import TimeSeries, write_fields, write_grains, write_wall

__all__ = ["TimeSeries", "cf_dataset", "dataset", "joined", "variable", "wall_dataset", "with_interval", "write_fields", "write_grains",
           "write_netcdf", "write_wall"]
