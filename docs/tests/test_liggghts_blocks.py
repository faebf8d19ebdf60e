"""LIGGGHTS blocks of the documentation: fragments run in a small deck, syntax lines fit what was run, outputs are what is printed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from blocks import ROOT, Block, blocks, built, logical_lines

from dembark.validation import engines

HEAD = """
units           si
atom_style      granular
atom_modify     map array sort 0 0.0
boundary        f f f
newton          off
communicate     single vel yes
region          domain block {box} units box
create_box      {types} domain
neighbor        {skin} bin
neigh_modify    delay 0
"""
# Two grains that just touch, and two logs in a drum of radius 1.9 m; the commands that fragments take for granted come after.
GRAINS = HEAD.format(box="-0.01 0.02 -0.01 0.01 -0.01 0.01", types=1, skin=0.001) + """
create_atoms    1 single 0 0 0 units box
create_atoms    1 single 0.004998 0 0 units box
set             group all density 2500 diameter 0.005
"""
LOGS = HEAD.format(box="-2 2 -2 2 -2 2", types="{types}", skin=0.05) + """
create_atoms    1 single 0 0 0 units box
create_atoms    {types} single 0.1995 0 0 units box
set             group all diameter 0.2
set             group all mass 50
group           logs type 1:{types}
timestep        1e-5
"""
MESH = "fix stl all mesh/surface file drum.stl type 1 scale {scale}\n"
STL = "solid s\n" + "".join(f"facet normal 0 0 1\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n" for a, b, c in (
    ("-1 -1 -0.5", "1 -1 -0.5", "1 1 -0.5"), ("-1 -1 -0.5", "1 1 -0.5", "-1 1 -0.5"))) + "endsolid s\n"
# Properties that a fragment does not set itself.
PROPERTIES = {
    "youngsModulus": "peratomtype 5e6", "poissonsRatio": "peratomtype 0.3", "coefficientRestitution": "peratomtypepair 1 0.5",
    "coefficientFriction": "peratomtypepair 1 0.5", "staticFriction": "peratomtypepair 1 0.5", "kineticFriction": "peratomtypepair 1 0.4",
    "criticalSlipDistance": "peratomtypepair 1 1e-5", "characteristicVelocity": "scalar 2", "surfaceTension": "scalar 0.072",
    "contactAngle": "peratomtype 0.35", "bridgeVolume": "peratomtypepair 1 8e-11"}
PAIR_STYLE = "pair_style gran model hertz tangential finnie_rabinowicz cohesion capillary"
# Lines that no block shows, for the forms of a page's syntax that its examples leave out.
MORE = """
fix hits all lcp/impact stiffness 2e7 wall plane floor y -0.5 lo stiffness 5e7 friction 0.3
fix lid all wall/gran model hertz tangential history cohesion capillary mesh n_meshes 1 meshes stl
"""


@pytest.fixture(scope="module")
def liggghts() -> engines.Engine:
    return built("liggghts")


def run(engine: engines.Engine, text: str, folder: Path, ranks: int = 1, **values: str) -> str:
    """What the engine prints for a deck; AssertionError when it stops."""
    (folder / "deck.in").write_text(text)
    done = engines.call(engine.command(Path("deck.in"), values, ranks), folder, engine.environment(), timeout=120)
    assert done.returncode == 0, done.stdout[-1500:] + done.stderr
    return done.stdout


def alternatives(lines: list[str]) -> Iterator[list[str]]:
    """The lines, or each by itself where all of them are forms of one command."""
    if len(lines) > 1 and len({tuple(line.split()[:2]) for line in lines}) == 1 and lines[0].startswith(("pair_style", "fix hits")):
        yield from ([line] for line in lines)
    else:
        yield lines


def deck(lines: list[str]) -> str:
    """A complete deck with these lines of a fragment in their places."""
    if hits := next((line for line in lines if "lcp/impact" in line), ""):
        types = len(re.search(r"stiffness((?: [\d.e+-]+)+)", hits).group(1).split())
        mesh = MESH.format(scale=1) if "wall mesh" in hits else ""
        return LOGS.format(types=types) + mesh + "\n".join(lines) + "\nfix motion all nve/sphere\nrun 20\n"
    given = {match.group(1) for line in lines if (match := re.match(r"fix \S+ all property/global (\w+)", line))}
    # With carried liquid a bridge volume is refused.
    given |= {"bridgeVolume"} if "carried_liquid on" in " ".join(lines) else set()
    head = [line for line in lines if "property/global" in line]
    head += [f"fix default{n} all property/global {name} {value}" for n, (name, value) in enumerate(PROPERTIES.items())
             if name not in given]
    head += [next((line for line in lines if line.startswith("pair_style")), PAIR_STYLE), "pair_coeff * *", "timestep 1e-6"]
    rest = [line for line in lines if "property/global" not in line and not line.startswith("pair_style")]
    if not any(line.startswith("run") for line in rest):
        rest.append("run 1000")
    mesh = [MESH.format(scale=0.009)] if "meshes" in " ".join(lines) else []
    return GRAINS + "\n".join([*head, *mesh, "fix motion all nve/sphere", *rest]) + "\n"


FRAGMENTS = [*blocks("LIGGGHTS fragment"),
             *(Block("more", number, "LIGGGHTS fragment", line) for number, line in enumerate(MORE.split("\n")) if line)]


@pytest.mark.parametrize("block", FRAGMENTS, ids=lambda block: block.place)
def test_fragment(block: Block, liggghts: engines.Engine, tmp_path: Path) -> None:
    for number, lines in enumerate(alternatives(logical_lines(block.text, "&"))):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "drum.stl").write_text(STL)
        assert "Loop time" in run(liggghts, deck(lines), folder)


def shown() -> list[str]:
    """Every line that a test of the documentation gives to the engine."""
    files = [block for block in blocks() if block.kind.startswith("lammps ")]
    return [" ".join(line.split()) for block in [*FRAGMENTS, *blocks("deck"), *files] for line in logical_lines(block.text, "&")]


def pattern(template: str) -> re.Pattern[str]:
    """What fits a line of a syntax: words in capitals stand for one word, `a|b` for one of two, [...] may be missing."""
    text = re.sub(r"\[[^]]*\]", "\0", re.sub(r"\s*\(.*\)$", "", template))
    text = re.sub(r"(?:keyword values?|\S+) \.\.\.(?: \S*_ntypes)?", "\1", text)
    words = []
    for word in text.split():
        if word in "\0\1":
            words.append(r"(?: \S+)*")
        elif re.fullmatch(r"[A-Z][A-Z0-9-]*|group-ID|s_1", word):
            words.append(r" \S+")
        else:
            words.append(f" (?:{'|'.join(map(re.escape, word.split('|')))})")
    return re.compile("".join(words))


@pytest.mark.parametrize("block", blocks("syntax"), ids=lambda block: block.place)
def test_syntax_is_that_of_lines_that_run(block: Block) -> None:
    lines = [f" {line}" for line in shown()]
    missing = [line for line in logical_lines(block.text, "&") if not any(pattern(line).search(other) for other in lines)]
    assert not missing


def test_resumed_run_says_what_its_page_says(liggghts: engines.Engine, tmp_path: Path) -> None:
    page = "docs/reference/fix_resume_exact.md"
    (text,) = (block.text for block in blocks("deck") if block.page == page)
    (said,) = (block.text for block in blocks("output") if block.page == page)
    exactly, approximately = said.splitlines()
    run(liggghts, text, tmp_path)
    whole = {name: (tmp_path / name).read_bytes() for name in ("time.csv", "grains.dump")}
    assert exactly in run(liggghts, text, tmp_path, resuming="1").splitlines()
    assert all((tmp_path / name).read_bytes() == content for name, content in whole.items())
    other = tmp_path / "two"
    other.mkdir()
    run(liggghts, text, other, ranks=2)
    assert approximately in run(liggghts, text, other, resuming="1").splitlines()


def test_binary_dump(liggghts: engines.Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (block,) = blocks("python grains.bin")
    columns = re.search(r'columns="([^"]*)"', block.text).group(1)
    run(liggghts, deck([f"dump grains all custom 10 grains.bin {columns}", "run 20"]), tmp_path)
    monkeypatch.chdir(tmp_path)
    known: dict[str, object] = {}
    exec(f"from dembark.postproc import GrainsDump\n{block.text}", known)
    assert known["grains"].steps.tolist() == [0, 10, 20] and known["grains"][0].radii.tolist() == [0.0025, 0.0025]


def test_compute_after_the_first_run_is_refused(liggghts: engines.Engine, tmp_path: Path) -> None:
    page = (ROOT / "docs/how-to/trajectories.md").read_text(encoding="utf-8")
    told = re.search(r"Otherwise the engine stops: `([^`]*)`", page).group(1)
    compute = next(line for line in shown() if "pair/gran/local" in line)
    (tmp_path / "deck.in").write_text(deck(["run 1", compute, "run 1"]))
    done = engines.call(liggghts.command(Path("deck.in"), {}), tmp_path, liggghts.environment(), timeout=120)
    assert done.returncode != 0 and told in done.stdout + done.stderr
