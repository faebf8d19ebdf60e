"""dam_break_cubes: trajectories of the experiment pass, wrong ones fail; a tiny flume with cubes in both engines."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.estimates import unlike
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc.pictures import water
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case import folders, walls
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

dam = module("dam_break_cubes")
DT, STRIDE, SPACING = 1e-3, 100, 0.025
# One particle at 3 m/s has 0.5 % of the energy of the column; with a spacing of 0.05 m it has 1.3 %, more than `energy_growth` allows.
TINY = {"spacing": 0.0375, "column_length": 0.4125, "column_height": 0.3, "distance": 0.3, "downstream_length": 0.7875,
        "flume_height": 0.525, "flume_width": 0.2625, "run_time": 0.42, "frames": 3, "rows": 70, "stiffness": 5e4, "courant": 0.36,
        # Half of this spacing is an eighth of a cube: too much for a film.
        "slit_pressure": 0.0, "lattice_noise": 0.0, "cube_noise": 0.0}
SPHERES = {"contacts": "spheres", "edge_spheres": 7}
# The scheme of Sarmakeeva et al. (2017), but for its friction and its h of 2.1 spacings, whose layer would be as thick as a cube here.
SOURCE = SPHERES | {"coupling": "potential", "boundary": "dynamic", "kernel": "cubic_spline", "delta": 0.0, "xsph": 0.5, "shepard": 30}


def run(cubes: str, carried: float = 0.0, late: float = 0.0, jumps: float = 0.0, shut: bool = False, dry: bool = False, within: int = 0,
        leaked: int = 0, made: float = 0.0, noise: float = 0.0) -> Any:
    """The top cube on the experiment's way, `carried` (m) too far after a second, `late` (s) in falling, `jumps` (m) at 0.9 s; water on
    the floor and in the gaps unless it is `dry` or the gaps are `shut`; particles `within` a cube or `leaked`; energy `made` of nothing."""
    p = defaults("dam_break_cubes", arrangement=cubes, spacing=SPACING, lattice_noise=noise, cube_noise=0.0)
    count, time = {"three": 3, "six": 6}[cubes], np.arange(0.0, 1.6001, 0.01)
    rows: dict[str, Any] = {"step": np.round(time / DT), "time": time, "overlap": 0.0 * time}
    energy = np.ones(len(time))
    energy[80:] += made * 0.5 * 1000.0 * 9.81 * p["column_length"] * p["flume_width"] * p["column_height"] ** 2
    rows |= {name: (energy if name == "kinetic_energy" else 0.0 * time) for name in dam.STORED}
    for k in range(1, count + 1):
        place = np.array([1.775, 0.0 if cubes == "three" else (k - 2) * 0.2, 0.075])
        rows |= {f"cube{k}_{axis}": np.full(len(time), place[i]) for i, axis in enumerate("xyz")}
        rows |= {f"cube{k}_{part}": np.full(len(time), float(part == "qw")) for part in ("qw", "qx", "qy", "qz")}
    rows[f"cube{count}_y"] = 0.0 * time
    rows[f"cube{count}_x"] = np.interp(time, *dam.published(cubes, "x")) + carried * time
    times, heights = dam.published(cubes, "z")
    low, high = heights[-1], heights[0]
    rows[f"cube{count}_z"] = 0.075 + 0.3 * (np.interp(time - late, times, heights) - low) / (high - low)
    rows[f"cube{count}_z"][90] += jumps

    def frame(step: int) -> Any:
        x, y, z = (part.ravel() for part in np.meshgrid(np.arange(1.0125, 2.0, SPACING), np.arange(-0.3375, 0.35, SPACING),
                                                       np.arange(0.0125, 0.05, SPACING), indexing="ij"))
        places, row, cube = np.stack([x, y, z], axis=1), int(np.searchsorted(rows["step"], step)), np.zeros(len(x), bool)
        for k in range(1, count + 1):
            cube |= (np.abs(places - dam.pose(rows, k, row)[0]) < 0.075).all(axis=1)
        if shut:
            cube |= (np.abs(x - 1.775) < 0.075) & (np.abs(y) < 0.3)
        if dry:
            cube |= x < 1.3
        places = places[~cube]
        places[:within] = [1.775, 0.0, 0.075]
        places[len(places) - leaked:, 2] = -0.1
        return frame_of(places, 0.5 * SPACING, {}, step=step)

    frames = [frame(step) for step in range(STRIDE, 1601, STRIDE)]
    derived = {"cube_count": count, "stride": STRIDE, "grain_count": min(len(one.ids) for one in frames), "layers": 3}
    return SimpleNamespace(parameters=p, derived=derived, time_step=DT, grains=lambda: frames, times=lambda: rows)


def verdicts(cubes: str, **changes: Any) -> dict[str, dict[str, Any]]:
    return judged("dam_break_cubes", dam.measure([run(cubes, **changes)]))


def test_the_experiment_itself_passes() -> None:
    every = {"half_fallen", "rise", "inside", "leaked", "energy_growth"}
    three, six = verdicts("three"), verdicts("six")
    assert every | {"three_rms_x"} <= names(three, "pass"), three
    assert every | {"six_rms_x"} <= names(six, "pass"), six
    assert three["half_fallen"]["value"] == pytest.approx(1.10, abs=0.02)


@pytest.mark.parametrize(("change", "named"), [
    ({"edge": 0.1}, "edge = 0.15"), ({"distance": 2.0}, "distance = 1.7"), ({"cube_density": 1200.0}, "cube_density = 800"),
    ({"column_length": 1.0}, "column_length = 1.5")])
def test_another_set_up_is_not_compared_with_the_experiment(change: dict[str, float], named: str) -> None:
    one = run("three")
    one.parameters |= change
    found = judged("dam_break_cubes", dam.measure([one]))
    for name in ("three_rms_x", "half_fallen", "rise"):
        assert found[name]["verdict"] == "info" and named in found[name]["reason"], name
    assert "leaked" in names(found, "pass")


@pytest.mark.parametrize("variant", sorted(find("dam_break_cubes").variants))
@pytest.mark.parametrize("profile", [None, "standard", "full"])
def test_all_variants_have_the_set_up_of_the_experiment(variant: str, profile: str | None) -> None:
    p = resolve(find("dam_break_cubes"), profile, variant)
    assert not unlike(p, dam.PUBLISHED) and all(p[name] >= least for name, least in dam.LEAST_LENGTHS.items())


def test_the_rise_before_a_second_needs_a_second() -> None:
    one, rows = run("three"), run("three").times()
    one.times = lambda: {name: values[:90] for name, values in rows.items()}
    one.grains = lambda: run("three").grains()[:8]
    found = judged("dam_break_cubes", dam.measure([one]))["rise"]
    assert (found["verdict"], found["value"]) == ("info", None) and "before 1 s" in found["reason"]


def test_dry_gaps_and_a_dry_floor_are_seen_and_not_judged() -> None:
    for cubes, name, changes in (("six", "gap_filled", {"shut": True}), ("three", "floor_wetted", {"dry": True})):
        wet, dry = verdicts(cubes)[name], verdicts(cubes, **changes)[name]
        assert wet["value"] > 0.9 and dry["value"] < 0.6 and wet["verdict"] == dry["verdict"] == "info" and wet["reference"] is None


def test_the_worst_replica_counts_where_nothing_may_happen() -> None:
    runs = [run("three", noise=0.05), run("three", carried=0.02, noise=0.05), run("three", carried=0.04, leaked=2, noise=0.05)]
    found = judged("dam_break_cubes", dam.measure(runs))
    assert found["leaked"]["value"] == pytest.approx(2.0)
    each = [verdicts("three", carried=carried)["three_rms_x"]["value"] for carried in (0.0, 0.02, 0.04)]
    assert found["three_rms_x"]["value"] == pytest.approx(np.mean(each))
    assert found["three_rms_x"]["interval"][1] > each[1]


def test_a_single_run_that_is_random_decides_nothing() -> None:
    found = verdicts("three", noise=0.05)
    assert (found["three_rms_x"]["verdict"], found["leaked"]["verdict"]) == ("info", "pass")


def test_what_goes_over_the_walls_has_not_leaked() -> None:
    """From the outer edge of a wall's top, 1 m high, with 2 m/s outwards and 1 m/s upwards; a millimetre lower it is through the wall."""
    p, t, thick = defaults("dam_break_cubes"), 0.4, 0.075
    v = np.array([[0.3, 2.0, 1.0 - 9.81 * t], [-2.0, 0.3, 1.0 - 9.81 * t], [0.0, 0.0, 0.0]])
    fall = 1.0 * t - 0.5 * 9.81 * t**2
    for drop, found in ((-1e-6, [[False, False, True], [True, True, False]]), (1e-3, [[True, True, True], [False, False, False]])):
        height = 1.0 + fall - drop
        places = np.array([[1.0, 0.35 + thick + 2.0 * t, height], [-1.5 - thick - 2.0 * t, 0.0, height], [1.0, 0.3, -0.05]])
        np.testing.assert_array_equal(dam.tank(p, thick).outside(places, v), found)


def test_what_bounces_on_the_top_of_a_wall_has_not_leaked() -> None:
    """A particle of a run, above the wall and 0.1 s later: then, back in free flight, it was 0.3 m below the top at the inner face."""
    p = defaults("dam_break_cubes")
    places = np.array([[1.247105, 0.370131, 1.050771], [1.210368, 0.4297332, 1.056744]])
    v = np.array([[-0.86871, 0.696412, -0.583182], [0.333574, 0.435077, 1.07171]])
    np.testing.assert_array_equal(dam.tank(p, 0.075).outside(places, v), [[False, False], [True, True]])
    # Past the inner edge of the top by 17 mm, and past the outer one below it by 0.4 mm.
    skimmed, w = np.array([[2.61688, 0.6475215, 0.7326508]]), np.array([[-0.988949, 1.3141, -2.40614]])
    np.testing.assert_array_equal(dam.tank(p, 0.075).outside(skimmed, w), [[False], [True]])
    # In the wall, 20 mm below its top, and above the wall's inner half.
    places = np.array([[1.0, 0.39, 0.98], [1.0, 0.37, 1.01]])
    np.testing.assert_array_equal(dam.tank(p, 0.075).outside(places, 0.0 * v), [[True, False], [False, True]])


def study(last: float, fallen: float = 1.1, standing: float = 0.0) -> dict[str, dict[str, Any]]:
    """x at the end and the time of the fall at 50 and 25 mm as they are, and at 12.5 mm what is given."""
    points = [point({"spacing": spacing}, {"x_end": x, "half_fallen": t, "standing": standing})
              for spacing, x, t in ((0.0125, last, fallen), (0.05, 2.24, 1.2), (0.025, 2.2, 1.12))]
    return judged("dam_break_cubes", dam.study("spacing", points, "spacing"))


def test_spacings_whose_results_approach_each_other_pass() -> None:
    found = study(2.19)
    assert {"x_end_converged", "half_fallen_converged"} <= names(found, "pass")
    assert found["x_end_converged"]["value"] == pytest.approx(-0.01)
    # A cube that stands in both has not fallen at the same time.
    assert study(2.19, 1.12, standing=1.0)["half_fallen_converged"]["verdict"] == "info"
    assert names(study(2.17, 1.0), "fail") == {"x_end_converged", "half_fallen_converged"}


def test_cubes_that_part_have_no_gap() -> None:
    """The outer cubes run ahead: after half an edge there is no gap between them and the middle one."""
    axes = np.arange(1.65, 1.95, 0.0125), np.arange(-0.35, 0.35, 0.0125), [0.01, 0.03]
    lattice = np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")], axis=1)
    for ahead, gap in ((0.0, True), (0.07, True), (0.08, False)):
        centres = [np.array([1.775 + ahead * (k != 0), 0.2 * k, 0.075]) for k in (-1, 0, 1)]
        assert np.isfinite(dam.gap_filling(lattice, centres, 0.075, 0.0125)) == gap


def test_springs_stop_a_corner_that_lands_within_its_rounding() -> None:
    """A cube that falls by its edge and lands with one corner, a/sqrt(2) from its centre, feels a quarter of its mass there: I = M a^2/6.
    With half of the stiffness runs of six ended when one landed."""
    p = defaults("dam_break_cubes")
    speed, mass = np.sqrt(2.0 * 9.81 * p["edge"]), 0.25 * p["cube_density"] * p["edge"] ** 3
    assert speed * np.sqrt(mass / p["stiffness"]) < p["rounding"] < speed * np.sqrt(mass / (0.5 * p["stiffness"]))


def test_a_cube_that_stands_has_not_fallen_in_time() -> None:
    one = run("three")
    one.times()["cube3_z"][:] = 0.375
    found = judged("dam_break_cubes", dam.measure([one]))["half_fallen"]
    assert (found["verdict"], found["value"]) == ("fail", pytest.approx(1.6))


def test_a_cube_is_known_however_it_is_turned() -> None:
    """A quarter turn about z takes x to y; the frame of the body sees the reverse."""
    row = {"cube1_x": [0.0], "cube1_y": [0.0], "cube1_z": [0.0], "cube1_qw": [0.5], "cube1_qx": [0.0], "cube1_qy": [0.0], "cube1_qz": [0.5]}
    _, turn = dam.pose(row, 1, 0)
    np.testing.assert_allclose(turn.inv().apply([[0.0, 1.0, 0.0]]), [[1.0, 0.0, 0.0]], atol=1e-15)


@pytest.mark.parametrize("scheme", [{}, SPHERES, SOURCE], ids=["ours", "spheres", "source"])
@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_water_runs_against_cubes_in_an_engine(engine: str, scheme: dict[str, Any], simulate: Any) -> None:
    one = simulate("dam_break_cubes", engine, TINY | scheme)
    found = judged("dam_break_cubes", dam.measure([one]))
    assert {"leaked", "inside", "energy_growth"} <= names(found, "pass"), found
    height = one.times()[f"cube{int(one.derived['cube_count'])}_z"]
    assert np.max(height) - height[0] <= 0.015  # the run is too short and too small for `rise`
    rows = one.times()
    assert 1.0 <= rows["time"][-1] / 0.42 < 1.1
    # The water has come, and the cubes are where they were pushed, the lowest ones first.
    assert max(rows[f"cube{k}_x"][-1] for k in (1, 2, 3)) > 0.375 + 0.002
    for k in (1, 2, 3):
        assert rows[f"cube{k}_z"][-1] == pytest.approx(0.075 + 0.15 * (k - 1), abs=0.02)


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
@pytest.mark.parametrize(("floor", "between"), [(2.0, 0.0), (0.0, 2.0), (0.1, 0.0)])
def test_cubes_and_floor_have_frictions_of_their_own(engine: str, floor: float, between: float, simulate: Any) -> None:
    """In YADE cubes of less friction than the floor had slid on it with their own."""
    rows = simulate("dam_break_cubes", engine, TINY | {"floor_friction": floor, "friction": between}).times()
    low, middle, top = (rows[f"cube{k}_x"][-1] - 0.375 for k in (1, 2, 3))
    if floor > 1.0:
        assert low < 0.005, low
    elif between > 1.0:
        assert low > 0.02 and 0.8 * low < top < middle < low, (low, middle, top)
    else:
        assert low > 0.02 and abs(top) < 0.1 * low, (low, middle, top)


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_six_cubes_stand_upright_at_first(engine: str, simulate: Any) -> None:
    """YADE may make a clump with half a turn, which is none of the cube."""
    one = simulate("dam_break_cubes", engine, TINY | {"arrangement": "six", "flume_width": 0.675, "run_time": 0.02, "frames": 2, "rows": 5,
                                                     "lattice_noise": 0.05, "cube_noise": 1e-3})
    rows, p = one.times(), one.parameters
    for k in range(1, 7):
        place, turn = dam.pose(rows, k, 0)
        assert turn.magnitude() < 2e-3
        assert place[0] == pytest.approx(0.375, abs=p["cube_noise"] + 1e-4)
    heights = sorted(float(rows[f"cube{k}_z"][0]) for k in range(1, 7))
    np.testing.assert_allclose(heights, [0.075, 0.075, 0.075, 0.225, 0.225, 0.375], atol=1e-3)
    # Pictures have them there, too.
    record = walls.resolved(folders.find("dam_break_cubes"), {**p, **one.derived})
    drawn = water.boxes(one.folder, record, np.zeros(1, np.int64))
    assert len(drawn) == 6
    for k in range(1, 7):
        corners = drawn[f"cube{k}"].reshape(-1, 3)
        np.testing.assert_allclose(corners.mean(axis=0), [rows[f"cube{k}_{axis}"][0] for axis in "xyz"], atol=1e-9)
        np.testing.assert_allclose(np.ptp(corners, axis=0), 0.15, atol=1e-3)


def controls_dam_break_cubes(_folder: Path) -> Iterator[Control]:
    three, six = verdicts("three"), verdicts("six")
    for right, cubes in ((three, "three"), (six, "six")):
        yield Control("cubes that the water carries along 0.12 m too far", right, verdicts(cubes, carried=0.08))
    yield Control("a stack that falls a tenth of a second late", three, verdicts("three", late=0.1))
    yield Control("a top cube that jumps", six, verdicts("six", jumps=0.075))
    yield Control("a particle in a cube", three, verdicts("three", within=1))
    yield Control("a particle that leaks out", three, verdicts("three", leaked=1))
    yield Control("a fall that the spacing decides", study(2.19), study(2.17, 1.0))
    yield Control("a scheme that makes energy", three, verdicts("three", made=0.05))
