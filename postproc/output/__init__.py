"""Fields, walls and grains as files: NetCDF for analysis with xarray, VTKHDF for ParaView."""

from dembark.postproc.output.netcdf import FieldsNetcdf, dataset, wall_dataset, write_netcdf, write_wall_netcdf
from dembark.postproc.output.vtkhdf import FieldsVtkhdf, GrainsVtkhdf, write_vtkhdf, write_vtkhdf_grains, write_vtkhdf_wall

__all__ = ["FieldsNetcdf", "FieldsVtkhdf", "GrainsVtkhdf", "dataset", "wall_dataset", "write_netcdf", "write_vtkhdf", "write_vtkhdf_grains",
           "write_vtkhdf_wall", "write_wall_netcdf"]
