"""Fields that a measurement left are drawn with their data next to them; what cannot be drawn is reported."""

import csv
from importlib import import_module

import numpy as np
import pytest
import xarray
from measuring import measure
from synthetic import plug_flow, silo

from dembark.input_decks.debarking_drum.figures import draw
from dembark.postproc.field_figures import Look
from dembark.validation import report
from dembark.validation.report import figures, sections
from dembark.validation.report.gather import gather


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A silo in both engines and a channel in one, measured."""
    folder = tmp_path_factory.mktemp("fields") / "quick"
    for engine in ("liggghts", "yade"):
        measure(silo(folder, engine=engine, noise=0.05))
    measure(plug_flow(folder))
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(import_module("dembark.validation.report.build"), "write_pdf", lambda *_: None)
        report.build(folder)
    return folder


def test_fields_are_drawn_with_their_data_beside_them(results):
    html = (results / "report.html").read_text()
    assert "Fields over radius and height" in html and "Eulerian and Lagrangian profiles" in html
    rows = list(csv.DictReader((results / "figures" / "silo-dry-fields-section.csv").open()))
    assert {row["engine"] for row in rows} == {"liggghts", "yade"}
    fields = xarray.load_dataset(results / "silo" / "dry" / "yade" / "fields.nc", engine="h5netcdf")
    place, stress = (np.array([float(row[name]) for row in rows if row["engine"] == "yade"]) for name in ("height_m", "sigma_zz_Pa"))
    np.testing.assert_allclose(np.interp(place, fields.height, fields.stress_zz_section), stress)
    assert (results / "figures" / "silo-dry-fields-maps.svg").is_file()


def test_fields_that_cannot_be_drawn_are_no_silent_gap(results, tmp_path):
    (results / "plug_flow" / "smooth" / "liggghts" / "fields.nc").write_text("not NetCDF")
    found = {one.case: one for one in sections.sections(gather(results), tmp_path)}
    assert any("fields.nc cannot be drawn: " in line for line in found["plug_flow"].missing)
    assert not any("fields.nc" in line for line in found["silo"].missing)


def test_drum_is_drawn_without_a_single_impact_on_the_shell():
    place, angle, force = np.array([-0.5, 0.5]), np.arange(-175.0, 180.0, 10.0), np.logspace(1.1, 5.9, 25)
    none = np.zeros((len(angle), len(force)))
    variables = {"impact_power": (("x", "z"), np.array([[0.0, 1.0], [2.0, 0.0]])), "shell_power": (("angle",), none[:, 0]),
                 "shell_power_half": (("angle",), none[:, 0]), "shell_peaks": (("angle", "force"), none),
                 **{name: (("log",), np.array([0.1])) for name in ("log_x", "log_z", "log_radius")}}
    attributes = {"drum_radius": 1.0, "impact_speed": 0.1, "revolutions": 3, "replicas": 1, "impacts": 2, "log_length": 1.0}
    one = xarray.Dataset(variables, {"x": place, "z": place, "angle": angle, "force": force}, attributes)
    found, unrolled = draw({"yade": one}, {"yade": Look("YADE", "#0072B2", "o")})
    assert len(found.tables["power"][1]) == 4 and len(unrolled.tables["shell_power"][1]) == len(angle)
    assert figures.svg(found.figure).startswith(b"<?xml") and figures.svg(unrolled.figure).startswith(b"<?xml")
