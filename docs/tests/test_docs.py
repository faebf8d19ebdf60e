"""The documentation is true: its Python, complete decks and C++ run, its links exist, its tables are those of the data."""

from __future__ import annotations

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from blocks import FENCE, PAGES, ROOT, Block, blocks, load_script

from dembark.validation.engines import call

LINKING = [*PAGES, *sorted((ROOT / "input_decks").glob("*/README.md"))]
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def program(*places: Path | None) -> Path:
    """The first of these programs that is there; the test is skipped when none is."""
    for place in places:
        if place is not None and os.access(place, os.X_OK):
            return place
    pytest.skip(f"not built: {', '.join(str(place) for place in places if place)}")


def anchors(page: Path) -> set[str]:
    """Link targets of the headings, as the usual viewers of Markdown name them."""
    heads = re.findall(r"^#+ (.*)$", FENCE.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).strip().replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", LINKING, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_exist(page: Path) -> None:
    missing = []
    for link in LINK.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            missing.append(link)
    assert not missing


def snippets(kind: str, long: str) -> list[object]:
    """All blocks of this kind; those that contain `long` take ten seconds."""
    return [pytest.param(block, id=block.place, marks=pytest.mark.full if long in block.text else ()) for block in blocks(kind)]


@pytest.mark.parametrize("block", snippets("python", "brentq"))
def test_python_snippet(block: Block, tmp_path: Path) -> None:
    (tmp_path / "snippet.py").write_text(block.text, encoding="utf-8")
    result = subprocess.run([sys.executable, "-W", "error", "snippet.py"], cwd=tmp_path, capture_output=True, text=True, timeout=300,
                            check=False)
    assert result.returncode == 0, result.stderr
    following = next((other for other in blocks() if other.page == block.page and other.line > block.line), None)
    if following is not None and following.kind == "output":
        assert result.stdout == following.text


def rows(text: str, title: str) -> list[str]:
    """Rows of the first table under the section `title`."""
    _, _, section = text.partition(f"# {title}\n")
    return [line for line in re.split(r"\n#+ ", section)[0].splitlines() if line.startswith("| ")][1:]


def test_the_readme_counts_what_fails_as_the_page_does() -> None:
    page, readme = (ROOT / "docs/validation.md").read_text(), (ROOT / "README.md").read_text()
    compared = rows(page, "Comparison with experiments and other codes")
    failed = sum("**fail" in row for row in compared)
    assert f"at least one in {failed} of the {len(compared)} [comparisons" in readme
    assert f"and {len(rows(page, 'Other checks that fail'))} [other checks]" in readme


def parts_of_decks() -> dict[str, list[str]]:
    """The words in backticks in each row of the table of parts of decks, by the part."""
    page = (ROOT / "docs/how-to/cases.md").read_text(encoding="utf-8")
    section = page.partition("### Parts of `liggghts.in`")[2].partition("###")[0]
    rows = re.findall(r"^\| `(\w+\.in)` \|(.*)$", section, re.MULTILINE)
    return {name: re.findall(r"`(\w+)(?:\(p\))?`", rest) for name, rest in rows}


def test_the_table_of_parts_names_all_of_them_and_what_they_use() -> None:
    common = ROOT / "input_decks/common"
    files: dict[str, str] = {}
    for path in (*common.glob("*.in"), *common.glob("liggghts/*.in"), *common.glob("lammps/*.in")):
        files[path.name] = files.get(path.name, "") + path.read_text(encoding="utf-8")
    parts = parts_of_decks()
    assert parts.keys() == files.keys()

    def text(name: str) -> str:
        return files[name] + "".join(text(one) for one in re.findall(r'include "(.+?)"', files[name]))

    absent = {(name, word) for name, words in parts.items() for word in words
              if word not in ("contacts", "friction") and not re.search(rf"\b{word}\b", text(name))}
    assert not absent


def test_parts_of_yade_decks_have_the_arguments_that_the_page_names() -> None:
    page = (ROOT / "docs/how-to/cases.md").read_text(encoding="utf-8").partition("### Parts of `yade.py`")[2].partition("## ")[0]
    rows = re.findall(r"^\| `(\w+)\((.*?)\)`", page, re.MULTILINE)
    arguments = {}
    for path in (ROOT / "plugins/yade/python/dembark").glob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                arguments[node.name] = next(one.args for one in node.body if isinstance(one, ast.FunctionDef) and one.name == "__init__")
            elif isinstance(node, ast.FunctionDef):
                arguments[node.name] = node.args
    assert {name for name, _ in rows} == {"begin", "Recorder", "contact_loop", "engine_loop", "machine_history", "LoadedPlates",
                                          "StressedCell", "sort_materials", "of_sorts"}
    for name, named in rows:
        assert set(named.split(", ")) <= {one.arg for one in arguments[name].args}


def run_lammps(text: str, folder: Path) -> list[list[float]]:
    """Rows of numbers that liggghts-dembark prints for a deck."""
    engine = program(Path(os.environ["DEMBARK_LIGGGHTS"]) if "DEMBARK_LIGGGHTS" in os.environ else None,
                     ROOT / "build/bin/liggghts-dembark")
    (folder / "deck.in").write_text(text, encoding="utf-8")
    result = call([engine, "-in", "deck.in", "-log", "none"], folder, timeout=300)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr
    return [[float(word) for word in line.split()] for line in result.stdout.splitlines()
            if re.fullmatch(r"[\s\d.e+-]+", line) and line.strip()]


@pytest.mark.parametrize("block", blocks("deck"), ids=lambda block: block.place)
def test_complete_deck(block: Block, tmp_path: Path) -> None:
    assert block.text.startswith("# Complete deck")
    assert run_lammps(block.text, tmp_path)


def test_decks_show_what_their_pages_say(tmp_path: Path) -> None:
    drag, pull = (next(block.text for block in blocks("deck") if block.page == f"docs/reference/{page}.md")
                  for page in ("liggghts_tangential_finnie_rabinowicz", "liggghts_cohesion_capillary"))
    ratios = [row[3] for row in run_lammps(drag, tmp_path)][1:]
    assert 0.5 < ratios[0] < 0.6 and ratios == sorted(ratios, reverse=True)
    assert ratios[-1] == pytest.approx(0.3, rel=1e-3)
    rows = run_lammps(pull, tmp_path)
    held = [gap for _, gap, force in rows if force > 0.0]
    assert max(held) < 0.4968e-3 < max(gap for _, gap, _ in rows)


@pytest.mark.parametrize("block", snippets("cpp", "energy_lcp"))
def test_cpp_snippet(block: Block, tmp_path: Path) -> None:
    compiler = shutil.which("c++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    (tmp_path / "main.cpp").write_text(block.text, encoding="utf-8")
    (tmp_path / "dembark").symlink_to(ROOT / "plugins/physics")
    eigen = shlex.split(subprocess.run(["pkg-config", "--cflags", "eigen3"], check=True, capture_output=True, text=True).stdout)
    subprocess.run([compiler, "-std=c++17", "-I.", *eigen, "main.cpp", "-o", "main"], cwd=tmp_path, check=True, timeout=300)
    assert float(subprocess.run(["./main"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()[0]) > 0.0


def test_accuracy_of_closed_forms_is_what_the_page_says() -> None:
    columns = load_script().read()
    shares, angles = columns["gap_over_rupture"], columns["contact_angle_deg"]
    usual = (columns["volume_over_R3"] > 0.99e-4) & (shares <= 0.8) & (angles <= 30.0)
    for model in ("willett_full", "bagheri"):
        held = usual & (columns[model] > -1.0)
        assert abs(columns[model][held]).max() < 0.105
    assert abs(columns["exact"]).max() < 0.02


@pytest.mark.parametrize(("angle", "volume"), [(0, 1e-3), (30, 1e-3), (60, 1e-3)])
def test_exact_bridges_of_unequal_spheres_are_those_of_the_reference(angle: int, volume: float) -> None:
    errors = load_script("capillary_ratio_errors")
    rows = [row for row in errors.read_reference() if row[1] == angle and row[2] == volume]
    assert len(rows) == len(errors.RATIOS)
    assert max(abs(errors.law_errors(row)).max() for row in rows) < 1e-3


def test_reference_of_unequal_spheres_is_that_of_the_code() -> None:
    errors = load_script("capillary_ratio_errors")
    stored = next(row for row in errors.read_reference() if tuple(row[:3]) == (0.05, 60, 1e-3))
    assert errors.reference_row(0.05, 60, 1e-3) == pytest.approx(stored, rel=1e-5)


@pytest.mark.parametrize(("angle", "volume", "share"), [(0, 1e-6, 0.0), (30, 1e-2, 0.5), (60, 0.1, 0.9)])
def test_data_of_capillary_errors_are_those_of_the_code(angle: int, volume: float, share: float) -> None:
    import numpy as np

    errors = load_script()
    columns = errors.read()
    stored = np.array([columns[name] for name in errors.HEADER]).T
    at = np.argmin(np.abs(stored[:, :3] - (angle, volume, share)).sum(axis=1) + np.abs(np.log(stored[:, 1] / volume)))
    assert stored[at, 3:] == pytest.approx(errors.row(angle, volume, share)[3:], rel=1e-3, abs=1e-5)
