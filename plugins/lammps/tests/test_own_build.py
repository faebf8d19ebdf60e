"""The plugin for a LAMMPS of one's own: what CMake takes from its source, and what it refuses."""

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


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


def configure(folder, source, **options):
    words = [f"-D{name}={value}" for name, value in {"LAMMPS_SOURCE_DIR": source, **options}.items()]
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
    (source / "src/version.h").write_text('#define LAMMPS_VERSION "4 Feb 2025"\n')
    assert told(configure(tmp_path / "build", source)) == (
        "LAMMPS_SOURCE_DIR is LAMMPS 4 Feb 2025; dembark's styles are made for the stable release of 22 Jul 2025")


def test_what_is_no_source_is_refused(source, tmp_path):
    assert "has no src/version.h; set it to the top of LAMMPS's source tree" in told(configure(tmp_path / "build", tmp_path))
    assert "STUBS/mpi.h' is missing" in told(configure(tmp_path / "other", source, LAMMPS_MPI="OFF"))
