"""liggghts-dembark with a LIGGGHTS compiled from its sources (engine.cmake)."""

import hashlib
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from rig.cloud import DECK, cloud, deviation
from rig.liggghts_driver import read_dump, run_deck

ROOT = Path(__file__).parents[3]
TARBALL = "liggghts_3.8.0+repack1.orig.tar.xz"
SHA256 = "c18721d9a870c5170f03b91e4f1ffe13335c66ed1f0ff2c64ebd3be91c37867a"
# As published: no C++17.
NUMBERS = "  return static_cast< std::ostringstream & >(( std::ostringstream() << std::dec << a ) ).str();\n"
COUNT = "  if (neighbor->lists[m]->numneigh > 0) {\n  if (neighbor->lists[m]->inum > 0)\n"
MAKE = "for kind in surface normal tangential cohesion rolling; do echo '// the tree alone' > style_${kind}_model.h; done\n"


def configure(build: Path, source: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["cmake", "-G", "Ninja", "-S", str(ROOT), "-B", str(build), "-DDEMBARK_PYTHON=OFF", "-DDEMBARK_TESTS=OFF",
                           f"-DLIGGGHTS_SOURCE_DIR={source}"], capture_output=True, text=True, check=False)


def stand_in(folder: Path, version: str = "3.8.0") -> Path:
    """A folder that looks like a LIGGGHTS source tree."""
    folder.mkdir(parents=True)
    for name, text in {"utils.h": NUMBERS, "finish.cpp": COUNT, "finish.h": "", "Make.sh": MAKE, "main.cpp": "",
                       "version_liggghts.txt": f"{version}\n", "cohesion_model_sjkr.h": "COHESION_MODEL(COHESION_SJKR,sjkr,1)\n"}.items():
        (folder / name).write_text(text)
    return folder


def written(*folders: Path) -> dict[Path, int]:
    """When each file in these folders was written."""
    return {path: path.stat().st_mtime_ns for folder in folders for path in folder.iterdir()}


def test_a_source_tree_is_mended_in_a_copy(tmp_path):
    source = stand_in(tmp_path / "src")
    before = {path.name: path.read_bytes() for path in source.iterdir()}
    for _ in range(2):
        done = configure(tmp_path / "build", source)
        assert done.returncode == 0, done.stderr
        engine = tmp_path / "build/plugins/liggghts/engine"
        assert (engine / "utils.h").read_text() == "  return std::to_string(a);\n"
        assert (engine / "finish.cpp").read_text() == COUNT.replace(" > 0) {", ") {")
        assert not (engine / "main.cpp").exists()
        times = written(engine, engine.with_name("engine_lists"))
    assert configure(tmp_path / "build", source).returncode == 0
    assert written(engine, engine.with_name("engine_lists")) == times
    assert {path.name: path.read_bytes() for path in source.iterdir()} == before
    # Our program has its own lists of models. Headers of the tree must not find another one next to them.
    assert not list(engine.glob("style_*_model.h"))
    assert (tmp_path / "build/plugins/liggghts/engine_lists/style_cohesion_model.h").read_text() == "// the tree alone\n"
    assert '#include "cohesion_model_sjkr.h"' in (tmp_path / "build/plugins/liggghts/lists/style_cohesion_model.h").read_text()


def test_wrong_folders(tmp_path):
    taken = stand_in(tmp_path / "taken")
    (taken / "cohesion_model_other.h").write_text("COHESION_MODEL(COHESION_OTHER,other,20)\n")
    for source, what in ((tmp_path / "none", "is not the folder src"), (stand_in(tmp_path / "old", "3.3.1"), "version found: 3.3.1"),
                         (taken, "the number 20")):
        done = configure(tmp_path / f"build-{source.name}", source)
        assert done.returncode != 0 and what in " ".join(done.stderr.split()), done.stderr


@pytest.mark.parametrize("engine", ["liggghts", "lammps"])
def test_private_members_of_an_engine_are_reached_in_one_file(engine):
    """By explicit instantiation with a pointer to a member; in a header it would be there more than once."""
    files = [path for folder in (engine, "lammps_family") for path in (ROOT / "plugins" / folder).glob("*.*")]
    reaching = [path.name for path in files if re.search(r"^template (struct|class) \w+<.*&", path.read_text(), re.MULTILINE)]
    assert reaching == ["engine_access.cpp"]


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


@pytest.mark.slow
def test_built_from_source_is_the_same_as_with_the_library_of_debian(tmp_path):
    """Takes 10 minutes of one core for the first build; it is kept in build/test-from-source."""
    place = ROOT / "build/test-from-source"
    source, build = place / "LIGGGHTS-PUBLIC-3.8.0/src", place / "build"
    place.mkdir(parents=True, exist_ok=True)
    if not source.exists():
        subprocess.run(["tar", "-xJf", str(fetch(place))], cwd=place, check=True)
        # Of the stock combinations one is enough.
        (source / "style_contact_model.whitelist").write_text(
            "GRAN_MODEL(HERTZ, TANGENTIAL_HISTORY, COHESION_OFF, ROLLING_OFF, SURFACE_DEFAULT)\n")
    assert configure(build, source).returncode == 0
    made = subprocess.run(["ninja", "-C", str(build), "liggghts-dembark"], capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stdout[-2000:]
    deck = DECK.format(cohesion="cohesion capillary", rolling="", settings="")
    deck = deck.replace("\nrun ", "\nfix watch all integration/monitor speed 1\nrun ", 1)
    assert "integration/monitor" in deck
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
            subprocess.run([str(build / "bin/liggghts-dembark"), "-in", "case.in"], cwd=folder, env=environment, stdout=subprocess.DEVNULL,
                           check=True)
        tables.append(np.stack(read_dump(folder / "grains.dump")[1]))
    assert deviation(*tables) < 1e-9
