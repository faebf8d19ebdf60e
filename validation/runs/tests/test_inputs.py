"""Each result holds the hash of its inputs: when they change it is made anew, with all that follows from it, and nothing else is."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest
from harness import command, decks, stand_in  # noqa: F401
from stand_in_analysis import STAND_INS

import dembark as package
from dembark.common.errors import RunError
from dembark.common.files import read_json, write_json
from dembark.validation import engines
from dembark.validation.campaigns.plan import Plan, Series, of_profile
from dembark.validation.case import folders, imports
from dembark.validation.results import PLAN
from dembark.validation.runs.simulate import simulate
from dembark.validation.runs.steps import Step, steps

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

QUANTITIES = """
[quantities.height]
label = "height"
unit = "m"
evidence = "theory"
tolerance = 0.1
why = "as it is"
detail = "a detail"
source = "a source"

[controls]
"other physics" = ["height"]
"""
MEASURE = """
from pathlib import Path

from dembark.helper_a import value
from dembark.postproc.measurement import Measurement, number

COUNT = Path(__file__).parents[2] / "measured"


def measure(replicas):
    COUNT.write_text(COUNT.read_text() + "x" if COUNT.exists() else "x")
    reference = float(Path(__file__).with_name("reference").joinpath("curve.csv").read_text())
    return Measurement({"height": number(value(), reference)})
"""


@pytest.fixture
def box(decks: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The case `box`, in LIGGGHTS alone, measured with a module of the package that imports another one; a third is there that it does not
    import."""
    root = tmp_path / "package"
    root.mkdir()
    (root / "helper_a.py").write_text("def value():\n    from dembark import helper_b\n    return helper_b.VALUE\n")
    (root / "helper_b.py").write_text("VALUE = 1.05\n")
    (root / "helper_c.py").write_text("VALUE = 3\n")
    monkeypatch.setattr(package, "__path__", [str(root), *package.__path__])
    # Files are looked at anew when they change, as by processes that are started anew, also modules of the package.
    monkeypatch.setattr(imports, "_state", lambda path: (path.stat().st_mtime_ns, path.stat().st_size))
    imports.module_file.cache_clear()
    case = decks / "box"
    text = (case / "case.toml").read_text().replace('engines = ["liggghts", "yade"]', 'engines = ["liggghts"]')
    (case / "case.toml").write_text(text.replace('{variant = "wet", engines = ["liggghts"]}', "") + QUANTITIES)
    (case / "measure.py").write_text(MEASURE)
    (case / "reference").mkdir()
    (case / "reference" / "curve.csv").write_text("1.0\n")
    return case


class Chain:
    """The steps of the case `box` as a process that is started anew sees them."""

    def __init__(self, tmp_path: Path) -> None:
        self.results, self.count = tmp_path / "results", tmp_path / "measured"
        self.runs = 0

    def planned(self) -> tuple[Series, Step]:
        folders.load.cache_clear()
        engines.find.cache_clear()
        (one,) = of_profile("quick")

        self.results.mkdir(exist_ok=True)
        write_json(self.results / PLAN, Plan("quick", (one,), {}).as_json())
        return one, next(step for step in steps(self.results) if step.kind == "measure")

    def __call__(self) -> tuple[int, int, bool]:
        """How many runs and measurements were made, and whether anything was."""
        one, step = self.planned()
        before, ran = len(self.count.read_text()) if self.count.exists() else 0, 0
        for run in one.runs:
            ran += simulate(run, self.results / one.place, threading.Event())
        done = step.up_to_date()
        if not done:
            step.call(*step.arguments)
            assert step.up_to_date()
        return ran, len(self.count.read_text()) - before, not done

    @property
    def result(self) -> dict[str, object]:
        (path,) = self.results.glob("box/dry/*/metrics.json")
        return json.loads(path.read_text())["quantities"][0]


@pytest.fixture
def chain(box: Path, tmp_path: Path) -> Chain:
    made = Chain(tmp_path)
    assert made() == (1, 1, True) and made() == (0, 0, False)
    assert made.result["verdict"] == "pass"
    return made


def edit(path: Path, before: str, after: str) -> None:
    assert before in path.read_text(encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8").replace(before, after), encoding="utf-8")


JUDGED = [
    ("tolerance = 0.1", "tolerance = 0.01", "verdict", "fail"),
    ("as it is", "as it was", "detail", "a detail"),
    ('label = "height"', 'label = "depth"', "label", "depth"),
    ('evidence = "theory"', 'evidence = "experiment"', "evidence", "experiment"),
    ("a detail", "another", "detail", "another"),
    ("a source", "another", "source", "another"),
    ('"other physics"', '"wrong physics"', "control", "wrong physics"),
    ('[controls]\n"other physics" = ["height"]\n', "", "control", ""),
    ('why = "as it is"', 'why = "as it is"\nabsolute = true', "deviation_kind", "absolute"),
]


def test_what_only_judging_reads_is_judged_anew_and_nothing_is_measured(chain: Chain, box: Path) -> None:
    declared = (box / "case.toml").read_text(encoding="utf-8")
    for before, after, key, expected in JUDGED:
        edit(box / "case.toml", before, after)
        assert chain() == (0, 0, True), after
        assert chain.result[key] == expected
        (box / "case.toml").write_text(declared)
    assert chain() == (0, 0, True) and chain() == (0, 0, False)


MEASURED = [
    ("reference/curve.csv", "1.0", "2.0", "fail"), ("reference/other.csv", "", "3", "fail"), ("reference/curve.csv", "2.0", "1.0", "pass"),
    ("measure.py", "number(value(), reference)", "number(value() + 1.0, reference)", "fail"),
    ("../../package/helper_a.py", "return helper_b", "return 1.0 * helper_b", "fail"),
    ("../../package/helper_b.py", "1.05", "1.02", "fail"),
]


def test_what_only_measuring_reads_is_measured_anew_and_nothing_runs(chain: Chain, box: Path) -> None:
    for file, before, after, verdict in MEASURED:
        (box / file).touch()
        edit(box / file, before, after)
        assert chain() == (0, 1, True), file
        assert chain.result["verdict"] == verdict, file
    assert chain() == (0, 0, False)


def test_other_modules_files_and_clocks_change_nothing(chain: Chain, box: Path, tmp_path: Path) -> None:
    edit(tmp_path / "package" / "helper_c.py", "3", "4")
    (box / "README.md").write_text("A box.\n")
    (box / "reference" / "README.md").write_text("A source.\n")
    for path in [*box.rglob("*"), *chain.results.rglob("*")]:
        path.touch()
    assert chain() == (0, 0, False)
    chain.results = chain.results.rename(tmp_path / "elsewhere")
    assert chain() == (0, 0, False)


MADE = [
    ("liggghts.in", "# A deck", "# The deck"), ("table.txt", "", "1 2 3"), ("case.toml", 'steps = "100"', 'steps = "100 + 0"'),
    ("case.toml", "value = 0.005", "value = 0.006"), ("../../engine/bin/stand-in", "Stands in", "Stands  in"),
]


def test_what_a_run_is_inputs_hash_runs_anew(chain: Chain, box: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for file, before, after in MADE:
        (box / file).touch()
        edit(box / file, before, after)
        assert chain() == (1, 1, True), file
    assert chain() == (0, 0, False)
    monkeypatch.setenv("DEMBARK_LANES", "1")
    assert chain() == (1, 1, True)


def test_a_reference_that_the_set_up_reads_is_an_input_of_the_run(box: Path, tmp_path: Path) -> None:
    (box / "setup.py").write_text('from pathlib import Path\nfrom dembark.input_decks.common.setup import Setup\n\n\ndef setup(p):\n'
                                  '    Path(__file__).with_name("reference").joinpath("curve.csv").read_text()\n'
                                  "    return Setup(100, 1e-5, None, {})\n")
    chain = Chain(tmp_path)
    assert chain() == (1, 1, True)
    (box / "reference" / "curve.csv").write_text("1.01\n")
    assert chain() == (1, 1, True)


def test_a_result_that_is_lost_or_damaged_is_made_anew_when_it_is_needed(chain: Chain, box: Path) -> None:
    (path,) = chain.results.glob("box/dry/*/metrics.json")
    for damage in (path.unlink, lambda: path.write_text("{"), lambda: edit(path, '"inputs_hash"', '"made"')):
        damage()
        assert chain() == (0, 0, True)
    kept = path.with_name("measurement.json")
    damages = (kept.unlink, lambda: kept.write_text('{"inputs_hash"'), lambda: kept.write_text('{"inputs_hash": 1}'))
    for number, damage in enumerate(damages, start=1):
        damage()
        assert chain() == (0, 0, False)
        edit(box / "case.toml", f"tolerance = 0.{number}", f"tolerance = 0.{number + 1}")
        assert chain() == (0, 1, True)


def test_a_record_that_is_edited_is_measured_anew_and_a_run_that_is_deleted_runs(chain: Chain) -> None:
    (record,) = chain.results.glob("box/dry/*/replica-1/run.json")
    edit(record, '"time_step": 1e-05', '"time_step": 2e-05')
    assert chain() == (0, 1, True)
    record.unlink()
    assert chain() == (1, 1, True)


def test_a_deck_that_is_edited_while_its_run_waits_is_not_run(box: Path, tmp_path: Path) -> None:
    (one,) = of_profile("quick")
    assert one.runs[0].inputs
    edit(box / "liggghts.in", "# A deck", "# The deck")
    with pytest.raises(RunError, match="its deck was changed since this was planned"):
        simulate(one.runs[0], tmp_path / "out", threading.Event())
    assert not list((tmp_path / "out").glob("replica-*"))


def test_a_report_is_built_anew_when_a_verdict_changes_and_kept_otherwise(
        box: Path, tmp_path: Path, command: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, function in STAND_INS:
        if name not in ("metrics", "judge.comparison"):
            monkeypatch.setattr(import_module(f"dembark.validation.{name}"), function.__name__, function)
    report, facts = tmp_path / "results/quick/report.html", []
    for after in (None, None, "tolerance = 0.01", None):
        if after:
            edit(box / "case.toml", "tolerance = 0.1", after)
        code, out, error = command("validate")
        assert code == 0, error
        facts.append((report.stat().st_mtime_ns, "1 FAILED" in out, error.count("1: finished in"), (tmp_path / "measured").read_text(),
                      error.count("verification: finished in")))
    times = [one[0] for one in facts]
    assert times[0] == times[1] < times[2] == times[3]
    assert [one[1:] for one in facts] == [(False, 1, "x", 1), (False, 0, "x", 0), (True, 0, "x", 0), (True, 0, "x", 0)]
    assert read_json(tmp_path / "results/quick/box/dry/liggghts/metrics.json")["inputs_hash"]


def test_a_report_of_some_cases_is_kept_although_that_of_all_left_a_verification(
        box: Path, tmp_path: Path, command: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    for name, function in STAND_INS:
        if name not in ("metrics", "judge.comparison"):
            monkeypatch.setattr(import_module(f"dembark.validation.{name}"), function.__name__, function)
    built = [command("validate", *words)[2].count("report: started") for words in ((), ("--case", "box"), ("--case", "box"))]
    assert built == [1, 1, 0]
    assert not (tmp_path / "results/quick/verification.json").exists()
