"""The Python package: what a checkout, an editable install and a wheel hold."""

import os
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dembark.physics import capillary_force

ROOT = Path(__file__).parents[2]
LINKS = {path.name: path for path in (ROOT / "dembark").iterdir() if path.is_symlink()}
COMPILED = ("_dumps", "_fields", "_physics")


def build(folder: Path, *settings: str) -> Path:
    """The wheel of this checkout, built below `folder`; returns its path."""
    words = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation",
             *(f"--config-settings={setting}" for setting in (f"build-dir={folder / 'build'}", *settings)), "--wheel-dir", folder, ROOT]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(["nice", "-n", "19", *words], capture_output=True, text=True, check=False, env=os.environ | {"PATH": path})
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel


def files(folder: Path) -> set[str]:
    """What of a package belongs into the wheel: all that Git does not ignore, without tests and C++."""
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True).stdout.splitlines()
    return {name for name in listed if not {"tests", "native"} & set(Path(name).parts) and (folder / name).exists()}


def test_links_lead_to_folders_of_the_checkout():
    assert set(LINKS) == {"common", "input_decks", "physics", "postproc", "validation"}
    for link in LINKS.values():
        assert link.is_dir() and not link.readlink().is_absolute() and link.resolve().is_relative_to(ROOT)


def test_a_new_module_is_importable_at_once():
    module = ROOT / "common" / f"new_module_{os.getpid()}.py"
    module.write_text("value = 7\n", encoding="utf-8")
    try:
        words = f"from dembark.common import {module.stem} as new; print(new.value, new.__file__)"
        done = subprocess.run([sys.executable, "-c", words], cwd="/", capture_output=True, text=True, check=False)
    finally:
        module.unlink()
    assert done.stdout.split() == ["7", str(ROOT / "dembark/common" / module.name)], done.stderr


def test_python_files_need_no_new_install():
    words = ["make", "--dry-run", "--print-data-base", "build/.python"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    (needed,) = [line.split() for line in done.stdout.splitlines() if line.startswith("build/.python:")]
    assert {"pyproject.toml", "plugins/python/bindings.cpp", "plugins/physics/contact.hpp", "postproc/native/CMakeLists.txt"} <= set(needed)
    assert not [name for name in needed if name.endswith(".py")]


def test_stubs_are_those_of_the_compiled_modules(tmp_path):
    for name in COMPILED:
        words = [sys.executable, "-m", "nanobind.stubgen", "--quiet", "--module", f"dembark.{name}", "--output-file", tmp_path / name]
        subprocess.run(words, check=True)
        assert (tmp_path / name).read_text() == (ROOT / f"dembark/{name}.pyi").read_text(), f"{name} has changed: make stubs"


def test_wheel_holds_all_files_of_the_packages(tmp_path):
    wheel = zipfile.ZipFile(build(tmp_path, "wheel.cmake=false"))
    names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    stubs = {f"dembark/{name}.pyi" for name in COMPILED}
    assert names == stubs | {f"dembark/{name}/{path}" for name, link in LINKS.items() for path in files(link)}
    assert {".py", ".pyi", ".toml", ".in", ".css"} <= {Path(name).suffix for name in names}
    assert not any(wheel.getinfo(name).external_attr >> 28 == 0xA for name in names), "links in the wheel"
    with (ROOT / "pyproject.toml").open("rb") as file:
        version = tomllib.load(file)["project"]["version"]
    assert f"dembark-{version}.dist-info/entry_points.txt" in wheel.namelist()


@pytest.mark.slow
def test_wheel_works_in_an_empty_environment(tmp_path):
    wheel = build(tmp_path / "wheel")
    assert not [name for name in zipfile.ZipFile(wheel).namelist() if name.endswith(".pth")], "paths of this checkout in the wheel"
    # And what `dembark` builds its plugin for LAMMPS from.
    plugin = {name.removeprefix("dembark/plugins/") for name in zipfile.ZipFile(wheel).namelist() if name.startswith("dembark/plugins/")}
    sources = {f"{folder}/{name}" for folder in ("lammps", "lammps_family", "physics") for name in files(ROOT / "plugins" / folder)
               if name.endswith((".h", ".hpp", ".cpp", ".in")) and not {"kokkos", "python"} & set(Path(name).parts)}
    assert plugin == sources | {"lammps/CMakeLists.txt", "packaging/build.py", "packaging/build_weights.txt"}
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env/bin/python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index", "--no-deps", wheel], check=True)
    # What it depends on comes from the present environment, and nothing else does.
    (libraries := tmp_path / "libraries").mkdir()
    for name in ("numpy", "numpy.libs", "scipy", "scipy.libs"):
        if (found := Path(np.__file__).parents[1] / name).is_dir():
            (libraries / name).symlink_to(found)
    (site,) = (tmp_path / "env/lib").glob("python3*/site-packages")
    (site / "libraries.pth").write_text(f"{libraries}\n", encoding="utf-8")
    words = ("import dembark._dumps, dembark._fields, dembark.physics as physics; "
             "print(physics.capillary_force(1e-3, 1e-3, 0.0, 1e-12, 0.072, 0.3), physics.__file__)")
    done = subprocess.run([python, "-I", "-c", words], cwd="/", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    force, place = done.stdout.split()
    assert float(force) == capillary_force(1e-3, 1e-3, 0.0, 1e-12, 0.072, 0.3)
    assert Path(place).is_relative_to(site)
