"""Runs of the decks that are killed with SIGKILL and resumed: every row and frame once, and all of it the same to the byte."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError, Killed
from dembark.common.files import check_times, count_frames, read_json
from dembark.postproc import ContactsDump, GrainsDump, read_times
from dembark.validation import engines
from dembark.validation.campaigns import plan
from dembark.validation.campaigns.plan import Resources
from dembark.validation.case.folders import find
from dembark.validation.runs import restarts
from dembark.validation.runs.simulate import simulate

ALL = ("liggghts", "yade", "lammps")
OUTPUTS = ("time.csv", "grains.dump", "contacts.dump", "impacts.txt")
SILO = {"grain_count": 120, "cylinder_radius": 0.018, "settle_time": 0.15, "measure_time": 0.05, "frames": 5, "bridge_volume": 8e-11,
        "restart_every": 700}
# The plate is a mesh that has begun to move when the run is killed.
PLUG = {"grain_count": 40, "channel_width": 0.03, "settle_time": 0.1, "run_in": 0.5, "travel": 0.5, "base_speed": 0.05, "frames": 4,
        "restart_every": 700}
# The box shrinks before the flow begins, so that another grid of processors would suit it.
CHANNEL = {"channel_width": 0.04, "channel_depth": 0.021, "channel_length": 0.02, "youngs_modulus": 5e6, "solid_fraction": 0.62,
           "pack_time": 4.0, "run_in": 1.0, "measure": 1.0, "frames": 3, "start_speed": 1.0, "restart_every": 500}
PILE = {"time_step": 1e-4, "log_count": 9, "width": 0.9, "duration": 0.4, "friction": 0.3, "stake_friction": 0.2, "restart_every": 900}

# Killed while the gate moves: sums of all works, wet and dry, are in the state.
COLUMN = {"grain_count": 60, "column_width": 0.021, "column_depth": 0.021, "settle_time": 0.1, "collapse_time": 0.1, "frames": 11,
          "bridge_volume": 8e-11, "liquid_viscosity": 0.01, "restart_every": 700}

# Killed while the side walls make way, or just after: rolling springs and walls that move are in the state.
BED = {"plate_width": 0.15, "outlet_width": 0.03, "fill_height": 0.03, "confinement": 0.34, "settle_time": 0.12, "discharge_time": 0.12,
       "restart_every": 200}

# Killed under load: the integrals of the stresses that are lacking, and the sums of a row, are in the state.
SPECIMEN = {"grain_count": 100, "inertial_number": 0.01, "strain": 0.1, "frames": 11, "restart_every": 333}

# Killed when the water is at the cubes. Densities of dynamic boundary particles, contacts of agglomerates and the steps of the filter of
# density are in the state.
CUBES = {"spacing": 0.0375, "column_length": 0.4125, "column_height": 0.3, "distance": 0.15, "downstream_length": 0.6,
         "flume_height": 0.525, "flume_width": 0.2625, "run_time": 0.3, "frames": 3, "rows": 20, "slit_pressure": 0.0, "courant": 0.36,
         "contacts": "spheres", "edge_spheres": 7, "coupling": "potential", "boundary": "dynamic", "kernel": "cubic_spline", "delta": 0.0,
         "xsph": 0.5, "shepard": 30, "restart_every": 70}


@dataclass
class Run:
    """A deck that is run with the words `restart_every` of its values, on `ranks` processes."""

    deck: Any
    every: int
    ranks: int = 1

    @property
    def folder(self) -> Path:
        return self.deck.folder

    def go(self, ranks: int | None = None, **words: Any) -> str:
        """To the end; what the engine said."""
        return self.deck.run(ranks or self.ranks, restart_every=self.every, **words)

    def kill_after(self, step: int) -> int:
        """SIGKILL to a run as soon as it has a state of `step` or later; the step of its newest state."""
        process = self.deck.start(self.ranks, restart_every=self.every)
        while process.poll() is None and (self.newest() or -1) < step:
            time.sleep(0.005)
        process.kill()
        assert process.wait() == -signal.SIGKILL, "the run was over before it could be killed"
        found = self.newest()
        assert found is not None
        return found

    def newest(self) -> int | None:
        return restarts.newest(self.folder, self.deck.engine.name)

    def written(self) -> dict[str, bytes]:
        """Output files and the states that are left, which hold all digits of all numbers."""
        names = [name for name in OUTPUTS if (self.folder / name).exists()]
        names += sorted(path.name for path in self.folder.glob("state.*.restart"))
        return {name: (self.folder / name).read_bytes() for name in names}


@pytest.fixture
def prepared(decks: Any, tmp_path: Path) -> Callable[..., Run]:
    """Makes the run of a case in a folder of `tmp_path`."""

    def make(case: str, engine: str, values: dict[str, Any], folder: str = "run", ranks: int = 1) -> Run:
        given = {key: value for key, value in values.items() if key != "restart_every"}
        return Run(decks(case, engine, tmp_path / folder, given), values["restart_every"], ranks)

    return make


@pytest.fixture
def both(prepared: Any) -> Callable[..., tuple[Run, Run, int]]:
    """Makes a run that was left alone, one that was killed, and the step of the newest state of the latter."""

    def make(case: str, engine: str, values: dict[str, Any], ranks: int = 1) -> tuple[Run, Run, int]:
        whole, broken = (prepared(case, engine, values, name, ranks) for name in ("whole", "broken"))
        whole.go()
        return whole, broken, broken.kill_after(whole.deck.setup.steps // 2)

    return make


@pytest.mark.full
@pytest.mark.parametrize(("case", "values"), [
    ("plug_flow", PLUG | {"grain_count": 120}), ("column_collapse", COLUMN),
    ("plane_silo", {"grain_count": 120, "silo_width": 0.03, "slab_depth": 0.024, "settle_time": 0.1, "measure_time": 0.05, "frames": 3})])
def test_no_grain_falls_through_the_base_after_a_restart(case: str, values: dict[str, Any], prepared: Any) -> None:
    """Pairs that nearly touch are found anew whenever YADE goes on from a state, also those with a base that is larger than the period."""
    run = prepared(case, "yade", values | {"restart_every": 80})
    run.go()
    radius = 0.5 * 0.005
    for frame in GrainsDump(run.folder / "grains.dump"):
        assert frame.positions[:, 2].min() > -0.05 * 0.2 - 2 * radius


@pytest.mark.parametrize(("case", "engine", "ranks", "values"), [
    ("column_collapse", "liggghts", 2, COLUMN), ("column_collapse", "yade", 1, COLUMN), ("log_pile", "lammps", 1, PILE),
    *(pytest.param(*one, marks=pytest.mark.full) for one in [
        ("silo", "liggghts", 1, SILO), ("silo", "yade", 1, SILO), ("plug_flow", "liggghts", 2, PLUG),
        ("gravity_channel", "liggghts", 2, CHANNEL), ("gravity_channel", "yade", 1, CHANNEL), ("log_pile", "liggghts", 1, PILE),
        ("log_pile", "yade", 1, PILE), ("angle_of_repose", "liggghts", 1, BED), ("angle_of_repose", "yade", 1, BED),
        ("silo", "lammps", 2, SILO), ("plug_flow", "lammps", 1, PLUG), ("gravity_channel", "lammps", 1, CHANNEL),
        ("column_collapse", "lammps", 1, COLUMN), ("dam_break_cubes", "liggghts", 2, CUBES), ("dam_break_cubes", "yade", 1, CUBES),
        ("triaxial", "yade", 1, SPECIMEN)])])
def test_killed_run_goes_on_to_the_same_bytes(case: str, engine: str, ranks: int, values: dict[str, Any], both: Any) -> None:
    whole, broken, step = both(case, engine, values, ranks)
    if case == "log_pile":
        # A state that was cut is passed over.
        state = broken.folder / f"state.{step}.{'yade.gz' if engine == 'yade' else 'restart'}"
        state.write_bytes(state.read_bytes()[:-100])
        step -= values["restart_every"]
    assert f"dembark: resumed at step {step} exactly" in broken.go(resume="yes")
    one, other = whole.written(), broken.written()
    if case in ("gravity_channel", "dam_break_cubes") and engine == "liggghts":
        # The list of fixes stands in another order in the file, or losses of a fluid differ in their last bit; the outputs have the rest.
        one, other = ({name: text for name, text in files.items() if name in OUTPUTS} for files in (one, other))
    assert one.keys() == other.keys()
    assert [name for name in one if one[name] != other[name]] == []


@pytest.mark.parametrize(("case", "variant", "values", "engine"), [
    pytest.param(*one, engine, marks=pytest.mark.full if engine == "yade" else ())
    for *one, engines_of_it in (
        ("single_contact", "test_8_b", {"points": 3, "time_step": 1e-5, "restart_every": 70}, ALL),
        ("liquid_exchange", None, {"duration": 0.2, "rows": 200, "restart_every": 700}, ALL[:2]),
        # While the force on the cylinder still grows.
        ("water_tank", "cylinder", {"across": 8, "run_time": 0.45, "restart_every": 300}, ALL[:2]),
        ("water_tank", "drifting", {"across": 8, "restart_every": 60}, ALL[:2]))
    for engine in engines_of_it])
def test_finished_run_is_resumed_from_its_last_state_to_the_same_files(case: str, variant: str | None, values: dict[str, Any], engine: str,
                                                                      decks: Any, tmp_path: Path) -> None:
    given = {key: value for key, value in values.items() if key != "restart_every"}
    whole, resumed = (Run(decks(case, engine, tmp_path / name, given, variant), values["restart_every"]) for name in ("whole", "resumed"))
    for run in (whole, resumed):
        run.go()
    assert "dembark: resumed at step" in resumed.go(resume="yes")
    assert whole.written() == resumed.written()


@pytest.mark.parametrize("engine", ALL)
@pytest.mark.parametrize(("case", "values"), [
    ("silo", SILO), pytest.param("debarking_drum", {"log_count": 10, "filling": 0.2, "run_in": 0, "revolutions": 1, "restart_every": 700},
                                 marks=pytest.mark.full)])
def test_resuming_without_a_state_says_so(case: str, values: dict[str, Any], engine: str, prepared: Any) -> None:
    deck = prepared(case, engine, values).deck
    assert deck.start(resume="yes").wait(60) != 0
    said = deck.said()
    assert "there is no whole state" in said and "Traceback" not in said


@pytest.mark.parametrize("engine", ["liggghts", pytest.param("yade", marks=pytest.mark.full)])
def test_run_begun_anew_leaves_the_states_of_another(engine: str, prepared: Any) -> None:
    values = PILE | {"duration": 0.1, "restart_every": 500}
    prepared("log_pile", engine, values).go()
    again = prepared("log_pile", engine, values)
    states = {path.name: path.read_bytes() for path in again.folder.glob("state.*")}
    assert again.deck.start(restart_every=500).wait(60) != 0
    assert "there is a state of an earlier run, state.1000" in again.deck.said() and "Traceback" not in again.deck.said()
    assert {path.name: path.read_bytes() for path in again.folder.glob("state.*")} == states


def test_other_number_of_ranks_goes_on_approximately(both: Any) -> None:
    """Forces are computed anew at the step of the state: rows and frames are complete, and the bed weighs what it weighs."""
    whole, broken, step = both("silo", "liggghts", SILO | {"bridge_volume": 0.0}, ranks=2)
    assert f"dembark: resumed at step {step} approximately: the state is of 2 ranks, the run has 1" in broken.go(ranks=1, resume="yes")
    one, other = (read_times(run.folder / "time.csv") for run in (whole, broken))
    np.testing.assert_array_equal(one["step"], other["step"])
    for reader, name in ((GrainsDump, "grains.dump"), (ContactsDump, "contacts.dump")):
        assert [frame.step for frame in reader(whole.folder / name)] == [frame.step for frame in reader(broken.folder / name)]
    weight = 9.81 * GrainsDump(whole.folder / "grains.dump")[-1].masses.sum()
    for table in (one, other):
        assert (table["side_fz"] + table["base_fz"])[-40:].mean() == pytest.approx(weight, rel=0.05)


# --- through the harness -----------------------------------------------------------------------------------------------

def planned(engine: str) -> plan.Run:
    values = {key: value for key, value in SILO.items() if key != "restart_every"}
    try:
        return plan.series(find("silo"), "wet", "quick", engines.find(engine), values).runs[0]
    except DembarkError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize(("engine", "number"), [
    pytest.param("liggghts", signal.SIGTERM, marks=pytest.mark.full), pytest.param("yade", signal.SIGKILL, marks=pytest.mark.full),
    ("lammps", signal.SIGKILL)])
def test_harness_resumes_what_was_ended_from_outside(engine: str, number: int, tmp_path: Path) -> None:
    one = planned(engine)
    used = Resources(restart_interval={"liggghts": 0.05, "yade": 0.5, "lammps": 0.05}[engine])
    caught: list[Exception] = []

    def attempt() -> None:
        try:
            simulate(one, tmp_path, threading.Event(), used)
        except Killed as error:
            caught.append(error)

    thread = threading.Thread(target=attempt)
    thread.start()
    work = restarts.work_folder(one, tmp_path / "replica-1")
    while thread.is_alive() and restarts.newest(work, engine) is None:
        time.sleep(0.01)
    os.kill(engine_in(work), number)
    thread.join(60)
    assert len(caught) == 1 and "it continues from step" in str(caught[0])
    assert simulate(one, tmp_path, threading.Event(), used)
    folder = tmp_path / "replica-1"
    record = read_json(folder / "run.json")
    assert record and record["attempts"] == 2 and record["resume"] == "exact" and len(record["resumed_at"]) == 1
    assert count_frames(folder / "grains.dump", "ATOMS") == SILO["frames"]
    assert check_times(folder / "time.csv") > 900
    assert not list(folder.glob("state*")) and not work.exists()


def engine_in(folder: Path) -> int:
    """Process that works in `folder`."""
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "cwd").resolve(strict=True) == folder and "setpriv" not in (process / "cmdline").read_text():
                return int(process.name)
        except OSError:
            continue
    raise AssertionError(f"no engine works in {folder}")
