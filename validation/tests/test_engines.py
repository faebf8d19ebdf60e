"""The real engines under the harness: two grains that fall, from a LIGGGHTS deck and a YADE deck of the same case."""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from dembark.common.errors import Interrupted, RunError
from dembark.common.files import read_json
from dembark.validation import engines, provenance
from dembark.validation.campaigns.plan import Resources, Run, series
from dembark.validation.case import folders
from dembark.validation.case.folders import find
from dembark.validation.engines.liggghts import Liggghts
from dembark.validation.runs.simulate import simulate

CASE = """
[case]
title = "Two grains fall"
engines = ["liggghts", "yade"]
[parameters.grain_count]
value = 2
doc = "grains"
[parameters.gravity]
value = 9.81
unit = "m/s^2"
doc = "downward acceleration; may be negative"
[parameters.steps]
value = 1000
doc = "steps of 1e-5 s"
[parameters.frames]
value = 2
doc = "frames"
[derived]
time_step = "1e-5"
"""

LIGGGHTS = """
variable stride equal ${steps}/${frames}
atom_style granular
units si
boundary f f f
newton off
communicate single vel yes
region box block -1 1 -1 1 -5 1 units box
create_box 1 box
neighbor 0.01 bin
fix m1 all property/global youngsModulus peratomtype 5e6
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.5
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
create_atoms 1 single 0 0 0
create_atoms 1 single 0.5 0 0
set group all density 2500 diameter 0.1
fix grav all gravity ${gravity} vector 0 0 -1
fix move all nve/sphere
compute contacts all pair/gran/local pos id force
print "dembark: steps ${steps} time_step 1e-5"
variable frame equal stride(${stride},${steps},${stride})
variable n equal step
variable t equal step*1e-5
variable ke equal ke
fix times all print 100 "${n},${t},${ke}" file time.csv screen no title "step,time,kinetic_energy"
dump grains all custom ${stride} grains.dump id type x y z vx vy vz radius mass
dump_modify grains every v_frame first no
dump contacts all local ${stride} contacts.dump c_contacts[1] c_contacts[2] c_contacts[3]
dump_modify contacts every v_frame first no
thermo_style custom step ke
thermo 100
run ${steps}
print "dembark: finished"
"""

YADE = """
from yade import dembark
p = dembark.parameters()
steps, frames = p.steps, p.frames
ids = [O.bodies.append(sphere((x, 0, 0), 0.05)) for x in (0, 0.5)]
O.engines = [ForceResetter(), NewtonIntegrator(gravity=(0, 0, -p.gravity), damping=0)]
O.dt = 1e-5
print(f"dembark: steps {steps} time_step {O.dt}")
with open("time.csv", "w") as times, open("grains.dump", "w") as grains, open("contacts.dump", "w") as contacts:
    times.write("step,time,kinetic_energy\\n")
    while O.iter < steps:
        O.run(steps // frames, True)
        print(O.iter, O.time, kineticEnergy())
        times.write(f"{O.iter},{O.time},{kineticEnergy()}\\n")
        head = f"ITEM: TIMESTEP\\n{O.iter}\\nITEM: NUMBER OF %s\\n%d\\nITEM: BOX BOUNDS ff ff ff\\n-1 1\\n-1 1\\n-5 1\\nITEM: %s\\n"
        grains.write(head % ("ATOMS", 2, "ATOMS id z vz"))
        for i in ids:
            grains.write(f"{i} {O.bodies[i].state.pos[2]} {O.bodies[i].state.vel[2]}\\n")
        contacts.write(head % ("ENTRIES", 0, "ENTRIES a"))
print("dembark: finished")
"""


@pytest.fixture(autouse=True)
def decks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    folder = tmp_path / "decks" / "fall"
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(CASE)
    (folder / "liggghts.in").write_text(LIGGGHTS)
    (folder / "yade.py").write_text(YADE)
    (folder / "measure.py").touch()
    monkeypatch.setenv("DEMBARK_DECKS", str(folder.parent))
    folders.load.cache_clear()
    engines.find.cache_clear()
    yield
    engines.find.cache_clear()


def test_output_that_is_no_text_is_kept(tmp_path: Path) -> None:
    """Stock LIGGGHTS follows some error lines with bytes of freed memory."""
    done = engines.call(["printf", r"ERROR: too small\ntl\307\312\207U (input.cpp:327)\n"], tmp_path)
    assert done.returncode == 0
    assert done.stdout.splitlines()[0] == "ERROR: too small"


def plan(engine: str, **changes: object) -> Run:
    return series(find("fall"), "default", None, engines.find(engine), changes).runs[0]


def final_energy(folder: Path) -> float:
    return float((folder / "time.csv").read_text().splitlines()[-1].split(",")[2])


@pytest.mark.parametrize(("engine", "gravity"), [("liggghts", 9.81), ("liggghts", -2.0), ("yade", 2.0)])
def test_both_engines_get_the_parameters_and_fall_as_they_say(tmp_path: Path, engine: str, gravity: float) -> None:
    reported: dict[str, object] = {}
    simulate(plan(engine, gravity=gravity), tmp_path / "out", threading.Event(), follow=lambda **facts: reported.update(facts))
    folder = tmp_path / "out/replica-1"
    record = read_json(folder / "run.json")
    assert (record["steps"], record["time_step"], record["frames"]) == (1000, 1e-5, 2)
    assert reported["step"] == 1000
    velocity = gravity * 1e-2
    density = 2500 if engine == "liggghts" else 1000
    mass = density * 4 / 3 * 3.141592653589793 * 0.05**3
    # YADE's leap-frog velocity is half a step behind, 0.05 % here.
    assert final_energy(folder) == pytest.approx(2 * mass * velocity**2 / 2, rel=2.1e-3)
    facts = provenance.collect(engines.find(engine))
    assert facts["versions"][engine] and facts["cpu"] and facts["engine_identity"]


def test_two_mpi_ranks(tmp_path: Path) -> None:
    simulate(plan("liggghts"), tmp_path / "out", threading.Event(), Resources(ranks=2))
    folder = tmp_path / "out/replica-1"
    assert read_json(folder / "run.json")["provenance"]["ranks"] == 2
    assert "2 by 1 by 1" in (folder / "engine.log").read_text() or "1 by 2" in (folder / "engine.log").read_text()


@pytest.mark.parametrize(("engine", "old", "new", "word"), [
    ("liggghts", "pair_style gran model hertz", "pair_style gran model hurtz", "ERROR"),
    ("yade", "O.dt = 1e-5", "O.dt = undefined_name", "NameError")])
def test_a_mistake_in_a_deck_is_told_in_the_engines_words(tmp_path: Path, engine: str, old: str, new: str, word: str) -> None:
    run = plan(engine)
    deck = run.case.deck(engine)
    deck.write_text(deck.read_text().replace(old, new))
    with pytest.raises(RunError, match=word) as caught:
        simulate(run, tmp_path / "out", threading.Event())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("engine", "ranks"), [("liggghts", 1), ("liggghts", 2), ("yade", 1)])
def test_progress_comes_while_it_runs_and_cancelling_leaves_no_process(
        tmp_path: Path, engine: str, ranks: int, wait_for: Callable[..., object]) -> None:
    told, cancel, ended = [], threading.Event(), []
    run = plan(engine, steps=10**9, frames=10**5)

    def work() -> None:
        with pytest.raises(Interrupted):
            simulate(run, tmp_path / "out", cancel, Resources(ranks=ranks), lambda **facts: told.append(facts.get("step", 0)))
        ended.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        assert wait_for(lambda: not thread.is_alive() or any(told), 60) and thread.is_alive()
    finally:
        cancel.set()
        thread.join(30)
    assert ended
    left = subprocess.run(["pgrep", "-f", str(tmp_path)], capture_output=True, text=True, check=False).stdout.split()
    assert left == []


def test_compiler_flags_are_read_beside_the_build(tmp_path: Path) -> None:
    program = tmp_path / "build/engines/bin/liggghts-dembark"
    program.parent.mkdir(parents=True)
    program.touch()
    cache = "CMAKE_BUILD_TYPE:STRING=Release\nCMAKE_CXX_FLAGS:STRING=-O2 -g\nOTHER:BOOL=ON\n"
    (tmp_path / "build/engines/CMakeCache.txt").write_text(cache)
    (tmp_path / "build/bin").mkdir()
    (tmp_path / "build/bin/liggghts-dembark").symlink_to(program)
    engine = Liggghts(tmp_path / "build/bin/liggghts-dembark", "3.8.0", "")
    assert provenance.build_flags(engine) == {"CMAKE_BUILD_TYPE": "Release", "CMAKE_CXX_FLAGS": "-O2 -g"}
