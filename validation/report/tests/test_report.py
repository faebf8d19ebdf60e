"""The report stands alone, hides nothing, and its numbers read well."""

import csv
import json
import re
import sys
import types

import numpy as np
import pytest
import xarray
from dembark.common.errors import RunError
from dembark.postproc.fields.coarse_graining import WallContacts
from dembark.validation import report
from dembark.validation.compare import compare
from dembark.validation.metrics import measure
from dembark.validation.report import fields, figures, numbers, pictures
from dembark.validation.report.build import _fields, overview
from dembark.validation.verification import scenes
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


def test_fields_are_drawn_with_their_data_beside_them(results):
    html = (results / "report.html").read_text()
    assert "Fields over radius and height" in html and "Eulerian beside Lagrangian profiles" in html
    rows = list(csv.DictReader((results / "figures" / "silo-dry-fields-section.csv").open()))
    assert {row["engine"] for row in rows} == {"liggghts", "yade"}
    fields = xarray.load_dataset(results / "silo" / "dry" / "yade" / "fields.nc", engine="h5netcdf")
    place, stress = (np.array([float(row[name]) for row in rows if row["engine"] == "yade"]) for name in ("height_m", "sigma_zz_Pa"))
    np.testing.assert_allclose(np.interp(place, fields.height, fields.stress_zz_section), stress)
    assert (results / "figures" / "silo-dry-fields-maps.svg").is_file()


def test_fields_that_cannot_be_drawn_are_no_silent_gap(tmp_path):
    page = types.SimpleNamespace(folder=tmp_path, metrics={"yade": {}}, anchor="silo-dry", name="silo / dry")
    assert _fields(page, tmp_path) == ([], "")
    (tmp_path / "yade").mkdir()
    (tmp_path / "yade" / "fields.nc").write_text("not NetCDF")
    drawn, reason = _fields(page, tmp_path)
    assert drawn == [] and reason.startswith("fields.nc cannot be drawn: ")


def test_verification_is_a_chapter_and_its_verdicts_count(results):
    html = (results / "report.html").read_text()
    assert "Static balance" in html and 'href="#verification"' in html
    own = {row["quantity"]: row["verdict"] for row in csv.DictReader((results / "figures" / "verdicts.csv").open()) if row["engine"] == "dembark"}
    assert own["balance_order"] == own["mass_error"] == "pass"
    written = json.loads((results / "verification.json").read_text())["quantities"]
    assert {one["name"] for one in written} == own.keys()
    assert (results / "figures" / "verification-balance.csv").is_file()


def test_drum_is_drawn_without_a_single_impact_on_the_shell():
    place, angle, force = np.array([-0.5, 0.5]), np.arange(-175.0, 180.0, 10.0), np.logspace(1.1, 5.9, 25)
    none = np.zeros((len(angle), len(force)))
    variables = {"impact_power": (("x", "z"), np.array([[0.0, 1.0], [2.0, 0.0]])), "shell_power": (("angle",), none[:, 0]),
                 "shell_power_half": (("angle",), none[:, 0]), "shell_peaks": (("angle", "force"), none),
                 **{name: (("log",), np.array([0.1])) for name in ("log_x", "log_z", "log_radius")}}
    attributes = {"kind": "drum", "drum_radius": 1.0, "impact_speed": 0.1, "revolutions": 3, "replicas": 1, "impacts": 2, "log_length": 1.0}
    one = xarray.Dataset(variables, {"x": place, "z": place, "angle": angle, "force": force}, attributes)
    found, unrolled = fields.figures({"yade": one})
    assert len(found.tables["power"][1]) == 4 and len(unrolled.tables["shell_power"][1]) == len(angle)
    assert figures.svg(found.figure).startswith(b"<?xml") and figures.svg(unrolled.figure).startswith(b"<?xml")


def test_pressure_in_a_grain_between_two_others():
    """A row of three, pressed with the force F: F d over three volumes in the middle one, half of that at the ends."""
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    frame = scenes.grains(place, np.full(3, 0.5), low=-np.ones(3), high=np.full(3, 3.0))
    pairs = np.array([[0, 1], [1, 2]])
    links = scenes.contacts(place[pairs[:, 0]], np.tile([1.0, 0.0, 0.0], (2, 1)), np.tile([-6.0, 0.0, 0.0], (2, 1)), pairs)
    middle = 6.0 * 1.0 / (3.0 * np.pi / 6.0)
    np.testing.assert_allclose(pictures.grain_pressure(frame, links), [0.5 * middle, middle, 0.5 * middle])
    wall = WallContacts(np.array([[-0.5, 0.0, 0.0]]), place[:1], np.array([[6.0, 0.0, 0.0]]))
    np.testing.assert_allclose(pictures.grain_pressure(frame, links, [wall]), [middle, middle, 0.5 * middle])


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


@pytest.mark.parametrize(("value", "text"), [(1e300, "1·10³⁰⁰"), (0.005, "0.005"), (60, "60"), (5e6, "5·10⁶"), ("exact", "exact"), (None, "not set")])
def test_parameters_without_needless_zeros(value, text):
    assert numbers.compact(value) == text


def test_pairs_leave_out_what_has_no_ratio():
    good = {"value": 2.0, "interval": [1.8, 2.2], "reference": 1.0, "reference_interval": None, "deviation_kind": "relative"}
    bad = [good | {"reference": 0.0}, good | {"deviation_kind": "absolute"}, good | {"value": None}]
    assert figures.pairs([("a", good), *(("b", one) for one in bad)]) == [("a", 2.0, 1.0, pytest.approx(0.1), 0.0)]
