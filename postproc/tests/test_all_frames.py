"""What a command takes for granted holds for all frames: the region of the fields, the walls, the box, the time; and what it would need."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray
from dumps import contacts_text, grains_text
from packings import grain_frame

from dembark.common import memory
from dembark.common.errors import DembarkError
from dembark.postproc import ContactFrame
from dembark.postproc.fields.cells import cell_totals
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.validation.cli import main

PLACES = np.array([[0.1, 0.1, 0.1], [0.12, 0.1, 0.1], [0.1, 0.13, 0.1], [0.1, 0.1, 0.14]])
RADII, BOX = np.full(4, 0.01), ((0.0, 1.0),) * 3
FAR = PLACES + np.array([0.2, 0.3, 0.1])


def frame(step, places=PLACES, radii=RADII, **options):
    """Grains of 0.5 kg."""
    return grains_text(step, places, radii, masses=np.full(len(places), 0.5), **{"box": BOX} | options)


def pairs(step, places=PLACES, flags="ff ff ff"):
    """A contact of the first two grains."""
    return contacts_text(step, places[:1], places[1:2], [[1, 2]], [[-1.0, 0.0, 0.0]], box=BOX, flags=flags)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fields(grains, *options, contacts=None):
    """Run `dembark fields` on frames; the exit code."""
    Path("g.dump").write_text("".join(grains), encoding="ascii")
    words = ["fields", "g.dump", "--width", "1d", "--out", "f.nc", *(["--fields", "density"] if contacts is None else []), *options]
    if not {"--grid", "--spacing", "--cells", "--width", "--box"} & set(options):
        words += ["--grid", "9"]
    if contacts is not None:
        Path("c.dump").write_text("".join(contacts), encoding="ascii")
        words += ["--contacts", "c.dump"]
    return main(words)


def masses():
    """Mass (kg) in the fields at each time."""
    with xarray.open_dataset("f.nc") as found:
        volume = math.prod(float(np.diff(found[f"{axis}_bounds"].values[0])[0]) for axis in "xyz")
        return (found.density.sum(["x", "y", "z"]) * volume).values


JUMPS = {"between": [PLACES, FAR, PLACES], "at the end": [PLACES, PLACES, FAR], "at the start": [FAR, PLACES, PLACES],
         "and are fewer": [PLACES, FAR[:2], PLACES[:3]], "out of an empty box": [PLACES[:0], FAR, PLACES]}


HOW = [["--average", "1"], ["--kernel", "lucy"], ["--spacing", "4d"], ["--cells"]]


@pytest.mark.parametrize(("places", "options"), [*((one, []) for one in JUMPS.values()),
                                                 *((JUMPS["between"], how) for how in HOW)])
def test_grains_of_every_frame_are_in_the_region(here, capsys, places, options):
    contacts = [pairs(step, one) if len(one) > 1 else contacts_text(step, [], [], [], [], box=BOX) for step, one in enumerate(places)]
    assert fields([frame(step, one, RADII[: len(one)]) for step, one in enumerate(places)], *options,
                  *(["--least-contacts", "0"] if "--cells" in options else []), contacts=contacts) == 0
    held = 0.5 * np.array([len(one) for one in places])
    np.testing.assert_allclose(masses(), held if "--average" in options else held.mean(), rtol=1e-9)
    assert "note: the last" not in capsys.readouterr().out


def test_what_lies_outside_a_region_that_was_given_is_told(here, capsys):
    assert fields([frame(0), frame(1, FAR)], "--box", "0,0.3,0,0.3,0,0.3") == 0
    assert "note: 50 % of the mass lie outside the region of --box" in capsys.readouterr().out
    assert masses() == pytest.approx([1.0])


@pytest.mark.parametrize(("box", "code"), [(BOX, 0), (((0.0, 1.0), (0.0, 1.0), (0.0, 2.0)), 0), (((0.0, 1.1), *BOX[1:]), 2),
                                           (((0.1, 1.1), *BOX[1:]), 2)])
def test_a_periodic_box_that_changes_is_refused_before_the_work(here, capsys, box, code):
    frames = [frame(0, flags="pp pp ff"), frame(1, box=box, flags="pp pp ff"), frame(2)]
    assert fields(frames, "--frames", ":2", "--grid", "9") == code
    if code:
        assert re.search(r"the periodic box changes along x, 0 to 1 m at step 0, .* at step 1, choose frames", capsys.readouterr().err)
        assert not (here / "f.nc").exists()
    else:
        assert fields(frames, "--grid", "9") == 2
        assert "the periodic box changes along x" in capsys.readouterr().err


# --- what is missing ------------------------------------------------------------------------------------------------------

def test_a_dump_without_forces_of_walls_says_so(here, capsys):
    wall = {"walls": {"base": np.ones((4, 3))}}
    for grains, flags, said in (([frame(0)], "ff ff ff", True), ([frame(0, flags="pp pp pp")], "pp pp pp", False),
                                ([frame(0, **wall)], "ff ff ff", False)):
        assert fields(grains, contacts=[pairs(0, flags=flags)]) == 0
        assert ("has no forces of walls (columns f_force_NAME[1..3])" in capsys.readouterr().out) == said
    # A wall whose columns come later.
    assert fields([frame(0), frame(1, **wall)], contacts=[pairs(0), pairs(1)]) == 0
    assert "the position of the wall base is unknown" in capsys.readouterr().out
    assert main(["walls", "g.dump", "--frames", "1", "--wall", "base:plane", "--out", "w.nc"]) == 0
    assert fields([frame(0, walls={"base": np.zeros((4, 3))})]) == 0
    assert main(["walls", "g.dump", "--wall", "base:plane", "--out", "w.nc"]) == 0
    assert "note: no grain feels this wall in these frames" in capsys.readouterr().out


@pytest.mark.parametrize(("column", "message"), [("radius", "column radius is missing"), ("mass", "column mass is missing; give --density"),
                                                 ("vx", "velocities are not known, the dump has no vx vy vz"), ("z", "column x, y, z is"),
                                                 ("id", "column id is missing")])
def test_a_missing_column_gets_one_line(here, capsys, column, message):
    for grains in ([frame(0), frame(1)], [frame(0)], [frame(1)]):
        renamed = [re.sub(rf"(ITEM: ATOMS.*) {column} ", r"\1 other ", one) for one in grains]
        assert fields(grains[:1] * (len(grains) > 1) + renamed[-1:]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and message in error
        assert not (here / "f.nc").exists()


def test_dumps_say_what_is_odd_in_the_summary(here, capsys, recwarn):
    text = frame(0).replace(" ff ff ff", "")
    assert fields([text], "--density", "2500 kg/m^3", contacts=[pairs(0)]) == 0
    said = capsys.readouterr()
    assert "note: g.dump, from step 0 on: the file does not say which axes are periodic" in said.out
    assert "note: g.dump, from step 0 on: the given density is not used, for the dump has a column mass" in said.out
    assert not said.err and not [one for one in recwarn if "density" in str(one.message)]


def test_times_are_those_of_the_dump(here, capsys):
    timed = [frame(step).replace("ITEM: NUM", f"ITEM: TIME\n{time}\nITEM: NUM", 1) for step, time in ((0, 0.0), (100, 1e-3), (200, 1.5e-3))]
    for option, note in ((["--time-step", "1e-5"], True), ([], False), (["--frames", ":2", "--time-step", "1e-5"], True)):
        assert fields(timed, "--average", "1", *option) == 0
        said = capsys.readouterr().out
        assert ("the times are those of the dump, not its steps times 1e-05 s" in said) == note and "times are steps" not in said
        with xarray.open_dataset("f.nc") as found:
            assert found.time.values == pytest.approx([0.0, 1e-3, 1.5e-3][: len(found.time)])
    assert fields([*timed[:2], frame(200)]) == 2
    assert "the frame has no ITEM: TIME, but others have" in capsys.readouterr().err


def test_steps_are_not_called_times_where_those_are_not_known(here, capsys):
    assert fields([frame(step, walls={"base": np.ones((4, 3))}) for step in (10, 20)], "--wall", "base:plane") == 0
    moving = ["--wall", "base:plane:velocity=0,0,-1mm/s"]
    for options, unit, time in (([], "1", 15.0), (["--time-step", "0.1"], "s", 1.5)):
        assert main(["fields", "g.dump", "--grid", "9", "--width", "1d", "--out", "f.nc", *options]) == 0
        assert main(["walls", "g.dump", "--out", "w.nc", *options, *(moving if options else ["--wall", "base:plane"])]) == 0
        raw = {"decode_times": False}
        with xarray.open_dataset("f.nc", **raw) as found, xarray.open_dataset("w.nc", group="base", **raw) as wall:
            assert found.time.values == pytest.approx([time])
            assert found.time.attrs["units"] == wall.time.attrs["units"] == wall.peak_time.attrs["units"] == unit
    capsys.readouterr()
    for command in ("walls", "fields"):
        assert main([command, "g.dump", "--out", "w.nc", *moving]) == 2
        assert "the wall moves, but the times of the frames are not known, for --wall base, give --time-step" in capsys.readouterr().err


def test_a_mean_diameter_that_changes_is_told(here, capsys):
    for later, said in ((RADII, False), (2.0 * RADII, True)):
        assert fields([frame(0), frame(1, radii=later, walls={"base": np.ones((4, 3))})]) == 0
        assert ("the mean diameter of the frames is 20 to 40 mm; d is that of the first" in capsys.readouterr().out) == said
    assert main(["walls", "g.dump", "--frames", "1", "--wall", "base:plane", "--out", "w.nc"]) == 0
    assert "mean diameter of the frames" not in capsys.readouterr().out


def test_contacts_of_another_step_are_not_taken_for_those_of_the_grains():
    grains = grain_frame(PLACES, radii=0.01, high=(1.0,) * 3)
    pair = ContactFrame(8, PLACES[:1], PLACES[1:2] - PLACES[:1], np.ones((1, 3)), grains.ids[None, :2])
    grid = Grid.around(grains, 0.05)
    for average in (lambda: coarse_grain(grains, pair, grid, width=0.01), lambda: cell_totals(grains, pair, grid)):
        with pytest.raises(DembarkError, match="the contacts are of step 8, the grains of step 7, give both of the same step"):
            average()


def test_units_of_dumps_that_name_none_are_given(here, capsys):
    assert fields([frame(0), frame(1)], "--units", "cgs") == 0
    assert "mean diameter d = 0.2 mm" in capsys.readouterr().out
    assert fields(["ITEM: UNITS\nsi\n" + frame(0)], "--units", "cgs") == 2
    assert "its units are si, but the option units, or another dump of the run, says cgs" in capsys.readouterr().err
    assert fields([frame(0)], "--units", "lj") == 2
    assert "its units are lj, which have no size in SI" in capsys.readouterr().err


@pytest.mark.parametrize(("of_grains", "of_contacts"), [("cgs", ""), ("", "cgs"), ("cgs", "cgs"), ("cgs", "si")])
def test_grains_and_contacts_of_a_run_have_the_same_units(here, capsys, of_grains, of_contacts):
    head = "ITEM: UNITS\n{}\n"
    code = fields([head.format(of_grains) * bool(of_grains) + frame(0)], contacts=[head.format(of_contacts) * bool(of_contacts) + pairs(0)])
    said = capsys.readouterr()
    if of_contacts == "si":
        assert code == 2 and "its units are si, but the option units, or another dump of the run, says cgs" in said.err
        return
    assert code == 0 and "d = 0.2 mm" in said.out
    with xarray.open_dataset("f.nc") as found:
        volume = math.prod(float(np.diff(found[f"{axis}_bounds"].values[0])[0]) for axis in "xyz")
        # -f l of the one contact: 1 dyn over 0.02 cm.
        assert float(found.contact_stress[0].sel(i="x", j="x").sum()) * volume == pytest.approx(2e-9, rel=1e-9)


@pytest.mark.parametrize("flags", ["ff ff ff", "pp ff ff"])
def test_contacts_across_a_border_that_their_dump_does_not_know_are_refused(here, capsys, flags):
    places = np.array([[0.005, 0.5, 0.5], [0.99, 0.5, 0.5]])
    for options in ([], ["--cells"]):
        code = fields([frame(0, places, RADII[:2], flags="pp ff ff")], *options, contacts=[pairs(0, places, flags=flags)])
        assert code == (2 if flags == "ff ff ff" else 0)
        if code:
            assert "the contact of grains 1 and 2 is 985 mm long" in (error := capsys.readouterr().err) and error.count("\n") == 1
    # Two grains fill a box without periodic axes.
    chain = grain_frame([[0.0, 0.0, 0.0], [0.019, 0.0, 0.0]], radii=0.01, low=(-0.01,) * 3, high=(0.029, 0.01, 0.01))
    pair = ContactFrame(chain.step, np.zeros((1, 3)), np.array([[0.019, 0.0, 0.0]]), np.zeros((1, 3)), np.array([chain.ids]))
    coarse_grain(chain, pair, Grid.around(chain, 0.01), width=0.01)


STL = "solid base\n" + "".join(
    "facet normal 0 0 1\nouter loop\n" + "".join(f"vertex {x} {y} 0\n" for x, y in corners) + "endloop\nendfacet\n"
    for corners in (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1)))) + "endsolid base\n"


@pytest.mark.parametrize("wall", ["base:plane", "base:cylinder:radius=1", "base:mesh:file=base.stl"])
@pytest.mark.parametrize("command", ["walls", "fields"])
def test_frames_without_grains_are_frames(here, command, wall):
    """The load of a wall is zero in them, and the mean of the fields counts them."""
    (here / "base.stl").write_text(STL)
    low = PLACES * [1, 1, 0] + [0, 0, 0.01]
    frames = [frame(step, low[:count], RADII[:count], walls={"base": np.ones((count, 3))}) for step, count in enumerate((0, 4, 0, 4))]
    (here / "g.dump").write_text("".join(frames))
    more = {"walls": ["--patch", "0.5"], "fields": ["--grid", "9", "--width", "1d", "--grains", "g.pvd"]}
    assert main([command, "g.dump", "--wall", wall, "--out", "w.nc", *more[command]]) == 0
    with xarray.open_dataset("w.nc", group="base") as found:
        np.testing.assert_allclose(found.force.values, np.array([0, 4, 0, 4])[:, None] * np.ones(3))


# --- what would not fit ---------------------------------------------------------------------------------------------------

@pytest.fixture
def small(monkeypatch):
    """A machine with 1 GB of free memory, so that no test can take more than that."""
    monkeypatch.setattr(memory, "free_memory", lambda: 1e9)


HUGE = [(["--width", "3"], "of memory"), (["--grid", "100000"], "of memory"),
        (["--grid", "99999999999999999999"], "of memory"), (["--spacing", "1e-9"], "--spacing|larger ones"),
        (["--spacing", "1e-300"], "larger ones"), (["--spacing", "0.001d"], "of memory"), (["--box", "0,1e9,0,1,0,1"], "of memory"),
        (["--box", "0,nan,0,1,0,1"], "finite"), (["--width", "-1"], "is not a length"), (["--spacing", "0"], "is not a length"),
        (["--grid", "0,1,1"], "is not a grid"), (["--grid", "-5"], "is not a grid"), (["--average", "0"], "--average")]


@pytest.mark.parametrize(("options", "message", "flags"), [
    *((*one, "ff ff ff") for one in HUGE), (["--width", "3"], "of memory", "pp pp pp"),
    (["--width", "99d", "--box", "0,1,0,1,0,1"], "of memory", "pp pp pp")])
def test_grids_that_do_not_fit_are_refused_in_one_line(here, capsys, small, options, message, flags):
    code = fields([frame(0, flags=flags), frame(1, flags=flags)], *options)
    error = capsys.readouterr().err
    assert code == 2 and error.count("\n") == 1 and re.search(message, error), error
    assert not (here / "f.nc").exists()


PATCHES = [(["--wall", "base:plane", "--patch", "1e-9"], "larger ones"), (["--wall", "base:plane", "--patch", "0.01d"], "of memory"),
           (["--wall", "base:plane", "--patch", "1e-300"], "larger ones"), (["--wall", "base:plane:u=0,1e9"], "larger ones"),
           (["--wall", "base:cylinder:radius=1:around=9999999999"], "larger ones"),
           (["--wall", "stone:inclusion:ids=1:around=1:along=9999999999"], "larger ones"),
           (["--wall", "stone:inclusion:ids=1-99999999999"], "too many grains"), (["--wall", "base:plane", "--patch", "nan"], "finite")]


@pytest.mark.parametrize(("options", "message"), PATCHES, ids=[" ".join(words) for words, _ in PATCHES])
def test_patches_that_do_not_fit_are_refused_in_one_line(here, capsys, small, options, message):
    (here / "g.dump").write_text(frame(0, walls={"base": np.ones((4, 3))}))
    (here / "c.dump").write_text(pairs(0))
    assert main(["walls", "g.dump", "--contacts", "c.dump", "--out", "w.nc", *options]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and message in error and not (here / "w.nc").exists()


def test_more_threads_than_can_be_started_do_no_harm(here):
    for threads in ("100000", "99999999999999"):
        assert fields([frame(0)], "--threads", threads) == 0


def test_free_memory_is_that_of_the_machine():
    assert 1e6 < memory.free_memory() < 1e14
    memory.check_memory(1e7, "a few cells", "")
    with pytest.raises(DembarkError, match=r"cells are too many: they take 1e\+\d+ TB of memory, .* GB are free, take fewer"):
        memory.check_memory(1e18, "cells", "take fewer")
