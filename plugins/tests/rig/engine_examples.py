"""Scripts that come with LIGGGHTS and LAMMPS: run by the stock program, by ours, and by ours with dembark's styles."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.validation.engines import call
from rig import lammps_driver, liggghts_driver

ROOT = Path(__file__).resolve().parents[3]
TABLE = Path(__file__).parents[1] / "engine_examples.toml"
PACKAGES = {"liggghts": ("liggghts-doc", Path("/usr/share/doc/liggghts/examples/LIGGGHTS/Tutorials_public")),
            "lammps": ("lammps-examples", Path("/usr/share/lammps/examples"))}
FRAMES = 50  # of the last run
COLUMNS = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass"
FORMATS = {"liggghts": '"' + " ".join("%d" if name in ("id", "type", "ix", "iy", "iz") else "%.17g" for name in COLUMNS.split()) + '"',
           "lammps": "float %.17g"}
RUN = re.compile(r"^[ \t]*run[ \t]+\S+([ \t]+upto)?[ \t]*$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Example:
    """A row of the table; its head says what the fields mean."""

    engine: str
    deck: str
    runs: tuple[int, ...]
    variant: str = ""
    both: tuple[tuple[str, str], ...] = ()
    ours: tuple[tuple[str, str], ...] = ()
    refused: str = ""
    fails: str = ""
    dump: bool = True
    up: str = "z"
    gravity: float = 9.81
    within: dict[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return f"{self.engine} {self.deck}{' ' * bool(self.variant)}{self.variant}"

    @property
    def source(self) -> Path:
        return PACKAGES[self.engine][1] / self.deck

    def text(self, *, ours: bool) -> str:
        """The script with its run lengths, what both programs get, and a dump of the last run at full precision and a restart file."""
        text = self.source.read_text(encoding="utf-8")
        for pattern, replacement in (*self.both, *(self.ours if ours else ())):
            text, count = re.subn(pattern, replacement, text, flags=re.MULTILINE)
            assert count, f"{self.name}: no line matches {pattern}"
        places = list(RUN.finditer(text))
        assert len(places) == len(self.runs), f"{self.name}: {len(places)} runs in the script, {len(self.runs)} in the table"
        every = max(1, self.runs[-1] // FRAMES)
        exact = "" if not self.dump else (f"dump exact all custom {every} exact.dump {COLUMNS}\n"
                                          f"dump_modify exact sort id format {FORMATS[self.engine]}\n")
        for place, steps in reversed([*zip(places, self.runs, strict=True)]):
            text = f"{text[:place.start()]}{exact if place == places[-1] else ''}run {steps}{text[place.end():]}"
        return f"{text}\nwrite_restart exact.restart\n"

    def run(self, folder: Path, program: list[Path], environment: dict[str, str], *,
            ours: bool = False) -> subprocess.CompletedProcess[str]:
        """Run it in a copy of its folder, at most ten minutes."""
        shutil.copytree(self.source.parent, folder)
        (folder / "post").mkdir(exist_ok=True)
        (folder / "deck.in").write_text(self.text(ours=ours), encoding="utf-8")
        return call([*program, "-in", "deck.in"], folder, os.environ | {"OMP_NUM_THREADS": "1"} | environment, timeout=600.0)


def table() -> list[Example]:
    """All rows. An edit is a pair [pattern, replacement], or the name of one of the lists of [edits]."""
    with TABLE.open("rb") as file:
        data = tomllib.load(file)

    def edits(words: list[Any]) -> tuple[tuple[str, str], ...]:
        return tuple(edit for word in words for edit in (edits(data["edits"][word]) if isinstance(word, str) else [tuple(word)]))

    return [Example(**row | {"runs": tuple(row["runs"]), "both": edits(row.get("both", [])), "ours": edits(row.get("ours", []))})
            for row in data["example"]]


def programs(engine: str) -> tuple[tuple[list[Path], dict[str, str]], tuple[list[Path], dict[str, str]]]:
    """Stock and ours, each with its environment; of LAMMPS the one that our launcher starts."""
    if engine == "liggghts":
        stock = shutil.which("liggghts")
        assert stock, "no stock liggghts on PATH; install the package liggghts"
        ours = liggghts_driver.engine()
        return ([Path(stock)], {}), ([Path(ours.command(Path("deck.in"), {}, 1)[0])], {})
    launcher = lammps_driver.engine()
    text = launcher.read_text(encoding="utf-8")
    (library,) = re.findall(r"^LD_LIBRARY_PATH=([^$\n]*)", text, re.MULTILINE)
    (stock,) = re.findall(r'^exec "([^"]+)"', text, re.MULTILINE)
    return ([Path(stock)], {"LD_LIBRARY_PATH": library}), ([launcher], {})


def thermo(folder: Path) -> list[str]:
    """The rows of numbers that the run printed."""
    (log,) = folder.glob("log.*")
    return [line for line in log.read_text(encoding="utf-8", errors="replace").splitlines() if re.fullmatch(r"[\s0-9.e+-]+", line)]


def outputs(folder: Path) -> dict[str, bytes]:
    """Every file that a run wrote, but for its log."""
    files = [path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("log.")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def frames(folder: Path) -> list[dict[str, NDArray[np.float64]]]:
    """The last run, a table of columns for each frame."""
    found = []
    for part in (folder / "exact.dump").read_text(encoding="utf-8").split("ITEM: ATOMS")[1:]:
        names, *rows = part.split("ITEM: TIMESTEP")[0].splitlines()
        columns = names.split()
        values = np.array([row.split() for row in rows], dtype=float).reshape(len(rows), len(columns))
        found.append(dict(zip(columns, values.T, strict=True)))
    return found


def bulk(example: Example, folder: Path) -> dict[str, float]:
    """What the grains do in the last run: number and mass at its end; the others are means over its frames."""
    last = [frame for frame in frames(folder)[1:] if len(frame["id"])]
    height = np.mean([np.quantile(frame[example.up], 0.95) for frame in last])
    kinetic = np.mean([0.5 * np.sum(frame["mass"] * sum(frame[f"v{axis}"] ** 2 for axis in "xyz")) for frame in last])
    centre = np.mean([np.average(frame[example.up], weights=frame["mass"]) for frame in last])
    walls = np.mean([np.sum(frame[f"f{example.up}"]) + example.gravity * np.sum(frame["mass"]) for frame in last])
    return {"grains": len(last[-1]["id"]), "mass": float(np.sum(last[-1]["mass"])), "centre": float(centre), "height": float(height),
            "kinetic": float(kinetic), "walls": float(walls)}
