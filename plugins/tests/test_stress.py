"""Random small scenes in all engines: grains, momentum, liquid and energy are conserved, and ranks and resumed runs agree.

`DEMBARK_STRESS=200` tries that many scenes for each engine, other ones each time; by default a few, always the same.
"""

import json
import math
import os
import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from rig import lammps_driver, liggghts_driver, stress_decks, yade_driver
from rig.energy_account import Account
from rig.liggghts_driver import Run, read_dump
from rig.stress import CONTENT, INSERTED, LAST, SIDE, STATES, Scene, all_grains, assert_physical, assert_third_law, first, record, scenes
from rig.walls import stl

COUNT = int(os.environ.get("DEMBARK_STRESS", "0"))
# A scene is small as it is: the first that fails is shown.
RANDOM = settings(max_examples=COUNT or 5, derandomize=not COUNT, deadline=None, database=None, report_multiple_bugs=False,
                  phases=(Phase.explicit, Phase.generate), suppress_health_check=list(HealthCheck))


@dataclass
class Found:
    """Frames of a run, and what it printed."""

    run: Run
    steps: np.ndarray
    frames: list[np.ndarray]


def computed(driver: ModuleType, deck: Any, folder: Path, scene: Scene, **options: Any) -> Found:
    folder.mkdir(exist_ok=True)
    (folder / "floor.stl").write_text(stl(stress_decks.FLOOR))
    done = driver.run_deck(folder, deck(scene, **options), ranks=options.get("ranks", 1))
    assert done.code == 0 and not done.error, f"{scene}: {done.error or done.output[-2000:]}"
    steps, frames = read_dump(folder / "grains.dump")
    return Found(done, steps, [frame if len(frame) else np.empty((0, frames[-1].shape[1])) for frame in frames])


def assert_conserved(scene: Scene, found: Found) -> None:
    assert len(found.frames[0]) == len(first(scene)) and len(found.frames[-1]) == len(all_grains(scene)) and found.steps[-1] == LAST, scene
    assert_physical(scene, found.steps, found.frames, SIDE)
    if scene.carried:
        held, error = np.loadtxt(found.run.folder / "books.txt")[:, 1:].T
        assert np.abs(error).max() < 1e-12 * held.max(), scene
    Account(found.run).assert_balanced()


def assert_goes_on(driver: ModuleType, deck: Any, folder: Path, scene: Scene, found: Found) -> None:
    """A run resumed from a state in the middle gives the same bytes, or says that it does not."""
    again = folder / "again"
    shutil.copytree(found.run.folder, again)
    states = sorted(again.glob("state.*.restart"), key=lambda path: int(path.name.split(".")[1]))
    assert [int(path.name.split(".")[1]) for path in states] == [(LAST - 1) // STATES * STATES - STATES, (LAST - 1) // STATES * STATES]
    done = driver.run_deck(again, deck(scene, resumed=True))
    if done.code != 0:
        assert scene.entering in INSERTED and "fix enter" in done.error, f"{scene}: {done.error or done.output[-2000:]}"
    elif "exactly" in done.output:
        assert (again / "grains.dump").read_bytes() == (found.run.folder / "grains.dump").read_bytes(), scene
    else:
        # How far LIGGGHTS looks for bridges follows from the liquid that grains have when a run begins.
        liquid_moves = scene.carried and driver is liggghts_driver
        assert "approximately" in done.output and (scene.entering in INSERTED or liquid_moves), f"{scene}: {done.output[-2000:]}"


def assert_same_on_two_ranks(one: Found, two: Found, scene: Scene) -> None:
    """Sums have another order, and chaos some hundred steps to make that larger."""
    for a, b in zip(one.frames, two.frames, strict=True):
        assert a.shape == b.shape, scene
        if len(a):
            assert np.abs(a[:, 1:4] - b[:, 1:4]).max() < 1e-7, scene


@pytest.mark.full
@RANDOM
@given(scene=scenes())
def test_lammps(lammps_is_there: None, scene: Scene) -> None:
    with tempfile.TemporaryDirectory() as name:
        one = computed(lammps_driver, stress_decks.lammps, Path(name) / "one", scene)
        assert_conserved(scene, one)
        for frame in one.frames[1:]:
            assert_third_law(scene, frame, frame[:, 12:15].sum(axis=0))
        two = computed(lammps_driver, stress_decks.lammps, Path(name) / "two", scene, ranks=2)
        assert_conserved(scene, two)
        assert_same_on_two_ranks(one, two, scene)
        if scene.resumed:
            assert_goes_on(lammps_driver, stress_decks.lammps, Path(name), scene, one)


@RANDOM
@given(scene=scenes(moving_planes=False, empty_box=False))  # stock LIGGGHTS refuses to run without a grain
def test_liggghts(liggghts_is_there: None, scene: Scene) -> None:
    with tempfile.TemporaryDirectory() as name:
        one = computed(liggghts_driver, stress_decks.liggghts, Path(name) / "one", scene)
        assert_conserved(scene, one)
        two = computed(liggghts_driver, stress_decks.liggghts, Path(name) / "two", scene, ranks=2)
        assert_conserved(scene, two)
        if scene.entering not in INSERTED:  # each rank has random numbers of its own
            assert_same_on_two_ranks(one, two, scene)
        if scene.resumed:
            assert_goes_on(liggghts_driver, stress_decks.liggghts, Path(name), scene, one)


@pytest.fixture(scope="module")
def yade_scenes(yade_is_there: None, tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Scene, dict[str, np.ndarray]]]:
    """All scenes in one start of the engine, which takes longer than a scene."""
    drawn: list[Scene] = []

    @RANDOM
    @given(scene=scenes())
    def collect(scene: Scene) -> None:
        drawn.append(replace(scene, resumed=False))

    collect()
    folder = tmp_path_factory.mktemp("yade")
    (folder / "scenes.json").write_text(json.dumps([record(scene) for scene in drawn]))
    done = yade_driver.run_script(folder, Path(__file__).parent / "rig/stress_yade.py", "scenes.json", "out.npz")
    assert "rig: finished" in done.stdout, (done.stdout + done.stderr)[-3000:]
    found: list[tuple[Scene, dict[str, np.ndarray]]] = [(scene, {}) for scene in drawn]
    with np.load(folder / "out.npz") as stored:
        for name in stored.files:
            number, table = name.split("/")
            found[int(number)][1][table] = stored[name]
    return found


def test_yade(yade_scenes: list[tuple[Scene, dict[str, np.ndarray]]]) -> None:
    for scene, found in yade_scenes:
        frames = [found[f"frame{k}"] for k in range(len(found["steps"]))]
        assert len(frames[-1]) == len(all_grains(scene)) and found["steps"][-1] == LAST, scene
        assert_physical(scene, found["steps"], frames, None)
        balance, other, scale = found["energy"]
        assert max(abs(balance), abs(other)) < 1e-12 * scale, scene
        if scene.carried:
            given_away = CONTENT * sum(4.0 / 3.0 * math.pi * grain.radius**3 for grain in all_grains(scene))
            assert found["liquid"][0] == pytest.approx(given_away, rel=1e-12), scene
