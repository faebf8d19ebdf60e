"""Optional libraries by the extra of the package that installs them, `pip install 'dembark[fields]'`."""

from __future__ import annotations

from dembark.common.errors import DembarkError

EXTRAS = {**dict.fromkeys(("xarray", "h5netcdf", "h5py", "pyvista", "vtkmodules", "threadpoolctl"), "fields"),
          **dict.fromkeys(("matplotlib", "mpl_toolkits", "PIL", "weasyprint"), "report")}


def missing_extra(error: ModuleNotFoundError, what: str) -> DembarkError:
    """One line for `what` that needs a library of an extra; raises `error` itself where the module is none of these."""
    name = (error.name or "").partition(".")[0]
    if name not in EXTRAS:
        raise error
    return DembarkError(f"{what} needs {name}", "which is not installed", f"pip install 'dembark[{EXTRAS[name]}]'")
