"""LAMMPS, in the program lammps-dembark: stock LAMMPS with dembark's styles, and an MPI of its own."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path

from dembark.common.errors import DembarkError

from .base import EngineFacts
from .input_script import InputScript
from .lammps_package import Package


class Lammps(InputScript):
    """LAMMPS's input script; MPI ranks of the MPICH that LAMMPS was built with."""

    facts = EngineFacts.read("lammps")

    @classmethod
    def locate(cls) -> Path:
        """As of all engines, else the LAMMPS of this Python's environment; its plugin is built when it is asked for the first time."""
        try:
            return super().locate()
        except DembarkError:
            if not (package := cls._package()):
                raise
        return package.build()

    @classmethod
    def pending(cls) -> str:
        """The Python package of LAMMPS when no plugin has been built for it yet."""
        try:
            super().locate()
        except DembarkError:
            package = cls._package()
            if package and not package.launcher.is_file():
                if missing := package.missing_tools():
                    raise DembarkError(f"LAMMPS {package.version} in {package.folder}", "its plugin cannot be built", missing) from None
                return f"LAMMPS {package.version} in {package.folder}; the first run builds its plugin"
        return ""

    @classmethod
    def _package(cls) -> Package | None:
        # A program that the environment names wrongly is an error.
        return None if any(map(os.environ.get, cls.facts.variables)) else Package.find()

    def launcher(self, ranks: int) -> list[str]:
        """Words that start `ranks` processes: those that DEMBARK_LAMMPS_MPIRUN names, else the `lammps-mpiexec` next to the program."""
        # Another MPI's launcher would start as many runs of one process each.
        if os.environ.get(self.facts.launcher):
            return super().launcher(ranks)
        return [str(self.executable.with_name("lammps-mpiexec")), "-n", str(ranks)]

    def own_files(self) -> Iterable[Path]:
        """The launcher of LAMMPS, the program that it starts with its library, and the plugin that it loads."""
        started = re.findall(rb'^exec "(/[^"]+)"', self.executable.read_bytes(), re.MULTILINE)
        programs = [path for text in started if (path := Path(os.fsdecode(text))).is_file()]
        return [*super().own_files(), *programs, *(library for program in programs for library in self.libraries(program)),
                *self.executable.parent.parent.glob("lammps/plugin/*.so")]

    def build_folders(self) -> Iterable[Path]:
        """The plugin is built in `lammps` next to the folder of the program."""
        return [self.executable.parent.parent / "lammps"]
