"""Tracks of random walks with a known diffusion, through the box, with lost grains, as files, and on the command line."""

from __future__ import annotations

import numpy as np
import pytest
import xarray
from dumps import contacts_text, grains_text
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from dembark.common.errors import DembarkError
from dembark.postproc import tracks as tracking
from dembark.postproc.sources import open_source, select
from dembark.postproc.track_report import lines
from dembark.postproc.tracks import Tracks, diffusion, measure, read_csv, write_csv
from dembark.validation.cli import main

STEP, SIGMA = 1e-3, (2e-5, 4e-5, 1e-5)
EXACT = np.array(SIGMA) ** 2 / (2.0 * STEP)


def walk(seed=1, grains=60, frames=401, drift=(0.0, 0.1, 0.0)):
    """Steps of a normal distribution with a drift (m/s)."""
    moves = np.random.default_rng(seed).normal(scale=SIGMA, size=(frames - 1, grains, 3)) + STEP * np.array(drift)
    places = np.concatenate([np.zeros((1, grains, 3)), np.cumsum(moves, axis=0)])
    return Tracks(np.arange(1, grains + 1), STEP * np.arange(frames), places)


def test_a_random_walk_has_its_diffusion_drift_and_gaussian_velocities():
    found = measure(walk(), lags=(5 * STEP, 20 * STEP))
    for axis in range(3):
        one = found.coefficient[axis]
        assert one.value == pytest.approx(EXACT[axis], abs=max(2.0 * one.half, 0.1 * EXACT[axis]))
        assert one.half < 0.2 * EXACT[axis]
        assert found.fluctuation[axis].value == pytest.approx(SIGMA[axis] / STEP, rel=0.02)
        assert found.flatness[axis].value == pytest.approx(1.0, abs=0.05)
        assert found.squares[:4, axis] == pytest.approx(2.0 * EXACT[axis] * found.lags[:4], rel=0.05)
    assert found.velocity[1].value == pytest.approx(0.1, abs=0.001)


def test_the_intervals_of_the_diffusion_hold_its_value():
    held = [abs(one.value - EXACT[0]) <= one.half for seed in range(60)
            for one in [diffusion(walk(seed, grains=10, frames=201), (2 * STEP, 10 * STEP))[0]]]
    assert np.mean(held) > 0.85  # 95 % intervals; 60 of them scatter


def test_a_straight_flight_does_not_diffuse():
    """Negative control: the drift alone is no diffusion, and fluctuations of the starting speeds grow as the square of the lag."""
    walker = walk()
    flying = Tracks(walker.ids, walker.times, walker.times[:, None, None] * np.array([0.3, 0.0, 0.1]) + np.zeros((1, 60, 1)))
    found = measure(flying, lags=(5 * STEP, 20 * STEP))
    assert [one.value for one in found.coefficient] == pytest.approx([0.0] * 3, abs=1e-15)
    assert found.velocity[0].value == pytest.approx(0.3)
    speeds = np.random.default_rng(5).normal(size=(60, 3))
    ballistic = measure(Tracks(walker.ids, walker.times, walker.times[:, None, None] * speeds))
    assert np.polyfit(np.log(ballistic.lags), np.log(ballistic.squares[:, 0]), 1)[0] == pytest.approx(2.0, abs=5e-3)


def unit_walks(seen):
    """Walks of one step of one grain each: a sum over them of what is quadratic in the steps is its mean over random steps of variance 1.
    Where the grains are not `seen` (frames, grains) there is no place."""
    frames, grains = seen.shape
    for number in range((frames - 1) * grains):
        yield places_of(np.eye(1, (frames - 1) * grains, number), seen)


def places_of(steps, seen):
    """Tracks of these steps along x; along y they are at rest."""
    frames, grains = seen.shape
    places = np.zeros((frames, grains, 2))
    places[1:, :, 0] = np.cumsum(np.reshape(steps, (frames - 1, grains)), axis=0)
    places[~seen] = np.nan
    return Tracks(np.arange(grains), np.arange(float(frames)), places, "xy")


@given(st.integers(1, 3), st.floats(0.0, 0.3), st.integers(0, 10**6), st.sampled_from([(1, 2), (2, 5), (3, 4)]))
@settings(max_examples=10, deadline=None)
def test_self_diffusion_and_mean_squares_of_few_tracers_are_unbiased(grains, lost, seed, lags):
    """Exactly, with gaps and tracks of unequal length."""
    seen = np.random.default_rng(seed).random((16, grains)) >= lost
    seen[:6, 1:2] = seen[11:, 2:] = False
    assume(min((seen[lag:] & seen[:-lag]).sum() for lag in lags) >= 8)
    assert sum(diffusion(one, lags)[0].value for one in unit_walks(seen)) == pytest.approx(0.5)
    assert [sum(one.scatter(lag).squares[0] for one in unit_walks(seen)) for lag in lags] == pytest.approx(lags)


@pytest.mark.parametrize("lost", [0.0, 0.2])
def test_degrees_of_freedom_are_those_of_the_quadratic_form(lost):
    seen, units = np.random.default_rng(3).random((10, 2)) >= lost, np.eye(18)
    alone = [diffusion(places_of(one, seen), (1, 2))[0].value for one in units]
    both = [0.5 * (diffusion(places_of(units[i] + units[k], seen), (1, 2))[0].value - alone[i] - alone[k])
            for i in range(18) for k in range(i)]
    squares = np.sum(np.square(alone)) + 2.0 * np.sum(np.square(both))
    assert tracking.walk_degrees(places_of(units[0], seen), 1, 2) == pytest.approx(np.sum(alone) ** 2 / squares)


@pytest.mark.parametrize("kind", ["all of the time", "with gaps", "of unequal length"])
@pytest.mark.parametrize("grains", [1, 3, 10])
def test_intervals_of_the_diffusion_of_few_tracers_hold_its_value(grains, kind):
    random, held = np.random.default_rng(4), []
    for _ in range(100):
        tracks = walk(random, grains, 121)
        if kind == "with gaps":
            tracks.positions[random.random((121, grains)) < 0.2] = np.nan
        elif kind == "of unequal length":
            for grain in range(1, grains):
                tracks.positions[random.integers(10, 121):, grain] = np.nan
        one = diffusion(tracks, (2 * STEP, 6 * STEP))[0]
        held.append(abs(one.value - EXACT[0]) <= one.half < 20.0 * EXACT[0])
    assert np.mean(held) >= 0.89  # 95 % less three standard deviations of a hundred


def test_one_tracer_over_long_lags_has_no_interval():
    one = walk(grains=1)
    found = measure(one)
    assert {estimate.half for estimate in found.coefficient} == {np.inf}
    assert "(interval not known: a random walk of 2 degrees of freedom)" in lines([one], {one.name: found})[-1]


def slow(seed, frames=500, grains=1):
    """Tracks with velocities of unit variance, uncorrelated along x, and along y with a correlation time of 50 frames."""
    noise = np.random.default_rng(seed).normal(size=(frames + 1000, grains, 2))
    memory = 49.0 / 51.0
    speeds = np.stack([noise[:, :, 0], lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], noise[:, :, 1], axis=0)], axis=2)
    return Tracks(np.arange(grains), np.arange(float(frames)), np.cumsum(speeds[-frames:], axis=0), "xy")


def test_the_fluctuation_of_one_slow_tracer_is_not_too_small():
    """Ten correlation times: the mean that is taken out holds a tenth of the variance."""
    assert np.mean([measure(slow(seed)).fluctuation[1].value ** 2 for seed in range(30)]) == pytest.approx(1.0, abs=0.06)


def test_time_blocks_are_those_of_the_axis_that_is_measured():
    one = slow(1)
    other = Tracks(one.ids, one.times, one.positions[:, :, ::-1], "xy")
    for name in ("velocity", "fluctuation", "flatness", "coefficient"):
        assert getattr(measure(one), name)[::-1] == getattr(measure(other), name)


def dumped(folder, places, image_flags=False, absent=()):
    """A dump of places (frames, grains, 3) in a periodic box of 1 mm; `absent`: (frame, grain) that are left out."""
    box, length = ((0.0, 1e-3), (0.0, 1e-3), (-1.0, 1.0)), np.array([1e-3, 1e-3, np.inf])
    text = ""
    for frame, place in enumerate(places):
        images = np.where(np.isfinite(length), np.floor(place / length), 0.0)
        inside = place - np.where(np.isfinite(length), images * 1e-3, 0.0)
        one = grains_text(100 * frame, inside, np.full(len(place), 1e-4), velocities=np.full((len(place), 3), 0.5),
                          images=images if image_flags else None, box=box, flags="pp pp ff")
        if not image_flags:
            one = one.replace(" ix iy iz", " a b c")
        for number, grain in absent:
            if number == frame:
                lines = one.splitlines(keepends=True)
                lines = [line for line in lines if not line.startswith(f"{grain} ")] if len(lines) > 9 else lines
                one = "".join(lines).replace(f"ATOMS\n{len(place)}\n", f"ATOMS\n{len(place) - 1}\n")
        text += one
    (folder / "grains.dump").write_text(text)
    return folder / "grains.dump"


@pytest.mark.parametrize("image_flags", [True, False])
def test_tracks_go_through_the_faces_of_a_periodic_box(tmp_path, image_flags):
    exact = 5e-4 + walk(grains=8, frames=60).positions
    source = open_source(dumped(tmp_path, exact, image_flags), time_step=1e-5)
    found = tracking.follow(select(source, range(60)))
    moved = found.positions - found.positions[0]
    assert np.abs(exact - exact[0])[:, :, 1].max() > 2e-3  # some go round more than twice
    assert moved == pytest.approx(exact - exact[0], abs=1e-12)
    assert found.times == pytest.approx(STEP * np.arange(60))
    assert (found.others["vx"] == 0.5).all()


@pytest.mark.parametrize("columns", ["x y z ix iy iz", "xu yu zu ix iy iz", "x y z a b c"])
def test_positions_that_are_not_wrapped_are_used_though_they_all_lie_in_the_box(tmp_path, columns):
    """Without such columns the nearest image is taken, as in the last."""
    box = ((0.0, 1.0), (0.0, 1.0), (-1.0, 1.0))
    text = "".join(grains_text(100 * frame, np.array([[x, 0.5, 0.0]]), [0.1], box=box, flags="pp pp ff")
                   for frame, x in enumerate((0.05, 0.75, 0.05)))
    (tmp_path / "grains.dump").write_text(text.replace("x y z ix iy iz", columns))
    found = tracking.follow(select(open_source(tmp_path / "grains.dump", time_step=1e-5), range(3)))
    assert found.positions[1, 0, 0] == pytest.approx(-0.25 if columns.endswith("c") else 0.75)


def test_a_plane_layer_may_have_a_box_without_thickness(tmp_path):
    text = "".join(grains_text(100 * frame, np.array([[x, 0.0, 0.5]]), [0.1], box=((0.0, 1.0), (0.0, 0.0), (0.0, 1.0)), flags="pp ff ff")
                   for frame, x in enumerate((0.75, 0.05, 0.35)))
    (tmp_path / "grains.dump").write_text(text.replace("x y z ix iy iz", "x y z a b c"))
    found = tracking.follow(select(open_source(tmp_path / "grains.dump", time_step=1e-5), range(3)))
    assert found.positions[:, 0, 0] == pytest.approx([0.75, 1.05, 1.35]) and not found.positions[:, 0, 1].any()


@pytest.mark.parametrize(("image_flags", "frames", "absent", "noted"), [
    (False, 30, 0, True), (False, 120, 0, False), (True, 30, 0, False), (False, 120, 3, True), (True, 120, 3, False)])
def test_a_note_says_where_grains_pass_half_a_period_between_frames(tmp_path, monkeypatch, capsys, image_flags, frames, absent, noted):
    """0.5 m/s over 1.5 ms or 0.375 ms in a period of 1 mm, or four times the latter with a grain that is out of the dump for three
    frames."""
    monkeypatch.chdir(tmp_path)
    time = 0.045 / frames
    places = 5e-4 + np.tile(0.5 * time * np.arange(frames)[:, None, None], (1, 4, 1))
    dumped(tmp_path, places, image_flags, [(10 + k, 2) for k in range(absent)])
    assert main(["tracks", "grains.dump", "--time-step", repr(time / 100)]) == 0
    note = "note: by their velocities grains move up to 0.75 periods from one frame that has them to the next"
    assert (note in capsys.readouterr().out) == noted


def test_lost_grains_have_gaps_and_come_back(tmp_path):
    exact = 5e-4 + walk(grains=8, frames=30).positions
    source = open_source(dumped(tmp_path, exact, absent=[(10, 2), (11, 2), (29, 3)]), time_step=1e-5)
    found = tracking.follow(select(source, range(30)), [2, 3, 5])
    lost = ~np.isfinite(found.positions[:, :, 0])
    assert np.argwhere(lost).tolist() == [[10, 0], [11, 0], [29, 1]]
    assert found.positions[12:, 0] - found.positions[9, 0] == pytest.approx(exact[12:, 1] - exact[9, 1], abs=1e-12)
    assert len(found.displacements(1).moves) == 3 * 29 - 3 - 1
    with pytest.raises(DembarkError, match="there is no grain 77 in the chosen frames"):
        tracking.follow(select(source, range(30)), [2, 77])


def test_contacts_are_counted_with_their_forces(tmp_path):
    places = np.array([[1e-4, 1e-4, 0.0], [3e-4, 1e-4, 0.0], [5e-4, 1e-4, 0.0]])
    pairs = np.array([[1, 2], [2, 3]])
    for frame in range(2):
        text = contacts_text(100 * frame, places[pairs[:, 0] - 1], places[pairs[:, 1] - 1], pairs, [[3.0, 4.0, 0.0], [0.0, 0.0, 2.0]])
        with (tmp_path / "contacts.dump").open("a") as file:
            file.write(text)
    dumped(tmp_path, np.stack([places, places]))
    found = tracking.follow(select(open_source(tmp_path, time_step=1e-5), range(2)), [1, 2])
    assert found.others["contacts"].tolist() == [[1.0, 2.0]] * 2
    assert found.others["contact_force"].tolist() == [[5.0, 7.0]] * 2


@given(st.integers(1, 5), st.integers(2, 6), st.sets(st.sampled_from("xyz"), min_size=2), st.integers(0, 10**6))
def test_a_file_of_tracks_gives_them_back(tmp_path_factory, grains, frames, axes, seed):
    random = np.random.default_rng(seed)
    places = random.normal(size=(frames, grains, len(axes)))
    places[random.random((frames, grains)) < 0.2] = np.nan
    places[0, 0] = places[-1, -1] = 0.25
    seen = np.isfinite(places).all(axis=2)
    kept, grain = seen.any(axis=1), seen.any(axis=0)
    tracks = Tracks(np.arange(10, 10 + grains), 0.5 * np.arange(frames), places, "".join(sorted(axes)), {"vx": np.where(seen, 0.5, np.nan)})
    found = read_csv(write_csv(tmp_path_factory.mktemp("tracks") / "a.csv", tracks))
    assert found.axes == tracks.axes and found.ids.tolist() == tracks.ids[grain].tolist()
    # Frames in which nothing was seen may be there.
    at = np.abs(found.times[:, None] - tracks.times[kept]).argmin(axis=0)
    assert found.times[at] == pytest.approx(tracks.times[kept])
    assert found.positions[at] == pytest.approx(places[kept][:, grain], abs=1e-9, nan_ok=True)
    assert np.array_equal(found.others["vx"][at], tracks.others["vx"][kept][:, grain], equal_nan=True)
    assert np.isnan(np.delete(found.positions, at, axis=0)).all()


def test_lost_frames_and_jitter_leave_equal_intervals(tmp_path):
    rows = [f"{0.01 * k + 1e-9 * (grain * k % 3)},{grain},{k},0" for k in range(20) if k not in (4, 5, 11) for grain in range(4)]
    (tmp_path / "camera.csv").write_text("\n".join(["time,grain,x,z", *rows]))
    found = read_csv(tmp_path / "camera.csv")
    assert len(found.times) == 20 and found.interval == pytest.approx(0.01, rel=1e-6)
    assert np.isnan(found.positions[[4, 5, 11]]).all() and found.positions[6, :, 0].tolist() == [6.0] * 4


def test_times_that_are_no_frames_are_refused():
    tracks = Tracks(np.arange(3), 0.005 * np.arange(50), np.random.default_rng(1).normal(size=(50, 3, 2)), "xz")
    assert tracks.lag(0.01) == 2
    for time in (0.002, 0.008):
        with pytest.raises(DembarkError, match=r"no multiple of its 0\.005 s between frames"):
            tracks.lag(time)


def test_units_stand_in_the_header(tmp_path):
    (tmp_path / "camera.csv").write_text("Grain,grain,time [ms],x [mm],z (mm),vx [cm/s],note\na,1,0,1,2,5,?\nb,1,8,1.5,2,5,\n\n")
    found = read_csv(tmp_path / "camera.csv")
    assert found.times == pytest.approx([0.0, 8e-3]) and found.axes == "xz"
    assert found.positions[:, 0] == pytest.approx(np.array([[1e-3, 2e-3], [1.5e-3, 2e-3]]))
    assert found.others["vx"][:, 0] == pytest.approx([0.05, 0.05])


@pytest.mark.parametrize(("text", "line"), [
    ("", "has no tracks, it needs a header"),
    ("time,grain,x,z\n", "has no tracks"),
    ("time,x,z\n0,1,2\n", "its header has no grain, it must be such as time,grain,x,z"),
    ("time,grain,x\n0,1,2\n", "its header has no two of x, y and z"),
    ("time,grain,x,z\n0,1,2,one\n", "line 2, column z: 'one' is no number"),
    ("time,grain,x,z\n0,1,2\n", "line 2, column z: it is missing"),
    ("time,grain,x,z\n0,1,nan,3\n", "column x: 'nan' is not finite, leave rows out where a grain is not seen"),
    ("time,grain,x,z\n0,1.5,2,3\n", "a number of a grain is no integer"),
    ("time,grain,x,z\n0,1,2,3\n0,1,2,3\n", "grain 1 is there twice at 0 s"),
    ("time,grain,x,x [mm],z\n0,1,2,3,4\n", "the column x is there twice"),
    ("time,grain,x,z\n0,01,1,0,2,0,3\n", "line 2, has 7 fields, the header 4, separate fields by commas"),
    ("time,grain,x,x,z\n0,1,2,3,4\n", "has two columns 'x'"),
    ("time [kg],grain,x,z\n0,1,2,3\n", "cannot convert '1 kg' to s"),
])
def test_a_wrong_file_gets_one_line(tmp_path, text, line):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DembarkError) as caught:
        read_csv(tmp_path / "a.csv")
    assert line in str(caught.value) and "\n" not in str(caught.value)


def test_frames_at_unequal_intervals_are_refused():
    one = walk(frames=20)
    with pytest.raises(DembarkError, match=r"frames lie 0\.001 to 0\.003 s apart, displacements need equal intervals"):
        measure(one.at([0, 1, 4, 5]))
    with pytest.raises(DembarkError, match=r"a lag of 1 s is not within 0\.019 s"):
        measure(one, lags=(1e-3, 1.0))


def test_a_run_is_compared_with_a_camera(tmp_path, monkeypatch, capsys):
    """The camera sees x and z of other grains, every fourth frame."""
    monkeypatch.chdir(tmp_path)
    dumped(tmp_path, 5e-4 + walk(grains=20, frames=121).positions, image_flags=True)
    write_csv(tmp_path / "camera.csv", walk(2, grains=20, frames=121).at(range(0, 121, 4)).along("xz"))
    words = ["tracks", "grains.dump", "--time-step", "1e-5", "--grains", "1-15", "--against", "camera.csv", "--diffusion", "4ms,12ms"]
    assert main([*words, "--out", "run.nc", "--plot", "plots"]) == 0
    said = capsys.readouterr().out
    assert "grains.dump: 15 grains; 121 frames, 1 ms apart" in said and "camera.csv: 20 grains; 31 frames, 4 ms apart" in said
    numbers = [line for line in said.splitlines() if line.startswith("  fluctuation")]
    run, camera = (float(line.split("x ")[1].split(" ±")[0]) for line in numbers)
    assert run == pytest.approx(SIGMA[0] / STEP / 2.0, rel=0.1) and camera == pytest.approx(run, rel=0.1)
    assert (tmp_path / "plots/tracks.png").is_file()
    with xarray.open_dataset("run.nc") as data:
        assert data.position.shape == (121, 15, 3) and data.seen.values.tolist() == ["x", "z"]
        assert data.self_diffusion.values == pytest.approx(EXACT[[0, 2]], rel=0.5)
        assert data.vx.attrs == {"units": "m/s", "long_name": "velocity along x"}
    assert main(["tracks", "camera.csv", "--grains", "3", "--frames", ":20", "--out", "part.csv"]) == 0
    part = read_csv(tmp_path / "part.csv")
    assert part.ids.tolist() == [3] and len(part.times) == 20


@pytest.mark.parametrize(("words", "line"), [
    (["camera.csv", "--out", "a.txt"], "a.txt does not end in .csv or .nc"),
    (["camera.csv", "--grains", "5-1"], "'5-1' names no grains, in --grains"),
    (["camera.csv", "--grains", "77"], "there is no grain 77, in camera.csv, it has 20 grains, 1 to 20"),
    (["camera.csv", "--diffusion", "3ms"], "'3ms' is not a range, in --diffusion"),
    (["camera.csv", "--against", "absent.csv"], "absent.csv cannot be read"),
    (["camera.csv", "--out", "camera.csv"], "camera.csv is a file that is read"),
    (["grains.dump"], "the times of the frames are not known"),
    (["grains.dump", "--time-step", "1e-5", "--frames", "3"], "have one frame, displacements need two"),
])
def test_a_mistake_gets_one_line(tmp_path, monkeypatch, capsys, words, line):
    monkeypatch.chdir(tmp_path)
    dumped(tmp_path, 5e-4 + walk(grains=3, frames=5).positions)
    write_csv(tmp_path / "camera.csv", walk(grains=20, frames=41).along("xz"))
    assert main(["tracks", *words]) == 2
    said = capsys.readouterr().err.strip()
    assert line in said and "\n" not in said
