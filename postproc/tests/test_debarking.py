"""Debarking from impacts: what was put into the records is found, on the right side of the right log, and laws have their known limits."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray
from dumps import grains_text
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dembark.common.errors import DembarkError
from dembark.postproc import DumpError
from dembark.postproc.debarking import (
    ForceRange,
    Load,
    Logs,
    RemovalLaw,
    bark_force,
    bond,
    dose,
    doses,
    force_bound,
    outcome,
    peak_of_duration,
    peak_of_impulse,
    peak_of_speed,
)
from dembark.postproc.debarking.report import against, figures, lines
from dembark.postproc.impacts import COLUMNS, RECORD, read_impacts
from dembark.validation.cli import main

RANGE = ForceRange(1000.0, 5000.0)
PERIOD = 2.0
LOGS = Logs(np.array([1, 2, 3]), np.array([0.05, 0.1, 0.12]), np.array([10.0, 30.0, 40.0]), 1.5)


def records(count: int, seed: int = 0, **fields: object) -> np.ndarray:
    """Impacts of the drum's shell on log 1 at its lowest point, with a force in the range, spread over four revolutions."""
    found = np.zeros(count, RECORD)
    found["id_a"], found["id_b"], found["peak_force"], found["relative_speed"] = 1, -1, 2000.0, 1.0
    found["nz"], found["duration"], found["impulse"] = 1.0, 0.01, 2000.0 * 0.01 * 2.0 / math.pi
    found["time"] = np.random.default_rng(seed).uniform(0.0, 4 * PERIOD, count)
    for name, values in fields.items():
        found[name] = values
    return found


def load(impacts: np.ndarray, logs: Logs = LOGS, **more: float) -> Load:
    return Load(impacts, logs, 0.0, 4 * PERIOD, PERIOD, **more)


@given(angle=st.floats(-math.pi, math.pi), turn_a=st.floats(-50.0, 50.0), turn_b=st.floats(-50.0, 50.0), axis=st.integers(0, 2))
def test_contacts_are_on_the_sector_of_the_logs_own_frame(angle: float, turn_a: float, turn_b: float, axis: int) -> None:
    """A mark on the log, at the contact's angle less the rotation, lies in the sector that gets the impact; b gets it on its other side."""
    normal = dict.fromkeys(("nx", "ny", "nz"), 0.0)
    across, up = (("ny", "nz"), ("nz", "nx"), ("nx", "ny"))[axis]
    normal |= {across: math.cos(angle), up: math.sin(angle)}
    # Where the first impact's normal lies in two planes, a second one outside of the window shows the axis.
    impacts = records(2, id_b=2, turn_a=turn_a, turn_b=turn_b, time=[1.0, 100.0], **normal)
    impacts["nx ny nz".split()[axis]] = 0.0
    impacts[across][1], impacts[up][1] = 0.6, 0.8
    found = doses(impacts, LOGS, RANGE, np.array([0.0, PERIOD]), sectors=360)
    for log, place in ((0, angle + math.pi - turn_a), (1, angle - turn_b)):
        hit = int(np.flatnonzero(found.useful[0, log])[0])
        apart = (math.radians(hit + 0.5) - place + math.pi) % (2.0 * math.pi) - math.pi
        assert abs(apart) < math.radians(0.5) + 1e-6
    assert found.useful.sum() == 2 and found.damaging.sum() == 0


def test_forces_are_sorted_by_the_range_and_slow_contacts_only_rub() -> None:
    forces, speeds = [999.0, 1000.0, 5000.0, 5001.0, 9000.0, 3000.0], [1, 1, 1, 1, 1, 0.01]
    impacts = records(6, peak_force=forces, relative_speed=speeds, friction_loss=2.0)
    found = doses(impacts, LOGS, RANGE, np.array([0.0, 4 * PERIOD]), least_speed=0.1, stiffness=1e6)
    assert (found.useful.sum(), found.damaging.sum(), found.friction.sum()) == (2, 2, 12.0)
    assert found.excess.sum() == pytest.approx((5001.0**2 + 9000.0**2 - 2 * 5000.0**2) / 2e6)
    assert len(found.peaks) == 5 and found.shape[1] == pytest.approx(0.5)


@pytest.mark.parametrize("name", ["peak_force", "time", "relative_speed"])
def test_an_impact_that_is_neither_hard_nor_soft_is_refused(name: str) -> None:
    impacts = records(3)
    impacts[name][1] = math.nan
    with pytest.raises(DumpError, match="impact 2 holds a number that is not finite"):
        doses(impacts, LOGS, RANGE, np.array([0.0, 4 * PERIOD]))


def test_two_logs_share_the_friction_and_each_is_hit() -> None:
    found = doses(records(1, id_b=3, friction_loss=2.0), LOGS, RANGE, np.array([0.0, 4 * PERIOD]))
    assert found.friction.sum(axis=(0, 2)).tolist() == [1.0, 0.0, 1.0]
    assert found.useful.sum(axis=(0, 2)).tolist() == [1.0, 0.0, 1.0]


def test_pieces_of_a_long_file_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(1)
    angle = random.uniform(-math.pi, math.pi, 100)
    impacts = records(100, nx=np.cos(angle), nz=np.sin(angle), id_a=random.integers(1, 3, 100), id_b=3, turn_a=random.normal(0, 9, 100),
                      peak_force=random.uniform(0, 8000, 100), friction_loss=random.random(100))
    edges = np.linspace(0.0, 4 * PERIOD, 17)
    whole = doses(impacts, LOGS, RANGE, edges)
    monkeypatch.setattr(dose, "_CHUNK", 7)
    parts = doses(impacts, LOGS, RANGE, edges)
    for name in ("useful", "damaging", "friction", "peaks"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name))
    assert whole.effective.sum() > 100


def even_impacts(count: int, seed: int = 2) -> np.ndarray:
    """At random on all sides of log 1."""
    return records(count, seed, turn_a=np.random.default_rng(seed + 1).uniform(0.0, 2.0 * math.pi, count), friction_loss=0.5)


ONE = Logs(np.array([1]), np.array([0.1]), np.array([30.0]), 1.5)


def test_impacts_at_random_clear_a_log_as_the_coverage_law_says() -> None:
    width = 0.002
    found = outcome(load(even_impacts(900), ONE), RANGE, RemovalLaw(width=width))
    expected = 1.0 - math.exp(-900 * width / (2.0 * math.pi * 0.1))
    assert found.degree[0] == 0.0 and (np.diff(found.degree) >= 0.0).all()
    assert found.degree[-1] == pytest.approx(expected, abs=0.01)
    assert found.even(np.array([4.0]))[0] == pytest.approx(expected, rel=1e-9)
    assert found.values["sector_dispersion"].value == pytest.approx(1.0, abs=0.8)
    time = found.values["debarking_time"].value
    assert found.even(np.array([time / PERIOD]))[0] == pytest.approx(0.9, rel=1e-9)
    assert time == pytest.approx(4 * PERIOD * math.log(10.0) * 2.0 * math.pi * 0.1 / (900 * width), rel=1e-9)
    assert found.values["useful_impacts"].value == pytest.approx(900 / 4)
    low, high = found.values["useful_impacts"].interval
    assert low < 900 / 4 < high


def test_a_log_that_is_hit_on_one_side_keeps_its_bark_on_the_other() -> None:
    found = outcome(load(records(900), ONE), RANGE, RemovalLaw(width=0.02))
    assert found.degree[-1] == pytest.approx(1.0 / 12.0, rel=1e-6)
    assert found.values["sector_dispersion"].value == pytest.approx(900.0)
    assert found.even(np.array([4.0]))[0] > 0.99


def test_energy_of_friction_takes_bark_off() -> None:
    energy, area = 200.0, 2.0 * math.pi * 0.1 * 1.5
    found = outcome(load(even_impacts(900), ONE), RANGE, RemovalLaw(energy=energy))
    assert found.degree[-1] == pytest.approx(1.0 - math.exp(-450.0 / (energy * area)), abs=0.02)
    assert found.values["friction_work"].value == pytest.approx(450.0 / 4 / area)


def test_harder_impacts_damage_more_wood() -> None:
    soft, hard = (outcome(load(records(400, peak_force=force), stiffness=1e6), RANGE).values for force in (4000.0, 6000.0))
    assert soft["damaging_share"].value == soft["wood_loss_index"].value == 0.0
    assert hard["damaging_share"].value == 1.0
    assert hard["wood_loss_index"].value == pytest.approx(400 * (6000.0**2 - 5000.0**2) / 2e6 / 80.0 / 4)
    assert "debarking_degree" not in hard


def test_two_logs_that_fall_head_on_reach_the_bound_and_no_more() -> None:
    """Masses on springs in series, each with the speed of the shell and of a fall, by integration of their motion."""
    speed, radius, s, m = 1.2, 1.3, 1e7, 30.0
    v = math.sqrt((speed * radius) ** 2 + 4.0 * 9.81 * radius)
    done = solve_ivp(lambda _, y: [y[1], -0.5 * s * y[0] / (0.5 * m)], (0.0, math.pi / math.sqrt(s / m)), [0.0, 2.0 * v], rtol=1e-10,
                     atol=1e-12, max_step=1e-5)
    bound = force_bound(speed, radius, s, m)
    assert (0.5 * s * done.y[0]).max() == pytest.approx(bound, rel=1e-6)
    one = Load(records(1), Logs(np.array([1, 2]), np.array([0.1, 0.1]), np.array([m, 0.5 * m])), 0.0, 1.0, 2.0 * math.pi / speed,
               stiffness=s, radius=radius)
    assert one.bound == pytest.approx(bound)
    assert math.isnan(load(records(1)).bound)


def in_space(count: int) -> np.ndarray:
    """Impacts with normals in all directions."""
    normal = np.random.default_rng(5).normal(size=(3, count))
    nx, ny, nz = normal / np.linalg.norm(normal, axis=0)
    return records(count, nx=nx, ny=ny, nz=nz, friction_loss=0.5)


def test_logs_in_space_have_one_sector_and_lose_bark_by_energy() -> None:
    """Rotations mean nothing there; the doses are those of the same impacts in a plane."""
    law = RemovalLaw(energy=200.0)
    found, flat = outcome(load(in_space(900), ONE), RANGE, law, sectors=1), outcome(load(even_impacts(900), ONE), RANGE, law, sectors=1)
    assert found.degree[-1] == pytest.approx(1.0 - math.exp(-450.0 / (200.0 * 2.0 * math.pi * 0.1 * 1.5)), rel=1e-9)
    for name in ("useful_impacts", "friction_work"):
        assert found.values[name].value == pytest.approx(flat.values[name].value)
    assert "sector_dispersion" not in found.values
    assert any(line.startswith("impacts in the range") for line in lines([found]))
    assert sorted(figures([found])) == ["degree", "doses", "forces"]
    for sectors, other in ((12, law), (1, RemovalLaw(width=0.002))):
        with pytest.raises(DumpError, match="take one sector, and a law by energy"):
            outcome(load(in_space(9), ONE), RANGE, other, sectors=sectors)


def test_forces_of_impulses_are_those_of_the_motion() -> None:
    k, m, v = 4e6, 20.0, 1.5
    for zeta in (0.0, 0.2, 0.5):
        c = 2.0 * zeta * math.sqrt(k * m)
        done = solve_ivp(lambda _, y, c=c: [y[1], -(k * y[0] + c * y[1]) / m], (0.0, math.pi / math.sqrt(k / m)), [0.0, v], rtol=1e-10,
                         atol=1e-12, max_step=1e-5)
        force = np.maximum(k * done.y[0] + c * done.y[1], 0.0)
        assert force.max() <= peak_of_speed(v, k, m) * (1.0 + 1e-6)
        if zeta == 0.0:
            impulse = np.array([np.trapezoid(force, done.t)])
            assert force.max() == pytest.approx(peak_of_speed(v, k, m), rel=1e-6)
            assert peak_of_impulse(impulse, k, m, 1.0) == pytest.approx(force.max(), rel=1e-5)
            assert peak_of_duration(impulse, np.array([done.t[-1]])) == pytest.approx(force.max(), rel=1e-5)


def test_force_of_a_bond() -> None:
    assert bark_force(bond("spruce", "dormant").strength, 2e-3, 0.4) == pytest.approx(1800.0)


@pytest.mark.parametrize(("work", "message"), [
    (lambda: ForceRange(3000.0, 2000.0), "removes bark, 3000 N, is not below the one that damages wood, 2000 N"),
    (lambda: ForceRange(0.0, 2000.0), "must be > 0 N"),
    (lambda: bond("pine", "dormant"), "'pine', .*give the force or the strength itself"),
    (lambda: bond("spruce", "frozen"), "spruce in the condition 'frozen', known are dormant, growing"),
    (RemovalLaw, "one positive number"),
    (lambda: RemovalLaw(width=0.01, energy=1.0), "one positive number"),
    (lambda: outcome(load(records(9)), RANGE, RemovalLaw(width=0.03)), "a sector of the thinnest log has 26.2 mm, take fewer sectors"),
    (lambda: outcome(load(records(9), Logs(LOGS.ids, LOGS.radii, LOGS.masses)), RANGE, RemovalLaw(energy=1.0)), "length of the logs"),
    (lambda: outcome(load(records(9, id_a=7)), RANGE), "that of log 7, which is not among the 3 logs"),
    (lambda: outcome(load(records(3, nx=[1, 0, 0], ny=[0, 1, 0], nz=[0, 0, 1])), RANGE), "do not lie in a plane")])
def test_mistakes_are_one_line(work: object, message: str) -> None:
    assert callable(work)
    with pytest.raises((DembarkError, DumpError), match=message) as error:
        work()
    assert "\n" not in str(error.value)


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three loads of two logs in the current folder, in both forms of the file."""
    monkeypatch.chdir(tmp_path)
    for number in (1, 2, 3):
        folder = tmp_path / "out" / f"replica-{number}"
        folder.mkdir(parents=True)
        impacts = even_impacts(400 + 20 * number, number)
        impacts["time"] += PERIOD
        table = impacts.view(float).reshape(-1, len(COLUMNS))
        if number == 3:
            (folder / "impacts.bin").write_bytes(table.tobytes())
        else:
            np.savetxt(folder / "impacts.txt", table, fmt="%.12g", header=" ".join(COLUMNS))
        place = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
        (folder / "grains.dump").write_text(grains_text(0, place, np.array([0.1, 0.1]), masses=np.array([30.0, 30.0])))
        (folder / "run.json").write_text(json.dumps({"time_step": 0.01, "steps": round(5 * PERIOD / 0.01)}))
    return tmp_path


def test_command_reads_the_loads_of_a_run(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["debark", "out", "--speed", "30 rpm", "--begin", "2", "--bark-force", "1 kN", "--wood-force", "5 kN", "--clears", "2 mm",
                 "--stiffness", "1 MN/m", "--length", "1.5 m", "--radius", "1 m", "--least-speed", "0.1", "--out", "d.nc",
                 "--plot", "p"]) == 0
    said = capsys.readouterr().out
    assert "3 loads of 2 logs, 4 revolutions of 2 s each, from 2 s on" in said
    # 440 impacts in four revolutions, on one of the two logs; Student's interval over 420, 440, 460.
    assert f"impacts in the range, per log and revolution: 55 ± {4.303 * 2.5 / math.sqrt(3):.2g}\n" in said
    # Two logs of 30 kg that meet head on, each with the speed of a shell of 1 m and of a fall of 2 m.
    assert f"the largest is 2000 N, none can exceed {math.sqrt(1e6 * 30.0 * (math.pi**2 + 4.0 * 9.81)):.4g} N by its energy" in said
    assert "degree of debarking at the end" in said and "time to 90%" not in said.split("±")[0]
    with xarray.open_dataset("d.nc") as found:
        assert found.useful_impacts.sum(("log", "sector")).values.tolist() == [420, 440, 460]
        assert found.degree.sizes == {"load": 3, "revolutions": 17} and found.bark_force == 1000.0
    assert sorted(path.name for path in (runs / "p").iterdir()) == ["degree.png", "doses.png", "forces.png"]


@pytest.mark.parametrize("loads", [1, 3])
def test_no_damaging_impact_bounds_their_rate_and_is_no_certain_nothing(loads: int) -> None:
    """In trials at a low rate, nineteen of twenty intervals hold it."""
    from dembark.postproc.debarking.report import pooled_values

    rng, rate, held = np.random.default_rng(5), 0.03, 0
    for _ in range(40):
        found = []
        for _ in range(loads):
            damaging = records(int(rng.poisson(4 * 3 * rate)), int(rng.integers(1 << 30)), peak_force=6000.0)
            found.append(outcome(load(np.concatenate([records(50, int(rng.integers(1 << 30))), damaging])), RANGE))
        value = pooled_values(found)["damaging_impacts"]
        held += abs(value.value - rate) <= value.half
    assert held >= 36
    none = outcome(load(records(50)), RANGE).values
    # Four revolutions of three logs without an event: at most 3.69, with 97.5 % confidence.
    assert none["damaging_impacts"].interval[1] == pytest.approx(3.6889 / 12.0, rel=1e-4)
    assert none["damaging_share"].half == pytest.approx(1.0 - 0.025 ** (1.0 / 50.0)) and none["wood_loss_index"].half == math.inf


def test_a_window_beyond_the_run_is_refused(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["debark", "out", "--speed", "30 rpm", "--bark-force", "1 kN", "--wood-force", "5 kN", "--begin", "2", "--end"]
    assert main([*words, "10"]) == 0
    capsys.readouterr()
    assert main([*words, "60"]) == 2
    assert "ends at 60 s, its run at 10 s" in capsys.readouterr().err


def test_command_reads_a_file_of_the_users_own(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (runs / "mine.txt").write_bytes((runs / "out/replica-1/impacts.txt").read_bytes())
    words = ["debark", "mine.txt", "--grains", "out/replica-1/grains.dump", "--wood-force", "5 kN",
             "--bond", "spruce:dormant", "--area", "20 cm^2", "--friction", "0.4"]
    assert main([*words, "--speed", "30 rpm"]) == 0
    said = capsys.readouterr().out
    assert "range of forces: 1800 to 5000 N" in said and "wood-loss" not in said
    assert main(words) == 2
    assert "the speed of the drum is not given" in capsys.readouterr().err


@pytest.fixture
def drums(runs: Path) -> Path:
    """Two drums of three loads: the second turns three times as fast, and its logs get as many impacts a revolution."""
    for folder, slower in (("slow", 3.0), ("fast", 1.0)):
        for one in sorted((runs / "out").iterdir()):
            other = runs / folder / one.name
            shutil.copytree(one, other)
            record = {"time_step": 0.01 * slower, "steps": 1000,
                      "parameters": {"drum_speed": math.pi / slower, "filling": 0.3, "model": "x", "rest": 0.0}}
            (other / "run.json").write_text(json.dumps(record))
            file = next(other.glob("impacts.*"))
            impacts = np.array(read_impacts(file))
            impacts["time"] *= slower
            file.unlink()
            (other / "impacts.bin").write_bytes(impacts.tobytes())
    return runs


COMPARED = ["debark", "slow", "fast", "--speed", "drum_speed", "--begin", "6", "--bark-force", "1 kN", "--wood-force", "5 kN"]


def test_command_compares_drums(drums: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMPARED, "--clears", "2 mm", "--against", "drum_speed", "--plot", "p"]) == 0
    slow, fast = capsys.readouterr().out.split("drum_speed = 3.14159\n")
    assert slow.startswith("drum_speed = 1.0472\n3 loads of 2 logs, 4 revolutions of 6 s each, from 6 s on")
    assert fast.startswith("3 loads of 2 logs, 2 revolutions of 2 s each, from 6 s on")
    hits = [float(found[1]) for one in (slow, fast) if (found := re.search(r"in the range, per log and revolution: (\S+)", one))]
    assert hits == pytest.approx([55.0, 55.0], rel=0.15)
    assert [path.name for path in (drums / "p").iterdir()] == ["against.png"]


def test_figure_compares_degrees_of_debarking() -> None:
    """The curve of each drum is the mean of its loads, and the points are on the curves."""
    groups = {value: [outcome(load(even_impacts(count + 20 * seed, seed), ONE), RANGE, RemovalLaw(width=0.002)) for seed in range(3)]
              for value, count in ((0.3, 600), (0.2, 300))}
    over_time, across = against(groups, "filling").axes
    curves = {str(line.get_label()): np.asarray(line.get_xydata()) for line in over_time.lines}
    assert sorted(curves) == ["0.2", "0.3"]
    longest = max(np.mean([one.values["debarking_time"].value for one in some]) for some in groups.values())
    for place, value in enumerate(sorted(groups)):
        minutes, degree = curves[f"{value:g}"].T
        expected = np.mean([one.even(60.0 * minutes / PERIOD) for one in groups[value]], axis=0)
        np.testing.assert_allclose(degree, 100.0 * expected, rtol=1e-9)
        points = [float(bar.lines[0].get_ydata()[place]) for bar in across.containers]
        np.testing.assert_allclose(points, np.interp(np.array([0.25, 0.5, 1.0]) * longest / 60.0, minutes, degree), atol=0.1)
    idle = {0.1: [outcome(load(records(9, peak_force=1.0), ONE), RANGE, RemovalLaw(width=0.002))]}
    assert all((np.asarray(line.get_ydata()) == 0.0).all() for line in against(idle, "filling").axes[0].lines)


@pytest.mark.parametrize(("words", "message"), [
    (["--clears", "2 mm", "--against", "fillin"], "has no number of the name 'fillin', did you mean filling?"),
    (["--clears", "2 mm", "--against", "model"], "has no number of the name 'model'"),
    (["--against", "filling"], "give --clears or --energy"),
    (["--clears", "2 mm", "--against", "filling", "--out", "d.nc"], "with --against there is no --out"),
    (["--speed", "rest"], "the speed of the drum of slow/replica-1/impacts.bin is 0 rad/s"),
    (["--speed", "drum_sped"], "has no number of the name 'drum_sped', did you mean drum_speed?"),
    (["--radius", "1.3 m"], "--stiffness is missing")])
def test_mistakes_of_a_comparison_are_one_line(drums: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str) -> None:
    assert main([*COMPARED, *words]) == 2
    said = capsys.readouterr().err
    assert message in " ".join(said.split()) and said.count("\n") == 1


@pytest.mark.parametrize(("words", "message"), [
    (["--wood-force", "1 kN"], "give --bark-force, or --bond with --area and --friction; there is no default"),
    (["--bark-force", "1 kN"], "the force that damages wood is not given"),
    (["--bark-force", "9 kN", "--wood-force", "1 kN"], "is not below the one that damages wood, 1000 N"),
    (["--bond", "1 MPa", "--wood-force", "1 kN"], "--area is missing"),
    (["--bond", "pine:dormant", "--area", "1 cm^2", "--friction", "0.4", "--wood-force", "1 kN"], "is known for 'pine'"),
    (["--bark-force", "1 N", "--wood-force", "1 kN", "--clears", "2 mm", "--energy", "3 J/m^2"], "one positive number"),
    (["--bark-force", "1 N", "--wood-force", "1 kN", "--begin", "9", "--end", "9.1"], "less than a quarter of a revolution")])
def test_mistakes_of_the_command_are_one_line(runs: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str) -> None:
    assert main(["debark", str(runs / "out"), "--speed", "30 rpm", *words]) == 2
    said = capsys.readouterr().err
    assert message in " ".join(said.split()) and said.count("\n") == 1


def test_missing_columns_are_named(runs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = runs / "out/replica-1/impacts.txt"
    path.write_text(path.read_text().replace("friction_loss ", "").replace(" turn_a", ""))
    assert main(["debark", str(path), "--speed", "30 rpm", "--bark-force", "1 N", "--wood-force", "1 kN"]) == 2
    assert "lacks the columns friction_loss turn_a" in capsys.readouterr().err
    assert main(["debark", str(runs), "--speed", "30 rpm", "--bark-force", "1 N", "--wood-force", "1 kN"]) == 2
    assert "has no impacts.txt or impacts.bin" in capsys.readouterr().err
