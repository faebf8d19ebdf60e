"""YADE, in an overlay of links to the system's YADE and dembark's plugin and Python module."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from dembark.common.choices import Value
from dembark.common.errors import DembarkError

from .base import DECK_NOTE, DeckNumber, Engine, EngineFacts, RigidBody, texts

# Features of YADE's build, and what needs them.
_FEATURES = {"VTK": "VTKRecorder", "QT5": "yade.qt, SnapshotEngine", "GTS": "pack.gtsSurface2Facets", "CGAL": "TesselationWrapper",
             "PFVFLOW": "FlowEngine"}


_BODY = '''"""{about}

    import sys
    sys.path.append("folder of this file")
    import {name}_body
    number, members = {name}_body.add()
"""

from yade import Body, Matrix3, O, Quaternion, Vector3, utils

MASS = {mass!r}  # kg
CENTRE = Vector3{centre!r}  # m, where the file has the centre of mass
INERTIA = Matrix3(*(number for row in {inertia!r} for number in row))  # kg m^2, about it

# x, y, z from the centre of mass, radius (m)
SPHERES = (
{rows})


def add(position=CENTRE, orientation=Quaternion.Identity, material=-1):
    """A clump with its centre of mass at `position`, turned by `orientation`; its number, and those of its spheres."""
    position = Vector3(*position)
    spheres = [utils.sphere(position + orientation * Vector3(x, y, z), r, material=material) for x, y, z, r in SPHERES]
    volume = sum(r**3 for _, _, _, r in SPHERES)
    # YADE sums up the inertia of members: that of one without a volume, while spheres have no density. It is taken out at once.
    axes, moments = INERTIA.spectralDecomposition()
    core = utils.box(position, (1e-9, 1e-9, 1e-9), material=material)
    core.state.mass, core.state.inertia = MASS, moments
    core.state.ori = orientation * Quaternion(axes if axes.determinant() > 0 else -axes)
    shared, density = spheres[0].mat, spheres[0].mat.density
    shared.density = 0
    number, members = O.bodies.appendClumped([core, *spheres])
    shared.density = density
    O.bodies.erase(members[0])
    for sphere, (_, _, _, r) in zip(spheres, SPHERES):
        sphere.state.mass = MASS * r**3 / volume
        sphere.state.inertia = Vector3(1, 1, 1) * (0.4 * sphere.state.mass * r**2)
    return number, members[1:]
'''


class Yade(Engine):
    """YADE's Python script with words `key=value`; one process, threads."""

    facts = EngineFacts.read("yade")

    @classmethod
    def body_files(cls, body: RigidBody) -> dict[str, str]:
        """See Engine: a module whose function `add` makes the clump."""
        rows = "".join(f"    {sphere!r},\n" for sphere in body.spheres)
        text = _BODY.format(about=body.about(), name=body.name, mass=body.mass, centre=body.centre, inertia=body.inertia, rows=rows)
        return {f"{body.name}_body.py": text}

    @property
    def prefix(self) -> Path:
        """Folder of the overlay, with `bin` and `lib`."""
        return self.executable.parent.parent

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        """See Engine. The numbers take the place of the line `p = dembark.parameters()`."""
        lines = [f"# {DECK_NOTE}", "p = dembark.parameters("]
        lines += [f"    {name}={number.value!r}," + (f"  # {number.meaning}" if number.meaning else "") for name, number in numbers.items()]
        before, marker, after = source.partition("p = dembark.parameters()\n")
        if not marker:
            raise DembarkError("the deck has no line 'p = dembark.parameters()'", cls.facts.deck, "add it where the numbers belong")
        return before + "\n".join([*lines, ")"]) + "\n" + after

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        """See Engine; DembarkError for more than one rank."""
        self.facts.check_ranks(ranks)
        return [str(self.executable), f"-j{threads}", "-n", "-x", str(deck), *(f"{key}={value}" for key, value in texts(values).items())]

    def environment(self, threads: int = 1) -> dict[str, str]:
        """See Engine; it runs with the system's Python."""
        result = super().environment(threads)
        return result | {"YADE_PREFIX": str(self.prefix), "PATH": "/usr/bin:" + result.get("PATH", "")}

    def own_files(self) -> Iterable[Path]:
        """The program, YADE's libraries and dembark's part of the overlay."""
        # The overlay consists of links to YADE's own files; what is no link, or carries our name, is dembark's.
        return [self.executable, *(path for suffix in ("*.so", "*.py") for path in (self.prefix / "lib").rglob(suffix)
                                   if path.is_file() and (not path.is_symlink() or "dembark" in path.name or path.match("lib*.so")))]

    def missing_parts(self) -> Iterable[str]:
        """See Engine; its start script names the features."""
        script = self.executable.read_text(encoding="utf-8", errors="replace")
        named = re.search(r"(?m)^features,version,debugbuild='([^']*)'", script)
        return [f"{name} ({needed_by})" for name, needed_by in _FEATURES.items() if named and name not in named[1].split()]

    def build_folders(self) -> Iterable[Path]:
        """The plugin is built in `yade` next to the overlay."""
        return [self.prefix.parent / "yade"]
