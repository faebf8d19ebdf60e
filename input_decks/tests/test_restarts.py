"""Runs of the decks that are killed with SIGKILL and resumed: every row and frame once, and all of it the same to the byte."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dembark.common.errors import DembarkError, Killed
from dembark.common.files import check_times, count_frames, read_json
from dembark.postproc import ContactsDump, GrainsDump, read_times
from dembark.validation import engines
from dembark.validation.cases import find
from dembark.validation.runs import restarts
from dembark.validation.runs.plan import Resources, Run, series
from dembark.validation.runs.simulate import simulate

ROOT = Path(__file__).resolve().parents[1]
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


@dataclass
class Deck:
    """A deck run by hand in `folder`, with states every `restart_every` steps."""

    case: str
    engine: str
    folder: Path
    values: dict[str, Any]
    ranks: int = 1

    def start(self, resume: str = "no", ranks: int | None = None) -> subprocess.Popen[bytes]:
        try:
            engine = engines.find(self.engine)
        except DembarkError as error:
            pytest.skip(str(error))
        self.folder.mkdir(exist_ok=True)
        deck = ROOT / self.case / {"liggghts": "liggghts.in", "yade": "yade.py"}[self.engine]
        with (self.folder / "log").open("wb") as log:
            return subprocess.Popen(engine.command(deck, self.values | {"resume": resume}, ranks or self.ranks), cwd=self.folder,
                                    env=engine.environment(), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)

    def run(self, resume: str = "no", ranks: int | None = None) -> str:
        """To the end; what the engine said."""
        code = self.start(resume, ranks).wait(120)
        said = (self.folder / "log").read_text(errors="replace")
        assert code == 0 and "dembark: finished" in said, said[-2000:]
        return said

    def kill_after(self, step: int) -> int:
        """SIGKILL to a run as soon as it has a state of `step` or later; the step of its newest state."""
        process = self.start()
        while process.poll() is None and (self.newest() or -1) < step:
            time.sleep(0.005)
        process.kill()
        assert process.wait() == -signal.SIGKILL, "the run was over before it could be killed"
        found = self.newest()
        assert found is not None
        return found

    def newest(self) -> int | None:
        return restarts.newest(self.folder, self.engine)

    def written(self) -> dict[str, bytes]:
        """Output files and the states that are left, which tell all digits of all numbers."""
        names = [name for name in OUTPUTS if (self.folder / name).exists()]
        names += sorted(path.name for path in self.folder.glob("state.*.restart"))
        return {name: (self.folder / name).read_bytes() for name in names}


def both(case: str, engine: str, base: Path, values: dict[str, Any], ranks: int = 1) -> tuple[Deck, Deck, int]:
    """A run that was left alone, one that was killed, and the step of the newest state of the latter."""
    whole, broken = (Deck(case, engine, base / name, values, ranks) for name in ("whole", "broken"))
    said = whole.run()
    steps = int(re.search(r"dembark: steps (\d+)", said)[1])  # type: ignore[index]
    return whole, broken, broken.kill_after(steps // 2)


@pytest.mark.parametrize(("case", "values"), [
    ("plug_flow", PLUG | {"grain_count": 120}), ("column_collapse", COLUMN),
    ("plane_silo", {"grain_count": 120, "silo_width": 0.03, "slab_depth": 0.024, "settle_time": 0.1, "measure_time": 0.05, "frames": 3})])
def test_no_grain_falls_through_the_base_after_a_restart(case: str, values: dict[str, Any], tmp_path: Path) -> None:
    """Pairs that nearly touch are found anew whenever YADE goes on from a state, also those with a base that is larger than the period."""
    deck = Deck(case, "yade", tmp_path / "run", values | {"restart_every": 80})
    deck.run()
    radius = 0.5 * 0.005
    for frame in GrainsDump(deck.folder / "grains.dump"):
        assert frame.positions[:, 2].min() > -0.05 * 0.2 - 2 * radius


@pytest.mark.parametrize(("case", "engine", "ranks", "values"), [
    ("silo", "liggghts", 1, SILO), ("silo", "yade", 1, SILO), ("plug_flow", "liggghts", 2, PLUG),
    ("gravity_channel", "liggghts", 2, CHANNEL), ("gravity_channel", "yade", 1, CHANNEL), ("log_pile", "liggghts", 1, PILE),
    ("log_pile", "yade", 1, PILE), ("column_collapse", "liggghts", 2, COLUMN), ("column_collapse", "yade", 1, COLUMN)])
def test_killed_run_goes_on_to_the_same_bytes(case: str, engine: str, ranks: int, values: dict[str, Any], tmp_path: Path) -> None:
    whole, broken, step = both(case, engine, tmp_path, values, ranks)
    if case == "log_pile":
        # A state that was cut is passed over.
        state = broken.folder / f"state.{step}.{'restart' if engine == 'liggghts' else 'yade.gz'}"
        state.write_bytes(state.read_bytes()[:-100])
        step -= values["restart_every"]
    assert f"dembark: resumed at step {step} exactly" in broken.run("yes")
    one, other = whole.written(), broken.written()
    if case == "gravity_channel" and engine == "liggghts":
        # The list of fixes stands in another order in the file; the numbers are in the outputs.
        one, other = ({name: text for name, text in files.items() if name in OUTPUTS} for files in (one, other))
    assert one.keys() == other.keys()
    assert [name for name in one if one[name] != other[name]] == []


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_resuming_without_a_state_says_so(engine: str, tmp_path: Path) -> None:
    deck = Deck("silo", engine, tmp_path, SILO)
    assert deck.start("yes").wait(60) != 0
    said = (tmp_path / "log").read_text(errors="replace")
    assert "there is no whole state" in said and "Traceback" not in said


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_run_begun_anew_forgets_the_states_of_another(engine: str, tmp_path: Path) -> None:
    deck = Deck("log_pile", engine, tmp_path, PILE | {"duration": 0.2})
    deck.run()
    assert deck.newest() == 1800
    deck.values = PILE | {"duration": 0.1, "restart_every": 500}
    deck.run()
    assert deck.newest() == 1000


def test_other_number_of_ranks_goes_on_approximately(tmp_path: Path) -> None:
    """Forces are computed anew at the step of the state: rows and frames are complete, and the bed weighs what it weighs."""
    whole, broken, step = both("silo", "liggghts", tmp_path, SILO | {"bridge_volume": 0.0}, ranks=2)
    assert f"dembark: resumed at step {step} approximately: the state is of 2 ranks, the run has 1" in broken.run("yes", ranks=1)
    one, other = (read_times(deck.folder / "time.csv") for deck in (whole, broken))
    np.testing.assert_array_equal(one["step"], other["step"])
    for reader, name in ((GrainsDump, "grains.dump"), (ContactsDump, "contacts.dump")):
        assert [frame.step for frame in reader(whole.folder / name)] == [frame.step for frame in reader(broken.folder / name)]
    weight = 9.81 * GrainsDump(whole.folder / "grains.dump")[-1].masses.sum()
    for table in (one, other):
        assert (table["side_fz"] + table["base_fz"])[-40:].mean() == pytest.approx(weight, rel=0.05)


# --- through the harness -----------------------------------------------------------------------------------------------

def planned(engine: str) -> Run:
    values = {key: value for key, value in SILO.items() if key != "restart_every"}
    try:
        return series(find("silo"), "wet", "quick", engines.find(engine), values).runs[0]
    except DembarkError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize(("engine", "number"), [("liggghts", signal.SIGTERM), ("yade", signal.SIGKILL)])
def test_harness_resumes_what_was_ended_from_outside(engine: str, number: int, tmp_path: Path) -> None:
    one = planned(engine)
    used = Resources(restart_interval={"liggghts": 0.05, "yade": 0.5}[engine])
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
    assert len(caught) == 1 and "it goes on from step" in str(caught[0])
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
