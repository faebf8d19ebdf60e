"""The build's answers to a wrong set-up, and the overlay of a small stand-in for YADE's installation."""

import os
import re
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
    return subprocess.run(["cmake", f"-DPREFIX={prefix}", f"-DOVERLAY={place}", "-DSUBDIR=lib/x/yade",
                           f"-DPLUGIN={prefix.parent}/libdembark_yade.so",
                           f"-DMODULE={HERE}/python/dembark", "-P", HERE / "overlay.cmake"], capture_output=True, text=True, check=False)


def test_overlay_finds_itself_and_leaves_the_prefix_alone(prefix, tmp_path):
    before = sorted(prefix.rglob("*"))
    place = tmp_path / "build/overlay"
    assert overlay(prefix, place).returncode == 0
    assert (place / "lib/x/yade/libdembark_yade.so").read_text() == "plugin"
    assert (place / "lib/x/yade/py/yade/dembark/__init__.py").is_file()
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


@pytest.mark.parametrize(("given", "parts"), [
    ([], ("YADE_PREFIX=''", "bin/yade")), (["-DYADE_PREFIX={prefix}"], ("YADE_SOURCE_DIR=''", "core/Scene.hpp")),
    (["-DYADE_PREFIX={prefix}", "-DYADE_SOURCE_DIR={tmp}/source"], ("DEMBARK_YADE_DEFINITIONS", "-DYADE_REAL_BIT=64"))])
def test_wrong_set_up_names_the_variable(prefix, tmp_path, given, parts):
    (tmp_path / "source/core").mkdir(parents=True)
    (tmp_path / "source/core/Scene.hpp").touch()
    words = [word.format(prefix=prefix, tmp=tmp_path) for word in given]
    done = subprocess.run(["cmake", "-S", HERE, "-B", tmp_path / "build", "-DCMAKE_CXX_COMPILER_WORKS=1", *words], capture_output=True,
                          text=True,
                          check=False)
    assert done.returncode != 0
    text = " ".join(done.stderr.split())
    assert "dembark: " in text
    assert all(part in text for part in parts), done.stderr


def definitions(folder, features, bits=64, mpmath=True):
    (folder / "py/yade").mkdir(parents=True, exist_ok=True)
    (folder / "py/yade/config.py").write_text(f"highPrecisionBits         ={bits}\nhighPrecisionMpmath       ={mpmath}\n")
    (folder / "yade").write_text(f"features,version,debugbuild=' {features}'.split(' '),'2025.2.0',' '\n")
    (folder / "ask.cmake").write_text(f"cmake_minimum_required(VERSION 3.22)\ninclude({HERE}/definitions.cmake)\n"
                                      f"dembark_yade_definitions(flags {folder}/source {folder}/yade {folder})\nmessage(\"${{flags}}\")\n")
    return subprocess.run(["cmake", "-P", folder / "ask.cmake"], capture_output=True, text=True, check=False)


def test_a_packaged_yade_is_compiled_for_as_its_features_say(tmp_path):
    words = definitions(tmp_path, "LOGGER USEFUL_ERRORS OPENMP QT5 MPI FEMLIKE LBMFLOW").stderr.split()
    assert {"-DYADE_BOOST_LOG", "-DYADE_OPENMP", "-fopenmp", "-DYADE_OPENGL", "-DYADE_MPI", "-DYADE_FEM", "-DYADE_REAL_BIT=64",
            "-DEIGEN_DONT_ALIGN"} <= set(words)
    assert not {"-DYADE_SPH", "-DYADE_LS_DEM", "-DYADE_DISABLE_REAL_MULTI_HP"} & set(words)
    assert "-DYADE_DISABLE_REAL_MULTI_HP" in definitions(tmp_path, "LOGGER", mpmath=False).stderr


def test_what_could_change_the_layout_of_classes_unseen_is_not_guessed(tmp_path):
    assert "-D" not in definitions(tmp_path, "LOGGER NEW_FEATURE").stderr
    done = definitions(tmp_path, "LOGGER", bits=128)
    assert done.returncode != 0 and "double precision" in " ".join(done.stderr.split())


def test_classes_of_other_folders_are_declared_and_own_ones_defined(tmp_path):
    for path, text in {"core/Body.hpp": "#pragma once\n", "core/Bare.hpp": "",
                       "pkg/common/Wide.hpp": "#pragma once\n#include <pkg/dem/Own.hpp>\n",
                       "pkg/dem/Own.hpp": "#pragma once\n", "core/Subdomain.hpp": "#pragma once\n"}.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    (tmp_path / "a.cpp").write_text("".join(f"#include <{path}.hpp>\n" for path in (
        "core/Body", "core/Bare", "pkg/common/Wide", "pkg/dem/Own", "core/Subdomain", "core/Missing")))
    (tmp_path / "ask.cmake").write_text(f"cmake_minimum_required(VERSION 3.22)\ninclude({HERE}/engine_classes.cmake)\n"
                                        f"dembark_declare_engine_classes(HEADER {tmp_path}/declared.hpp "
                                        f"SOURCE_DIR {tmp_path} FOLDERS core pkg/common SOURCES {tmp_path}/a.cpp)\n")
    subprocess.run(["cmake", "-P", tmp_path / "ask.cmake"], check=True)
    text = (tmp_path / "declared.hpp").read_text()
    # Body is declared; the others are no header on their own, lead to classes of the sources, belong to a feature, or are not there.
    assert [line for line in text.splitlines() if line.startswith(("#include <core", "#include <pkg"))] == ["#include <core/Body.hpp>"]
    assert text.index("push_macro") < text.index("core/Body.hpp") < text.index("pop_macro")


def test_pointers_and_containers_are_inlined(yade):
    """Functions that GCC has first seen where less is optimised stay calls in the loops of a simulation, which then take twice as long.

    So in the plugin, and in a YADE that was built here; that of a distribution is as it is.
    """
    plugin = next(yade.engine.executable.parents[1].rglob("libdembark_yade.so"))
    engine = plugin.with_name("libyade.so").resolve().parent
    own = sorted(engine.glob("libpkg_*.so")) if "dembark" in engine.parts and "YADE_PREFIX" not in os.environ else []
    call = re.compile(r" W (boost::shared_ptr<.*>::(operator->|operator\*|get)|std::vector<.*>::operator\[\])")
    for file in [plugin, *own]:
        names = subprocess.run(["nm", "-DC", file], capture_output=True, text=True, check=True).stdout.splitlines()
        assert any("yade::" in name for name in names)
        assert not [name for name in names if call.search(name)], file
