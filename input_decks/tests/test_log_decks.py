"""The decks of log_pair, log_cradle and log_pile start alike in all engines, do the same and write what readers expect."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest

from dembark.common.files import check_impacts, check_times, count_frames
from dembark.input_decks.common.log_run import LogRun, read

CASES = ("log_pair", "log_cradle", "log_pile")
ENGINES = ("liggghts", "yade", "lammps")
TINY: dict[str, dict[str, Any]] = {
    "log_pair": {"time_step": 1e-5},
    "off_centre": {"time_step": 1e-5, "offset": 0.1, "mass_2": 80.0, "radius_2": 0.14, "velocity_2": -0.5, "theta": 0.75, "damping": 50.0,
                   "contact_damping": 500.0},
    "wall": {"time_step": 1e-5, "target": "wall", "velocity_1": 2.0, "stiffness_2": 5e7},
    "log_cradle": {"time_step": 1e-5, "log_count": 3, "gap": 1e-4},
    "log_pile": {"time_step": 1e-4, "log_count": 9, "width": 0.9, "duration": 0.4, "friction": 0.3, "stake_friction": 0.2},
}
CASE_OF = {name: name if name in CASES else "log_pair" for name in TINY}


@pytest.fixture(scope="module")
def finished(decks: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Tiny runs by (scene, engine), each done once: (the deck that was run, what the logs did)."""
    @cache
    def get(scene: str, engine: str) -> tuple[Any, LogRun]:
        one = decks(CASE_OF[scene], engine, tmp_path_factory.mktemp(f"{scene}-{engine}"), TINY[scene])
        said = re.search(r"dembark: steps (\d+) time_step (\S+)", one.run())
        assert said and int(said[1]) == one.setup.steps and float(said[2]) == TINY[scene]["time_step"]
        return one, read(one.replica())

    return get


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scene", TINY)
def test_files_are_whole_and_belong_together(scene: str, engine: str, finished: Any) -> None:
    one, run = finished(scene, engine)
    folder, frames = one.folder, one.values["frames"]
    assert count_frames(folder / "grains.dump", "ATOMS") == count_frames(folder / "contacts.dump", "ENTRIES") == frames
    assert check_times(folder / "time.csv") == frames - 1 >= 200
    assert check_impacts(folder / "impacts.txt") == len(run.impacts) > 0
    assert run.times[0] == 0.0 and run.history["step"][-1] == one.setup.steps
    np.testing.assert_allclose(run.history["kinetic_energy"], run.kinetic[1:], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scene", TINY)
def test_forces_on_each_log_add_up(scene: str, engine: str, finished: Any) -> None:
    """Contacts, walls and weight, counted contact by contact, make up the engine's own total."""
    run = finished(scene, engine)[1]
    for frame, touch in enumerate(run.touches):
        total = np.zeros_like(run.forces[frame])
        total[:, 1] -= run.masses * run.parameters.get("gravity", 0.0)
        on_first = touch.normals * touch.forces[:, None] + touch.friction
        np.add.at(total, touch.ids[:, 0] - 1, on_first)
        pairs = touch.ids[:, 1] > 0
        np.add.at(total, touch.ids[pairs, 1] - 1, -on_first[pairs])
        # The damping of the bodies is no force of a contact.
        loose = run.parameters.get("damping", 0.0) * np.linalg.norm(run.velocities[frame], axis=1).max()
        np.testing.assert_allclose(total, run.forces[frame], rtol=0.0, atol=1e-9 * max(1.0, np.abs(run.forces).max()) + 1.5 * loose)


@pytest.mark.parametrize("engine", ENGINES[1:])
@pytest.mark.parametrize("scene", TINY)
def test_engines_do_the_same(scene: str, engine: str, finished: Any) -> None:
    one, other = (finished(scene, each)[1] for each in (ENGINES[0], engine))
    np.testing.assert_array_equal(one.masses, other.masses)
    np.testing.assert_array_equal(one.radii, other.radii)
    speed = np.abs(one.velocities).max()
    # A pile makes ever more of its round-off; the first impacts are what has to be the same.
    until = len(one.times) if scene != "log_pile" else np.searchsorted(one.times, np.sort(one.impacts[:, 2])[:10][-1])
    np.testing.assert_allclose(one.positions[:until], other.positions[:until], rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(one.velocities[:until], other.velocities[:until], rtol=0.0, atol=1e-9 * speed)
    np.testing.assert_allclose(one.spins[:until], other.spins[:until], rtol=0.0, atol=1e-9 * max(1.0, np.abs(one.spins).max()))
    if scene != "log_pile":
        np.testing.assert_allclose(one.impacts, other.impacts, rtol=2e-8, atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_logs_start_as_the_case_says(engine: str, finished: Any) -> None:
    head_on, aside = finished("log_pair", engine)[1], finished("off_centre", engine)[1]
    p = aside.parameters
    for run in (head_on, aside):
        q = run.parameters
        np.testing.assert_allclose(run.velocities[0, :, 0], [q["velocity_1"], q["velocity_2"]])
        apart = run.positions[0, 1] - run.positions[0, 0] - (q["velocity_1"] - q["velocity_2"]) * q["lead_time"] * np.array([1.0, 0.0, 0.0])
        np.testing.assert_allclose(np.linalg.norm(apart), q["radius_1"] + q["radius_2"], rtol=1e-12)
    np.testing.assert_allclose(aside.positions[0, 0, 1] - aside.positions[0, 1, 1], p["offset"])
    pile = finished("log_pile", engine)[1]
    assert np.ptp(pile.radii) > 0.0 and not pile.velocities[0].any()
    np.testing.assert_allclose(pile.masses, 800.0 * np.pi * pile.radii**2 * 2.0, rtol=1e-12)
    apart = np.linalg.norm(pile.positions[0, :, None] - pile.positions[0, None, :], axis=2) + 10.0 * np.eye(9)
    assert (apart > pile.radii[:, None] + pile.radii[None, :]).all()
