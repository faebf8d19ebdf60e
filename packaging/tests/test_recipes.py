"""Recipes for other package managers, the workflow of the forge and the licences of files are those of the project."""

import ast
import re
import subprocess
import tomllib
from functools import cache
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT = PYPROJECT["project"]
EXTRAS = PROJECT["optional-dependencies"]
REUSE = tomllib.loads((ROOT / "REUSE.toml").read_text(encoding="utf-8"))
SPACK, CONDA, WORKFLOW = (ROOT / name for name in ("packaging/spack/package.py", "packaging/conda/recipe.yaml", ".github/workflows/ci.yml"))


def read_yaml(path: Path) -> dict:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def in_conda(line: str) -> str:
    """A requirement of pyproject.toml as conda-forge has it."""
    one = Requirement(line)
    name = {"matplotlib": "matplotlib-base"}.get(one.name, canonicalize_name(one.name))
    return f"{name} {one.specifier}".strip()


def in_spack(line: str) -> str:
    """A requirement of pyproject.toml, with a lower bound or none, as Spack has it."""
    one = Requirement(line)
    bound = "".join(f"@{each.version}:" for each in one.specifier if each.operator == ">=")
    return f"py-{canonicalize_name(one.name)}{bound}"


def conda_outputs() -> dict[str, dict]:
    return {one["package"]["name"]: one for one in read_yaml(CONDA)["outputs"]}


@cache
def spack_calls(name: str) -> list[tuple[str, dict]]:
    """First argument and keywords of each directive of this name."""
    calls = [one for one in ast.walk(ast.parse(SPACK.read_text(encoding="utf-8")))
             if isinstance(one, ast.Call) and isinstance(one.func, ast.Name) and one.func.id == name]
    return [(one.args[0].value, {word.arg: ast.literal_eval(word.value) for word in one.keywords}) for one in calls]


def spack_needs(kind: str, variant: str | None = None) -> set[str]:
    return {what for what, words in spack_calls("depends_on")
            if kind in words.get("type", ("build", "run")) and words.get("when") == variant}


def test_recipes_have_the_version_and_licence_of_the_project():
    recipe = read_yaml(CONDA)
    assert recipe["schema_version"] == 1 and recipe["context"]["version"] == PROJECT["version"]
    assert {one["package"]["version"] for one in recipe["outputs"]} == {"${{ version }}"} == {recipe["recipe"]["version"]}
    assert [what for what, _ in spack_calls("version")] == [PROJECT["version"]]
    assert f"dembark@{PROJECT['version']} " in SPACK.read_text(encoding="utf-8")
    citation = read_yaml(ROOT / "CITATION.cff")
    assert citation["version"] == PROJECT["version"]
    licences = {recipe["about"]["license"], citation["license"], *(what for what, _ in spack_calls("license_of"))}
    assert licences == {PROJECT["license"]}


def test_the_conda_package_needs_what_pyproject_names():
    needs = conda_outputs()["dembark"]["requirements"]
    python = f"python {PROJECT['requires-python']}"
    assert set(needs["run"]) == {python, *map(in_conda, PROJECT["dependencies"])}
    build = [line for line in PYPROJECT["build-system"]["requires"] if not line.startswith("cmeel-eigen")]
    assert {python, "eigen 3.4.*", *map(in_conda, build)} <= set(needs["host"])


def test_the_conda_outputs_are_extras():
    outputs = conda_outputs()
    assert set(outputs) == {"dembark", *(f"dembark-{name}" for name in ("fields", "report", "campaigns"))}
    own = {"dembark-fields": {"dembark"}, "dembark-report": {"dembark"}, "dembark-campaigns": {"dembark-fields", "dembark-report"}}
    for name, parts in own.items():
        others = {in_conda(line) for line in EXTRAS[name.removeprefix("dembark-")] if not line.startswith("dembark[")}
        assert set(outputs[name]["requirements"]["run"]) == others | {f"{one} ==${{{{ version }}}}" for one in parts}


def test_the_spack_package_needs_what_pyproject_names():
    python = f"python@{PROJECT['requires-python'].removeprefix('>=')}:"
    assert spack_needs("run") == {python, *map(in_spack, PROJECT["dependencies"])}
    build = [line for line in PYPROJECT["build-system"]["requires"] if not line.startswith("cmeel-eigen")]
    assert {python, "eigen@3.4", *map(in_spack, build)} <= spack_needs("build")
    assert spack_needs("run", "+fields") == set(map(in_spack, EXTRAS["fields"]))
    # Spack has no WeasyPrint.
    assert spack_needs("run", "+report") == set(map(in_spack, EXTRAS["report"])) - {"py-weasyprint"}


def test_the_spack_package_builds_the_plugins_with_options_that_they_have():
    calls = [one for one in ast.walk(ast.parse(SPACK.read_text(encoding="utf-8")))
             if isinstance(one, ast.Call) and isinstance(one.func, ast.Attribute) and one.func.attr == "build"]
    folders = {one.args[1].value: {word.arg for word in one.keywords} for one in calls}
    assert set(folders) == {"plugins/lammps", "plugins/yade", "."}
    for folder, options in folders.items():
        files = [ROOT / folder / "CMakeLists.txt", *([ROOT / "plugins/liggghts/CMakeLists.txt"] if folder == "." else [])]
        text = "\n".join(path.read_text(encoding="utf-8") for path in files)
        assert {name for name in options if not name.startswith("CMAKE_")} <= set(re.findall(r"\b(?:set|option)\((\w+) ", text))
    assert {what for what, _ in spack_calls("variant")} == {"fields", "report", "lammps", "liggghts", "yade"}


def test_sources_are_this_checkout():
    assert (CONDA.parent / read_yaml(CONDA)["source"]["path"]).resolve() == ROOT
    for path in (SPACK, CONDA, WORKFLOW):
        assert "://" not in path.read_text(encoding="utf-8"), path
    for path in (SPACK, CONDA):
        assert "NOT TRIED" in path.read_text(encoding="utf-8").splitlines()[0], path


def test_the_workflow_runs_ci_on_both_releases_of_debian():
    jobs = read_yaml(WORKFLOW)["jobs"]
    job = jobs.pop("check")
    assert job["container"] == "debian:${{ matrix.debian }}" and job["strategy"]["matrix"]["debian"] == ["bookworm", "trixie"]
    assert job["timeout-minutes"] == 120
    steps = [one.get("run", one.get("uses", "")) for one in job["steps"]]
    assert [one for one in steps if one == ".ci/run"] and (ROOT / ".ci/run").is_file()
    tools, checkout = (next(number for number, one in enumerate(steps) if word in one) for word in ("apt-get install", "actions/checkout"))
    assert tools < checkout < steps.index(".ci/run")
    (kept,) = [one for one in job["steps"] if "upload-artifact" in one.get("uses", "")]
    assert kept["if"] == "always()"
    made = {one["run"].split()[1] for other in jobs.values() for one in other["steps"] if one.get("run", "").startswith("make ")}
    assert made == {"test-full", "container"}
    assert made <= set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))


def pattern(glob: str) -> re.Pattern[str]:
    """What a path of REUSE.toml matches: `*` all but a slash, `**` everything."""
    parts = {"**": ".*", "*": "[^/]*"}
    return re.compile("".join(parts.get(one, re.escape(one)) for one in re.split(r"(\*\*|\*)", glob)))


def files() -> list[str]:
    """What is in Git, or would be after `git add`, without links."""
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    return [name for name in listed if (ROOT / name).is_file() and not (ROOT / name).is_symlink()]


def test_every_file_has_a_licence_whose_text_is_here():
    assert REUSE["version"] == 1
    found: dict[str, str] = {}
    for block in REUSE["annotations"]:
        assert block["SPDX-FileCopyrightText"]
        matched = [name for name in files() if pattern(block["path"]).fullmatch(name)]
        assert matched, f"{block['path']} matches no file"
        found |= dict.fromkeys(matched, block["SPDX-License-Identifier"])
    assert set(found) == set(files())
    assert {path.stem for path in (ROOT / "LICENSES").iterdir()} == set(found.values())
    assert (ROOT / f"LICENSES/{PROJECT['license']}.txt").read_bytes() == (ROOT / "LICENSE").read_bytes()
    foreign = {name: licence for name, licence in found.items() if licence != PROJECT["license"]}
    packing = "input_decks/penetration/reference/packing_25k.npy"
    assert foreign.pop(packing) == "BSD-3-Clause" and (ROOT / f"{packing}.license").is_file()
    assert {name for name in found if "/lcp_data/" in name and name.endswith(".dat")} == set(foreign)
    assert set(foreign.values()) == {"Apache-2.0"}
