"""LAMMPS blocks of the documentation: complete decks and fragments run, and syntax lines fit what was run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from blocks import Block, blocks, built, logical_lines
from test_liggghts_blocks import pattern

from dembark.validation import engines
from dembark.validation.case.folders import package_root

DECKS, FRAGMENTS = blocks("LAMMPS deck"), blocks("LAMMPS fragment")
# Of pages about both engines.
SHARED = [block for block in blocks("LIGGGHTS fragment") if re.match("docs/reference/(fix|integration)_", block.page)
          and "pair_style gran" not in block.text]
# Two grains that just touch above a floor; what a fragment does not say itself.
HEAD = """
units           si
atom_style      sphere
boundary        f f f
atom_modify     map array
newton          off
comm_modify     vel yes
region          domain block -0.01 0.02 -0.01 0.01 -0.0025 0.01 units box
create_box      2 domain
neighbor        0.001 bin
create_atoms    1 single 0 0 0.0025 units box
create_atoms    1 single 0.004998 0 0.0025 units box
set             group all density 2500 diameter 0.005
group           wetted id 1
"""
# Below the grains.
TROUGH = """solid trough
facet normal 0 0 1
  outer loop
    vertex -1 -1 -1
    vertex 1 -1 -1
    vertex 0 1 -1
  endloop
endfacet
endsolid trough
"""
# Two logs in a drum of radius 1.9 m.
LOGS = """
units           si
atom_style      sphere
atom_modify     map array sort 0 0.0
boundary        f f f
comm_modify     vel yes
region          domain block -2 2 -2 2 -2 2 units box
create_box      {types} domain
neighbor        0.05 bin
create_atoms    1 single 0 0 0 units box
create_atoms    {types} single 0.1995 0 0 units box
set             group all diameter 0.2
set             group all mass 50
group           logs type 1:{types}
timestep        1e-5
"""
PAIR = "pair_style dembark/granular"
COEFFICIENTS = ("pair_coeff * * youngs_modulus 5e6 poissons_ratio 0.3 restitution 0.5 static_friction 0.5 kinetic_friction 0.4 "
                "critical_slip_distance 1e-5")
# Of laws that a pair style may have: the words that choose one, and its coefficients.
MORE = {r"rolling_resistance (?!off)": "rolling_friction 0.1", r"capillary_model|cohesion bridge": "contact_angle 0.3",
        r"(capillary_model|cohesion bridge)(?!.*carried_liquid on)": "bridge_volume 8e-11"}


def run(text: str, folder: Path) -> str:
    engine = built("lammps")
    (folder / "deck.in").write_text(text)
    done = engines.call(engine.command(Path("deck.in"), {}), folder, engine.environment(), timeout=120)
    assert done.returncode == 0, done.stdout[-1500:] + done.stderr
    return done.stdout


@pytest.mark.parametrize("block", DECKS, ids=lambda block: block.place)
def test_complete_deck(block: Block, tmp_path: Path) -> None:
    assert block.text.startswith("# Complete deck")
    rows = [line.split() for line in run(block.text, tmp_path).splitlines() if re.fullmatch(r"\s*\d[\s\d.e+-]+", line)]
    if "integration/monitor" in block.text:
        # Errors of positions and velocities, too few steps a contact, one impact.
        _, along, speed, steps, impacts = map(float, rows[-1])
        assert along > 0.0 and speed > 0.005 and 0.0 < steps < 10.0 and impacts == 1
    else:
        # The wall touches grains, and holds more by bridges.
        assert len(rows) == 4 and float(rows[-1][1]) != 0.0 and 5 < float(rows[-1][2]) <= float(rows[-1][3])


@pytest.mark.parametrize("block", [block for block in SHARED if "lcp/impact" in block.text], ids=lambda block: block.place)
def test_fragment_of_impacts(block: Block, tmp_path: Path) -> None:
    forms = [line for line in logical_lines(block.text, "&") if "wall mesh" not in line]
    for number, line in enumerate(forms):
        folder = tmp_path / str(number)
        folder.mkdir()
        types = len(re.search(r"stiffness((?: [\d.e+-]+)+)", line).group(1).split())
        assert "Loop time" in run("\n".join([LOGS.format(types=types), line, "fix motion all nve/sphere", "run 20", ""]), folder)


@pytest.mark.parametrize("block", [block for block in (*FRAGMENTS, *SHARED) if "lcp/impact" not in block.text],
                         ids=lambda block: block.place)
def test_fragment(block: Block, tmp_path: Path) -> None:
    lines = logical_lines(block.text, "&")
    pairs = [line for line in lines if line.startswith("pair_style")] or [PAIR]
    rest = [line for line in lines if not line.startswith("pair_style")]
    (tmp_path / "trough.stl").write_text(TROUGH)
    for pair in pairs:
        coefficients = " ".join([COEFFICIENTS, *(more for words, more in MORE.items() if re.search(words, pair))])
        deck = "\n".join([HEAD, pair, coefficients, "timestep 1e-6", "fix motion all nve/sphere", *rest, "run 100", ""])
        assert "Loop time" in run(deck, tmp_path)


@pytest.mark.parametrize("block", blocks("LAMMPS syntax"), ids=lambda block: block.place)
def test_syntax_is_that_of_lines_that_run(block: Block) -> None:
    run_here = [line for other in (*DECKS, *FRAGMENTS) for line in logical_lines(other.text, "&")]
    # What the decks of cases choose from.
    run_here += re.findall(r'"([^"]+)"', (package_root() / "common" / "start.in").read_text())
    lines = [f" {' '.join(line.split())}" for line in run_here]
    assert not [line for line in logical_lines(block.text, "&") if not any(pattern(line).search(other) for other in lines)]
