"""fix wall/dembark stl: whatever a file has twice or leaves open, the floor is the same; grains that enter or grow feel it."""

import numpy as np
import pytest
from rig import floors
from rig.lammps_driver import BIN, head, run_deck
from rig.liggghts_driver import read_dump

from dembark.validation.engines import call

PAIR = "youngs_modulus 5e6 poissons_ratio 0.3 restitution 1 static_friction 0.5 kinetic_friction 0.4 critical_slip_distance 1e-5"


def deck(wall: str, number: int = 0, boundary: str = "f f f") -> str:
    lines = []
    for n, (start, velocity) in enumerate(floors.PATHS, start=1):
        lines.append(f"create_atoms 1 single {start[0]} {start[1]} {floors.HEIGHT} units box\ngroup g{n} id {n}\n"
                     f"fix m{n} g{n} move linear {velocity[0]} {velocity[1]} 0 units box")
    return f"""\
{head(boundary=boundary)}
region domain block -0.03 0.03 -0.03 0.03 -0.03 0.03 units box
create_box 2 domain
neighbor 0.002 bin
pair_style dembark/granular
pair_coeff * * {PAIR}
timestep {floors.STEP}
{chr(10).join(lines)}
set group all diameter {2 * floors.RADIUS} density 2500
{wall}
dump grains all custom 5 {number}.dump id fx fy fz
dump_modify grains sort id format float %.17g
thermo 1000
run {floors.STEPS}
"""


def test_every_file_of_a_floor_is_the_floor(tmp_path):
    files = {**floors.files(), "plane": b""}
    decks = []
    for number, (name, content) in enumerate(files.items()):
        (tmp_path / f"{number}.stl").write_bytes(content)
        wall = f"stl {number}.stl" if name != "plane" else "region floor"
        region = "region floor plane 0 0 0 0 0 1 units box\n" * (name == "plane")
        decks.append(deck(region + f"fix wall all wall/dembark {wall} type 2", number))
    done = run_deck(tmp_path, "clear\n".join(decks))
    assert done.code == 0, done.error or done.output[-2000:]
    forces = {name: np.array(read_dump(tmp_path / f"{number}.dump")[1])[..., 1:] for number, name in enumerate(files)}
    assert forces["plane"][..., 2] == pytest.approx(5.7917e-3, rel=1e-4)
    for name, force in forces.items():
        assert np.abs(force - forces["plane"]).max() < 2e-3 * forces["plane"].max(), name
        if "um" not in name:
            assert np.abs(force - forces["plane"]).max() < 3e-5 * forces["plane"].max(), name
    assert "left out 2 triangles without area and 0 given again" in done.output
    assert "left out 0 triangles without area and 8 given again" in done.output


@pytest.mark.parametrize("line", floors.refused())
def test_other_files_are_refused_in_one_line(tmp_path, line):
    (tmp_path / "0.stl").write_bytes(floors.refused()[line])
    done = run_deck(tmp_path, deck("fix wall all wall/dembark stl 0.stl type 2"))
    assert done.code != 0 and "fix wall wall/dembark: file '0.stl'" in done.error and line in done.error, done.output[-500:]


@pytest.mark.parametrize(("words", "line"), [("precision -1", "must be a length >= 0"), ("precision", "[precision P]"),
                                             ("precision 1e-6 move", "[precision P]")])
def test_wrong_words_are_refused_in_one_line(tmp_path, words, line):
    (tmp_path / "0.stl").write_bytes(floors.files()["plain"])
    done = run_deck(tmp_path, deck(f"fix wall all wall/dembark stl 0.stl type 2 {words}"))
    assert done.code != 0 and line in done.error, done.output[-500:]


def test_precision_is_a_word_of_the_fix(tmp_path):
    (tmp_path / "0.stl").write_bytes(floors.files()["plain"])
    done = run_deck(tmp_path, deck("fix wall all wall/dembark stl 0.stl type 2 precision 1e-6 motion uniform velocity 0 0 0"))
    assert done.code == 0, done.error


ENTER = {
    "created between runs": "run 0\ncreate_atoms 1 single 0.001 0.002 0.0024 units box\nset group all diameter 0.005 density 2500\n",
    "grown between runs": "create_atoms 1 single 0.001 0.002 0.0024 units box\nset group all diameter 0.002 density 2500\nrun 0\n"
                          "set group all diameter 0.005\n",
    "grown during a run": "create_atoms 1 single 0.001 0.002 0.0024 units box\nset group all diameter 0.001 density 2500\n"
                          "pair_coeff 1 1 largest_radius 0.0026\n"
                          "variable d equal 0.001+0.0004*step\nfix grow all adapt 1 atom diameter v_d\nrun 10\nunfix grow\n",
}


@pytest.mark.parametrize("boundary", ["f f f", "p p f"])
def test_grains_that_enter_or_grow_feel_the_floor(tmp_path, boundary):
    """Nothing is there when the wall is defined, so that no reach is known."""
    (tmp_path / "0.stl").write_bytes(floors.files()["plain"])
    decks = []
    for number, words in enumerate(ENTER.values()):
        before, _, _ = deck("", number, boundary).partition("create_atoms 1 single")
        decks.append(before.replace("atom_style sphere", "atom_style sphere 1") + "fix wall all wall/dembark stl 0.stl type 2\n" + words +
                     f"dump grains all custom 1 {number}.dump id fx fy fz\ndump_modify grains format float %.17g\nrun 0\n")
    done = run_deck(tmp_path, "clear\n".join(decks))
    assert done.code == 0, done.error or done.output[-2000:]
    for number, name in enumerate(ENTER):
        force = read_dump(tmp_path / f"{number}.dump")[1][-1][0, 1:]
        assert force == pytest.approx([0.0, 0.0, 5.7917e-3 * 10**1.5], rel=1e-3, abs=1e-9), name


def test_only_the_first_rank_needs_the_file(tmp_path):
    """Ranks of other nodes may not see it: a rank without the file neither stops nor waits."""
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    (tmp_path / "here/0.stl").write_bytes(floors.files()["plain"])
    for folder in ("here", "there"):
        (tmp_path / folder / "case.in").write_text(deck("fix wall all wall/dembark stl 0.stl type 2"))
    one = ["-n", "1", "-wdir"]
    done = call([BIN / "lammps-mpiexec", *one, tmp_path / "here", BIN / "lammps-dembark", "-in", "case.in", "-log", "none", ":",
                 *one, tmp_path / "there", BIN / "lammps-dembark", "-in", "case.in", "-log", "none"], tmp_path)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-1000:]
    forces = np.array(read_dump(tmp_path / "here/0.dump")[1])[..., 3]
    assert forces == pytest.approx(5.7917e-3, rel=1e-4)
