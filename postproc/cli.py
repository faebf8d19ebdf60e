"""The commands `dembark fields`, `dembark walls`, `dembark debark`, `dembark render` and `dembark tracks`."""

from __future__ import annotations

import math
import signal
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from dembark.common.errors import DembarkError, Interrupted
from dembark.common.extras import missing_extra
from dembark.common.files import write_atomic
from dembark.common.signals import interruptible
from dembark.common.units import to_si

from .cli_options import (
    contact_columns,
    frame_numbers,
    grain_numbers,
    lags,
    length,
    parse_wall,
    picture_size,
    positive,
    removal_force,
    value_or_name,
    value_range,
)
from .cli_output import check_places, progress, provenance, say
from .contacts import ContactColumnsError
from .dumps.frames import ColumnsError, DensityError, DumpError, DumpWarning
from .grains import GrainFrame
from .sources import Sizes, Source, frames_at, open_source, select
from .style import SEQUENTIAL
from .walls import Inclusion, Wall
from .walls.run import WallLoads, wall_lines

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
                  context_settings={"help_option_names": ["-h", "--help"]})

SourceArgument = Annotated[Path, typer.Argument(metavar="DUMP|RUN", help=(
    "A dump of grains, or the folder of a run (grains.dump, contacts.dump, run.json)."))]
Contacts = Annotated[Path | None, typer.Option(help="Dump of contacts, written at the same steps; default: contacts.dump of the run.")]
Frames = Annotated[str, typer.Option(help="Frames from 0, as in Python: 10:50, ::5, -20:, 3.")]
TimeStep = Annotated[float | None, typer.Option(parser=positive("s", "--time-step"), metavar="TEXT", help=(
    "Time step of the simulation, turns steps into times; default: that of the run."))]
Density = Annotated[float | None, typer.Option(parser=positive("kg/m^3", "--density"), metavar="TEXT", help=(
    "Density of the grains' material, where the dump has no masses: '2500 kg/m^3'."))]
Columns = Annotated[str | None, typer.Option(help="Names of the columns of a binary dump of grains: 'id type x y z ...'.")]
ContactColumns = Annotated[dict[str, list[int | str]] | None, typer.Option(parser=contact_columns, metavar="TEXT", help=(
    "Columns of a foreign dump of contacts: 'first=1,2,3 second=4,5,6 ids=7,8 forces=10,11,12'."))]
Units = Annotated[str, typer.Option(help="Unit style of dumps that do not name it (ITEM: UNITS): si, cgs, micro, ...; default: si.")]
Walls = Annotated[list[str] | None, typer.Option("--wall", metavar="NAME:KIND[:KEY=VALUE...]", help=(
    "A wall, by the name of its columns f_force_NAME[1..3]; repeat for more. side:cylinder:radius=25mm, base:plane:normal=z, "
    "lid:mesh:file=lid.stl:unit=mm, stone:inclusion:ids=1,5-9. Default: the walls of the run's record."))]
Time = Annotated[list[float] | None, typer.Option("--at", parser=lambda text: to_si(text, "s", "--at"), metavar="TIME", help=(
    "Time of a picture, '0.98 s', the nearest frame; repeat for more. Default: the last frame."))]
Plot = Annotated[Path | None, typer.Option(metavar="FOLDER", help="Draw plots (PNG) into this folder.")]


def run(words: Sequence[str]) -> int:
    """Run one of the commands with its `words` (the first is its name); returns the exit code. DembarkError for the user's mistakes."""
    try:
        with interruptible(signal.SIGTERM), warnings.catch_warnings():
            # The summary says what was odd in the files.
            warnings.simplefilter("ignore", DumpWarning)
            code = app(args=list(words), prog_name="dembark", standalone_mode=False)
    except ModuleNotFoundError as error:
        raise missing_extra(error, f"dembark {words[0]}") from None
    except MemoryError:
        raise DembarkError("there is not enough memory", "", "take larger cells or patches, or fewer frames at a time") from None
    except ColumnsError as error:
        # The readers name their own parameter; here it is an option.
        options = {ContactColumnsError: "--contact-columns", DensityError: "--density", ColumnsError: "--columns"}
        raise DembarkError(error.named(options[type(error)])) from None
    except DumpError as error:
        raise DembarkError(str(error)) from None
    if code == Interrupted.exit_code:
        # Typer makes this of a KeyboardInterrupt, without a message.
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
    out: Annotated[Path | None, typer.Option(help="NetCDF file of the fields, NAME.nc, for xarray.")] = None,
    paraview: Annotated[Path | None, typer.Option(help="Collection of VTK files of the fields for ParaView, NAME.pvd.")] = None,
    grains: Annotated[Path | None, typer.Option(help="The same for the grains of these frames.")] = None,
    plot: Plot = None,
    time_step: TimeStep = None,
    density: Density = None,
    columns: Columns = None,
    contact_columns: ContactColumns = None,
    units: Units = "",
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; default: all cores. The result does not depend on it.")] = None,
) -> None:
    """Stress, velocity, strain rate and more on a grid, from grains and contacts, by coarse graining or by cell averages."""
    from .fields.run import FieldAverages
    from .output.netcdf import write_netcdf
    from .output.paraview import TimeSeries, add_grains, write_fields

    if not any((out, paraview, grains, plot)):
        raise DembarkError("there is nothing to write", "", "name a file with --out or --paraview, or a folder with --plot")
    check_places(out, paraview, grains, plot=plot, read=(source, contacts))
    opened = _opened(source, contacts, time_step, density, columns, contact_columns, units)
    chosen = select(opened, frame_numbers(frames, len(opened.grains)))
    averages = FieldAverages(
        chosen, kernel=kernel, width=width, grid=grid, spacing=spacing, box=box, average=average, walls=wall or (), cells=cells,
        least_contacts=least_contacts, only=only, threads=threads, show=progress)
    about = provenance("fields", source)
    opening = TimeSeries(grains, about, spheres=True) if grains else nullcontext()
    with progress("fields", len(chosen.numbers)) as advance, opening as points:
        def done(frame: GrainFrame, time: float) -> None:
            if points:
                add_grains(points, frame, time)
            advance()

        data = averages.run(done)
    data.attrs.update(about)
    if out:
        write_netcdf(out, data, averages.loads, timed=opened.timed)
    if paraview:
        write_fields(paraview, data)
    written = [path for path in (out, paraview, grains) if path]
    if plot:
        from .plots import field_figures, save, wall_figures

        assert averages.last
        of_walls = {name: figure for load in averages.loads for name, figure in wall_figures(load).items()}
        written += save(plot, field_figures(averages.last) | of_walls)
    say([*averages.summary(), *(f"written: {path}" for path in written)])


@app.command()
def walls(
    source: SourceArgument,
    contacts: Contacts = None,
    wall: Walls = None,
    patch: Annotated[str, typer.Option(help="Size of the patches: 2d (mean diameters), '5 mm'; those of a mesh are its triangles.")] = "2d",
    frames: Frames = ":",
    out: Annotated[Path | None, typer.Option(help="NetCDF file, NAME.nc, a group for each wall, for xarray.")] = None,
    paraview: Annotated[Path | None, typer.Option(help=(
        "Collection of VTK files of the patches for ParaView, NAME.pvd; with several walls NAME_WALL.pvd."))] = None,
    plot: Plot = None,
    time_step: TimeStep = None,
    density: Density = None,
    columns: Columns = None,
    contact_columns: ContactColumns = None,
    units: Units = "",
) -> None:
    """Normal and shear stress on walls and inclusions: distribution, time series, fluctuations, peaks."""
    check_places(out, paraview, plot=plot, read=(source, contacts))
    opened = _opened(source, contacts, time_step, density, columns, contact_columns, units)
    chosen = select(opened, frame_numbers(frames, len(opened.grains)))
    loads, sizes, written = WallLoads(wall or (), chosen), Sizes(), []
    if not loads.walls:
        known = ", ".join(chosen.first.wall_forces) or "none"
        raise DembarkError("no wall is given", "; ".join([f"walls in the dump: {known}", *loads.notes]),
                           "add --wall, such as side:cylinder:radius=25mm")
    loads.record(length(patch, chosen.diameter, "--patch"))
    with progress("walls", len(chosen.numbers)) as advance:
        for grains, touching in opened.frames(chosen.numbers):
            loads.check(grains)
            loads.add(grains, touching, opened.time(grains))
            sizes.add(grains)
            advance()
    results, about = loads.results(), provenance("walls", source)
    if out:
        import xarray

        from .output.netcdf import write_netcdf

        written.append(write_netcdf(out, xarray.Dataset(attrs={"Conventions": "CF-1.11", **about}), results, timed=opened.timed))
    if paraview:
        from .output.paraview import write_wall

        of = {one.wall.name: paraview.with_stem(f"{paraview.stem}_{one.wall.name}") if len(results) > 1 else paraview for one in results}
        written += [write_wall(of[one.wall.name], one, about) for one in results]
    if plot:
        from .plots import save, wall_figures

        written += save(plot, {name: figure for one in results for name, figure in wall_figures(one).items()})
    say([*chosen.averaging_notes(sizes), *chosen.lines(sizes), *loads.mesh_notes(), *(f"note: {one}; add --wall" for one in loads.notes),
          *(line for one in results for line in wall_lines(one, opened)), *(f"written: {path}" for path in written)])


@app.command()
def debark(
    sources: Annotated[list[Path], typer.Argument(metavar="IMPACTS|RUN...", help=(
        "Files of impacts (.txt, .bin), folders of runs, or of their replicas: each is a load."))],
    grains: Annotated[Path | None, typer.Option(help="Dump with id, radius and mass of the logs; default: that of the run.")] = None,
    bark_force: Annotated[float | None, typer.Option(parser=positive("N", "--bark-force"), metavar="TEXT", help=(
        "Peak force from which an impact removes bark; or give the bond's strength, see --bond."))] = None,
    wood_force: Annotated[float | None, typer.Option(parser=positive("N", "--wood-force"), metavar="TEXT", help=(
        "Peak force above which it damages the wood. Required."))] = None,
    bond: Annotated[str | None, typer.Option(metavar="SPECIES:CONDITION|STRENGTH", help=(
        "Shear strength of the bond of bark and wood, such as '0.4 MPa' or spruce:dormant; with --area and --friction."))] = None,
    area: Annotated[float | None, typer.Option(parser=positive("m^2", "--area"), metavar="TEXT", help=(
        "Area that an impact shears: '20 cm^2'."))] = None,
    friction: Annotated[float | None, typer.Option(min=1e-9, help="Friction coefficient between logs.")] = None,
    clears: Annotated[float | None, typer.Option(parser=positive("m", "--clears"), metavar="TEXT", help=(
        "Width of the circumference that an effective impact clears of bark: '5 mm'."))] = None,
    energy: Annotated[float | None, typer.Option(parser=positive("J/m^2", "--energy"), metavar="TEXT", help=(
        "Or: energy of friction per area that takes bark off: '2 kJ/m^2'."))] = None,
    speed: Annotated[str | None, typer.Option(metavar="TEXT", help=(
        "Speed of the drum: '11.5 rpm', or the parameter of the runs that has it: drum_speed. Required."))] = None,
    begin: Annotated[float, typer.Option(min=0.0, help="Begin of the window in s, after the run-in.")] = 0.0,
    end: Annotated[float | None, typer.Option(min=0.0, help="Its end in s; default: that of the run, or the last impact.")] = None,
    least_speed: Annotated[float, typer.Option(min=0.0, help="Approach (m/s) from which a contact is an impact.")] = 0.0,
    stiffness: Annotated[float | None, typer.Option(parser=positive("N/m", "--stiffness"), metavar="TEXT", help=(
        "Local stiffness of a log, for the wood-loss index."))] = None,
    length_: Annotated[float | None, typer.Option("--length", parser=positive("m", "--length"), metavar="TEXT", help=(
        "Length of the logs."))] = None,
    radius: Annotated[float | None, typer.Option(parser=positive("m", "--radius"), metavar="TEXT", help=(
        "Radius of the drum; with --stiffness it gives the force that no impact exceeds by its energy."))] = None,
    against: Annotated[str | None, typer.Option(metavar="PARAMETER", help=(
        "Compare the IMPACTS or RUNs by this parameter of theirs, such as filling or drum_speed."))] = None,
    sectors: Annotated[int, typer.Option(min=1, max=3600, help="Sectors of the circumference.")] = 12,
    out: Annotated[Path | None, typer.Option(help="NetCDF file of doses and degree, NAME.nc, for xarray.")] = None,
    plot: Plot = None,
) -> None:
    """Degree of debarking and wood damage from the impacts of logs in a drum."""
    from .debarking import ForceRange, Outcome, RemovalLaw, outcome
    from .debarking.report import against as compared
    from .debarking.report import dataset, figures, lines
    from .debarking.sources import Given, files_of, load_of, parameter

    if wood_force is None:
        raise DembarkError("the force that damages wood is not given", "", "give it with --wood-force; there is no default")
    forces = ForceRange(removal_force(bark_force, bond, area, friction), wood_force)
    law = RemovalLaw(clears, energy) if clears or energy else None
    if speed is None:
        raise DembarkError("the speed of the drum is not given", "", "give it with --speed, such as '11.5 rpm'")
    if radius and not stiffness:
        raise DembarkError("--stiffness is missing", "with --radius", "the bound of the forces depends on the stiffness of the logs")
    if against and (out or not law):
        raise DembarkError("with --against there is no --out" if out else "--against compares degrees of debarking", "",
                           "write one file for each drum" if out else "give --clears or --energy")
    files = [file for source in sources for file in files_of(source)]
    check_places(out, plot=plot, read=(*files, grains))
    given = Given(value_or_name(speed, "rad/s", "--speed"), grains, begin, end, least_speed, stiffness or math.nan, length_ or math.nan,
                  radius or math.nan)
    numbers = [parameter(file, against) for file in files] if against else []
    results = []
    with progress("debark", len(files)) as advance:
        for file in files:
            results.append(outcome(load_of(file, given), forces, law, sectors))
            advance()
    written = []
    if against:
        groups: dict[float, list[Outcome]] = {}
        for number, one in zip(numbers, results, strict=True):
            groups.setdefault(number, []).append(one)
        if plot:
            from .plots import save

            written += save(plot, {"against": compared(groups, against)})
        say([line for value in sorted(groups) for line in (f"{against} = {value:g}", *lines(groups[value]))]
            + [f"written: {path}" for path in written])
        return
    if out:
        from .output.netcdf import write_netcdf

        written.append(write_netcdf(out, dataset(results, **provenance("debark", sources[0]))))
    if plot:
        from .plots import save

        written += save(plot, figures(results))
    say([*lines(results), *(f"written: {path}" for path in written)])


@app.command()
def render(
    source: SourceArgument,
    at: Time = None,
    frames: Annotated[str | None, typer.Option(help="Frames instead of times, from 0, as in Python: 10:50, ::5, -1.")] = None,
    film: Annotated[bool, typer.Option("--film", help="One film of all frames, or of those of --frames.")] = False,
    rate: Annotated[float, typer.Option(min=0.1, max=100.0, help="Frames of the film a second.")] = 15.0,
    view: Annotated[str, typer.Option(help=(
        "front, back, side, top, iso, or the direction to the eye: 1,-1,0.5; default: the face of a layer, else iso."))] = "",
    colour_by: Annotated[str, typer.Option(help=(
        "velocity, velocity:z, diameter, type, mass, force, angular_velocity, position:z, force_of_WALL, a column of the dump, or of "
        "contacts: contact_force, contact_count, pressure; default: velocity."))] = "",
    unit: Annotated[str, typer.Option(help="Unit of the colour scale: mm/s.")] = "",
    span: Annotated[str | None, typer.Option("--range", metavar="LOW,HIGH", help=(
        "Ends of the colour scale, in its unit; default: without the 2 % of the values at either end."))] = None,
    colours: Annotated[str, typer.Option(help="A colour map of matplotlib.")] = SEQUENTIAL,
    surface: Annotated[bool, typer.Option("--surface", help="Draw the particles of a fluid by their surface.")] = False,
    cut: Annotated[bool, typer.Option("--cut", help="Leave out the half that is nearer to the eye.")] = False,
    wall: Walls = None,
    bare: Annotated[bool, typer.Option("--no-walls", help="Draw no walls.")] = False,
    size: Annotated[str | None, typer.Option(metavar="WxH", help="Pixels; default: as the run is shaped, at most 1200x900.")] = None,
    out: Annotated[Path | None, typer.Option(help=(
        "File: .png, .jpg, .webp; a film .webp, .gif. Of several pictures, names have the times. Default: name of the run."))] = None,
    contacts: Contacts = None,
    time_step: TimeStep = None,
    density: Density = None,
    columns: Columns = None,
    contact_columns: ContactColumns = None,
    units: Units = "",
) -> None:
    """Draw pictures or a film of the grains, the surface of water, walls and bodies."""
    from . import render as drawing
    from .pictures.scenes import Album, Look

    if at and (frames or film):
        raise DembarkError("--at is for pictures of single times", "", "leave --frames and --film out")
    suffixes = drawing.FILMS if film else drawing.STILLS
    place = out or Path(f"{source.resolve().name.split('.')[0]}{suffixes[0]}")
    check_places(place, suffixes=suffixes, read=(source, contacts))
    drawing.View.named(view or "iso")
    look = Look(colour_by, unit, value_range(span) if span else None, colours=colours, view=view, cut=cut, surface=surface, walls=not bare,
                size=picture_size(size) if size else None)
    opened = _opened(source, contacts, time_step, density, columns, contact_columns, units)
    numbers = frames_at(opened, at) if at else frame_numbers(frames or (":" if film else "-1"), len(opened.grains))
    chosen = select(opened, numbers)
    album = Album(chosen.source, numbers, look, [_drawn(parse_wall(text, chosen.diameter).wall) for text in wall or ()])
    written = []
    with progress("render", len(numbers)) as advance:
        if film:
            written.append(drawing.write_film(place, album, 1000.0 / rate, advance))
        else:
            for number, (time, image) in zip(numbers, album, strict=True):
                mark = f"{time:.6g}s" if opened.timed else f"{number}"
                file = place if len(numbers) == 1 else place.with_stem(f"{place.stem}-{mark}")
                written.append(write_atomic(file, drawing.still(image, file.suffix)))
                advance()
    say([*chosen.lines(), *(f"note: {one}" for one in album.notes), *(f"written: {path}" for path in written)])


def _opened(source: Path, contacts: Path | None, time_step: float | None, density: float | None, columns: str | None,
            contact_columns: Mapping[str, Sequence[int | str]] | None, units: str) -> Source:
    """What the options that describe dumps say of `source`."""
    return open_source(source, contacts, time_step=time_step, density=density, columns=columns.split() if columns else None,
                       contact_columns=contact_columns, units=units)


def _drawn(wall: Wall | Inclusion) -> Wall:
    if isinstance(wall, Inclusion):
        raise DembarkError(f"{wall.name} is an inclusion", "in --wall", "its grains are drawn as they are; leave it out")
    return wall


@app.command()
def tracks(
    source: Annotated[Path, typer.Argument(metavar="DUMP|RUN|TRACKS.csv", help="A dump, a run's folder, or a file of measured tracks.")],
    grains: Annotated[str | None, typer.Option(metavar="IDS", help=(
        "Grains by their numbers: 1,5-9; default: those of the first frame."))] = None,
    frames: Frames = ":",
    against: Annotated[Path | None, typer.Option(metavar="TRACKS.csv", help=(
        "Measured tracks to compare with, along the axes of both."))] = None,
    interval: Annotated[float | None, typer.Option(parser=positive("s", "--interval"), metavar="TEXT", help=(
        "Time between two positions that give a velocity: '8 ms'; default: one frame, or that of --against."))] = None,
    diffusion: Annotated[str | None, typer.Option(metavar="TIME,TIME", help=(
        "Lags between which the mean square displacement shows the diffusion; default: 0.1 and 0.4 of the time."))] = None,
    out: Annotated[Path | None, typer.Option(help="File of the tracks: .csv, or .nc with what is measured, for xarray.")] = None,
    plot: Plot = None,
    contacts: Contacts = None,
    time_step: TimeStep = None,
    density: Density = None,
    columns: Columns = None,
    contact_columns: ContactColumns = None,
    units: Units = "",
) -> None:
    """Tracks of single grains, and their velocities, mean square displacements and self-diffusion."""
    from . import tracks as tracking
    from .track_report import dataset, figures, lines

    check_places(out, suffixes=(".csv", ".nc"), plot=plot, read=(source, contacts, against))
    ids = grain_numbers(grains, "in --grains") if grains else None
    between = lags(diffusion) if diffusion else None
    measured = tracking.read_csv(against) if against else None
    if source.suffix == ".csv":
        if contacts or time_step or density or columns or contact_columns or units:
            raise DembarkError(f"{source} is a file of tracks", "", "leave out what describes dumps, such as --contacts and --time-step")
        found, notes = tracking.read_csv(source).of(ids), []
        found = found.at(frame_numbers(frames, len(found.times)))
    else:
        opened = _opened(source, contacts, time_step, density, columns, contact_columns, units)
        chosen = select(opened, frame_numbers(frames, len(opened.grains)))
        with progress("tracks", len(chosen.numbers)) as advance:
            found = tracking.follow(chosen, ids, advance)
        notes = [*(f"note: {one}" for one in found.notes), *chosen.lines()]
    seen = [found] if measured is None else tracking.common(found, measured)
    time, ends = interval or (measured.interval if measured else None), between or tracking.usual_lags(*seen)
    movements = {one.name: tracking.measure(one, time, ends) for one in seen}
    written = []
    if out:
        if out.suffix == ".csv":
            written.append(tracking.write_csv(out, found))
        else:
            from .output.netcdf import write_netcdf

            written.append(write_netcdf(out, dataset(found, movements[found.name], **provenance("tracks", source))))
    if plot:
        from .plots import save

        written += save(plot, figures(movements))
    say([*notes, *lines(seen, movements), *(f"written: {path}" for path in written)])
