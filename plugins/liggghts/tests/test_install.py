"""packaging/install_liggghts.sh: the styles in a LIGGGHTS source tree."""

import hashlib
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from rig.cloud import DECK, cloud, deviation
from rig.combinations import KINDS, LIST
from rig.liggghts_driver import read_dump, run_deck

ROOT = Path(__file__).parents[3]
SCRIPT = ROOT / "packaging/install_liggghts.sh"
TARBALL = "liggghts_3.8.0+repack1.orig.tar.xz"
SHA256 = "c18721d9a870c5170f03b91e4f1ffe13335c66ed1f0ff2c64ebd3be91c37867a"


def install(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(SCRIPT), *map(str, words)], capture_output=True, text=True, check=False)


def stand_in(folder: Path) -> Path:
    """A folder that looks like a LIGGGHTS source tree."""
    folder.mkdir(parents=True)
    for name in ("pair_gran_base.h", "Make.sh", "utils.h"):
        (folder / name).write_text("")
    (folder / "tangential_model_history.h").write_text("TANGENTIAL_MODEL(TANGENTIAL_HISTORY,history,2)\n")
    (folder / "cohesion_model_sjkr.h").write_text("COHESION_MODEL(COHESION_SJKR,sjkr,1)\n")
    (folder / "version_liggghts.txt").write_text("3.8.0\n")
    return folder


def test_copies_once(tmp_path):
    source = stand_in(tmp_path / "src")
    (source / "style_contact_model_user.whitelist").write_text("GRAN_MODEL(HERTZ, MINE, COHESION_OFF, ROLLING_OFF, SURFACE_DEFAULT)")
    assert install(source).returncode == 0
    before = {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in source.rglob("*") if path.is_file()}
    assert install(source).returncode == 0
    assert {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in source.rglob("*") if path.is_file()} == before
    for name in ("tangential_model_finnie_rabinowicz.h", "cohesion_model_capillary.h", "fix_lcp_impact.cpp", "fix_resume_exact.cpp",
                 "fix_energy_account.cpp", "fix_energy_account.h"):
        assert (source / name).read_bytes() == (ROOT / "plugins/liggghts" / name).read_bytes()
    assert (source / "dembark/capillary/bridge.hpp").exists() and not (source / "dembark/tests").exists()
    lines = (source / "style_contact_model_user.whitelist").read_text().splitlines()
    assert "MINE" in lines[0] and len(lines) == len(set(lines)) == 21


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    folder = stand_in(tmp_path_factory.mktemp("installed") / "src")
    install(folder)
    return folder


def test_every_included_header_is_there(source):
    for path in [*source.glob("*_model_*.h"), *source.glob("fix_*"), *source.glob("*_fix.*"), *(source / "dembark").rglob("*.hpp")]:
        for name in re.findall(r'^#include "([^"]+)"', path.read_text(), re.MULTILINE):
            ours = name.startswith("dembark/") or path.suffix == ".hpp" or any(
                (ROOT / "plugins" / folder / name).exists() for folder in ("liggghts", "lammps_family"))
            assert not ours or (path.parent / name).exists() or (source / name).exists(), f"{path.name}: {name}"


def test_whitelist_is_what_liggghts_dembark_compiles(source):
    prefixed = [[f"{kind}_{model}".removeprefix("NORMAL_").upper() for kind, model in zip(KINDS, each, strict=True)] for each in LIST]
    expected = {f"GRAN_MODEL({', '.join(each)})" for each in prefixed}
    assert len(expected) == 20
    assert set((source / "style_contact_model_user.whitelist").read_text().splitlines()) == expected


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_private_members_of_an_engine_are_reached_in_one_file(engine):
    """By explicit instantiation with a pointer to a member; in a header it would be there more than once."""
    files = [path for folder in (engine, "lammps_family") for path in (ROOT / "plugins" / folder).glob("*.*")]
    reaching = [path.name for path in files if re.search(r"^template (struct|class) \w+<.*&", path.read_text(), re.MULTILINE)]
    assert reaching == ["engine_access.cpp"]


def test_wrong_folders(tmp_path):
    old = stand_in(tmp_path / "old")
    (old / "version_liggghts.txt").write_text("3.3.1\n")
    taken = stand_in(tmp_path / "taken")
    (taken / "cohesion_model_other.h").write_text("COHESION_MODEL(COHESION_OTHER,other,20)\n")
    for words, what in (((), "no LIGGGHTS source folder given"), ((tmp_path / "none",), "does not exist"),
                        ((tmp_path,), "has no pair_gran_base.h"),
                        ((old,), "is LIGGGHTS 3.3.1"), ((taken,), "has the model number 20")):
        done = install(*words)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
        assert done.stderr.startswith("dembark: ") and what in done.stderr
    assert not (taken / "dembark").exists()


def test_lines_that_are_no_cpp17_are_mended_once(tmp_path):
    source = stand_in(tmp_path / "src")
    (source / "utils.h").write_text(
        "  // numbers\n  return static_cast< std::ostringstream & >(( std::ostringstream() << std::dec << a ) ).str();\n")
    (source / "finish.cpp").write_text("  if (neighbor->lists[m]->numneigh > 0) {\n  if (neighbor->lists[m]->inum > 0)\n")
    done = install(source)
    assert done.returncode == 0 and done.stdout.count("mended") == 2, done.stderr
    assert (source / "utils.h").read_text() == "  // numbers\n  return std::to_string(a);\n"
    assert (source / "finish.cpp").read_text() == "  if (neighbor->lists[m]->numneigh) {\n  if (neighbor->lists[m]->inum > 0)\n"
    assert "integration/monitor" in done.stdout and "packs" in done.stdout
    (source / "utils.h").write_text("  // static_cast< std::ostringstream & >(( std::ostringstream() << std::dec << a ) ).str()\n")
    assert "up to date" in install(source).stdout


def fetch(folder: Path) -> Path:
    """The published source, through apt with lists of its own; skips when this machine's apt has no Debian 12 mirror."""
    tarball = folder / TARBALL
    if not tarball.exists():
        listed = subprocess.run(["apt-get", "indextargets", "--format", "$(CODENAME) $(COMPONENT) $(REPO_URI)", "Created-By: Packages"],
                                capture_output=True, text=True, check=False).stdout
        mirrors = [line.split()[2] for line in listed.splitlines() if line.startswith("bookworm main ")]
        if not mirrors:
            pytest.skip("apt lists no mirror of Debian 12")
        state = folder / "apt"
        for name in ("lists/partial", "cache/archives/partial"):
            (state / name).mkdir(parents=True, exist_ok=True)
        (state / "status").touch()
        key = "/usr/share/keyrings/debian-archive-keyring.gpg"
        (state / "source.list").write_text(f"deb-src [signed-by={key}] {mirrors[0]} bookworm main\n")
        options = [f"Dir::Etc::sourcelist={state}/source.list", "Dir::Etc::sourceparts=/dev/null", f"Dir::State={state}",
                   f"Dir::State::lists={state}/lists",
                   f"Dir::State::status={state}/status", f"Dir::Cache={state}/cache", "APT::Sandbox::User="]
        apt = ["apt-get", "-qq", *(word for option in options for word in ("-o", option))]
        subprocess.run([*apt, "update"], check=True)
        # Only the upstream tarball is needed; its checksum is known.
        subprocess.run([*apt, "source", "--download-only", "liggghts=3.8.0+repack1-9"], cwd=folder, check=False)
    assert hashlib.sha256(tarball.read_bytes()).hexdigest() == SHA256
    return tarball


def mend(source: Path) -> None:
    """What a build without VTK needs."""
    for path in source.glob("dump_mesh_vtk.*"):
        path.unlink()


@pytest.mark.slow
def test_built_from_source_is_the_same_as_liggghts_dembark(tmp_path):
    """Takes 10 minutes of one core for the first build; it is kept in build/test-install."""
    place = ROOT / "build/test-install"
    source = place / "LIGGGHTS-PUBLIC-3.8.0/src"
    place.mkdir(parents=True, exist_ok=True)
    if not (source / ".mended").exists():
        subprocess.run(["tar", "-xJf", str(fetch(place))], cwd=place, check=True)
        mend(source)
        # Of the stock combinations one is enough.
        (source / "style_contact_model.whitelist").write_text(
            "GRAN_MODEL(HERTZ, TANGENTIAL_HISTORY, COHESION_OFF, ROLLING_OFF, SURFACE_DEFAULT)\n")
        (source / ".mended").touch()
    assert install(source).returncode == 0
    made = subprocess.run(["make", f"-j{os.cpu_count()}", "mpi", "LMP_INC=", "VTK_INC=", "VTK_LIB=",
                           "CCFLAGS=-O2 -fPIC -w -std=c++17 -I/usr/include/eigen3", "DEPFLAGS=-MM"],
                          cwd=source, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr[-2000:]

    deck = DECK.format(cohesion="cohesion capillary", rolling="", settings="")
    tables = []
    for name in ("ours", "built"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "cloud.data").write_text(cloud())
        if name == "ours":
            done = run_deck(folder, deck)
            assert done.code == 0, done.error
        else:
            (folder / "case.in").write_text(deck)
            environment = os.environ | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
            subprocess.run([str(source / "lmp_mpi"), "-in", "case.in"], cwd=folder, env=environment, stdout=subprocess.DEVNULL, check=True)
        tables.append(np.stack(read_dump(folder / "grains.dump")[1]))
    assert deviation(*tables) < 1e-9
