"""Headers as engines and tools write them: whatever surrounds the numbers, the frames are the same, or one line says what is not."""

from __future__ import annotations

import gzip
import struct
import warnings

import numpy as np
import pytest
from dumps import contacts_text, grains_text
from hypothesis import given, settings
from hypothesis import strategies as st

from dembark.postproc import ContactsDump, DumpError, DumpWarning, GrainsDump, open_dump, universe
from dembark.postproc.dumps.units import unit_style
from dembark.postproc.walls import PlaneWall
from dembark.postproc.walls.patches import plane_patches
from dembark.postproc.walls.stress import wall_stress

LOW, HIGH, TILT = np.array([-0.1, 0.2, 0.0]), np.array([0.3, 0.5, 0.7]), np.array([0.1, -0.05, 0.08])
EDGES = np.array([[0.4, 0.0, 0.0], [0.1, 0.3, 0.0], [-0.05, 0.08, 0.7]])
SHARES = np.array([[0.1, 0.2, 0.3], [0.9, 0.95, 0.85], [0.5, 0.01, 0.99]])
IMAGES = np.array([[0, 0, 0], [2, -1, 3], [-1, 0, 1]])
PLACES = LOW + SHARES @ EDGES
SPEEDS = np.array([[1.0, 2.0, 3.0], [0.5, 0.0, -1.0], [0.0, 0.25, 0.125]])
RADII, MASSES = np.array([0.01, 0.02, 0.03]), np.array([1e-3, 2e-3, 3e-3])
STYLES = ["si", "cgs", "micro", "nano", "real", "metal", "electron"]


def text(step, time=None, units="", style="si", box="tilt", places="x", order=(0, 1, 2), columns=(), label=False, between="", end="\n"):
    """A frame of three grains in a periodic, tilted box, with a header as it may be."""
    factor = unit_style(style, "")
    low, high, edges, tilt = (values / factor.length for values in (LOW, HIGH, EDGES, TILT))
    head = [f"ITEM: UNITS\n{units}"] * bool(units) + ([] if time is None else [f"ITEM: TIME\n{time / factor.time:.17g}"])
    head += [f"ITEM: TIMESTEP\n{step}", "ITEM: NUMBER OF ATOMS\n3"]
    if box == "tilt":
        xy, xz, yz = tilt
        least = [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
        most = [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
        head += ["ITEM: BOX BOUNDS xy xz yz pp pp pp"]
        head += [f"{low[n] + least[n]:.17g} {high[n] + most[n]:.17g} {tilt[n]:.17g}" for n in range(3)]
    else:
        head += ["ITEM: BOX BOUNDS abc origin pp pp pp"] + [" ".join(f"{x:.17g}" for x in (*edges[n], low[n])) for n in range(3)]
    values = {"id": [1, 2, 3], "type": [1, 2, 1], "radius": RADII / factor.length, "mass": MASSES / factor.mass}
    values |= {f"v{axis}": SPEEDS[:, n] / factor.velocity for n, axis in enumerate("xyz")}
    part = {"x": PLACES / factor.length, "xs": SHARES, "xu": (PLACES + IMAGES @ EDGES) / factor.length, "xsu": SHARES + IMAGES}[places]
    values |= {f"{axis}{places[1:]}": part[:, n] for n, axis in enumerate("xyz")}
    if "u" not in places:
        values |= {f"i{axis}": IMAGES[:, n] for n, axis in enumerate("xyz")}
    names = sorted(values, key=lambda name: (columns.index(name) if name in columns else 99, name)) + ["typelabel"] * label
    rows = [" ".join("glass" if name == "typelabel" else f"{values[name][n]:.17g}" for name in names) for n in order]
    return (between + "\n".join([*head, "ITEM: ATOMS " + " ".join(names), *rows]) + "\n").replace("\n", end)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(STYLES), st.booleans(), st.booleans(), st.sampled_from(["\n", "\r\n"]), st.sampled_from(["", "\ufeff"]),
       st.booleans(),
       st.lists(st.fixed_dictionaries({"box": st.sampled_from(["tilt", "abc"]), "places": st.sampled_from(["x", "xs", "xu", "xsu"]),
                                       "order": st.permutations([0, 1, 2]), "columns": st.permutations(["id", "x", "mass", "vx", "ix"]),
                                       "label": st.booleans(), "between": st.sampled_from(["", "\n", "# a remark\n", " \n\n"])}),
                min_size=1, max_size=3))
def test_whatever_the_header_the_frames_are_the_same(tmp_path_factory, style, named, timed, end, mark, packed, quirks):
    path = tmp_path_factory.mktemp("headers") / "a.dump"
    frames = [text(100 * n, 0.5 * n if timed else None, style * (named and n == 0), style, end=end, **quirk)
              for n, quirk in enumerate(quirks)]
    data = (mark + "".join(frames) + "\n" * len(quirks)).encode()
    path.write_bytes(gzip.compress(data) if packed else data)
    dumps = [GrainsDump(path, stream=stream, units="" if named else style) for stream in (False, True)]
    for frame in [one for dump in dumps for one in dump]:
        np.testing.assert_allclose(frame.positions, PLACES + IMAGES @ EDGES, rtol=1e-12)
        np.testing.assert_allclose(frame.wrapped, PLACES, atol=1e-12)
        np.testing.assert_allclose([frame.low, frame.high, frame.tilt], [LOW, HIGH, TILT], atol=1e-14)
        np.testing.assert_allclose(frame.velocities, SPEEDS, rtol=1e-12)
        np.testing.assert_allclose([frame.radii, frame.masses], [RADII, MASSES], rtol=1e-12)
        assert (frame.ids.tolist(), frame.types.tolist(), frame.extra) == ([1, 2, 3], [1, 2, 1], {})
        assert frame.time == (pytest.approx(0.5 * frame.step / 100) if timed else None)
    assert not dumps[0].remarks
    np.testing.assert_allclose(dumps[0].times, 0.5 * np.arange(len(quirks)) if timed else np.nan)


@pytest.mark.parametrize("where", ["file", "series", "later file"])
def test_units_hold_for_every_frame_however_it_is_chosen(tmp_path, where):
    frames = [text(100 * n, None, "cgs" * (n == (2 if where == "later file" else 0)), "cgs") for n in range(3)]
    if where == "file":
        (tmp_path / "a.dump").write_text("".join(frames))
    else:
        for number, frame in enumerate(frames):
            (tmp_path / f"a{number}.dump").write_text(frame)
    dump = GrainsDump(str(tmp_path / "a*.dump") if where != "file" else tmp_path / "a.dump")
    for number in (2, 1, 0):
        np.testing.assert_allclose(dump[number].radii, RADII)
    assert {one.units for one in open_dump(dump.path)} == ({"cgs"} if where != "later file" else {""})


@pytest.mark.parametrize("frames", [[("cgs", 0), ("si", 1)], [("", 0), ("cgs", 1)]])
def test_units_that_contradict_each_other_are_refused(tmp_path, frames):
    path = tmp_path / "a.dump"
    path.write_text("".join(text(step, None, units) for units, step in frames))
    if frames[0][0]:
        with pytest.raises(DumpError, match=r"frame 2: its units are si, but .*frame 1 says cgs"):
            GrainsDump(path)
    with pytest.raises(DumpError, match=r"frame 2: its units are (si|cgs), but those before are (cgs|not named)"):
        [*iter(GrainsDump(path, stream=True))]
    with pytest.raises(DumpError, match="its units are"):
        GrainsDump(path, units="metal")


@pytest.mark.parametrize(("units", "message"), [("lj", "its units are lj, which have no size in SI"),
                                                ("furlongs", "furlongs, which is not a unit style; there are si, cgs")])
def test_units_without_a_size_are_refused_by_name(tmp_path, units, message):
    (tmp_path / "a.dump").write_text(text(0, None, units) + text(1))
    for make in (lambda: GrainsDump(tmp_path / "a.dump")[1], lambda: next(iter(GrainsDump(tmp_path / "a.dump", stream=True)))):
        with pytest.raises(DumpError, match=message):
            make()


def test_what_units_are_in_si():
    """Against the values of the manual and of CODATA, each reached in another way than in the table."""
    real, metal, electron = (unit_style(name, "") for name in ("real", "metal", "electron"))
    assert real.force == pytest.approx(6.9477e-11, rel=1e-4) and metal.force == pytest.approx(1.602177e-9, rel=1e-6)
    assert real.mass == metal.mass == pytest.approx(electron.mass, rel=1e-9) == pytest.approx(1.6605391e-27)
    assert electron.length / electron.velocity == pytest.approx(1.03275e-15, rel=1e-5)
    # In the styles of one system of units a force is a mass times an acceleration.
    for name in ("cgs", "micro", "nano"):
        style = unit_style(name, "")
        assert style.force == pytest.approx(style.mass * style.length / style.time**2) == pytest.approx(
            style.mass * style.velocity / style.time)
        assert style.density == pytest.approx(style.mass / style.length**3)
    assert unit_style("real", "").factor("omegax") == pytest.approx(1e15) and unit_style("cgs", "").factor("tqx") == pytest.approx(1e-7)


def test_columns_of_unknown_dimension_are_named(tmp_path):
    path = tmp_path / "a.dump"
    path.write_text(text(0, None, "cgs", "cgs").replace("type", "c_wet", 1))
    with pytest.warns(DumpWarning, match=r"columns c_wet stay in the units of the file, cgs"):
        assert GrainsDump(path)[0].extra["c_wet"].tolist() == [1.0, 2.0, 1.0]


def test_contacts_have_units_as_well(tmp_path):
    path = tmp_path / "contacts.dump"
    frames = [contacts_text(step, [[1.0, 2.0, 3.0]], [[1.5, 2.0, 3.0]], [[1, 2]], [[7.0, 0.0, 0.0]]) for step in (0, 10)]
    path.write_text("ITEM: UNITS\ncgs\n" + "".join(frames))
    for frame in (ContactsDump(path)[1], *ContactsDump(path, stream=True)):
        np.testing.assert_allclose([frame.first[0, 2], frame.branch[0, 0], frame.forces[0, 0]], [0.03, 0.005, 7e-5])
    path.write_text("".join(frames))
    np.testing.assert_allclose(ContactsDump(path, units="cgs")[0].branch, [[0.005, 0.0, 0.0]])


# --- times ----------------------------------------------------------------------------------------------------------------

TIMES = [0.0, 1e-3, 1.5e-3]


def moving(path, times=TIMES, box=((0.0, 1.0),) * 3):
    """A grain that presses on a floor, at `times` (s) that do not go with the steps; None: the frame says none."""
    frames = [grains_text(100 * n, [[0.5, 0.5, 0.1]], np.array([0.1]), walls={"base": [[0.0, 0.0, 1.0]]}, box=box)
              for n in range(len(times))]
    path.write_text("".join(frame if time is None else frame.replace("ITEM: NUMBER", f"ITEM: TIME\n{time:.17g}\nITEM: NUMBER")
                            for frame, time in zip(frames, times, strict=True)))


def test_times_of_the_dump_are_those_of_the_frames(tmp_path):
    path = tmp_path / "a.dump"
    moving(path)
    floor = PlaneWall("base")
    load = wall_stress(GrainsDump(path), floor, plane_patches(floor, np.array([0.0, 1.0]), np.array([0.0, 1.0])), time_step=1e-5)
    assert load.times.tolist() == [frame.time for frame in GrainsDump(path)] == GrainsDump(path).times.tolist() == TIMES
    world = universe(path, time_step=1e-5)
    assert [step.time for step in world.trajectory] == TIMES and world.trajectory.dt == pytest.approx(1e-3)


def test_frames_without_a_time_among_others_are_told(tmp_path):
    moving(tmp_path / "a.dump", [0.0, None, 2e-3])
    with pytest.warns(DumpWarning, match="1 of 3 frames have no ITEM: TIME"):
        assert GrainsDump(tmp_path / "a.dump")[1].time is None


@pytest.mark.parametrize(("steps", "times"), [((0, 100, 0, 100), (0.0, 1.0, 2.0, 3.0)), ((0, 100, 50), (0.0, 1.0, 2.0)),
                                              ((0, 100, 200), (0.0, 2.0, 1.0))])
def test_steps_that_begin_anew_while_the_time_goes_on_are_no_restart(tmp_path, steps, times):
    (tmp_path / "a.dump").write_text("".join(text(step, time) for step, time in zip(steps, times, strict=True)))
    with pytest.raises(DumpError, match=r"its step is \d+ at time .*write what follows a reset of the steps into a file of its own"):
        GrainsDump(tmp_path / "a.dump")


def test_a_restarted_run_keeps_units_and_times(tmp_path):
    """Its header may stand in the middle of a line that the killed run left."""
    path, whole = tmp_path / "a.dump", [text(100 * n, 0.5 * n, "cgs", "cgs") for n in range(4)]
    for cut in (3, 40, 90, 200):
        path.write_text(whole[0] + whole[1] + whole[2][:-cut] + whole[2] + whole[3])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            dump = GrainsDump(path)
        assert (dump.steps.tolist(), dump.times.tolist()) == ([0, 100, 200, 300], [0.0, 0.5, 1.0, 1.5])
        np.testing.assert_allclose(dump[2].radii, RADII)
    for name in "ab":
        (tmp_path / f"{name}.part").write_text(whole[0] + whole[1] + (whole[2] if name == "a" else whole[3]))
    with pytest.warns(DumpWarning, match="steps go back"):
        assert GrainsDump([tmp_path / "a.part", tmp_path / "b.part"]).steps.tolist() == [0, 100, 300]


# --- places ---------------------------------------------------------------------------------------------------------------

@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-30.0, 30.0)] * 3), min_size=1, max_size=8),
       st.tuples(*[st.floats(-0.2, 0.2)] * 2, st.floats(-0.15, 0.15)), st.tuples(*[st.booleans()] * 3))
def test_wrapped_positions_lie_inside_the_box(tmp_path_factory, places, tilt, periodic):
    path = tmp_path_factory.mktemp("wrapped") / "a.dump"
    edges = np.diag(HIGH - LOW)
    edges[[1, 2, 2], [0, 0, 1]] = tilt
    box = "\n".join(" ".join(f"{x:.17g}" for x in (*edges[n], LOW[n])) for n in range(3))
    flags = " ".join("pp" if one else "ff" for one in periodic)
    rows = "\n".join(f"{n} {x:.17g} {y:.17g} {z:.17g} 0.1 1" for n, (x, y, z) in enumerate(places, 1))
    path.write_text(f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(places)}\nITEM: BOX BOUNDS abc origin {flags}\n{box}\n"
                    f"ITEM: ATOMS id xu yu zu radius mass\n{rows}\n")
    frame = GrainsDump(path)[0]
    share = np.linalg.solve(edges.T, (frame.wrapped - LOW).T).T
    whole = share - np.linalg.solve(edges.T, (frame.positions - LOW).T).T
    assert (share[:, list(periodic)] > -1e-12).all() and (share[:, list(periodic)] < 1.0 + 1e-12).all()
    np.testing.assert_allclose(whole, np.where(periodic, np.round(whole), 0.0), atol=1e-10)


def test_image_flags_that_are_not_used_are_told(tmp_path):
    path = tmp_path / "a.dump"
    path.write_text(text(0).replace("pp pp pp", "pp ff pp") + text(1).replace("pp pp pp", "pp ff pp"))
    with pytest.warns(DumpWarning, match="image flags along y, not periodic, are not used"):
        dump = list(GrainsDump(path))
    np.testing.assert_allclose(dump[0].positions, PLACES + (IMAGES * [1, 0, 1]) @ EDGES)
    path.write_text(text(0).replace(" pp pp pp", "") + text(1).replace(" pp pp pp", ""))
    columns = {"first": (1, 1, 1), "second": (1, 1, 1), "ids": (1, 1), "forces": (1, 1, 1)}
    for dump in (GrainsDump(path), ContactsDump(path, columns=columns)):
        with pytest.warns(DumpWarning, match="does not say which axes are periodic") as caught:
            list(dump)
        assert len(caught) == 1 and dump.remarks == (str(caught[0].message),)
    np.testing.assert_allclose(GrainsDump(path)[0].positions, PLACES + IMAGES @ EDGES)


# --- what is refused ------------------------------------------------------------------------------------------------------

TURNED = "ITEM: BOX BOUNDS abc origin pp pp pp\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n"


@pytest.mark.parametrize(("data", "message"), [
    (text(0).replace("ITEM: NUMBER", TURNED + "ITEM: NUMBER"), "frame 1: its box is general triclinic"),
    (text(0).replace("ITEM: NUMBER", "ITEM: TIME\nnan\nITEM: NUMBER"), "header cannot be read"),
    (text(0).replace("pp pp pp", "pp pp"), "frame 1: header cannot be read"),
    (b"(\xb5/\xfd" + b"x" * 40, "is compressed by zstd; unpack it first"),
    (b"BZh9" + b"x" * 40, "is compressed by bzip2; unpack it first"),
    (struct.pack("=q", -10) + b"DUMPCUSTOM" + b"x" * 99, "is a binary dump in a format that cannot be read; write a text dump"),
    (text(0).replace("\n2 ", "\n\n2 "), "more than its 3 lines"),
])
def test_a_header_that_cannot_be_served_gets_one_line(tmp_path, data, message):
    path = tmp_path / "a.dump"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    with pytest.raises(DumpError, match=message) as caught:
        list(GrainsDump(path))
    assert "\n" not in str(caught.value)


def plain(columns, rows):
    """A frame with these columns and rows."""
    return (f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 1\n0 1\nITEM: ATOMS {columns}\n"
            + "".join(row + "\n" for row in rows))


@pytest.mark.parametrize(("columns", "rows", "message"), [
    ("id x y z radius mass", ["1.5 0 0 0 1 1"], "column id holds 1.5, which is not an integer"),
    ("id type x y z radius mass", ["1 1.25 0 0 0 1 1"], "column type holds 1.25, which is not an integer"),
    ("id x y z radius mass", [f"1.2345{n}e+06 0 0 0 1 1" for n in range(3)], "rounded to six digits"),
    ("id x y z radius mass", ["1 0 0 0 -1 1"], "grain 1 has a radius of -1"),
    ("id x y z diameter mass", ["1 0 0 0 1 1", "2 0 0 0 1 -3"], "grain 2 has a mass of -3"),
])
def test_numbers_that_make_no_sense_are_refused(tmp_path, columns, rows, message):
    (tmp_path / "a.dump").write_text(plain(columns, rows))
    with pytest.raises(DumpError, match=message):
        GrainsDump(tmp_path / "a.dump")[0]


@pytest.mark.parametrize(("columns", "row", "density", "mass", "message"), [
    ("id x y z radius mass", "1 0 0 0 1 5", 2.0, 5.0, "the given density is not used, for the dump has a column mass"),
    ("id x y z radius density", "1 0 0 0 1 5", 2.0, 20.943951, "the given density is not used, for the dump has a column density"),
    ("id type x y z radius", "1 1 0 0 0 1\n2 2 0 0 0 1", 2.0, 8.3775804, "all grains have the given density, though there are 2 types"),
    ("id x y z radius mass mass", "1 0 0 0 1 5 7", None, 5.0, "columns mass appear more than once; the first of each is used"),
    ("id x y z radius mass shapex shapey shapez", "1 0 0 0 1 5 1 1 2", None, 5.0, "grains are taken as spheres"),
])
def test_masses_are_those_of_the_dump_or_one_line_says_what_they_are(tmp_path, columns, row, density, mass, message):
    (tmp_path / "a.dump").write_text(plain(columns, row.split("\n")))
    with pytest.warns(DumpWarning, match=message):
        assert GrainsDump(tmp_path / "a.dump", density=density)[0].masses[0] == pytest.approx(mass)


def test_parts_of_one_frame_in_files_of_processes_are_not_taken_for_frames_written_again(tmp_path):
    for number in range(2):
        (tmp_path / f"a.{number}.dump").write_text(text(0) + text(1))
    with pytest.raises(DumpError, match=r"a\.1\.dump and .*a\.0\.dump hold the same steps"):
        GrainsDump(str(tmp_path / "a.*.dump"))


def test_an_empty_file_of_a_series_is_a_frame_that_was_cut_off(tmp_path):
    for number in range(3):
        (tmp_path / f"a{number}.dump").write_text(text(number) if number != 1 else "")
    with pytest.raises(DumpError, match=r"a1\.dump, frame 1: empty \(skip_truncated=True leaves it out\)"):
        GrainsDump(str(tmp_path / "a*.dump"))
    dump = GrainsDump(str(tmp_path / "a*.dump"), skip_truncated=True)
    assert dump.steps.tolist() == [0, 2] and "a1.dump" in dump.truncated


def test_columns_of_contacts_in_another_order_are_not_guessed(tmp_path):
    path = tmp_path / "contacts.dump"
    good = contacts_text(0, [[1.0, 2.0, 3.0]], [[1.5, 2.0, 3.0]], [[1, 2]], [[7.0, 0.0, 0.0]])
    path.write_text(good.replace("c_contacts[1] c_contacts[2]", "c_contacts[2] c_contacts[1]"))
    with pytest.raises(DumpError, match="its 12 columns are not numbered in their order; name those of first"):
        ContactsDump(path)[0]
    path.write_text(good.replace(" 1 2 0 ", " 1 2.5 0 "))
    with pytest.raises(DumpError, match=r"ids holds 2\.5, which is not an integer"):
        ContactsDump(path)[0]


def test_reading_says_nothing_about_a_plain_dump(tmp_path):
    (tmp_path / "a.dump").write_text(text(0) + text(1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(list(GrainsDump(tmp_path / "a.dump"))) == 2
