"""Where text cannot be laid out, as on clusters without Pango, the report is HTML alone."""

import sys
from pathlib import Path

import pytest

from dembark.validation.report.build import write_pdf


def test_without_pango_there_is_a_line_instead_of_a_pdf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "weasyprint.py").write_text("raise OSError('cannot load library\\nlibpango-1.0-0')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "weasyprint", raising=False)
    path = tmp_path / "report.pdf"
    path.write_text("of an earlier report")
    write_pdf("<p>text</p>", path)
    assert not path.exists()
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "no report.pdf" in told and "libpango" in told
