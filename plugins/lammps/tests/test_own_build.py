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
FIT = "dembark's styles need the release of 29 Aug 2024 or a later one"


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


@pytest.mark.parametrize("version", ["2 Aug 2023", "28 Aug 2024", "of today"])
def test_an_older_release_is_refused(source, tmp_path, version):
    (source / "src/version.h").write_text(f'#define LAMMPS_VERSION "{version}"\n')
    assert told(configure(tmp_path / "build", source)) == f"LAMMPS {version} in {source}/src does not fit; {FIT}"


@pytest.mark.parametrize(("version", "warned"), [("29 Aug 2024", False), ("19 Nov 2024", True), ("3 Dec 2026", True)])
def test_a_release_that_the_tests_did_not_run_with_checks_itself(known, source, tmp_path, version, warned):
    (source / "src/version.h").write_text(f'#define LAMMPS_VERSION "{version}"\n')
    done = configure(tmp_path / "build", source, MPI_INCLUDE_DIR=known["MPI_INCLUDE_DIR"])
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("dembark:") == warned and (f"LAMMPS {version}" in " ".join(done.stderr.split())) == warned
    assert ("DEMBARK_SELF_TEST" in (tmp_path / "build/CMakeFiles/dembarkplugin.dir/flags.make").read_text()) == warned


@pytest.mark.parametrize("version", ["20250722", "2025.7.22.4"])
def test_the_package_of_python_says_its_release(known, tmp_path, version):
    folder = tmp_path / "lammps"
    shutil.copytree(known["LAMMPS_INCLUDE_DIR"], folder / "include/lammps")
    (folder / "cmake/LAMMPS").mkdir(parents=True)
    (folder / "cmake/LAMMPS/LAMMPSConfigVersion.cmake").write_text(f'set(PACKAGE_VERSION "{version}")\n')
    done = configure(tmp_path / "build", LAMMPS_INCLUDE_DIR=folder / "include/lammps", MPI_INCLUDE_DIR=known["MPI_INCLUDE_DIR"])
    assert done.returncode == 0, done.stderr
    assert "22 Jul 2025" in (tmp_path / "build/CMakeFiles/dembarkplugin.dir/flags.make").read_text()


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
    assert "install lammps and liblammps-dev of Debian 13, or set LAMMPS_DIR" in told(done)


WARNING = "dembark's tests have not run with LAMMPS"


@pytest.mark.slow
def test_styles_that_check_themselves(known, tmp_path, monkeypatch):
    """A plugin that computes what the laws say warns and runs; one whose springs see another time step ends LAMMPS with one line."""
    shutil.copytree(ROOT / "plugins", tmp_path / "plugins", ignore=shutil.ignore_patterns("tests", "__pycache__"))
    options = {name: known[name] for name in ("LAMMPS_EXECUTABLE", "LAMMPS_INCLUDE_DIR", "MPI_INCLUDE_DIR", "MPI_LIBRARY_DIR", "MPI_EXEC")}
    words = [f"-D{name}={value}" for name, value in (options | {"LAMMPS_SELF_TEST": "ON", "DEMBARK_BIN": tmp_path / "bin"}).items()]
    build = tmp_path / "build"
    subprocess.run(["cmake", "-S", tmp_path / "plugins/lammps", "-B", build, *words], check=True, capture_output=True)
    subprocess.run(["cmake", "--build", build], check=True, capture_output=True)
    monkeypatch.setattr(lammps_driver, "BIN", tmp_path / "bin")
    done = lammps_driver.run_deck(tmp_path, lammps_driver.deck(SCENARIOS["collision, wet"]), ranks=2)
    assert done.code == 0 and done.output.count(WARNING) == 1, done.output
    pair = tmp_path / "plugins/lammps/pair_dembark_granular.cpp"
    right = "step.contact_flags = step.bridge_flag = 1;"
    assert right in pair.read_text()
    pair.write_text(pair.read_text().replace(right, right + "\n  step.dt *= 1.001;"))
    subprocess.run(["cmake", "--build", build], check=True, capture_output=True)
    done = lammps_driver.run_deck(tmp_path, "units si\n")
    assert done.code == 1 and done.output.count("ERROR") == 1 and "the force of contact 1 is wrong" in done.output


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
