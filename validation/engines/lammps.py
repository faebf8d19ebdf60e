"""LAMMPS, in the program lammps-dembark: stock LAMMPS with dembark's styles, and an MPI of its own."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable
from pathlib import Path

from dembark.common.errors import DembarkError

from .base import EngineFacts, RigidBody
from .input_script import InputScript, row
from .lammps_package import Package


class Lammps(InputScript):
    """LAMMPS's input script; MPI ranks of the MPICH that LAMMPS was built with."""

    facts = EngineFacts.read("lammps")

    @classmethod
    def body_files(cls, body: RigidBody) -> dict[str, str]:
        """See Engine: a molecule, commands that make one at the body's centre, and the file `infile` of its `fix rigid/small`."""
        sections = {"Coords": (sphere[:3] for sphere in body.spheres), "Diameters": ([2.0 * sphere[3]] for sphere in body.spheres),
                    "Masses": ([body.density * 4.0 / 3.0 * math.pi * sphere[3] ** 3] for sphere in body.spheres)}
        lines = [f"# {body.about()}", "", f"{len(body.spheres)} atoms", f"{body.mass!r} mass", "0 0 0 com", f"{row(body.moments)} inertia"]
        for title, rows in sections.items():
            lines += ["", title, "", *(f"{number} {row(one)}" for number, one in enumerate(rows, 1))]
        lines += ["", "Types", "", *(f"{number} 1" for number in range(1, len(body.spheres) + 1))]
        # The number of the molecule, that of the first which create_atoms makes; no velocity, no angular momentum, no image flags.
        made = f"1 {body.mass!r} {row(body.centre)} {row(body.moments)} 0 0 0 0 0 0 0 0 0"
        # Of a molecule, create_atoms puts the mean of the atoms there.
        place = row(x + sum(sphere[axis] for sphere in body.spheres) / len(body.spheres) for axis, x in enumerate(body.centre))
        name = body.name
        commands = f"""\
# {body.about()}
# One of them; fix ID GROUP rigid/small molecule infile {name}.infile moves it. The variable, if it is set before, is added to its type, 1.
variable {name}_type_offset index 0
molecule {name} {name}.mol
create_atoms ${{{name}_type_offset}} single {place} mol {name} 1 rotate 0 0 0 1 units box
"""
        return {f"{name}.mol": "\n".join(lines) + "\n", f"{name}.infile": f"# {body.about()}\n1\n{made}\n",
                f"{name}-lammps.in": commands}

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
