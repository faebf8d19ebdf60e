"""Optional libraries by the extra of the package that installs them, `pip install '.[fields]'`."""

from __future__ import annotations

from .errors import DembarkError

EXTRAS = {**dict.fromkeys(("xarray", "h5netcdf", "h5py", "pyvista", "vtkmodules"), "fields"),
          **dict.fromkeys(("matplotlib", "mpl_toolkits", "PIL", "weasyprint"), "report"),
          **dict.fromkeys(("SALib", "emcee", "sklearn"), "campaigns")}


def install_line(extra: str) -> str:
    """How to install an extra: from the sources, for no package index has dembark."""
    return f"pip install '.[{extra}]' in dembark's source folder"


def advice(error: Exception) -> tuple[str, ...]:
    """The library of an extra that an import did not find, and how to install it, as parts of an error line; empty for other errors."""
    name = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    return (f"{name} is not installed", install_line(EXTRAS[name])) if name in EXTRAS else ()


def missing_extra(error: ModuleNotFoundError, what: str) -> DembarkError:
    """The error for `what`, which needs a library of an extra; raises `error` itself for any other module."""
    if not (found := advice(error)):
        raise error
    return DembarkError(f"{what} needs another package", *found)
