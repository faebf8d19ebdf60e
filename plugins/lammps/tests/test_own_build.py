"""The styles for a LAMMPS of one's own: what CMake takes from its source or its package, and what it refuses."""

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from rig import lammps_driver, python_driver
from rig.motion import deviation
from rig.scenarios import SCENARIOS

ROOT = Path(__file__).resolve().parents[3]
FIT = "dembark's styles are made for the releases of 22 Jul 2025 and, as in Debian 13, of 4 Feb 2025"


@pytest.fixture(scope="module")
def known():
    """What packaging/lammps.sh found."""
    said = subprocess.run([ROOT / "packaging/lammps.sh", "--where"], capture_output=True, text=True, check=True).stdout
    return dict(word.partition("=")[::2] for line in said.splitlines() for word in shlex.split(line))


@pytest.fixture
def source(known, tmp_path):
    """A source tree like LAMMPS's, with its headers."""
    shutil.copytree(known["LAMMPS_INCLUDE_DIR"], tmp_path / "lammps/src")
    (tmp_path / "lammps/src/version.h").write_text('#define LAMMPS_VERSION "22 Jul 2025"\n#define LAMMPS_UPDATE "Update 4"\n')
    return tmp_path / "lammps"


def configure(folder, source=None, **options):
    words = [f"-D{name}={value}" for name, value in {"LAMMPS_SOURCE_DIR": source or "", **options}.items()]
    return subprocess.run(["cmake", "-S", ROOT / "plugins/lammps", "-B", folder, *words], capture_output=True, text=True, check=False)


def told(done):
    """The one sentence with which CMake ended."""
    assert done.returncode != 0
    said = [" ".join(text.split()) for text in done.stderr.partition("dembark:")[2].split("\n\n")]  # CMake wraps lines
    assert "dembark:" not in "".join(said)
    return said[0]


def test_the_source_says_what_is_needed(known, source, tmp_path):
    done = configure(tmp_path / "build", source, LAMMPS_EXECUTABLE=known["LAMMPS_EXECUTABLE"], MPI_INCLUDE_DIR=known["MPI_INCLUDE_DIR"],
                     LAMMPS_SIZES="bigbig")
    assert done.returncode == 0, done.stderr
    assert known["LAMMPS_EXECUTABLE"] in (tmp_path / "build/bin/lammps-dembark").read_text()
    flags = (tmp_path / "build/CMakeFiles/dembarkplugin.dir/flags.make").read_text()
    assert f"-isystem {source}/src" in flags and "-DLAMMPS_BIGBIG" in flags


def test_without_a_program_there_is_the_plugin(known, source, tmp_path):
    done = configure(tmp_path / "build", source, MPI_INCLUDE_DIR=known["MPI_INCLUDE_DIR"])
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "build/bin").exists() and "-DLAMMPS_BIGBIG" not in (
        tmp_path / "build/CMakeFiles/dembarkplugin.dir/flags.make").read_text()


def test_another_version_is_refused(source, tmp_path):
    (source / "src/version.h").write_text('#define LAMMPS_VERSION "29 Aug 2024"\n')
    assert told(configure(tmp_path / "build", source)) == f"LAMMPS 29 Aug 2024 in {source}/src does not fit; {FIT}"


def test_what_is_no_source_is_refused(source, tmp_path):
    assert "has no src/version.h; set it to the top of LAMMPS's source tree" in told(configure(tmp_path / "build", tmp_path))
    assert "STUBS/mpi.h' is missing" in told(configure(tmp_path / "other", source, LAMMPS_MPI="OFF"))


def package(folder, version):
    """What CMake finds of an installed LAMMPS."""
    folder.mkdir()
    (folder / "LAMMPSConfig.cmake").write_text("add_library(LAMMPS::lammps SHARED IMPORTED)\n")
    (folder / "LAMMPSConfigVersion.cmake").write_text(f'set(PACKAGE_VERSION "{version}")\n')
    return folder


def test_an_installed_lammps_of_another_version_is_refused(tmp_path):
    found = package(tmp_path / "lammps", "20220106")
    assert told(configure(tmp_path / "build", LAMMPS_INSTALLED="ON", LAMMPS_DIR=found)) == (
        f"LAMMPS 20220106 in {found} does not fit; {FIT}")


def test_without_an_installed_lammps_one_line_says_so(tmp_path):
    done = configure(tmp_path / "build", LAMMPS_INSTALLED="ON", CMAKE_DISABLE_FIND_PACKAGE_LAMMPS="ON")
    assert "install liblammps-dev of Debian 13, or set LAMMPS_DIR" in told(done)


@pytest.mark.slow
def test_a_program_over_an_installed_library(tmp_path, monkeypatch):
    """Debian 13's liblammps-dev: the styles are there after `clear`, too, and wrong words end the run."""
    done = configure(tmp_path / "build", LAMMPS_INSTALLED="ON", DEMBARK_BIN=tmp_path / "bin")
    if done.returncode:
        pytest.skip(told(done))
    subprocess.run(["cmake", "--build", tmp_path / "build"], check=True, capture_output=True)
    monkeypatch.setattr(lammps_driver, "BIN", tmp_path / "bin")
    decks = {name: lammps_driver.deck(case) for name, case in SCENARIOS.items()}
    found = lammps_driver.motions(tmp_path, decks, SCENARIOS)
    for name, case in SCENARIOS.items():
        assert max(deviation(python_driver.run(case), found[name]).values()) < 1e-9, name
    done = lammps_driver.run_deck(tmp_path, decks["collision, wet"].replace("normal hertz", "normal linear"))
    assert done.code == 1 and done.output.count("ERROR") == 1 and "hertz or hooke" in done.output
