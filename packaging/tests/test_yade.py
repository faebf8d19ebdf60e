"""packaging/yade.sh with an archive of the source."""

import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "yade.sh"


def archive(folder: Path, release: str) -> Path:
    """An archive that looks like YADE's source."""
    (folder / "yade/core").mkdir(parents=True)
    (folder / "yade/core/Scene.hpp").touch()
    (folder / "yade/RELEASE").write_text(f"{release}\n")
    with tarfile.open(folder / "yade.tar.bz2", "w:bz2") as file:
        file.add(folder / "yade", "yade")
    return folder / "yade.tar.bz2"


@pytest.mark.parametrize(("release", "what"), [("2020.01", "is not the source of YADE 2025.2.0"), ("", "cannot be unpacked"),
                                               (None, "cannot be read")])
def test_other_archives_are_refused(tmp_path: Path, release: str | None, what: str) -> None:
    file = tmp_path / "none.tar" if release is None else archive(tmp_path, release)
    if release == "":
        file.write_text("no archive\n")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("YADE_")}
    done = subprocess.run([SCRIPT], env=environment | {"XDG_CACHE_HOME": str(tmp_path / "cache"), "YADE_ARCHIVE": str(file)},
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and what in done.stderr and done.stderr.splitlines()[-1].startswith("dembark: "), done.stderr
    assert not list((tmp_path / "cache").glob("*/*/source/*"))


@pytest.mark.parametrize(("features", "given", "left_out"), [(None, set(), "image,vtk"), ("VTK QT5", {"VTK", "QT5"}, "image")])
def test_features_that_are_named_are_built(tmp_path: Path, features: str | None, given: set[str], left_out: str) -> None:
    (tmp_path / "cmake").write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > {tmp_path}/words\nexit 1\n')
    (tmp_path / "cmake").chmod(0o755)
    # With another Python than the system's the programs on PATH come first. Debian 13 has YADE as a package.
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache"), "YADE_ARCHIVE": str(archive(tmp_path, "2025.2.0")),
                                "PATH": f"{tmp_path}:{os.environ['PATH']}", "SYSTEM_PYTHON": sys.executable}
    environment |= {"YADE_FEATURES": features} if features else {}
    if subprocess.run([SCRIPT, "--packaged"], check=False).returncode == 0:
        pytest.skip("YADE is a package here")
    subprocess.run([SCRIPT], env=environment, capture_output=True, check=False)
    words = (tmp_path / "words").read_text().split()
    assert {word for word in words if word.startswith("-DENABLE_")} >= {f"-DENABLE_{one}=ON" for one in given}
    assert next(word for word in words if word.startswith("-DDISABLE_PKGS=")).endswith(f"potential,{left_out}")
