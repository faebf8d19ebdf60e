"""The report stands alone, hides nothing, and its numbers read well."""

import csv
import json
import re
import sys
import types

import numpy as np
import pytest
from dembark.validation import report
from dembark.validation.compare import compare
from dembark.validation.errors import RunError
from dembark.validation.metrics import measure
from dembark.validation.report import figures, numbers, pictures
from dembark.validation.report.build import overview
from synthetic import plug_flow, silo


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A silo in both engines, one of them with lost wall forces, a channel in one, and one run that failed."""
    folder = tmp_path_factory.mktemp("results") / "quick"
    for engine, lost in (("liggghts", 0.0), ("yade", 0.02)):
        measure(silo(folder, engine=engine, noise=0.05, lost_wall_force=lost))
    compare(folder / "silo" / "dry")
    measure(plug_flow(folder))
    runs = [
        {"case": case, "variant": variant, "engine": engine, "replica": 1, "state": state, "message": message}
        for case, variant, engine, state, message in (
            ("silo", "dry", "liggghts", "finished", ""),
            ("silo", "dry", "yade", "finished", ""),
            ("plug_flow", "smooth", "liggghts", "finished", ""),
            ("plug_flow", "smooth", "yade", "failed", "the engine was killed by SIGKILL <at> step 7"),
        )
    ]
    (folder / "runs.json").write_text(json.dumps({"profile": "quick", "runs": runs}))
    (folder / "plug_flow" / "smooth" / "liggghts" / "replica-1" / "grains.dump").write_text("gone")
    report.build(folder)
    return folder


def test_html_needs_no_other_file(results):
    html = (results / "report.html").read_text()
    assert not re.search(r'(?:src|href)="(?!data:|#)', html)
    assert "url(" not in html
    assert html.count("data:image/svg+xml;base64,") >= 4


def test_pdf_is_written(results):
    assert (results / "report.pdf").read_bytes().startswith(b"%PDF")


def test_failed_check_is_shown_as_failed(results):
    html = (results / "report.html").read_text()
    assert '<tr class="fail' in html
    rows = list(csv.DictReader((results / "figures" / "verdicts.csv").open()))
    failed = {(row["engine"], row["quantity"]) for row in rows if row["verdict"] == "fail"}
    assert ("YADE", "force_balance_error") in failed
    assert ("LIGGGHTS", "force_balance_error") not in failed


def test_overview_counts_the_verdicts_of_each_engine():
    page, other = (types.SimpleNamespace(anchor=name) for name in ("silo-dry", "silo-wet"))
    rows = [
        {"page": one, "engine": engine, "verdict": verdict}
        for one, engine, verdict in ((page, "YADE", "pass"), (page, "YADE", "pass"), (page, "LIGGGHTS", "fail"), (other, "YADE", "missing"))
    ]
    first, second = overview(rows)
    assert first["counts"]["YADE"] == {"pass": 2, "fail": 0, "info": 0, "missing": 0} and first["counts"]["LIGGGHTS"]["fail"] == 1
    assert second["page"] is other and second["counts"]["YADE"]["missing"] == 1


def test_missing_run_is_shown_with_its_reason(results):
    html = (results / "report.html").read_text()
    assert "1 run is missing" in html
    assert "the engine was killed by SIGKILL &lt;at&gt; step 7" in html


def test_unreadable_dump_is_no_silent_gap(results):
    assert re.search(r"No picture of LIGGGHTS: .*does not begin with", (results / "report.html").read_text())


def test_every_profile_has_its_data_beside_it(results):
    metrics = json.loads((results / "silo" / "dry" / "liggghts" / "metrics.json").read_text())
    for profile in metrics["profiles"]:
        rows = list(csv.DictReader((results / "figures" / f"silo-dry-{profile['name']}.csv").open()))
        assert {row["engine"] for row in rows} == {"liggghts", "yade"}
        own = [float(row["value"]) for row in rows if row["engine"] == "liggghts"]
        np.testing.assert_allclose(own, profile["value"])
    assert (results / "figures" / "scatter.csv").is_file()


def test_nothing_to_report_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("DEMBARK_DECKS", str(tmp_path))
    with pytest.raises(RunError, match="nothing to report"):
        report.build(tmp_path / "none")


def test_renderer_that_dies_gives_its_reason(monkeypatch):
    scene = pictures.Scene(np.zeros((1, 3)), np.ones(1), np.ones(1), "v")
    monkeypatch.setattr(sys, "executable", "/bin/false")
    figure, reasons = pictures.picture({"liggghts": scene})
    assert figure is None
    assert reasons == ["No picture of LIGGGHTS: the renderer ended with code 1."]


def test_picture_is_drawn_without_a_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    random = np.random.default_rng(1)
    scene = pictures.Scene(random.uniform(0, 1, (50, 3)), np.full(50, 0.1), random.uniform(0, 1, 50), "v")
    figure, reasons = pictures.picture({"liggghts": scene})
    assert reasons == []
    image = figure.axes[0].images[0].get_array()
    assert image.min() < 100
    assert image.max() > 250


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [
        (2.0512, [1.94, 2.1624], "2.05 ± 0.11"),
        (539.0, [456.0, 622.0], "539 ± 83"),
        (4.1e-5, [2.7e-5, 5.5e-5], "(4.1 ± 1.4)·10⁻⁵"),
        (0.25, None, "0.250"),
        (-0.0008, [-0.003, 0.0014], "−0.0008 ± 0.0022"),
        (None, None, "–"),
        (0.0, [0.0, 0.0], "0"),
    ],
)
def test_value_has_the_digits_of_its_interval(value, interval, text):
    assert numbers.with_interval(value, interval) == text


@pytest.mark.parametrize(("value", "text"), [(1e300, "1·10³⁰⁰"), (0.005, "0.005"), (60, "60"), (5e6, "5·10⁶")])
def test_parameters_without_needless_zeros(value, text):
    assert numbers.compact(value) == text


def test_pairs_leave_out_what_has_no_ratio():
    good = {"value": 2.0, "interval": [1.8, 2.2], "reference": 1.0, "reference_interval": None, "deviation_kind": "relative"}
    bad = [good | {"reference": 0.0}, good | {"deviation_kind": "absolute"}, good | {"value": None}]
    assert figures.pairs([("a", good), *(("b", one) for one in bad)]) == [("a", 2.0, 1.0, pytest.approx(0.1), 0.0)]
