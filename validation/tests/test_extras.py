"""The package without the libraries of its extras: what is core works, and what is not says in one line which extra it needs."""

import re
import subprocess
import sys
import tomllib

import numpy as np

from dembark.common.checkout import checkout
from dembark.common.extras import EXTRAS
from dembark.validation import doctor, provenance

BLOCK = f"""
import sys
class Block:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {set(EXTRAS)}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Block())
"""
FIELDS = "from dembark.validation.cli import main; sys.exit(main(['fields', *sys.argv[1:]]))"


def blocked(code, *words):
    return subprocess.run([sys.executable, "-c", BLOCK + code, *map(str, words)], capture_output=True, text=True, check=False)


def test_commands_of_the_core():
    done = blocked("from dembark.validation.cli import main\nfor words in sys.argv[1:]: print(f'[{words}]'), main(words.split())",
                   "--help", "cases", "cases silo", "campaigns", "doctor")
    assert "Traceback" not in done.stderr, done.stderr
    found = re.split(r"^\[.*\]$", done.stdout, flags=re.MULTILINE)[1:]
    for text, seen in zip(found, ("validate", "silo", "grain_count", "silo", "Python packages"), strict=True):
        assert seen in text


def test_the_command_line_starts_without_the_libraries_of_its_commands():
    """They take longer than all the rest of the start."""
    libraries = {"MDAnalysis", "matplotlib", "pandas", "scipy", "xarray"}
    code = f"import sys\nimport dembark.validation.cli\nprint({libraries} & {{*sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


def test_physics_and_dumps_are_of_the_core_and_what_is_missing_is_one_line(tmp_path):
    (tmp_path / "grains.dump").write_text("ITEM: TIMESTEP\n5\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
                                          "ITEM: ATOMS id type x y z vx vy vz radius mass\n1 1 .5 .5 .5 0 0 0 .1 2\n")
    done = blocked("from dembark.physics import capillary_force; from dembark.postproc import GrainsDump\n"
                   "print(capillary_force(1e-3, 1e-3, 0.0, 1e-12, 0.072, 0.3), GrainsDump(sys.argv[1])[0].radii[0])\n" + FIELDS,
                   tmp_path / "grains.dump", "--out", tmp_path / "fields.nc")
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert np.array(done.stdout.split(), float)[1] == 0.1
    assert "xarray" in done.stderr and "pip install '.[fields]'" in done.stderr


def test_a_report_without_its_libraries_is_one_line(tmp_path):
    (tmp_path / "plan.json").write_text('{"runs": []}')
    done = blocked("from pathlib import Path; from dembark.validation.runs.steps import build_report\n"
                   "try: build_report(Path(sys.argv[1]))\nexcept Exception as error: print(error)", tmp_path)
    assert "matplotlib is not installed, pip install '.[report]'" in done.stdout, done.stderr


def test_the_doctor_names_the_extra_of_an_absent_package(monkeypatch):
    known = provenance.package_version
    monkeypatch.setattr(provenance, "package_version", lambda name: None if name in ("xarray", "scipy") else known(name))
    core, fields, report, _ = (one for one in doctor.examine() if one.what.startswith("Python packages"))
    assert (core.found, core.required, fields.found, fields.required, bool(report.found)) == (None, True, None, False, True)
    assert "scipy missing" in core.advice and "pip install '.[fields]'" in fields.advice


def test_the_extras_are_those_of_pyproject():
    listed = tomllib.loads((checkout() / "pyproject.toml").read_text())["project"]
    for extra, names in doctor._PACKAGES.items():
        lines = listed["optional-dependencies"][extra] if extra else listed["dependencies"]
        assert set(names) == {line.partition(">")[0] for line in lines if not line.startswith("dembark[")}
    assert set(EXTRAS.values()) == set(doctor._PACKAGES) - {""}
