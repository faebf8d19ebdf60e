"""The report says what failed on its first page, names what is missing, opens no trajectory, and its PDF can be read."""

import csv
import json
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import full_size
import numpy as np
import pdf_pages as pdf
import pytest

from dembark.common.errors import RunError
from dembark.validation import report
from dembark.validation.judge import result
from dembark.validation.judge.comparison import pair
from dembark.validation.judge.tally import of_folder as tally_of
from dembark.validation.judge.tally import tally
from dembark.validation.report import facts, figures, front, numbers, scatter, sections
from dembark.validation.report.build import write_pdf
from dembark.validation.report.gather import Row, gather

build_module = sys.modules[write_pdf.__module__]

_listeners: list[list[str]] = []


def _hook(event, arguments):
    if event == "open":
        for opened in _listeners:
            opened.append(str(arguments[0]))


sys.addaudithook(_hook)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Two cases in both engines with a failed identity, a failure without tolerance, a run that failed, a result that cannot be read, and
    trajectories that nobody may open."""
    folder = full_size.write(tmp_path_factory.mktemp("results") / "quick", ("silo", "log_pile"), variants=2)
    full_size.change(folder / "silo/variant_0/yade/metrics.json", "quantity_0", verdict="fail", value=0.3, deviation=0.3, tolerance=0.1,
                     label="lost momentum")
    full_size.change(folder / "silo/variant_0/liggghts/metrics.json", "quantity_1", verdict="fail", value=0.2, deviation=0.2, tolerance=0.1,
                     label="lost energy", cause="the floor does not carry what it should")
    full_size.change(folder / "log_pile/variant_1/liggghts/metrics.json", "quantity_6", verdict="fail", tolerance=None,
                     label="too few contacts")
    plan = json.loads((folder / "plan.json").read_text())
    plan["runs"].append({"folder": "plug_flow/smooth/yade/replica-1", "inputs": "b"})
    (folder / "plan.json").write_text(json.dumps(plan))
    (folder / "plug_flow/smooth/yade").mkdir(parents=True)
    (folder / "plug_flow/smooth/yade/.replica-1.status.json").write_text(json.dumps(
        {"state": "failed", "inputs": "b", "message": "the engine was killed by SIGKILL <at> step 7"}))
    (folder / "silo/variant_1/yade/metrics.json").write_text('{"case": "silo"}')
    for place in (path.parent for path in folder.glob("*/*/*/metrics.json")):
        (place / "replica-1").mkdir(exist_ok=True)
        for name in ("grains.dump", "contacts.dump", "time.csv"):
            (place / "replica-1" / name).write_text("not to be read")
    written = sorted(path for path in folder.rglob("*") if path.is_file())
    pages, opened = [], []
    _listeners.append(opened)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build_module, "write_pdf", lambda html, path: pages.append(html) or write_pdf(html, path))
        report.build(folder)
    _listeners.clear()
    return folder, pages[0], opened, written


def test_no_trajectory_is_opened_and_no_result_is_written(results):
    folder, _, opened, written = results
    assert any(path.endswith("metrics.json") for path in opened)
    assert not [path for path in opened if path.endswith((".dump", ".csv")) and "replica-" in path]
    made = {path for path in folder.rglob("*") if path.is_file()} - set(written)
    assert {path.parent.name for path in made} == {"figures", "quick"} and {path.name for path in made if path.parent == folder} == {
        "report.html", "report.pdf"}


def test_the_first_page_says_what_failed_and_what_is_missing(results):
    first, second, *_ = pdf.pages(results[1])
    assert "3 FAILED" in first and "lost momentum" in first + second and "too few contacts" in first + second
    # What has the same cause stands together, under its cause.
    failed = results[1].partition('<section id="failed">')[2].partition("</section>")[0]
    known = failed.index("the floor does not carry what it should")
    assert "lost energy" in failed[known:] and failed.count('class="cause"') == 3
    assert "the engine was killed by SIGKILL <at> step 7" in first
    assert re.search(r"silo/variant_1/yade/metrics.json has no .*variant", first.replace("\N{NO-BREAK SPACE}", " "))


def test_the_first_page_has_a_row_for_each_case(results):
    rows = re.findall(r'<tr data-case="(\w+)" data-evidence="([^"]*)" data-verdict="([^"]*)"', results[1])[:4]
    assert [case for case, _, _ in rows] == ["log_pile", "plug_flow", "silo", "verification"]
    assert rows[0][1].split() == ["experiment", "theory", "code", "identity", "none"]
    assert rows[0][2].split() == rows[2][2].split() == ["failed", "open", "passed"] and rows[3][2].split() == ["passed"]
    # Of the case that was not measured, nothing is known.
    assert rows[1][1:] == ("", "")


def test_a_case_names_its_failed_identity_and_the_page_of_a_missing_case(results):
    text = results[1].partition('id="silo"')[2].partition('class="chapter"')[0]
    assert "lost momentum" in text and "2 FAILED" in text and "smooth: YADE, replica 1: the engine was killed" in results[1]
    # The synthetic quantities are none of those that the case declares.
    assert "Declared, but measured by no run here: " in text


def test_html_has_contents_and_everything_and_needs_nothing_from_elsewhere(results):
    folder = results[0]
    html = (folder / "report.html").read_text()
    assert '<nav id="contents">' in html and html.count("<details>") > 6 and 'id="silo-variant_0"' in html
    links = re.findall(r'(?:href|src)="([^"#][^"]*)"', html)
    assert links and all((folder / link).is_file() for link in links) and "url(" not in html
    assert set(re.findall(r'href="#([^"]*)"', html)) <= set(re.findall(r'id="([^"]*)"', html))
    assert "quantity σ<sub>zz</sub> number 11" in html
    # What fails a check stands with it.
    assert "fails with: friction off" in html and "fails with: a lost grain" in html
    for text in (html, results[1]):
        assert not re.search(r"\b(None|nan|inf)\b", pdf.text(text))


class Rows(HTMLParser):
    """The facts in the chapters of an HTML report: attributes, the heads of their table, and the texts of the cells of their rows."""

    def __init__(self, html):
        super().__init__()
        self.facts, self.fact, self.heads, self.chapter, self.texts = [], {"rows": []}, [], False, []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.chapter |= attributes.get("class") == "chapter"
        if tag == "thead":
            self.heads = []
        if tag in ("thead", "tbody"):
            self.fact = attributes | {"rows": [], "heads": self.heads}
            if self.chapter and attributes.get("class") == "fact":
                self.facts.append(self.fact)
        elif tag == "tr":
            self.fact["rows"].append([])
        elif tag in ("th", "td"):
            self.texts = self.heads if tag == "th" else self.fact["rows"][-1]
            self.texts.append("")

    def handle_data(self, data):
        if self.texts:
            self.texts[-1] += data


def test_a_fact_is_one_row_with_a_column_for_each_engine(results):
    folder = results[0]
    found = Rows((folder / "report.html").read_text()).facts
    checks = [one for one in found if one["data-case"] == "log_pile" and one["data-verdict"] != "information"]
    # 18 quantities of two variants in two engines, and 9 compared.
    assert len(checks) == 2 * (18 + 9) and all(len(one["rows"]) == 1 for one in checks)
    assert all(one["heads"][2:4] == ["LIGGGHTS", "YADE"] and len(one["rows"][0]) == len(one["heads"]) for one in checks)
    assert {one["data-evidence"] for one in checks} == {"experiment", "theory", "code", "identity", "none"}
    assert {one["data-verdict"] for one in found} == {"failed", "open", "passed"}
    assert sum(one["data-verdict"] == "failed" for one in found) == 3
    # Failed facts are first, and a value has its own verdict.
    lost = next(one for one in found if one["data-case"] == "silo")["rows"][0]
    assert ["✗" in text for text in lost[2:4]] == [False, True]


def test_the_members_of_a_family_follow_it():
    rows = [row(3, family="silo: k", deviation=0.01), row(3, family="silo: k", deviation=0.5, verdict="fail", cause="a wall"),
            row(4, family="silo: k", deviation=0.02), row(3, deviation=0.3)]
    rows[1] = replace(rows[1], engine="liggghts")
    family, alone = facts.facts(rows)
    assert family.standing == "failed" and family.worst == rows[1] and family.title == "k" and front.cause(family) == "a wall"
    assert {engine: cell.standing for engine, cell in family.cells.items()} == {"yade": "passed", "liggghts": "failed"}
    assert [len(one.rows) for one in family.members] == [2, 1] and alone.members == []
    assert facts.engines([family, alone]) == ["liggghts", "yade"]
    assert [why for why, _ in front.failed_groups([family, alone])] == ["a wall"]


def test_engines_that_are_compared_are_one_row():
    values = [replace(full_size.quantity(3, seed), samples=()) for seed in range(3)]
    pairs = [replace(pair(values[one], values[two], names[0], names[1]), family="silo, dry: k in the engines")
             for one, two, names in ((0, 1, ("lammps", "liggghts")), (0, 2, ("lammps", "yade")), (1, 2, ("liggghts", "yade")))]
    (found,) = facts.facts(Row("silo", "dry", "silo-dry", one.engine, one) for one in pairs)
    assert {engine: cell.value for engine, cell in found.cells.items()} == {
        "lammps": values[0].value, "liggghts": values[1].value, "yade": values[2].value}
    assert [found.label(one) for one in found.members] == ["LIGGGHTS / LAMMPS", "YADE / LAMMPS", "YADE / LIGGGHTS"]


def test_csv_holds_every_quantity_and_profile(results):
    folder = results[0]
    rows = list(csv.DictReader((folder / "figures/quantities.csv").open()))
    assert len(rows) == 7 * 18 + 4 * 9 + 1
    assert {row["control"] for row in rows} >= {"friction off", "a lost grain"}
    assert {row["evidence"] for row in rows} == {"experiment", "theory", "code", "identity", ""}
    own = result.read(folder / "silo/variant_0/liggghts/metrics.json").profiles[1]
    table = [row for row in csv.DictReader((folder / "figures/silo-variant_0-curve_1.csv").open()) if row["engine"] == "liggghts"]
    np.testing.assert_allclose([float(row["value"]) for row in table], own["value"])


def test_nothing_to_report_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("DEMBARK_DECKS", str(tmp_path))
    with pytest.raises(RunError, match="nothing to report"):
        report.build(tmp_path / "none")


def row(number, **changes):
    record = full_size.quantity(number, 0)
    return Row("silo", "dry", "silo-dry", "yade", type(record)(**{**record.__dict__, **changes}))


def test_scatter_is_of_checks_against_experiment_and_theory_only():
    rows = [row(3), row(5), row(0), row(6), row(3, tolerance=None, verdict="info"), row(3, reference=0.0), row(3, value=None),
            row(3, deviation_kind="absolute")]
    found = scatter.points(rows)
    assert [one.evidence for one in found] == ["theory", "experiment"] and found[0].half == pytest.approx(0.02)
    drawn = scatter.figure(found)
    assert len(drawn.axes[1].get_yticklabels()) == len({one.line for one in found}) == 2
    assert scatter.figure([]) is None and scatter.statistics(found) is None


def test_symbols_have_subscripts_and_no_number_is_parted_from_its_per_cent():
    assert figures.subscripts("<δ_max> in 95 % of runs") == "&lt;δ<sub>max</sub>&gt; in 95\N{NO-BREAK SPACE}% of runs"
    assert figures.symbols("u_max / peak_force") == r"$\mathrm{u_{max}}$ / peak_force"


def test_open_checks_are_one_line_for_each_case_and_reason():
    rows = [row(8, reason="its interval (±0.4) is wider than the tolerance", decides="about 7 packings", family="silo: a"),
            row(8, reason="its interval (±0.4) is wider than the tolerance", decides="about 12 packings", family="silo: a"),
            row(17, reason="its interval (±0.5) is wider than the tolerance", decides="3 packings or more"),
            row(26, reason="the run is too short"),
            # In a family with two reasons, and in one that failed.
            row(8, reason="its interval (±0.4) is wider than the tolerance", decides="about 9 packings", family="silo: b"),
            row(8, reason="it still moves", family="silo: b"),
            row(8, reason="it still moves", family="silo: c"), row(8, verdict="fail", family="silo: c")]
    first, second = front.open_lines(rows)
    assert sum(one.count for one in (first, second)) == tally(row.record for row in rows).open
    assert (first.count, first.reason) == (3, "its interval is wider than the tolerance") and "1 more" in first.names
    assert first.decides == "about 7 to 12 packings; 3 packings or more"
    assert (second.count, second.reason, second.decides) == (1, "the run is too short", "")


def test_of_many_variants_the_pdf_shows_the_worst():
    rows = [replace(row(3, deviation=0.01 * number), place=str(number), anchor=f"silo-{number}") for number in range(8)]
    (found,) = sections.printed(facts.facts(rows))
    assert len(found.rows) == 8 and found.worst.record.deviation == 0.07
    failed = [replace(row(3, deviation=0.5, verdict="fail"), anchor="silo-9"), row(0, verdict="fail"), row(0, name="other")]
    shown = sections.printed(facts.facts([*rows, *failed]))
    assert [(one.standing, one.worst.record.evidence) for one in shown] == [("failed", "theory"), ("failed", "identity")]


def test_a_report_of_some_cases_shows_these_alone(tmp_path):
    folder = full_size.write(tmp_path / "quick", ("silo", "log_pile"), variants=1, quantities=2, profiles=0)
    assert {row.case for row in gather(folder).rows} == {"silo", "log_pile", "verification"}
    (folder / "plan.json").write_text(json.dumps({"runs": [], "cases": ["silo"], "results": ["silo/variant_0/liggghts/metrics.json"]}))
    (folder / "verification.json").unlink()
    found = gather(folder)
    assert {row.case for row in found.rows} == set(found.cases) == {"silo"}
    assert {row.engine for row in found.rows} == {"liggghts"}
    assert tally_of(folder).checks == tally(row.record for row in found.rows).checks
    assert found.left_out == "Not shown, because not asked for: silo variant 0 (YADE)."


def test_without_a_list_of_runs_nothing_of_other_cases_is_missing(tmp_path):
    folder = full_size.write(tmp_path / "quick", ("silo",), variants=1, quantities=2, profiles=0)
    (folder / "plan.json").unlink()
    found = gather(folder)
    assert [page.case for page in found.pages] == ["silo"] and found.missing == [] and "Single runs" in found.summary["description"]


def test_a_finished_run_that_was_deleted_is_missing(tmp_path):
    folder = full_size.write(tmp_path / "quick", ("silo",), variants=1, quantities=2, profiles=0)
    (folder / "silo/variant_0/yade/replica-1/run.json").unlink()
    assert gather(folder).missing == ["silo, variant 0: YADE, replica 1: missing"]


def test_a_case_that_cannot_be_read_is_named_and_the_others_keep_their_titles(tmp_path, monkeypatch):
    (tmp_path / "own" / "broken").mkdir(parents=True)
    (tmp_path / "own" / "broken" / "case.toml").write_text("[case]\n")
    monkeypatch.setenv("DEMBARK_CASES", str(tmp_path / "own"))
    found = gather(full_size.write(tmp_path / "quick", ("silo",), variants=1, quantities=2, profiles=0))
    assert "silo" in found.cases and len(found.missing) == 1 and "case broken: title is missing" in found.missing[0]


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [(2.0512, [1.94, 2.1624], "2.05 ± 0.11"), (539.0, [456.0, 622.0], "539 ± 83"), (4.1e-5, [2.7e-5, 5.5e-5], "(4.1 ± 1.4)·10⁻⁵"),
     (0.25, None, "0.250"), (-0.0008, [-0.003, 0.0014], "−0.0008 ± 0.0022"), (None, None, "–"), (0.0, [0.0, 0.0], "0"),
     (0.3, [0.3 - 2e-11, 0.3 + 2e-11], "0.300 ± 2.0·10⁻¹¹")],
)
def test_value_has_the_digits_of_its_interval(value, interval, text):
    assert numbers.with_interval(value, interval) == text


@pytest.mark.parametrize(("value", "text"),
                         [(1e300, "1·10³⁰⁰"), (0.005, "0.005"), (60, "60"), (5e6, "5·10⁶"), ("exact", "exact"), (None, "not set")])
def test_parameters_without_needless_zeros(value, text):
    assert numbers.compact(value) == text


@pytest.mark.parametrize(
    ("changes", "text"),
    [({"deviation": 0.0123}, "+1.2 %"), ({"deviation": 2.7e-7}, "2.7·10⁻⁵ %"),
     ({"deviation": 60.35, "value": 0.6135, "reference": 0.01}, "0.60 kPa"),
     ({"deviation": 0.002, "deviation_kind": "absolute"}, "0.0020 kPa"), ({"deviation": None}, "–")],
)
def test_deviations_are_no_percentages_near_a_reference_of_zero(changes, text):
    assert numbers.deviation(row(3, **changes).record) == text


def test_variants_come_as_the_case_lists_them(tmp_path):
    for variant in ("theta_half", "damped", "a_point=2", "equal", "study-first_order"):
        (tmp_path / "log_pair" / variant / "yade").mkdir(parents=True)
        result.write(tmp_path / "log_pair" / variant / "yade/metrics.json", result.Result("log_pair", variant, "yade", ()))
    assert [page.variant for page in gather(tmp_path).pages] == ["equal", "theta_half", "damped", "a_point=2", "study-first_order"]


def test_profiles_with_a_reference_come_first():
    profiles = {"yade": [{"name": "a"}, {"name": "b", "reference": [1.0]}, {"name": "c"}]}
    assert figures.profile_names(profiles) == ["b", "a", "c"]


def test_a_figure_of_a_missing_picture_is_left_out(tmp_path):
    folder = full_size.write(Path(tmp_path, "quick"), ("silo",), variants=1, quantities=2, profiles=0)
    for path in folder.rglob("picture.png"):
        path.unlink()
    (one,) = sections.sections(gather(folder), tmp_path)
    assert one.pictures == [] and one.figures == []


@pytest.mark.parametrize(("value", "text"), [(99_940.0, "99940"), (99_960.0, "1.00·10⁵"), (999_960.0, "1.00·10⁶"), (9.996e-4, "0.00100"),
                                             (9.999, "10.0"), (-1.5e-5, "−1.50·10⁻⁵"), (0.0, "0"), (None, "–")])
def test_a_number_has_its_digits_after_it_is_rounded(value: float | None, text: str) -> None:
    assert numbers.plain(value) == text
