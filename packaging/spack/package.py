"""A Spack recipe of dembark. NOT TRIED with Spack: only its syntax was checked.

Spack 1.0 or newer reads it from a repository of yours: `spack repo create`, then copy this file to `packages/dembark/package.py` there. The
source is a checkout, because there is no archive of a release that a recipe could name:

    spack env activate --create dembark
    spack add dembark@1.0.0 +lammps
    spack develop --path /path/to/checkout dembark@1.0.0
    spack install

The package is called `dembark` and not `py-dembark`: it installs programs, also of engines without Python. packaging/tests/test_recipes.py
compares version and requirements with pyproject.toml.
"""

import os
from pathlib import Path

from spack.package import InstallError, depends_on, join_path, run_after, variant, version, which
from spack.package import license as license_of
from spack_repo.builtin.build_systems.python import PythonPackage


class Dembark(PythonPackage):
    """Contact laws, impact solver and validation harness for the DEM codes LIGGGHTS, YADE and LAMMPS."""

    license_of("GPL-2.0-or-later")

    # Without a checksum: `spack develop` names the source.
    version("1.0.0")

    variant("fields", default=False, description="Fields in NetCDF, files for ParaView and pictures")
    variant("report", default=False, description="Figures and the report in HTML; report.pdf needs WeasyPrint, which is not part of Spack")
    variant("lammps", default=False, description="lammps-dembark: a program over Spack's LAMMPS")
    variant("liggghts", default=False, description="liggghts-dembark, compiled from LIGGGHTS_SRC, the folder src of LIGGGHTS-PUBLIC 3.8.0")
    variant("yade", default=False, description="YADE with dembark's classes, from YADE_PREFIX and YADE_SOURCE_DIR")

    depends_on("cxx", type="build")
    depends_on("python@3.11:", type=("build", "run"))
    depends_on("py-scikit-build-core@1.0:", type="build")
    depends_on("py-nanobind@2.4:", type="build")
    depends_on("cmake@3.22:", type="build")
    depends_on("ninja", type="build")
    depends_on("eigen@3.4", type="build")

    depends_on("py-numpy@2:", type=("build", "run"))
    depends_on("py-scipy", type=("build", "run"))
    depends_on("py-pandas", type=("build", "run"))
    depends_on("py-mdanalysis@2.9:", type=("build", "run"))
    depends_on("py-filelock@4:", type=("build", "run"))
    depends_on("py-jinja2", type=("build", "run"))
    depends_on("py-pint", type=("build", "run"))
    depends_on("py-rich", type=("build", "run"))
    depends_on("py-typer", type=("build", "run"))

    depends_on("py-xarray", type="run", when="+fields")
    depends_on("py-h5netcdf", type="run", when="+fields")
    depends_on("py-h5py", type="run", when="+fields")
    depends_on("py-pyvista", type="run", when="+fields")
    depends_on("py-matplotlib", type="run", when="+report")

    # The first release that fits; docs/how-to/lammps_build.md says which were tested.
    depends_on("lammps@20240829: +lib+mpi", when="+lammps")
    depends_on("mpi", when="+lammps")
    depends_on("mpi", when="+liggghts")

    import_modules = ("dembark.physics", "dembark.postproc")

    def build(self, name, folder, *targets, **options):
        """Configure and build `folder` of the checkout by CMake; returns the folder of the build, which Git ignores in a checkout."""
        cmake = which("cmake", required=True)
        build = join_path(self.stage.source_path, "build", f"spack-{name}")
        cmake("-G", "Ninja", "-S", join_path(self.stage.source_path, folder), "-B", build, "-DCMAKE_BUILD_TYPE=Release",
              *(f"-D{key}={value}" for key, value in options.items()))
        cmake("--build", build, *(word for target in targets for word in ("--target", target)))
        return build

    def from_environment(self, name, holds):
        """The folder that an environment variable names; `holds` is a file in it."""
        folder = Path(os.environ.get(name, ""))
        if not (folder / holds).is_file():
            raise InstallError(f"{name}='{folder}' has no {holds}; docs/how-to/cluster.md says what to set it to")
        return folder.resolve()

    @run_after("install")
    def install_engines(self):
        """Build the styles and classes of the engines, as `make lammps`, `make liggghts` and `make yade-plugin` do."""
        if self.spec.satisfies("+lammps"):
            self.build("lammps", "plugins/lammps", LAMMPS_INSTALLED="ON", DEMBARK_BIN=self.prefix.bin)
        if self.spec.satisfies("+liggghts"):
            build = self.build("liggghts", ".", "liggghts-dembark", DEMBARK_PYTHON="OFF", DEMBARK_TESTS="OFF",
                               LIGGGHTS_SOURCE_DIR=self.from_environment("LIGGGHTS_SRC", "Make.sh"), CMAKE_INSTALL_PREFIX=self.prefix,
                               CMAKE_INSTALL_RPATH=self.prefix.lib, CMAKE_INSTALL_RPATH_USE_LINK_PATH="ON")
            which("cmake", required=True)("--install", build, "--component", "engines")
        if self.spec.satisfies("+yade"):
            self.build("yade", "plugins/yade", YADE_PREFIX=self.from_environment("YADE_PREFIX", "bin/yade"),
                       YADE_SOURCE_DIR=self.from_environment("YADE_SOURCE_DIR", "core/Scene.hpp"), DEMBARK_OVERLAY=self.overlay)

    @property
    def overlay(self):
        """The folder of YADE with dembark's classes."""
        return join_path(self.prefix, "yade-overlay")

    def setup_run_environment(self, env):
        """Name the engines for `dembark`."""
        if self.spec.satisfies("+lammps"):
            env.set("DEMBARK_LAMMPS", join_path(self.prefix.bin, "lammps-dembark"))
        if self.spec.satisfies("+liggghts"):
            env.set("DEMBARK_LIGGGHTS", join_path(self.prefix.bin, "liggghts-dembark"))
        if self.spec.satisfies("+yade"):
            env.set("DEMBARK_YADE", self.overlay)
