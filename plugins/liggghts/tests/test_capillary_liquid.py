"""fix capillary/liquid: liquid of grains, bridges and walls is conserved on any number of ranks, through restarts and when grains leave."""

import re
from pathlib import Path

import numpy as np
import pytest
from rig.liggghts_driver import head, properties, read_dump, run_deck
from rig.packing import packing, start_state
from rig.scenarios import Material

LIQUID = Material(static_friction=0.5, kinetic_friction=0.4, bridge_volume=1.0)
MODELS = "model hertz tangential finnie_rabinowicz cohesion capillary"
WORDS = "presliding linear carried_liquid on"
VOLUMES = "peratomtypepair 2 1e-12 1e-12 1e-12 1e-12"
SIDE = 0.03
GRAINS = "\n".join(f"create_atoms 1 single {0.003 + 0.006 * i} {0.003 + 0.006 * j} {0.004 + 0.006 * k} units box"
                   for i in range(5) for j in range(5) for k in range(5))
CREATE = f"region domain block 0 {SIDE} 0 {SIDE} -0.005 0.05 units box\ncreate_box 2 domain\n{GRAINS}"
STATE = start_state("0.0045*(1+0.25*sin(37*id))", 0.5)
THERMO = "thermo_style custom step atoms " + " ".join(f"f_liquid[{k}]" for k in range(1, 9))
OUTPUT = {name: k for k, name in enumerate(("step", "atoms", "grains", "bridges", "walls", "lost", "count", "added", "held", "error"))}


def write_floor(path: Path, n: int = 3) -> None:
    """A square of 2 n^2 coplanar triangles at z = 0."""
    at = np.linspace(0.0, SIDE, n + 1)
    triangles = []
    for i in range(n):
        for j in range(n):
            a, b, c, d = ((at[i], at[j]), (at[i + 1], at[j]), (at[i + 1], at[j + 1]), (at[i], at[j + 1]))
            triangles += [(a, b, c), (a, c, d)]
    corners = ["\n".join(f"vertex {x:.9g} {y:.9g} 0" for x, y in triangle) for triangle in triangles]
    facets = "\n".join(f"facet normal 0 0 1\nouter loop\n{three}\nendloop\nendfacet" for three in corners)
    path.write_text(f"solid floor\n{facets}\nendsolid floor\n", encoding="utf-8")


def shaken(run: str, *, ranks: int = 1, liquid: str = "content 0.01 return radius wall left 1e-10 0.05 0.3", create: str = CREATE,
           state: str = STATE, words: str = WORDS, newton: str = "off", bridge_volume: str = "") -> str:
    """125 grains of radii 1 : 1.7 on a shaken mesh between four primitive walls, the left one wet."""
    grid = {1: "1 1 1", 2: "2 1 1", 4: "2 2 1"}[ranks]
    planes = "\n".join(f"fix {name} all wall/gran {MODELS} primitive type 2 {axis}plane {at} {words}"
                       for name, axis, at in (("left", "x", 0.0), ("right", "x", SIDE), ("front", "y", 0.0), ("back", "y", SIDE)))
    return f"""\
{head(newton)}
processors {grid}
{create}
neighbor 0.002 bin
neigh_modify delay 0
timestep 1e-5
{properties(LIQUID, bridgeVolume=bridge_volume)}
pair_style gran {MODELS} {words}
pair_coeff * *
{state}
fix floor all mesh/surface file floor.stl type 2
fix ground all wall/gran {MODELS} mesh n_meshes 1 meshes floor {words}
{planes}
fix liquid all capillary/liquid {liquid}
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
fix shake all move/mesh mesh floor wiggle amplitude 0. 0. 0.0015 period 0.03
{THERMO}
thermo_modify lost ignore norm no format float %.17g
thermo 250
dump grains all custom 500 grains.dump id x y z vx vy vz f_capillaryLiquid
dump_modify grains sort id format "%d{' %.17g' * 7}"
{run}
"""


def run_shaken(folder: Path, deck: str, *, ranks: int = 1) -> np.ndarray:
    """The rows of the thermo output."""
    folder.mkdir(parents=True, exist_ok=True)
    write_floor(folder / "floor.stl")
    done = run_deck(folder, deck, ranks=ranks)
    assert done.code == 0, done.output[-2000:]
    rows = [line.split() for line in done.output.splitlines() if re.fullmatch(r"\s*\d+(\s+[-+.\deinf]+){9}\s*", line)]
    return np.array(rows, dtype=float)


def column(rows: np.ndarray, name: str) -> np.ndarray:
    return rows[:, OUTPUT[name]]


@pytest.fixture(scope="module")
def by_ranks(tmp_path_factory):
    """Frames and outputs of the same 2000 steps on 1 and 2 ranks, of the first half on 4: ranks that wait take processors."""
    runs = {}
    for ranks, steps in ((1, 2000), (2, 2000), (4, 1000)):
        folder = tmp_path_factory.mktemp(f"ranks{ranks}")
        rows = run_shaken(folder, shaken(f"run {steps}", ranks=ranks), ranks=ranks)
        runs[ranks] = rows, read_dump(folder / "grains.dump")[1]
    return runs


@pytest.mark.parametrize("ranks", [1, 2, 4])
def test_liquid_is_conserved(by_ranks, ranks):
    rows, frames = by_ranks[ranks]
    total = column(rows, "held")
    assert np.abs(total / total[0] - 1.0).max() <= 1e-14
    np.testing.assert_allclose(column(rows, "grains") + column(rows, "bridges") + column(rows, "walls"), total, rtol=1e-15)
    assert np.abs(column(rows, "error")).max() <= 1e-14 * total[0]
    assert (column(rows, "lost") == 0.0).all() and (column(rows, "atoms") == 125).all()
    # Bridges form and break, and the wall takes part.
    assert column(rows, "count")[-1] > 50 and column(rows, "bridges")[-1] > 0.1 * total[0]
    assert len(set(column(rows, "walls"))) > 4
    assert all((frame[:, 7] >= 0.0).all() for frame in frames)
    np.testing.assert_allclose([frame[:, 7].sum() for frame in frames], column(rows, "grains")[::2], rtol=1e-13)


def test_first_liquid_is_the_content(by_ranks):
    rows, _ = by_ranks[1]
    radius = 0.00225 * (1.0 + 0.25 * np.sin(37.0 * np.arange(1, 126)))
    np.testing.assert_allclose(column(rows, "grains")[0], 0.01 * (4.0 / 3.0 * np.pi * radius**3).sum(), rtol=1e-13)
    assert column(rows, "count")[0] == 0.0 and column(rows, "walls")[0] == 1e-10


@pytest.mark.parametrize("ranks", [2, 4])
def test_ranks_settle_alike(by_ranks, ranks):
    """Positions differ by rounding that grows with each collision; liquid does where bridges form from other sums."""
    (one, frames), (other, others) = by_ranks[1], by_ranks[ranks]
    one = one[:len(other)]
    np.testing.assert_allclose(other[:, 2:9], one[:, 2:9], rtol=1e-8, atol=1e-20)
    np.testing.assert_array_equal(column(other, "count"), column(one, "count"))
    np.testing.assert_allclose(others[-1][:, 7], frames[len(others) - 1][:, 7], rtol=1e-6, atol=1e-16)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_resumed_run_is_the_same_to_the_bit(tmp_path, ranks):
    state = "fix state all resume/exact 600 bed cut grains.dump\n"
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    rows = run_shaken(whole, shaken(f"{state}run 1500", ranks=ranks), ranks=ranks)
    run_shaken(broken, shaken(f"{state}run 1100", ranks=ranks), ranks=ranks)
    again = shaken(f"{state}run 1500 upto", ranks=ranks, create="resume_state bed", state="")
    resumed = run_shaken(broken, again.replace("dump_modify grains sort", "dump_modify grains append yes sort"), ranks=ranks)
    assert (whole / "grains.dump").read_bytes() == (broken / "grains.dump").read_bytes()
    assert resumed[-1].tolist() == rows[-1].tolist()


@pytest.mark.parametrize(("ranks", "others"), [(1, 2), pytest.param(2, 1, marks=pytest.mark.full)])
def test_restart_on_other_ranks_conserves(tmp_path, ranks, others):
    before = run_shaken(tmp_path, shaken("run 1000\nwrite_restart bed.restart", ranks=ranks), ranks=ranks)
    after = run_shaken(tmp_path, shaken("run 500", ranks=others, create="read_restart bed.restart", state=""), ranks=others)
    np.testing.assert_allclose(after[0, 2:9], before[-1, 2:9], rtol=1e-13, atol=1e-25)
    np.testing.assert_allclose(column(after, "held"), column(before, "held")[0], rtol=1e-14)
    assert column(after, "count")[-1] > 0


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_grains_that_leave_take_their_liquid_with_them(tmp_path, ranks):
    """Two grains are shot through the open top, one of them through the heap."""
    rows = run_shaken(tmp_path, shaken("set atom 125 vz 8.0\nset atom 63 vz 30.0\nrun 2000", ranks=ranks), ranks=ranks)
    held, lost = column(rows, "held"), column(rows, "lost")
    assert column(rows, "atoms")[-1] < 125
    assert lost[-1] > 0.0 and (np.diff(lost) >= 0.0).all()
    np.testing.assert_allclose(held + lost, held[0], rtol=1e-14)


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.full)])
def test_deleted_grains_and_walls(tmp_path, ranks):
    """A group is deleted in mid-heap, and a wet wall goes; what was in their bridges falls back to those that stay."""
    commands = """\
run 1000
group half id 1:60
delete_atoms group half compress no
run 250
unfix left
variable seen equal f_liquid[5]
print "bridges while a wall is gone: ${seen}"
run 250"""
    rows = run_shaken(tmp_path, shaken(commands, ranks=ranks), ranks=ranks)
    held, lost = column(rows, "held"), column(rows, "lost")
    np.testing.assert_allclose(held + lost, held[0], rtol=1e-13)
    assert column(rows, "atoms")[-1] == 65
    assert column(rows, "walls")[-1] == 0.0


def periodic(run: str, ranks: int) -> str:
    """64 grains that fall on a floor, periodic along it; for one rank or two."""
    bed = packing(Material(static_friction=0.5, kinetic_friction=0.4, bridge_volume=1.0), run, every=1000)
    bed = re.sub(r"fix p_bridgeVolume.*", "", bed).replace("capillary_model exact", "capillary_model exact carried_liquid on")
    bed = bed.replace("thermo 1000", f"{THERMO}\nthermo_modify norm no format float %.17g\nthermo 250")
    bed = bed.replace("fix weight", "fix liquid all capillary/liquid content 0.01 return taken\nfix weight")
    return bed if ranks == 2 else bed.replace("processors 2 1 1\n", "")


def test_periodic_borders(tmp_path):
    runs = {}
    for ranks in (1, 2):
        rows = runs[ranks] = run_shaken(tmp_path / str(ranks), periodic("run 3000", ranks), ranks=ranks)
        np.testing.assert_allclose(column(rows, "held"), column(rows, "held")[0], rtol=1e-14)
        assert (column(rows, "lost") == 0.0).all() and column(rows, "count")[-1] > 64
    np.testing.assert_allclose(runs[2][:, 2:9], runs[1][:, 2:9], rtol=1e-7, atol=1e-20)


def test_new_grains_bring_the_same_content(tmp_path):
    commands = """\
run 500
create_atoms 1 single 0.015 0.015 0.045 units box
set atom 126 diameter 0.004 density 2500
run 500"""
    rows = run_shaken(tmp_path, shaken(commands))
    assert column(rows, "atoms")[-1] == 126
    np.testing.assert_allclose(column(rows, "added")[-1], 0.01 * np.pi / 6.0 * 0.004**3, rtol=1e-13)
    np.testing.assert_allclose(column(rows, "held") - column(rows, "added"), column(rows, "held")[0], rtol=1e-14)


def test_liquid_set_by_hand_and_spread_by_contacts(tmp_path):
    """One wet grain among dry ones; `set` adds to it between two runs."""
    commands = "set atom 63 property/atom capillaryLiquid 1e-9\nrun 500\nset atom 63 property/atom capillaryLiquid 2e-9\nrun 500"
    rows = run_shaken(tmp_path, shaken(commands, liquid="volume 0"))
    np.testing.assert_allclose(column(rows, "held") - column(rows, "added"), 1e-9, rtol=1e-13)
    assert column(rows, "bridges")[-1] > 0.0


def test_liquid_that_changes_during_a_run_is_told_in_its_amounts(tmp_path):
    write_floor(tmp_path / "floor.stl")
    setting = 'run 2000 pre no every 1000 "set atom 63 property/atom capillaryLiquid 2e-9"'
    done = run_deck(tmp_path, shaken(f"set atom 63 property/atom capillaryLiquid 1e-9\nrun 1\n{setting}", liquid="volume 0"))
    assert done.code != 0
    found = re.search(r"there is (\S+) m\^3 of liquid, and (\S+) m\^3 is due: the liquid of grains was changed during the run", done.error)
    assert found and float(found[1]) > 1.9e-9 and abs(float(found[2]) - 1e-9) < 1e-17, done.error or done.output[-1500:]


@pytest.mark.parametrize("speed", [0.5, 60.0])
def test_liquid_goes_back_from_a_wall_however_fast_the_grain_leaves(tmp_path, speed):
    """At 60 m/s it is farther than the list of grains near the wall looks a step after it touches."""
    text = f"""\
{head()}
region domain block -0.02 0.02 -0.02 0.02 -0.01 0.1 units box
create_box 2 domain
neighbor 0.001 bin
neigh_modify delay 0
create_atoms 1 single 0 0 0.00249 units box
set group all diameter 0.005 density 2500
timestep 2e-5
{properties(LIQUID, bridgeVolume="")}
pair_style gran {MODELS} {WORDS}
pair_coeff * *
fix floor all wall/gran {MODELS} primitive type 2 zplane 0 {WORDS}
fix liquid all capillary/liquid content 0.001
fix motion all nve/sphere
variable count equal f_liquid[5]
variable bridges equal f_liquid[2]
variable grains equal f_liquid[1]
thermo 1000
run 3
print "wet ${{count}} ${{bridges}} ${{grains}}"
velocity all set 0 0 {speed}
run {round(1 + 0.03 / speed / 2e-5)}
print "wet ${{count}} ${{bridges}} ${{grains}}"
"""
    done = run_deck(tmp_path, text)
    assert done.code == 0, done.error or done.output[-1500:]
    rows = [line.split()[1:] for line in done.output.splitlines() if line.startswith("wet ")]
    (held, bridge, rest), (ruptured, none, grain) = np.array(rows, float)
    assert held == 1 and bridge > 0.0
    assert ruptured == 0 and none == 0.0 and grain > rest


def test_largest_bridge(tmp_path):
    done = shaken("compute bridges all pair/gran/local id history\n"
                  "compute most all reduce max c_bridges[4]\n"  # after the two ids: bridge_volume is the first of the model
                  "run 500", liquid="content 0.02 share fraction 1 max_bridge 1e-12")
    rows = run_shaken(tmp_path, done)
    assert column(rows, "bridges")[-1] <= 1e-12 * column(rows, "count")[-1] * (1.0 + 1e-12)
    np.testing.assert_allclose(column(rows, "held"), column(rows, "held")[0], rtol=1e-14)


@pytest.mark.parametrize(("change", "told"), [
    ({"liquid": "content -1"}, "content (liquid volume over grain volume) must be >= 0"),
    ({"liquid": "content nan"}, "content: the value must be a number, not 'nan'"),
    ({"liquid": "content 0.01 volume 1e-12"}, "either content or volume"),
    ({"liquid": "share cap 3"}, "must lie in (0, 2]"),
    ({"liquid": "share all"}, "cap or fraction"),
    ({"liquid": "return half"}, "equal, radius or taken"),
    ({"liquid": "max_bridge 0"}, "max_bridge (m^3) must be > 0"),
    ({"liquid": "film 3"}, "keyword 'film' is unknown"),
    ({"liquid": "wall left 1e-10 0.1 2"}, "must lie in 0...1"),
    ({"liquid": "wall left 1e-10"}, "wall must be followed by"),
    ({"liquid": "wall top 1e-10 0.1 0.5"}, "there is no fix wall/gran top"),
    ({"liquid": "content 0.01\nfix other all capillary/liquid content 0.01"}, "there can be one such fix only"),
    ({"words": "presliding linear", "bridge_volume": VOLUMES}, "liquid is not carried; write 'carried_liquid on'"),
    ({"bridge_volume": VOLUMES}, "bridgeVolume is given, but carried liquid"),
    ({"liquid": "content 0.01\nunfix liquid\nthermo_style one"}, "carried_liquid on needs the liquid"),
    ({"liquid": "content 0.01\nset atom 7 property/atom capillaryLiquid -3"}, "grain 7 has liquid"),
    ({"liquid": "volume 1e-7"}, "with a primitive wall reaches"),
    ({"newton": "on"}, "newton"),
])
def test_mistakes_are_one_line(tmp_path, change, told):
    write_floor(tmp_path / "floor.stl")
    text = shaken("run 50", **change)
    if told == "carried_liquid on needs the liquid":
        text = text.replace(THERMO, "").replace(" f_capillaryLiquid", "").replace("dump_modify grains", "undump grains #")
    done = run_deck(tmp_path, text)
    assert done.code != 0
    assert told in done.error, done.output[-1500:]
