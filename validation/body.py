"""The command `dembark body`: a rigid body of spheres from a closed surface of triangles."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from dembark.common.choices import pick
from dembark.common.errors import DembarkError
from dembark.common.files import write_atomic
from dembark.postproc.cli_options import STL_UNITS, positive
from dembark.validation import engines

if TYPE_CHECKING:
    from dembark.input_decks.common import bodies

app = typer.Typer()


@app.command()
def body(
    surface: Annotated[Path, typer.Argument(metavar="FILE.stl", help="A closed surface, text or binary.")],
    engine: Annotated[str, typer.Option(help=f"One of {', '.join(engines.names())}.")],
    density: Annotated[float, typer.Option(parser=positive("kg/m^3", "--density"), metavar="TEXT", help="Of the body: '2500 kg/m^3'.")],
    out: Annotated[Path, typer.Option(help="Folder for the files.")],
    spheres: Annotated[int | None, typer.Option(min=2, help=(
        "So many spheres of different sizes, which touch the surface from inside."))] = None,
    along: Annotated[int | None, typer.Option(min=1, max=200, help=(
        "Or equal spheres on a cubic lattice along x, y and z: so many along the longest side of the box around the body."))] = None,
    spacing: Annotated[float | None, typer.Option(parser=positive("m", "--spacing"), metavar="TEXT", help=(
        "Or equal spheres at this distance: '2 mm'."))] = None,
    unit: Annotated[str, typer.Option(help=f"Unit of the file: {', '.join(STL_UNITS)}.")] = "m",
    principal: Annotated[bool, typer.Option("--principal", help=(
        "Turn the principal axes to x, y and z, the smallest moment first."))] = False,
    place: Annotated[str | None, typer.Option("--at", metavar="X,Y,Z", help=(
        "Centre of mass in m; default: as in the file, with --principal the origin."))] = None,
    name: Annotated[str | None, typer.Option(help="Name in files and scripts; default: that of the file.")] = None,
) -> None:
    """Write a rigid body of spheres for an engine, with the mass and the inertia of what a closed surface encloses."""
    from dembark.input_decks.common import bodies
    pick(engine, engines.names(), "engine", "in --engine")
    pick(unit, tuple(STL_UNITS), "unit", "in --unit")
    if sum(one is not None for one in (spheres, along, spacing)) != 1:
        raise DembarkError("how the body is filled is not clear", "", "give one of --spheres, --along and --spacing")
    called = name if name is not None else re.sub(r"\W", "_", surface.stem)
    if not re.fullmatch(r"[A-Za-z]\w*", called, re.ASCII):
        raise DembarkError(f"{called!r} is no name for scripts", "", "give one of letters, digits and _, a letter first, with --name")
    at = _place(place)
    given = bodies.read_body(surface, STL_UNITS[unit])
    mesh = given.turned() if principal else given
    size = float(np.ptp(mesh.points, axis=0).max())
    filled = bodies.covering(mesh, spheres) if spheres else bodies.voxels(mesh, spacing or size / (along or 1))
    if len(filled.radii) < 2:
        raise DembarkError("there is one sphere in the body", "", "take more, or a sphere of the engine")
    centre, inertia = mesh.mass.centre, density * mesh.mass.inertia
    x, y, z = centre.tolist()
    rows = np.column_stack([filled.centres - centre, filled.radii]).tolist()
    made = engines.RigidBody(
        called, density * mesh.mass.volume, tuple((a, b, c) for a, b, c in inertia.tolist()), at or (x, y, z),
        tuple((a, b, c, r) for a, b, c, r in rows), bodies.is_principal(inertia), spheres is None)
    quality = bodies.fit(mesh, filled)
    texts = {out / file: text for file, text in engines.engine_class(engine).body_files(made).items()}
    if there := [path for path in texts if path.exists()]:
        raise DembarkError(f"{there[0]} is there already", "", "name another folder, or another --name")
    try:
        out.mkdir(parents=True, exist_ok=True)
        files = [write_atomic(path, text.encode()) for path, text in texts.items()]
    except OSError as error:
        raise DembarkError(f"cannot write to {out}", error.strerror or str(error)) from None
    print("\n".join([*_lines(given, quality, made), *(f"written: {file}" for file in files)]))


def _place(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    try:
        x, y, z = map(float, text.split(","))
    except ValueError:
        raise DembarkError(f"--at {text}", "it is no place", "give three numbers in m, such as 0,0,0.1") from None
    return x, y, z


def _lines(given: bodies.Mesh, fit: bodies.Fit, made: engines.RigidBody) -> list[str]:
    """What the body is, and how well the spheres fit it."""
    few, most = min(radius for *_, radius in made.spheres), max(radius for *_, radius in made.spheres)
    sizes = f"radius {most:.4g} m" if most == few else f"radii {few:.4g} to {most:.4g} m"
    loose = f"note: the surface encloses {given.pieces} pieces apart from each other, which move as one rigid body"
    return [
        *([loose] if given.pieces > 1 else []),
        f"surface: {len(given.faces)} triangles, closed; volume {given.mass.volume:.9g} m3",
        f"mass {made.mass:.9g} kg; centre of mass in the file {' '.join(f'{x:.9g}' for x in given.mass.centre)} m",
        f"inertia (kg m2) xx yy zz xy xz yz: {' '.join(f'{x:.6g}' for x in made.moments)}",
        f"{len(made.spheres)} spheres, {sizes}; volume of their union {100.0 * fit.volume_ratio:.1f} % of the body's",
        f"the surface is up to {fit.short:.3g} m outside of them (rms {fit.rms:.3g} m), they reach up to {fit.beyond:.3g} m out of it",
    ]
