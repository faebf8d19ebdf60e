"""Fields, walls and grains as files: NetCDF for analysis with xarray, VTK files for ParaView."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .netcdf import dataset, joined, wall_dataset, write_netcdf

if TYPE_CHECKING:
    from .paraview import TimeSeries, write_fields, write_grains, write_wall

__all__ = ["TimeSeries", "dataset", "joined", "wall_dataset", "write_fields", "write_grains", "write_netcdf", "write_wall"]


def __getattr__(name: str) -> Any:
    """What writes for ParaView, when it is asked for: pyvista takes longer to import than all else together."""
    if name in __all__:
        return getattr(import_module(".paraview", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
