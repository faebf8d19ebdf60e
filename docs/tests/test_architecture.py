"""The table of imports in architecture.md is what the code does."""

from __future__ import annotations

import ast
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = {"common": "common", "postproc": "postproc", "input_decks": "input_decks", "validation": "validation",
           "plugins/python/physics": "physics"}


def package(module: str) -> str:
    """Package of a dotted module below dembark: one of the table, or `validation` for modules that lie directly in it."""
    first, _, rest = module.partition(".")
    second = rest.split(".")[0]
    return f"{first}.{second}" if first == "validation" and second and (ROOT / "validation" / second).is_dir() else first


def imported(text: str) -> set[str]:
    """Packages of dembark that a source imports, wherever in it."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "dembark":
            whole = node.module in {"dembark", "dembark.validation"}
            found |= {f"{node.module}.{name.name}" if whole else node.module for name in node.names}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names if name.name.startswith("dembark.")}
    return {package(name.removeprefix("dembark.")) for name in found if name != "dembark"}


def actual() -> dict[str, set[str]]:
    """What the packages import, without their tests and the compiled modules."""
    result: dict[str, set[str]] = {}
    words = ["git", "ls-files", *(f"{folder}/**.py" for folder in FOLDERS)]
    files = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    for line in files.stdout.split():
        folder = next(name for name in FOLDERS if line.startswith(f"{name}/"))
        if "/tests/" in line or line.endswith("yade.py") or not (ROOT / line).is_file():
            continue
        own = package(FOLDERS[folder] + line.removeprefix(folder).removesuffix(".py").replace("/", "."))
        names = {name for name in imported((ROOT / line).read_text(encoding="utf-8")) if not name.startswith("_")}
        result.setdefault(own, set()).update(names - {own})
    return result


def test_packages_import_only_what_the_table_says() -> None:
    page = (ROOT / "docs/development/architecture.md").read_text(encoding="utf-8")
    table = {name: set(re.findall(r"`([a-z._]+)`", row)) for name, row in re.findall(r"^\| `([a-z._]+)` \|(.*)\|$", page, re.MULTILINE)}
    found = actual()
    assert len(table) == 11 and set(found) - {"validation"} == set(table)
    too_many = {name: sorted(found[name] - row - {"validation"}) for name, row in table.items() if found[name] - row - {"validation"}}
    assert not too_many, "imports that the table does not allow"
    unused = {name: sorted(row - found[name]) for name, row in table.items() if row - found[name]}
    assert not unused, "imports that the table allows and nobody has"


def test_general_code_names_no_case() -> None:
    """Prose, names and constants of modules and templates. Statements of publications do."""
    cases = {path.parent.name for path in ROOT.glob("input_decks/*/case.toml")}
    words = ["git", "ls-files", "common", "postproc", "validation"]
    files = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    code = [name for name in files if name.endswith((".py", ".j2", ".cpp", ".hpp")) and "/tests/" not in name and (ROOT / name).is_file()]
    assert len(cases) > 20 and len(code) > 100
    found = {name: sorted(named_cases((ROOT / name).read_text(encoding="utf-8"), cases)) for name in code}
    assert {name: cases for name, cases in found.items() if cases} == {}


def named_cases(text: str, cases: set[str]) -> set[str]:
    """Cases that a source names as a word, in any case of letters."""
    return cases & set(re.findall(r"\w+", text.lower()))


def test_the_picture_names_folders_that_exist() -> None:
    page = (ROOT / "docs/development/architecture.md").read_text(encoding="utf-8")
    picture = page.split("```picture")[1].split("```")[0]
    names = re.findall(r"\b(?:input_decks|validation|postproc|plugins)[/\w<>]*", picture)
    named = {name.replace("/<case>", "").rstrip("/") for name in names}
    assert len(named) > 8
    assert [name for name in sorted(named) if not (ROOT / name).exists() and not name.endswith("measure")] == []


def test_a_wrong_import_is_seen() -> None:
    assert imported("from dembark.validation import engines\nimport dembark.postproc.walls\n") == {"validation.engines", "postproc"}
    assert package("validation.cli") == "validation" and package("validation.runs.plan") == "validation.runs"
    assert named_cases("# as in the Silo\nsilos = log_pile", {"silo", "log_pile", "plug_flow"}) == {"silo", "log_pile"}
