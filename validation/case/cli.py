"""The commands for cases: `dembark cases`, `deck`, `new-case`."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Annotated

import typer

from dembark.common.choices import pick
from dembark.common.errors import DembarkError
from dembark.validation import engines, show

from .deck import write
from .folders import discover, find, package_root, shipped_root
from .resolve import portable, resolve, settings

app = typer.Typer()


@app.command("cases")
def show_cases(case: Annotated[str | None, typer.Argument(help="Show the keys, profiles and variants of this case.")] = None) -> None:
    """List the cases, or show one in detail."""
    console = show.console()
    if case is None:
        console.print(show.case_table(discover().values()))
        return
    one = find(case)
    console.print(f"{one.name}: {one.title}\n{one.description}", markup=False)
    console.print(show.key_table(one))
    console.print(show.overrides_table(one))
    for source in one.source:
        console.print(f"source: {source}", markup=False)


@app.command()
def deck(
    case: Annotated[str, typer.Argument(help="Name of a case, see 'dembark cases'.")],
    engine: Annotated[str, typer.Option(help="Engine, see 'dembark doctor'.")],
    out: Annotated[Path, typer.Option(help="New or empty folder for the deck.")],
    profile: Annotated[str, typer.Option(help="Size of the run: quick, standard, full, ...")] = "quick",
    variant: Annotated[str | None, typer.Option(help="Variant of the case; default: the first one.")] = None,
    change: Annotated[list[str] | None,
                      typer.Option("--set", metavar="KEY=VALUE", help='Set a parameter: --set "grain_diameter=4 mm".')] = None,
) -> None:
    """Write a deck that runs without the harness. The folder holds the input script with all numbers, the packing and the meshes."""
    one = find(case)
    pick(engine, engines.names(), "engine", "in --engine")
    values = portable(resolve(one, profile, variant or next(iter(one.variants)), settings(change or ())))
    _empty(out)
    try:
        setup = write(one, engine, values, out)
    except OSError as error:
        raise DembarkError(f"cannot write to {out}", error.strerror or str(error)) from None
    facts = engines.facts(engine)
    if int(values.get("replicas") or 1) > 1 and "replicas" in settings(change or ()):
        print(f"note: a deck has one packing, here that of seed {values.get('seed')}; write one with another seed for each further packing")
    print(f"{out / facts.deck}: {setup.steps} steps of {setup.time_step:.6g} s. Run it in its folder: {facts.by_hand}")


def _empty(folder: Path) -> None:
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise DembarkError(f"{folder} is not empty", "", "name a new folder")


@app.command("new-case")
def new_case(
    name: Annotated[str, typer.Argument(help="Name of the case: lower-case letters, digits and underscores.")],
    folder: Annotated[Path, typer.Option("--in", help="Folder of your cases; the case gets a folder of its name in it.")] = Path(),
    template: Annotated[str, typer.Option(help="sphere: one sphere bounces, no set-up in Python. packing: many grains settle.")] = "sphere",
) -> None:
    """Write a template of a case that runs."""
    templates = {path.name: path for path in (package_root() / "common" / "template").iterdir() if path.is_dir()}
    pick(template, templates, "template", "in --template")
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise DembarkError(f"{name!r} is not a name of a case", "", "take lower-case letters, digits and underscores, a letter first")
    if (shipped_root() / name).exists():
        raise DembarkError(f"a case {name} comes with dembark", "", "choose another name")
    target = folder / name
    _empty(target)
    try:
        target.mkdir(parents=True, exist_ok=True)
        for path in sorted(path for path in templates[template].iterdir() if path.is_file()):
            (target / path.name).write_text(path.read_text(encoding="utf-8").replace("NAME", name), encoding="utf-8")
    except OSError as error:
        raise DembarkError(f"cannot write to {target}", error.strerror or str(error)) from None
    words = ["dembark", "--cases", str(folder), "run", name, "--engine", engines.names()[0], "--out", f"results-{name}"]
    print(f"{target} is a case now. Run it: {shlex.join(words)}")
