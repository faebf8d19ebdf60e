"""Every header that a build includes belongs to a package that set-up installs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parents[1]
BUILD = HERE.parent / "build"
sys.path.insert(0, str(HERE))

import headers  # noqa: E402  (a script beside this folder, no package)


def named() -> list[str]:
    return subprocess.run([HERE / "system.sh", "--all"], capture_output=True, text=True, check=True).stdout.split()


def builds() -> list[Path]:
    """The folders of the builds of this checkout, and the list of what YADE's own build included, if it was built here."""
    found = [BUILD / name for name in ("engines", "python", "yade") if (BUILD / name / "build.ninja").is_file()]
    where = subprocess.run([HERE / "yade.sh", "--where"], capture_output=True, text=True, check=False).stdout
    source = dict(line.split("=", 1) for line in where.splitlines()).get("YADE_SOURCE_DIR", "")
    listed = Path(source).parent / "headers.txt"
    return [*found, listed] if source and listed.is_file() else found


@pytest.mark.skipif("YADE_PREFIX" in os.environ, reason="a group's own YADE brings packages of its own")
def test_set_up_names_the_packages_of_all_headers():
    places = builds()
    assert {place.name for place in places} >= {"engines", "python", "yade"}
    assert headers.foreign(places, named()) == {}


@pytest.mark.parametrize("package", ["libeigen3-dev", "libliggghts-dev", "libopenmpi-dev"])
def test_a_package_left_out_is_found(package):
    left = [name for name in named() if name != package and not name.startswith(("yade", "libboost"))]
    assert package in headers.foreign(builds(), left)


def test_dependencies_count(tmp_path):
    # g++ itself holds no header of the standard library; what it depends on does.
    listing = tmp_path / "headers.txt"
    listing.write_text("/usr/include/stdio.h\n  /usr/include/eigen3/Eigen/Core\nelsewhere.hpp\n")
    assert headers.foreign([listing], ["g++"]) == {"libeigen3-dev": "/usr/include/eigen3/Eigen/Core"}
    assert headers.foreign([listing], ["g++", "libeigen3-dev"]) == {}
