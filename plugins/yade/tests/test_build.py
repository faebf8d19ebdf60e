"""The build's answers to a wrong set-up, and the overlay of a small stand-in for YADE's installation."""

import os
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parents[1]
START = """#!/usr/bin/python3
import sys,os
import io

sys.path.insert(0,'/somewhere/else/lib/yade/py')
prefix,suffix='/somewhere/else' if 'YADE_PREFIX' not in os.environ else os.environ['YADE_PREFIX'],''
print(prefix, sys.path[0])
"""


@pytest.fixture
def prefix(tmp_path):
    root = tmp_path / "prefix"
    (root / "bin").mkdir(parents=True)
    (root / "lib/x/yade/py/yade").mkdir(parents=True)
    (root / "bin/yade").write_text(START)
    (root / "lib/x/yade/libyade.so").touch()
    (tmp_path / "libdembark_yade.so").write_text("plugin")
    return root


def overlay(prefix, place):
    return subprocess.run(["cmake", f"-DPREFIX={prefix}", f"-DOVERLAY={place}", "-DSUBDIR=lib/x/yade", f"-DPLUGIN={prefix.parent}/libdembark_yade.so",
                           f"-DMODULES={HERE}/python", "-P", HERE / "overlay.cmake"], capture_output=True, text=True, check=False)


def test_overlay_finds_itself_and_leaves_the_prefix_alone(prefix, tmp_path):
    before = sorted(prefix.rglob("*"))
    place = tmp_path / "build/overlay"
    assert overlay(prefix, place).returncode == 0
    assert (place / "lib/x/yade/libdembark_yade.so").read_text() == "plugin"
    assert (place / "lib/x/yade/py/yade/dembark.py").is_file()
    assert (place / "lib/x/yade/libyade.so").resolve() == prefix / "lib/x/yade/libyade.so"
    # Also with the variable that names the engine below.
    done = subprocess.run([place / "bin/yade"], capture_output=True, text=True, check=True, env=os.environ | {"YADE_PREFIX": str(prefix)})
    real = place.resolve()
    assert done.stdout.split() == [str(real), f"{real}/lib/x/yade/py"]
    assert sorted(prefix.rglob("*")) == before
    assert (prefix / "bin/yade").read_text() == START


def test_new_overlay_replaces_the_old_at_once(prefix, tmp_path):
    place = tmp_path / "build/overlay"
    seen = []
    for content in ("one", "two", "three"):
        (tmp_path / "libdembark_yade.so").write_text(content)
        assert overlay(prefix, place).returncode == 0
        assert place.is_symlink()
        assert (place / "lib/x/yade/libdembark_yade.so").read_text() == content
        seen.append(place.resolve())
    # A run that started on the second one can go on.
    assert [folder.is_dir() for folder in seen] == [False, True, True]
    assert sorted(p.name for p in place.parent.iterdir()) == sorted([seen[1].name, seen[2].name, "overlay"])


def test_overlay_of_something_else_is_refused(prefix, tmp_path):
    (prefix / "bin/yade").write_text("#!/bin/sh\n")
    done = overlay(prefix, tmp_path / "overlay")
    assert done.returncode != 0
    assert "does not look like YADE's start script" in " ".join(done.stderr.split())
    assert not (tmp_path / "overlay").exists()


@pytest.mark.parametrize("given, parts", [
    ([], ("YADE_PREFIX=''", "bin/yade")), (["-DYADE_PREFIX={prefix}"], ("YADE_SOURCE_DIR=''", "core/Scene.hpp")),
    (["-DYADE_PREFIX={prefix}", "-DYADE_SOURCE_DIR={tmp}/source"], ("DEMBARK_YADE_DEFINITIONS", "-DYADE_REAL_BIT=64"))])
def test_wrong_set_up_names_the_variable(prefix, tmp_path, given, parts):
    (tmp_path / "source/core").mkdir(parents=True)
    (tmp_path / "source/core/Scene.hpp").touch()
    words = [word.format(prefix=prefix, tmp=tmp_path) for word in given]
    done = subprocess.run(["cmake", "-S", HERE, "-B", tmp_path / "build", "-DCMAKE_CXX_COMPILER_WORKS=1", *words], capture_output=True, text=True,
                          check=False)
    assert done.returncode != 0
    text = " ".join(done.stderr.split())
    assert "dembark: " in text
    assert all(part in text for part in parts), done.stderr
