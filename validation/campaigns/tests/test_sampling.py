"""Samples of a sweep: designs that are reproducible and grow, distributions, conditions of the case, and mistakes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness import command, decks, stand_in, stand_in_analysis  # noqa: F401
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.validation.campaigns.expand import points
from dembark.validation.campaigns.sampling import Drawn, Sample, Variable
from dembark.validation.campaigns.spec import read
from dembark.validation.case.model import Parameter
from dembark.validation.cli import main

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

HEAD = '[campaign]\nname = "boxes"\nprofile = "quick"\nengines = ["liggghts"]\n'
SWEEP = HEAD + '[[sweeps]]\ncase = "box"\n'
DIAMETER = 'grain_diameter = { min = "4 mm", max = "8 mm" }\n'
SAMPLE = SWEEP + '[sweeps.sample]\ndesign = "sobol"\nsamples = 5\nseed = 3\n[sweeps.sample.parameters]\n' + DIAMETER


def variable(distribution: str, whole: bool = False, **numbers: float) -> Variable:
    return Variable(Parameter("x", "", 1 if whole else 1.0), distribution, numbers)


def drawn(design: str, samples: int, dimensions: int = 2, broken: Callable[[Any], str] = lambda row: "", seed: int = 1) -> Drawn:
    one = {f"x{number}": variable("uniform", min=0.0, max=1.0) for number in range(dimensions)}
    return Sample(design, samples, one, seed).draw(broken)


def outside(row: dict[str, float]) -> str:
    return "the sum exceeds one" if row["x0"] + row["x1"] > 1.0 else ""


@pytest.mark.parametrize(("design", "points"), [("morris", 4), ("saltelli", 5)])
def test_groups_of_a_sensitivity_analysis(design: str, points: int) -> None:
    few, many = drawn(design, 8, 3), drawn(design, 16, 3)
    assert len(few.rows) == 8 * points and many.rows[:len(few.rows)] == few.rows
    groups = np.array(many.quantiles).reshape(16, points, 3)
    if design == "morris":
        # Along a trajectory each parameter changes once, by two of the three steps between four levels.
        steps = np.abs(np.diff(groups, axis=1))
        assert np.sort(steps, axis=1)[:, -1] == pytest.approx(2.0 / 3.0) and (np.count_nonzero(steps, axis=(1, 2)) == 3).all()
    else:
        # The first and the last point of a group are independent; each between has one parameter of the last.
        first, last = groups[:, :1], groups[:, -1:]
        assert (groups[:, 1:-1] == np.where(np.eye(3, dtype=bool), last, first)).all()
    with pytest.raises(DembarkError, match=f"a point of the {design} breaks a condition"):
        drawn(design, 8, 3, outside)


@given(st.sampled_from(["sobol", "halton"]), st.integers(1, 70), st.integers(0, 70), st.integers(2, 5), st.booleans())
def test_more_samples_begin_with_the_earlier_ones(design: str, few: int, more: int, dimensions: int, conditions: bool) -> None:
    broken = outside if conditions else lambda row: ""
    short, long = (drawn(design, count, dimensions, broken) for count in (few, few + more))
    assert long.rows[:few] == short.rows and long.quantiles[:few] == short.quantiles and len(short.rows) == few
    assert not any(map(broken, long.rows))


@pytest.mark.parametrize("design", ["sobol", "halton", "latin_hypercube"])
def test_a_design_follows_from_its_seed_and_fills_the_square(design: str) -> None:
    assert drawn(design, 16).rows == drawn(design, 16).rows != drawn(design, 16, seed=2).rows
    places = np.array(drawn(design, 256).quantiles)
    # A random sample of this size is 0.02 off its mean, and correlated by 0.06.
    assert np.abs(places.mean(axis=0) - 0.5).max() < 4e-3 and abs(np.corrcoef(places.T)[0, 1]) < (0.2 if "latin" in design else 0.02)


def test_a_latin_hypercube_has_one_point_in_each_part_of_each_range() -> None:
    places = np.array(drawn("latin_hypercube", 20, 3).quantiles)
    assert all(sorted(column) == list(range(20)) for column in np.floor(20.0 * places).astype(int).T)


def test_points_that_break_a_condition_are_left_out_or_refused() -> None:
    found = drawn("sobol", 64, broken=outside)
    assert 40 < found.left_out < 90  # half of the square is allowed
    with pytest.raises(DembarkError, match="a point of the latin hypercube breaks a condition, the sum exceeds one, narrow the ranges, or "
                                           "choose sobol or halton"):
        drawn("latin_hypercube", 8, broken=outside)
    with pytest.raises(DembarkError, match="only 0 of 800 points break no condition, never, narrow the ranges"):
        drawn("halton", 8, broken=lambda row: "never")


@pytest.mark.parametrize(("one", "expected"), [
    (variable("uniform", min=2.0, max=6.0), [2.0, 3.0, 4.0, 6.0]),
    (variable("loguniform", min=1.0, max=1e4), [1.0, 10.0, 100.0, 1e4]),
    (variable("triang", min=0.0, mode=1.0, max=2.0), [0.0, math.sqrt(0.5), 1.0, 2.0]),
    (variable("norm", mean=5.0, std=2.0), [-math.inf, 5.0 - 2.0 * 0.6744898, 5.0, math.inf]),
    (variable("truncnorm", mean=5.0, std=2.0, min=3.0, max=7.0), [3.0, 5.0 + 2.0 * stats.norm.ppf(0.5 - 0.25 * 0.6826895), 5.0, 7.0]),
    (variable("lognorm", median=3.0, sigma=0.5), [0.0, 3.0 * math.exp(-0.5 * 0.6744898), 3.0, math.inf]),
], ids=lambda one: one.distribution if isinstance(one, Variable) else "")
def test_quantiles_of_the_distributions(one: Variable, expected: list[float]) -> None:
    found = one.values(np.array([0.0, 0.25, 0.5, 1.0]))
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-12)
    assert all(value == float(f"{value:.6g}") for value in found)


def test_whole_numbers_are_equally_frequent_and_values_stay_within_limits() -> None:
    found = variable("uniform", whole=True, min=3, max=6).values(np.arange(0.0, 1.0, 1e-3))
    assert all(isinstance(value, int) for value in found)
    assert set(Counter(found)) == {3, 4, 5, 6} and np.ptp(list(Counter(found).values())) <= 2
    third = variable("uniform", min=1.0 / 3.0, max=2.0 / 3.0)
    assert third.values(np.array([0.0, 1.0])) == [1.0 / 3.0, 2.0 / 3.0]


def write(folder: Path, text: str) -> Path:
    path = folder / "campaign.toml"
    path.write_text(text)
    return path


def test_a_sample_is_read_as_it_is_meant(tmp_path: Path) -> None:
    text = SAMPLE.replace("[sweeps.sample]\n", 'variants = ["dry", "wet"]\nreplicas = 2\nfixed = { static_friction = 0.4 }\n'
                          'derived = { grain_count = "round(0.08 / grain_diameter)" }\n[sweeps.sample]\n')
    spec = read(write(tmp_path, text + "kinetic_friction = { min = 0.2, max = 0.6 }\n"))
    found = points(spec)
    assert spec.sweeps[0].axes == ("variant", "grain_diameter", "kinetic_friction") and len(found) == 10
    dry, wet = found[:5], found[5:]
    assert [one.quantiles for one in dry] == [one.quantiles for one in wet] and {one.base for one in wet} == {"wet"}
    for one in found:
        assert 0.004 <= one.values["grain_diameter"] <= 0.008 and one.resolved["replicas"] == 2
        # A constraint of the case.
        assert 0.2 <= one.resolved["kinetic_friction"] <= 0.4
        assert one.resolved["grain_count"] == round(0.08 / one.values["grain_diameter"])
        assert one.values["grain_diameter"] == pytest.approx(0.004 * (1.0 + one.quantiles[0]), rel=1e-5)


def test_whole_numbers_that_come_twice_are_one_run(tmp_path: Path) -> None:
    text = SAMPLE.replace(DIAMETER, "grain_count = { min = 10, max = 12 }\n")
    assert sorted({one.variant for one in points(read(write(tmp_path, text)))}) == [f"dry_grain_count={count}" for count in (10, 11, 12)]


@pytest.mark.usefixtures("stand_in_analysis")
def test_a_larger_sample_keeps_the_runs_of_the_smaller_one(tmp_path: Path, command: Callable[..., tuple[int, str, str]]) -> None:
    write(tmp_path, SAMPLE)
    code, out, error = command("submit", "campaign.toml", "--out", "o")
    assert code == 0 and "5 of 5 runs finished" in out, error
    first = read_json(tmp_path / "o/plan.json")["sweeps"][0]
    assert first["sample"] == {"design": "sobol", "samples": 5, "seed": 3, "quantities": [], "left_out": 0,
                               "parameters": {"grain_diameter": "uniform, min 0.004, max 0.008"}}
    write(tmp_path, SAMPLE.replace("samples = 5", "samples = 8"))
    code, out, error = command("submit", "campaign.toml", "--out", "o")
    assert code == 0 and "8 of 8 runs finished" in out and error.count("already finished; reusing") == 5, error
    second = read_json(tmp_path / "o/plan.json")["sweeps"][0]
    assert second["points"][:5] == first["points"] and len(second["points"][0]["quantiles"]) == 1
    code, out, error = command("resume", "o")
    assert code == 0 and error.count("already finished; reusing") == 8, error


def test_a_dry_run_shows_the_points(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = SAMPLE.replace("[sweeps.sample]\n", "fixed = { static_friction = 0.4 }\n[sweeps.sample]\n")
    write(tmp_path, text + "kinetic_friction = { min = 0.2, max = 0.6 }\n")
    assert main(["submit", "campaign.toml", "--dry-run"]) == 0
    out = capsys.readouterr().out
    assert out.count("box   dry_grain_diameter=0.00") == 5
    left_out = read(tmp_path / "campaign.toml").sweeps[0].drawn.left_out
    assert left_out > 0
    assert (f"sweep 1: sobol, seed 3, 5 points of grain_diameter, kinetic_friction; {left_out} points break a condition and are left out"
            in out)


MISTAKES = {
    "samples in words": (SAMPLE.replace("samples = 5", 'samples = "many"'), "samples = 'many' has the wrong type"),
    "half a sample": (SAMPLE.replace("samples = 5", "samples = 2.5"), "it must be a whole number"),
    "no samples": (SAMPLE.replace("samples = 5", "samples = 0"), "samples = 0 is out of range, [sweeps 1.sample] of"),
    "too many": (SAMPLE.replace("samples = 5", "samples = 1000000000"), "a campaign may have 20000 runs"),
    "samples missing": (SAMPLE.replace("samples = 5\n", ""), "samples is missing"),
    "unknown design": (SAMPLE.replace("sobol", "sobl"), "unknown design 'sobl'"),
    "unknown design, near match": (SAMPLE.replace("sobol", "latin_hypercub"), "did you mean latin_hypercube?"),
    "trajectories of an unlimited distribution": (
        SAMPLE.replace("sobol", "morris").replace('min = "4 mm", max = "8 mm"', 'distribution = "norm", mean = "4 mm", std = "1 mm"'),
        "norm has no limits, which the design morris needs, [sweeps 1.sample.parameters.grain_diameter] of"),
    "no power of two": (SAMPLE.replace("sobol", "saltelli").replace("samples = 5", "samples = 100"), "give a power of 2: 64 or 128"),
    "too many groups": (SAMPLE.replace("sobol", "saltelli").replace("samples = 5", "samples = 8192"),
                        "samples = 8192 makes 24576 points, [sweeps 1.sample] of"),
    "unknown key": (SAMPLE.replace("seed", "sead"), "did you mean seed?"),
    "negative seed": (SAMPLE.replace("seed = 3", "seed = -3"), "seed = -3 is out of range"),
    "no parameters": (SAMPLE.replace(DIAMETER, ""), "the sample has no parameters"),
    "unknown parameter": (SAMPLE.replace("grain_diameter", "grain_dimeter"), "did you mean grain_diameter or"),
    "no range": (SAMPLE.replace('{ min = "4 mm", max = "8 mm" }', '"4 mm"'), "grain_diameter = '4 mm' is not a range"),
    "empty range": (SAMPLE.replace('{ min = "4 mm", max = "8 mm" }', "{}"), "grain_diameter has no min and no max"),
    "half a range": (SAMPLE.replace(', max = "8 mm"', ""), "grain_diameter has no max, [sweeps 1.sample.parameters.grain_diameter] of"),
    "reversed limits": (SAMPLE.replace("4 mm", "9 mm"), "min = 0.009 of grain_diameter is not below max = 0.008"),
    "wrong unit": (SAMPLE.replace("4 mm", "4 kg"), "grain_diameter: cannot convert '4 kg' to m"),
    "limit out of range": (SAMPLE.replace("4 mm", "0 mm"), "grain_diameter = 0 m is out of range, it must be > 0"),
    "unknown distribution": (SAMPLE.replace("min =", 'distribution = "normal", min ='), "unknown distribution 'normal'"),
    "numbers of another distribution": (SAMPLE.replace("{ min", '{ distribution = "norm", min'), "unknown key 'min'"),
    "no spread": (SAMPLE.replace('min = "4 mm", max = "8 mm"', 'distribution = "norm", mean = "4 mm", std = 0.0'),
                  "std of grain_diameter = 0 is out of range, [sweeps 1.sample.parameters.grain_diameter] of"),
    "spread in another unit": (SAMPLE.replace('min = "4 mm", max = "8 mm"', 'distribution = "norm", mean = "4 mm", std = "1 s"'),
                               "std of grain_diameter: cannot convert '1 s' to m"),
    "mode outside": (SAMPLE.replace("{ min", '{ distribution = "triang", mode = 0.01, min'), "mode = 0.01 of grain_diameter is not"),
    "logarithm of zero": (SAMPLE.replace(DIAMETER, 'static_friction = { distribution = "loguniform", min = 0, max = 1 }\n'),
                          "loguniform of static_friction reaches 0"),
    "a word": (SAMPLE.replace(DIAMETER, "behaviour = { min = 0, max = 1 }\n"), "behaviour is a word, of which there is no sample"),
    "replicas": (SAMPLE.replace(DIAMETER, "replicas = { min = 1, max = 2 }\n"), "replicas is not a parameter of a sweep"),
    "fixed too": (SAMPLE.replace("[sweeps.sample]\n", "fixed = { grain_diameter = 0.004 }\n[sweeps.sample]\n"),
                  "grain_diameter is fixed and varies"),
    "grid too": (SAMPLE.replace("[sweeps.sample]\n", "grid = { grain_count = [1, 2] }\n[sweeps.sample]\n"),
                 "grid and sample are both given"),
    "unknown quantity": (SAMPLE.replace("seed = 3", 'quantities = ["repose"]'), "unknown quantity 'repose'"),
    "quantities no texts": (SAMPLE.replace("seed = 3", "quantities = [3]"), "does not hold texts only"),
    "no point is allowed": (SAMPLE.replace("[sweeps.sample]\n",
                                           "fixed = { static_friction = 0.4, kinetic_friction = 0.5 }\n[sweeps.sample]\n"),
                            "only 0 of 800 points break no condition, the kinetic friction exceeds the static one"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_gets_one_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, expected = MISTAKES[name]
    assert main(["submit", str(write(tmp_path, text)), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and error.startswith("dembark: ") and expected in error and "campaign.toml" in error


FIT = SAMPLE.replace('"box"', '"silo"').replace(DIAMETER, "wall_friction = { min = 0.2, max = 0.8 }\n") + "[sweeps.sample.targets]\n"


@pytest.mark.parametrize(("target", "expected"), [
    ('apparent_mass_ratio = { value = "0.6", uncertainty = 0.02 }', ""),
    ("apparent_mas_ratio = { value = 0.6, uncertainty = 0.02 }", "silo does not measure it, did you mean apparent_mass_ratio"),
    ("apparent_mass_ratio = 0.6", "0.6 is not a table"),
    ("apparent_mass_ratio = { value = 0.6 }", "the target apparent_mass_ratio has no uncertainty, [sweeps 1.sample.targets.apparent"),
    ("apparent_mass_ratio = { value = 0.6, uncertainty = 0 }", "uncertainty of apparent_mass_ratio = 0 is out of range"),
    ('apparent_mass_ratio = { value = "30 deg", uncertainty = 0.02 }', "value of apparent_mass_ratio: "),
])
def test_targets(target: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv("DEMBARK_DECKS")
    path = write(tmp_path, FIT + target + "\n")
    if not expected:
        (found,) = read(path).sweeps[0].sample.targets.values()
        assert (found.value, found.uncertainty) == (0.6, 0.02)
        return
    assert main(["calibrate", str(path), "--dry-run"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and expected in error


def test_points_of_a_fit_have_packings_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Packings that all points shared would shift all of them alike; those of a sample without targets are shared, as in a grid."""
    monkeypatch.delenv("DEMBARK_DECKS")
    target = "apparent_mass_ratio = { value = 0.6, uncertainty = 0.02 }\n"
    free = FIT.replace("[sweeps.sample.targets]\n", "")

    def seeds(text: str) -> list[int]:
        return [int(point.resolved["seed"] or 0) for point in points(read(write(tmp_path, text)))]

    plain, own = seeds(free), seeds(FIT.replace("[[sweeps]]\n", "[[sweeps]]\nreplicas = 3\n") + target)
    assert len(plain) > 4 and len(set(plain)) == 1
    assert own == list(range(plain[0], plain[0] + 3 * len(own), 3))
    # Unless the file says otherwise.
    assert set(seeds(FIT.replace("[sweeps.sample]\n", "fixed = { seed = 7 }\n[sweeps.sample]\n") + target)) == {7}


@pytest.mark.parametrize(("seed", "expected"), [
    (99_988, ""), (99_989, "point 5 of [sweeps 1]"), (99_989, "has packings with the seeds 100001 and on, the largest is 100000")])
def test_seeds_of_a_fit_stay_within_the_range_of_the_case(seed: int, expected: str, tmp_path: Path, decks: Path,
                                                          capsys: pytest.CaptureFixture[str]) -> None:
    text = (decks / "box/case.toml").read_text(encoding="utf-8").replace("seed = { value = 7,", f"seed = {{ value = {seed}, max = 100000,")
    text += '[quantities]\nrepose = { label = "angle of repose", unit = "deg" }\n'
    (decks / "box/case.toml").write_text(text, encoding="utf-8")
    path = write(tmp_path, SAMPLE.replace("[[sweeps]]\n", "[[sweeps]]\nreplicas = 3\n") + (
        "[sweeps.sample.targets]\nrepose = { value = 30.0, uncertainty = 1.0 }\n"))
    assert main(["calibrate", str(path), "--dry-run"]) == (2 if expected else 0)
    error = capsys.readouterr().err
    assert error.count("\n") == (1 if expected else 0) and expected in error


def test_a_fit_needs_targets_and_a_design_that_fills_the_ranges(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                                capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.delenv("DEMBARK_DECKS")
    target = "apparent_mass_ratio = { value = 0.6, uncertainty = 0.02 }\n"
    for text, expected in ((FIT, "campaign.toml has no targets, give them in [sweeps.sample.targets]"),
                           (FIT.replace("sobol", "morris") + target, "the design morris has targets")):
        assert main(["calibrate", str(write(tmp_path, text)), "--dry-run"]) == 2
        error = capsys.readouterr().err
        assert error.count("\n") == 1 and expected in error


@pytest.mark.usefixtures("stand_in_analysis")
def test_a_calibration_runs_as_a_campaign_does(tmp_path: Path, decks: Path, command: Callable[..., tuple[int, str, str]]) -> None:
    with (decks / "box/case.toml").open("a") as file:
        file.write('[quantities]\nrepose = { label = "angle of repose", unit = "deg" }\n')
    write(tmp_path, SAMPLE + '[sweeps.sample.targets]\nrepose = { value = "0.5 rad", uncertainty = 1.0 }\n')
    code, out, _ = command("calibrate", "campaign.toml", "--dry-run")
    assert code == 0 and "boxes: 5 runs" in out
    code, out, error = command("calibrate", "campaign.toml", "--out", "o")
    assert code == 0 and "5 of 5 runs finished" in out, error
    (target,) = read(tmp_path / "o/campaign.toml").sweeps[0].sample.targets.values()
    assert target.value == pytest.approx(math.degrees(0.5))


def test_a_quantity_that_the_case_does_not_measure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DEMBARK_DECKS")
    text = SAMPLE.replace('"box"', '"silo"').replace("seed = 3", 'quantities = ["apparent_mass_ratio"]')
    assert read(write(tmp_path, text)).sweeps[0].sample.quantities == ("apparent_mass_ratio",)
    with pytest.raises(DembarkError, match=r"unknown quantity 'apparent_mas_ratio', .*silo does not measure it, did you mean apparent"):
        read(write(tmp_path, text.replace("mass", "mas")))
