"""Fields, walls and grains as files: NetCDF for analysis with xarray, VTK files for ParaView."""
