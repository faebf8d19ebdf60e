"""Fields, walls and grains as files: NetCDF for analysis with xarray, VTK files for ParaView."""

from .netcdf import dataset, joined, wall_dataset, write_netcdf
from .paraview import TimeSeries, write_fields, write_grains, write_wall

__all__ = ["TimeSeries", "dataset", "joined", "wall_dataset", "write_fields", "write_grains", "write_netcdf", "write_wall"]
