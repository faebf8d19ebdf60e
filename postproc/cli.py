"""The commands `dembark fields` and `dembark walls`."""

from __future__ import annotations

import math
import signal
import sys
import time as clock
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from dembark.common.errors import DembarkError, Interrupted
from dembark.postproc.contacts import ContactColumnsError
from dembark.postproc.dumps.frames import ColumnsError, DensityError, DumpError, DumpWarning

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
                  context_settings={"help_option_names": ["-h", "--help"]})

SourceArgument = Annotated[Path, typer.Argument(metavar="DUMP|RUN", help=(
    "A dump of grains, or the folder of a run (grains.dump, contacts.dump, run.json)."))]
Contacts = Annotated[Path | None, typer.Option(help="Dump of contacts, written at the same steps; default: contacts.dump of the run.")]
Frames = Annotated[str, typer.Option(help="Frames from 0, as in Python: 10:50, ::5, -20:, 3.")]
TimeStep = Annotated[str | None, typer.Option(help="Time step of the simulation, turns steps into times; default: that of the run.")]
Density = Annotated[str | None, typer.Option(help="Density of the grains' material, where the dump has no masses: '2500 kg/m^3'.")]
Columns = Annotated[str | None, typer.Option(help="Names of the columns of a binary dump of grains: 'id type x y z ...'.")]
ContactColumns = Annotated[str | None, typer.Option(help=(
    "Columns of a foreign dump of contacts: 'first=1,2,3 second=4,5,6 ids=7,8 forces=10,11,12'."))]
Units = Annotated[str | None, typer.Option(help="Unit style of dumps that do not name it (ITEM: UNITS): si, cgs, micro, ...; default: si.")]
Walls = Annotated[list[str] | None, typer.Option("--wall", metavar="NAME:KIND[:KEY=VALUE...]", help=(
    "A wall, by the name of its columns f_force_NAME[1..3]; repeat for more. side:cylinder:radius=25mm, base:plane:normal=z, "
    "lid:mesh:file=lid.stl:unit=mm, stone:inclusion:ids=1,5-9. Default: the walls of a case of dembark."))]
Plot = Annotated[Path | None, typer.Option(metavar="FOLDER", help="Draw plots (PNG) into this folder.")]


def run(words: Sequence[str]) -> int:
    """Run one of the commands with its `words` (the first is its name); returns the exit code. DembarkError for the user's mistakes."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with warnings.catch_warnings():
            # The summary says what was odd in the files.
            warnings.simplefilter("ignore", DumpWarning)
            code = app(args=list(words), prog_name="dembark", standalone_mode=False)
    except MemoryError:
        raise DembarkError("there is not enough memory", "", "take larger cells or patches, or fewer frames at a time") from None
    except ColumnsError as error:
        # The readers name their own parameter; here it is an option.
        options = {ContactColumnsError: "--contact-columns", DensityError: "--density", ColumnsError: "--columns"}
        raise DembarkError(error.named(options[type(error)])) from None
    except DumpError as error:
        raise DembarkError(str(error)) from None
    finally:
        signal.signal(signal.SIGTERM, before)
    if code == Interrupted.exit_code:
        # Typer makes this of a KeyboardInterrupt, without a word.
        raise Interrupted("interrupted")
    return code if isinstance(code, int) else 0


@app.command()
def fields(
    source: SourceArgument,
    contacts: Contacts = None,
    kernel: Annotated[str, typer.Option(help="gaussian, lucy or heaviside.")] = "gaussian",
    width: Annotated[str, typer.Option(help="Width of the kernel: 1.5d (mean diameters), '7 mm'.")] = "1.5d",
    grid: Annotated[str | None, typer.Option(help="Numbers of cells along x, y, z: 64,64,64.")] = None,
    spacing: Annotated[str | None, typer.Option(help=(
        "Size of the cells instead of their number: 0.5d, '2 mm'; default: 1d, or 10 grains with --cells."))] = None,
    box: Annotated[str | None, typer.Option(metavar="X0,X1,Y0,Y1,Z0,Z1", help="Region of the grid; default: around all grains.")] = None,
    frames: Frames = ":",
    average: Annotated[str, typer.Option(help="'all' frames into one field, or N frames at a time.")] = "all",
    wall: Walls = None,
    cells: Annotated[bool, typer.Option("--cells", help="Averages by cell, without a kernel; thin cells are masked.")] = False,
    least_contacts: Annotated[int, typer.Option(min=0, help=(
        "With --cells: cells with fewer contacts in all averaged frames are masked."))] = 3000,
    only: Annotated[str | None, typer.Option("--fields", metavar="NAME,...", help="Write these only: density,velocity,stress.")] = None,
    out: Annotated[Path | None, typer.Option(help="NetCDF file of the fields, for xarray.")] = None,
    vtkhdf: Annotated[Path | None, typer.Option(help="VTKHDF file of the fields, for ParaView.")] = None,
    grains: Annotated[Path | None, typer.Option(help="VTKHDF file of the grains of the same frames.")] = None,
    plot: Plot = None,
    time_step: TimeStep = None,
    density: Density = None,
    columns: Columns = None,
    contact_columns: ContactColumns = None,
    units: Units = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; default: all cores. The result does not depend on it.")] = None,
) -> None:
    """Stress, velocity, strain rate and more on a grid, from grains and contacts, by coarse graining or by cell averages."""
    from dembark.postproc.fields.run import FieldJob, Words
    from dembark.postproc.words import reading

    how = reading(time_step, density, columns, contact_columns, units)
    words = Words(source, how, contacts, kernel, width, grid, spacing, box, frames, average, wall or [], cells, least_contacts, only,
                  out, vtkhdf, grains, plot, threads)
    job = FieldJob.plan(words, progress)
    with progress("fields", len(job.numbers)) as advance:
        job.run(advance, _provenance("fields", source))
    _say(job.summary())


@app.command()
def walls(
    source: SourceArgument,
    contacts: Contacts = None,
    wall: Walls = None,
    patch: Annotated[str, typer.Option(help="Size of the patches: 2d (mean diameters), '5 mm'; those of a mesh are its triangles.")] = "2d",
    frames: Frames = ":",
    out: Annotated[Path | None, typer.Option(help="NetCDF file, a group for each wall, for xarray.")] = None,
    vtkhdf: Annotated[Path | None, typer.Option(help=(
        "VTKHDF file of the patches, for ParaView; with several walls _NAME is put behind its stem."))] = None,
    plot: Plot = None,
    time_step: TimeStep = None,
    density: Density = None,
    columns: Columns = None,
    contact_columns: ContactColumns = None,
    units: Units = None,
) -> None:
    """Normal and shear stress on walls and inclusions: distribution, time series, fluctuations, peaks."""
    from dembark.postproc.walls.run import WallJob
    from dembark.postproc.words import reading

    how = reading(time_step, density, columns, contact_columns, units)
    job = WallJob.plan(source, contacts, wall or [], patch, frames, out, vtkhdf, plot, how)
    with progress("walls", len(job.numbers)) as advance:
        job.run(advance, _provenance("walls", source))
    _say(job.summary())


def _provenance(command: str, source: Path) -> dict[str, str]:
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {"title": f"dembark {command} of {source.resolve().name}", "source": str(source),
            "history": f"{now}: dembark {' '.join(sys.argv[1:])}", "software": f"dembark {version('dembark')}"}


def _say(lines: Sequence[str]) -> None:
    console = Console(highlight=False, soft_wrap=True)
    for line in lines:
        console.print(line, markup=False)


@contextmanager
def progress(name: str, total: int, interval: float = 10.0) -> Iterator[Advance]:
    """Shows how many of `total` frames are done: a bar in a terminal, else a plain line every `interval` s."""
    console = Console(file=sys.stderr, highlight=False, soft_wrap=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("frames"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield Advance(bar, bar.add_task(name, total=total), name, total, math.inf if console.is_terminal else interval)


class Advance:
    """Counts frames that are done."""

    def __init__(self, bar: Progress, task: TaskID, name: str, total: int, interval: float) -> None:
        self._bar, self._task, self._name, self._total, self._interval = bar, task, name, total, interval
        self._done, self._told = 0, clock.monotonic()

    def __call__(self) -> None:
        """One more frame is done."""
        self._done += 1
        self._bar.advance(self._task)
        now = clock.monotonic()
        if now - self._told >= self._interval:
            self._told = now
            print(f"dembark: {self._name}: frame {self._done} of {self._total}", file=sys.stderr, flush=True)
