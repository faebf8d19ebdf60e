"""`dembark fields` and `dembark walls` as users type them: what they write, what they say, and one line for each mistake."""

from __future__ import annotations

import json
import resource
from contextlib import contextmanager

import numpy as np
import pytest
import pyvista
import xarray
from dumps import contacts_text, grains_text, write_times
from hypothesis import given
from hypothesis import strategies as st

from dembark.common.errors import DembarkError
from dembark.postproc.cli import progress
from dembark.postproc.cli_options import counts, frame_numbers, length, parse_wall, span
from dembark.postproc.fields import run as field_run
from dembark.validation.cli import main

RADIUS, WEIGHT, STEPS = 0.005, 0.02, (100, 200, 300, 400)
BOX = ((0.0, 0.04), (0.0, 0.04), (0.0, 0.06))


def packing():
    """Columns of four grains on a floor: places, wall forces, and the contacts' ids, ends and forces."""
    i, j, k = (index.ravel() for index in np.meshgrid(range(4), range(4), range(4), indexing="ij"))
    place = 2.0 * RADIUS * (np.column_stack([i, j, k]) + 0.5)
    up = WEIGHT * (4.0 - k)[:, None] * [0.0, 0.0, 1.0]
    upper = np.nonzero(k)[0]
    return place, np.where(k[:, None] == 0, up, 0.0), upper, up


@pytest.fixture
def run(tmp_path, monkeypatch):
    """A run folder with four frames, in the current folder."""
    monkeypatch.chdir(tmp_path)
    place, floor, upper, up = packing()
    grains, contacts = "", ""
    for number, step in enumerate(STEPS):
        share = 1.0 + 0.1 * (number % 2)
        grains += grains_text(step, place, np.full(64, RADIUS), masses=np.full(64, WEIGHT / 9.81), walls={"base": share * floor}, box=BOX)
        contacts += contacts_text(step, place[upper], place[upper - 1], np.column_stack([upper + 1, upper]), share * up[upper], box=BOX)
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "grains.dump").write_text(grains)
    (folder / "contacts.dump").write_text(contacts)
    record = {"case": "silo", "engine": "liggghts", "time_step": 1e-4, "parameters": {},
              "walls": {"base": {"kind": "plane", "normal": [0.0, 0.0, 1.0]}, "side": {"kind": "cylinder", "radius": 0.03}}}
    (folder / "run.json").write_text(json.dumps(record))
    total = floor[:, 2].sum()
    write_times(folder / "time.csv", {"step": STEPS, "time": 1e-4 * np.array(STEPS), "kinetic_energy": np.zeros(4), "base_fx": np.zeros(4),
                                      "base_fy": np.zeros(4), "base_fz": total * np.array([1.0, 1.1, 1.0, 1.1])})
    return folder


def test_fields_of_a_run_need_nothing_but_the_folder(run, capsys):
    assert main(["fields", "run", "--spacing", "1d", "--width", "0.5d", "--out", "f.nc", "--paraview", "f.pvd", "--grains", "g.pvd",
                 "--average", "2"]) == 0
    said = capsys.readouterr().out
    with xarray.open_dataset("f.nc") as found:
        assert found.time.values == pytest.approx([0.015, 0.035])
        assert found.time_bounds.values == pytest.approx(np.array([[0.01, 0.02], [0.03, 0.04]]))
        volume = float(np.prod([np.diff(found[f"{axis}_bounds"].values[0])[0] for axis in "xyz"]))
        assert float(found.density[0].sum()) * volume == pytest.approx(64 * WEIGHT / 9.81, rel=1e-9)
        # The base is known from the record: with it the integral of the stress is the moment of the weights about the floor.
        place, *_ = packing()
        moment = 1.05 * WEIGHT * place[:, 2].sum()
        assert float(found.stress.sel(i="z", j="z")[0].sum()) * volume == pytest.approx(moment, rel=1e-8)
        assert found.kernel == "gaussian" and found.kernel_width == pytest.approx(0.005) and found.engine == "liggghts"
        assert "dembark" in found.history and found.case == "silo"
    with xarray.open_dataset("f.nc", group="base") as found:
        assert found.sizes["time"] == 4 and float(found.force[0, 2]) == pytest.approx(64 * WEIGHT)
    assert pyvista.get_reader("f.pvd").time_values == pytest.approx([0.015, 0.035])
    assert pyvista.get_reader("g.pvd").time_values == pytest.approx([0.01, 0.02, 0.03, 0.04])
    assert "d = 10 mm" in said
    assert "written: f.nc" in said and "note" not in said
    assert float(said.split("difference ")[1].split(";")[0]) < 1e-9


def test_fields_of_dumps_with_options(run, capsys):
    words = ["fields", "run/grains.dump", "--contacts", "run/contacts.dump", "--kernel", "lucy", "--width", "12 mm", "--grid", "3,4,5",
             "--box", "0,40mm,0,0.04,0,5d", "--frames", "1::2", "--time-step", "1e-3 s", "--out", "f.nc"]
    assert main([*words, "--threads", "1"]) == 0
    said = capsys.readouterr().out
    assert "2 frames, 1 to 3 of 4; steps 200 to 400, 0.2 to 0.4 s" in said
    assert "the position of the wall base is unknown" in said
    with xarray.open_dataset("f.nc") as found:
        assert dict(found.sizes) | {"x": 3, "y": 4, "z": 5, "time": 1} == dict(found.sizes)
        assert found.time.values == pytest.approx([0.3]) and float(found.z_bounds.max()) == pytest.approx(0.05)
    assert main([*words, "--wall", "base:plane:normal=z", "--threads", "2", "--fields", "density, stress"]) == 0
    assert "is not known" not in capsys.readouterr().out
    with xarray.open_dataset("f.nc") as found:
        assert {name for name in found if not name.endswith("bounds")} == {"density", "stress"}
    assert main(["fields", "run/grains.dump", "--fields", "stress", "--out", "g.nc"]) == 2
    assert "there is no stress" in capsys.readouterr().err
    assert main(["fields", "run/grains.dump", "--out", "g.nc"]) == 0
    said = capsys.readouterr().out
    assert "without contacts there is no contact stress" in said and "times are steps" in said
    with xarray.open_dataset("g.nc") as found:
        assert "stress" not in found and "kinetic_stress" in found


def test_means_over_uneven_frames_and_over_a_sheared_box_are_no_surprise(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    place, floor, *_ = packing()

    def said(steps, command, shear=lambda step: 0.0):
        text = ""
        for step in steps:
            tilt = 1e-3 * shear(step)
            bounds = f"xy xz yz pp pp ff\n0 {0.04 + tilt} {tilt}\n0 0.04 0\n0 0.06 0\n"
            head, _, rest = grains_text(step, place, np.full(64, RADIUS), walls={"base": floor}).partition("ITEM: ATOMS")
            text += f"{head.partition('ITEM: BOX')[0]}ITEM: BOX BOUNDS {bounds}ITEM: ATOMS{rest}"
        (tmp_path / "a.dump").write_text(text)
        code = main(["fields" if command else "walls", "a.dump", "--time-step", "1e-4", *(command or ["--wall", "base:plane"])])
        out, error = capsys.readouterr()
        assert code == 0, error
        return out

    grid = ["--grid", "1,1,1", "--width", "2d", "--out", "a.nc"]
    for command in (grid, []):
        assert "apart" not in said((0, 100, 200), command)
        assert "note: frames lie 10 to 100 steps apart; means are over frames, not over time" in said((0, 100, 110), command)
    for command in (grid, []):
        assert "changes its shape" not in said((0, 100), command)
        for cycles in (0.5, 1.0):  # after a complete one, only the frames between the ends are sheared
            sheared = said((0, 25, 50, 75, 100), command, lambda step, cycles=cycles: np.sin(0.01 * np.pi * cycles * step) ** 2)
            assert "note: the periodic box changes its shape" in sheared


def test_averages_by_cell_mask_thin_cells(run, capsys):
    words = ["fields", "run", "--cells", "--out", "f.nc", "--box", "0,0.04,0,0.04,-1mm,59mm", "--grid", "2,2,3"]
    assert main([*words, "--least-contacts", "32"]) == 0
    said = capsys.readouterr().out
    # Two contacts of each of four columns lie in a lower or middle cell, in each of four frames.
    assert "66.7 % of them have at least 32 contacts" in said and float(said.split("difference ")[1].split(";")[0]) < 1e-12
    with xarray.open_dataset("f.nc") as found:
        assert found.method == "cell averages" and int(found.contact_count.sum()) == 4 * 64
        assert np.isnan(found.stress[0, :, :, 2]).all() and not np.isnan(found.stress[0, :, :, :2]).any()
        lower = 4 * 1.05 * WEIGHT * (4 * RADIUS + 3 * 2 * RADIUS) / 0.02**3
        np.testing.assert_allclose(found.stress[0, :, :, 0, 2, 2], lower)
    assert main([*words[:4], "f.nc"]) == 0
    assert "0 % of them have at least 3000 contacts" in capsys.readouterr().out


def test_walls_of_a_run(run, capsys):
    assert main(["walls", "run", "--patch", "1d", "--out", "w.nc", "--paraview", "w.pvd", "--plot", "plots"]) == 0
    said = capsys.readouterr().out
    with xarray.open_dataset("w.nc", group="base") as found:
        assert dict(found.sizes)["u"] == 4
        np.testing.assert_allclose(found.stress.sel(component="normal"), 1.05 * 4 * WEIGHT / (2 * RADIUS) ** 2, rtol=1e-9)
        assert found.peak_force.values == pytest.approx([1.1 * 64 * WEIGHT])
    assert "the engine's own force in time.csv at 4 of these steps differs by at most" in said
    assert float(said.split("differs by at most ")[1].split()[0]) < 1e-9
    assert {path.name for path in (run.parent / "plots").iterdir()} == {"wall_base.png", "wall_base_force.png", "wall_base_peaks.png"}
    assert (run.parent / "w.pvd").is_file()


def square(path, side, height=0.0):
    """Text STL of a square from the origin on, two triangles."""
    corner = side * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]) + [0.0, 0.0, height]
    facets = "".join("facet normal 0 0 1\nouter loop\n" + "".join("vertex {:g} {:g} {:g}\n".format(*corner[n]) for n in three) +
                     "endloop\nendfacet\n" for three in ((0, 1, 2), (0, 2, 3)))
    path.write_text(f"solid base\n{facets}endsolid base\n")


def test_several_walls_and_an_inclusion(run, capsys):
    square(run / "base.stl", 40.0)
    assert main(["walls", "run", "--wall", "base:mesh:file=run/base.stl:unit=mm:by=group",
                 "--wall", "stone:inclusion:ids=2-3:surface=cylinder", "--paraview", "w.pvd", "--out", "w.nc"]) == 0
    said = capsys.readouterr().out
    assert "written: w_base.pvd" in said and "written: w_stone.pvd" in said
    with xarray.open_dataset("w.nc", group="base") as found:
        assert found.patch.values.tolist() == ["base"] and float(found.area.sum()) == pytest.approx(0.0016)
        assert float(found.stress[0, 0]) == pytest.approx(1.05 * 64 * WEIGHT / 0.0016)
    with xarray.open_dataset("w.nc", group="stone") as found:
        # The upper two of a column press on the second and third grain, which press on the first.
        assert float(found.force[0, 2]) == pytest.approx((1.0 - 3.0) * WEIGHT)


def test_a_wall_in_the_wrong_place_raises_a_doubt(run, capsys):
    assert main(["walls", "run", "--wall", "base:plane:origin=0,0,-30mm", "--out", "w.nc"]) == 0
    assert "is it where the simulation had it?" in capsys.readouterr().out


def test_a_wall_that_faces_away_raises_a_doubt(run, capsys):
    assert main(["walls", "run", "--wall", "base:plane:normal=0,0,-1", "--out", "w.nc"]) == 0
    said = capsys.readouterr().out
    assert "note: the grains pull at this wall; does its normal point to them?" in said and "times its mean" not in said
    assert main(["walls", "run", "--wall", "base:plane", "--out", "w.nc"]) == 0
    said = capsys.readouterr().out
    assert "does its normal point" not in said and "(1.05 times its mean)" in said


@pytest.mark.parametrize("unit", ["m", "um"])
def test_an_stl_in_another_unit_is_refused_with_those_that_fit(run, capsys, unit):
    """Both commands, before any file is made: the loads of a mesh a thousand times too large would be nonsense."""
    square(run / "base.stl", 40.0)
    wall = f"base:mesh:file=run/base.stl:unit={unit}"
    for words in (["walls", "run", "--out", "w.nc"], ["fields", "run", "--out", "f.nc"]):
        assert main([*words, "--wall", wall]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and "--wall base" in error and "with unit=cm or unit=mm or unit=in it fits" in error
        assert [path.name for path in run.parent.iterdir()] == ["run"]
        assert main([*words, "--wall", wall.replace(f"unit={unit}", "unit=mm")]) == 0
        for path in run.parent.glob("*.nc"):
            path.unlink()
        capsys.readouterr()


def test_a_mesh_that_fits_in_no_unit_is_refused(run, capsys):
    square(run / "base.stl", 40.0, height=-500.0)
    assert main(["walls", "run", "--out", "w.nc", "--wall", "base:mesh:file=run/base.stl:unit=mm"]) == 2
    assert "the grains that feel it are 101 to 101 radii away from it" in (error := capsys.readouterr().err) and "fits" not in error


@contextmanager
def files_no_larger_than(size):
    """Writing beyond `size` (bytes) fails, as on a full disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("words", [
    ["fields", "run", "--width", "0.5d", "--out", "f.nc"], ["fields", "run", "--width", "0.5d", "--average", "1", "--out", "f.nc"],
    ["fields", "run", "--width", "0.5d", "--paraview", "f.pvd"],
    ["fields", "run", "--width", "0.5d", "--average", "1", "--grains", "g.pvd"],
    ["walls", "run", "--patch", "0.1d", "--out", "w.nc"],
    ["walls", "run", "--patch", "0.1d", "--paraview", "w.pvd"]], ids=lambda words: " ".join(words[:1] + words[-4:]))
def test_a_full_disk_gets_one_line_and_leaves_nothing(run, words, capsys):
    """Wherever the writing ends."""
    for size in (0, 1000, 10_000):
        with files_no_larger_than(size):
            code = main(words)
        error = capsys.readouterr().err
        left = sorted(path.name for path in run.parent.iterdir())
        if code == 0:
            assert size and not error
            break
        assert code == 1 and error.count("\n") == 1 and error.startswith("dembark: cannot write") and "File too large" in error
        assert left == ["run"]
    assert main(words) == 0


def test_a_cut_off_frame_is_left_out_and_told(run, capsys):
    path = run / "grains.dump"
    path.write_bytes(path.read_bytes()[:-100])
    assert main(["walls", "run", "--out", "w.nc"]) == 0
    said = capsys.readouterr().out
    assert "3 frames, 0 to 2 of 3" in said and "note: " in said and "truncated" in said


MISTAKES = [
    (["fields", "nowhere.dump", "--out", "f.nc"], "nowhere.dump"),
    (["fields", "run"], "--out"),
    (["fields", "run", "--out", "no/f.nc"], "no folder no"),
    (["fields", "run", "--out", "run"], "is a folder"), (["fields", "run", "--out", "f.csv"], "f.csv does not end in .nc, in --out"),
    (["walls", "run", "--out", "w.vtk"], "w.vtk does not end in .nc, in --out"),
    (["fields", ".", "--out", "f.nc"], "grains.dump"), (["walls", "."], "grains.dump"), (["render", ".", "--out", "x.png"], "grains.dump"),
    (["fields", "run", "--out", "run/grains.dump"], "grains.dump is a file that is read"),
    (["fields", "run/grains.dump", "--contacts", "run/contacts.dump", "--paraview", "run/contacts.dump"], "is a file that is read"),
    (["fields", "run", "--out", "f.nc", "--paraview", "f.nc"], "named twice"),
    (["fields", "run", "--out", "f.nc", "--kernel", "gausian"], "gaussian"),
    (["fields", "run", "--out", "f.nc", "--width", "0d"], "'0d' is not a length"),
    (["fields", "run", "--out", "f.nc", "--width", "1.5 kg"], "--width: cannot convert '1.5 kg' to m; give e.g. '4 mm'"),
    (["fields", "run", "--out", "f.nc", "--width", "4,5 mm"], "--width: '4,5 mm' has a comma; write the decimal point: 4.5 mm"),
    (["fields", "run", "--out", "f.nc", "--width", "1e999d"], "--width = 1e999d: give a finite number"),
    (["fields", "run", "--out", "f.nc", "--grid", "64,64"], "64,64,64"),
    (["fields", "run", "--out", "f.nc", "--grid", "0"], "--grid"),
    (["fields", "run", "--out", "f.nc", "--grid", "9", "--spacing", "1d"], "--grid and --spacing"),
    (["fields", "run", "--out", "f.nc", "--spacing", "0.01d"], "too many"),
    (["fields", "run", "--out", "f.nc", "--box", "0,1"], "--box"),
    (["fields", "run", "--out", "f.nc", "--box", "0,1,1,0,0,1"], "rising"),
    (["fields", "run", "--out", "f.nc", "--frames", "10:50"], "0 to 3"),
    (["fields", "run", "--out", "f.nc", "--frames", "all"], "--frames"),
    (["fields", "run", "--out", "f.nc", "--average", "5"], "1 to 4"),
    (["fields", "run", "--out", "f.nc", "--average", "some"], "--average"),
    (["fields", "run", "--out", "f.nc", "--time-step", "-1"], "--time-step"),
    (["fields", "run", "--out", "f.nc", "--density", "2500 kg"], "--density"),
    (["fields", "run", "--out", "f.nc", "--threads", "0"], "--threads"),
    (["fields", "run", "--out", "f.nc", "--wdth", "1d"], "--wdth"),
    (["fields", "run", "--out", "f.nc", "--contacts", "none.dump"], "none.dump"),
    (["fields", "run/grains.dump", "--cells", "--out", "f.nc"], "--contacts"),
    (["fields", "run", "--out", "f.nc", "--contact-columns", "first"], "first=1,2,3"),
    (["fields", "run", "--out", "f.nc", "--fields", "strss"], "did you mean stress?"),
    (["fields"], "DUMP"),
    (["walls", "run/grains.dump", "--out", "w.nc"], "no wall is given, walls in the dump: base"),
    (["walls", "run", "--wall", "base"], "name:kind:key=value"),
    (["walls", "run", "--wall", "base:plain"], "did you mean plane?"),
    (["walls", "run", "--wall", "base:plane:orign=0,0,0"], "did you mean origin?"),
    (["walls", "run", "--wall", "base:plane:origin=0,0"], "three numbers"),
    (["walls", "run", "--wall", "base:plane:normal=0,0,0"], "not a direction"),
    (["walls", "run", "--wall", "base:plane:normal"], "no value"),
    (["walls", "run", "--wall", "base:cylinder"], "radius is missing"),
    (["walls", "run", "--wall", "base:cylinder:radius=1:outside=no"], "'outside' takes no value"),
    (["walls", "run", "--wall", "base:cylinder:radius=1:radius=2"], "'radius' is given twice"),
    (["fields", "run", "--out", "f.nc", "--contact-columns", "first=1,2,3 first=4,5,6"], "first is given twice"),
    (["walls", "run", "--wall", "base:cylinder:radius=-1"], "not a length"),
    (["walls", "run", "--wall", "base:cylinder:radius=1:around=none"], "around"),
    (["walls", "run", "--wall", "side:cylinder:radius=1"], "walls in it: base"),
    (["walls", "run", "--wall", "base:plane", "--wall", "base:plane"], "given twice"),
    (["walls", "run", "--wall", "base:mesh:file=none.stl"], "none.stl does not exist"),
    (["walls", "run", "--wall", "base:mesh:file=run/run.json"], "STL"),
    (["walls", "run", "--wall", "stone:inclusion:ids=1-x"], "1,5-9"),
    (["walls", "run", "--wall", "stone:inclusion:ids=999"], "grain 999"),
    (["walls", "run/grains.dump", "--wall", "stone:inclusion:ids=9"], "--contacts"),
    (["walls", "run", "--patch", "nothing"], "--patch"),
    (["walls", "run", "--wall", "base:mesh:file=run/base.stl:unit=furlongs"],
     "unit=furlongs is unknown, in --wall base, it must be m, dm, cm, mm, um, in, ft or d"),
    (["walls", "run", "--plot", "run/run.json"], "name a folder"),
    (["walls", "run", "--paraview", "w.vtk"], ".pvd"),
    (["walls", "empty", "--out", "w.nc"], "no grains.dump"),
]


@pytest.mark.parametrize(("words", "expected"), MISTAKES, ids=[" ".join(words[:1] + words[2:]) for words, _ in MISTAKES])
def test_a_mistake_gets_one_line_and_exit_code_2(run, capsys, words, expected):
    (run.parent / "empty").mkdir()
    before = sorted(run.parent.rglob("*"))
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.startswith("dembark: ") and error.count("\n") == 1 and expected in error
    assert sorted(run.parent.rglob("*")) == before


def test_contacts_of_other_steps_are_refused_and_nothing_is_left(run, capsys):
    path = run / "contacts.dump"
    path.write_text(path.read_text().replace("TIMESTEP\n300\n", "TIMESTEP\n301\n"))
    assert main(["fields", "run", "--out", "f.nc", "--paraview", "f.pvd"]) == 2
    assert "no frame of step 300" in capsys.readouterr().err
    assert [path.name for path in run.parent.iterdir()] == ["run"]
    assert main(["fields", "run", "--out", "f.nc", "--frames", ":2"]) == 0


def test_foreign_contacts_are_told_apart_by_an_option(run, capsys):
    path = run / "contacts.dump"
    lines = [line.split(" ", 1)[1] if line[:1].isdigit() and line.count(" ") == 11 else line for line in path.read_text().splitlines()]
    path.write_text("\n".join(lines).replace("c_contacts[1] ", "") + "\n")
    assert main(["fields", "run", "--out", "f.nc"]) == 2
    assert "11 columns" in (error := capsys.readouterr().err) and "--contact-columns" in error
    assert main(["fields", "run", "--out", "f.nc", "--contact-columns", "first=3,1,2 second=3,4,5 ids=6,7 forces=9,10,11"]) == 0


def test_an_interruption_leaves_nothing(run, capsys, monkeypatch):
    frames = iter(range(2))

    def stop(*words, **options):
        if next(frames, None) is None:
            raise KeyboardInterrupt
        return original(*words, **options)
    original = field_run.coarse_grain
    monkeypatch.setattr(field_run, "coarse_grain", stop)
    assert main(["fields", "run", "--out", "f.nc", "--paraview", "f.pvd", "--grains", "g.pvd", "--average", "1"]) == 130
    assert capsys.readouterr().err == "dembark: interrupted\n"
    assert [path.name for path in run.parent.iterdir()] == ["run"]


def test_progress_tells_a_line_now_and_then_where_there_is_no_terminal(capsys):
    with progress("fields", 3, interval=0.0) as advance:
        advance()
        advance()
    assert capsys.readouterr().err.splitlines() == ["dembark: fields: frame 1 of 3", "dembark: fields: frame 2 of 3"]


# --- options ---------------------------------------------------------------------------------------------------------------

@given(st.integers(1, 30), st.one_of(st.none(), st.integers(-35, 35)), st.one_of(st.none(), st.integers(-35, 35)),
       st.one_of(st.none(), st.integers(1, 7)))
def test_frames_are_chosen_as_in_python(count, begin, end, step):
    text = ":".join("" if part is None else str(part) for part in (begin, end)) + ("" if step is None else f":{step}")
    expected = list(range(count))[begin:end:step]
    if expected:
        assert frame_numbers(text, count) == expected
    else:
        with pytest.raises(DembarkError, match="no frame"):
            frame_numbers(text, count)


def test_single_frames_and_nonsense():
    assert frame_numbers("3", 5) == [3] and frame_numbers("-1", 5) == [4] and frame_numbers(" 1 : 3 ", 5) == [1, 2]
    for text in ("5", "", "-", "1:2:0", "a", "1,2", "::-"):
        with pytest.raises(DembarkError, match="--frames"):
            frame_numbers(text, 5)


def test_lengths_grids_and_ranges():
    assert length("1.5d", 0.004, "x") == pytest.approx(0.006) and length("7 mm", 1.0, "x") == pytest.approx(0.007)
    assert length("0.01", 1.0, "x") == 0.01 and length("2e0 d", 0.5, "x") == 1.0
    assert counts("64") == (64, 64, 64) and counts("1, 2,3") == (1, 2, 3)
    assert span("-1d,5mm", 0.01, "x") == pytest.approx((-0.01, 0.005))
    for text in ("-1d", "inf", "nan", "0", "d"):
        with pytest.raises(DembarkError, match=r"(in |^)x\b"):
            length(text, 1.0, "x")


def test_walls_as_they_are_written():
    side = parse_wall("side:cylinder:radius=2d:axis=-x:outside:velocity=0,0,-20mm/s:since=0.5s:origin=1mm,2cm,0", 0.005).wall
    assert (side.radius, side.axis, side.inward, side.origin) == (0.01, (-1.0, 0.0, 0.0), False, (0.001, 0.02, 0.0))
    assert side.motion.velocity == pytest.approx((0.0, 0.0, -0.02)) and side.motion.since == 0.5
    assert parse_wall("stone:inclusion:ids=1,5-7,9", 1.0).wall.ids == (1, 5, 6, 7, 9)
    assert parse_wall("left:plane:normal=1,1,0", 1.0).wall.normal == (1.0, 1.0, 0.0)
