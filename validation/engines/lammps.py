"""LAMMPS, in the program lammps-dembark: stock LAMMPS with dembark's styles, and an MPI of its own."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path

from .base import EngineFacts
from .input_script import InputScript


class Lammps(InputScript):
    """LAMMPS's input script; MPI ranks of the MPICH that LAMMPS was built with."""

    facts = EngineFacts.read("lammps")

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
