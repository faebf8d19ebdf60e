"""The drum's decks: the same logs in all engines, the balance of energy, friction and nothing else drives them, and a run that was killed
goes on as if it had not been."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.drum_resume import FILES, compare
from dembark.common.errors import DembarkError
from dembark.input_decks.common.setup import Setup
from dembark.postproc import GrainsDump, read_times
from dembark.validation import engines
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

CASE = find("debarking_drum")
ENGINES = ("liggghts", "yade", "lammps")
TINY: dict[str, Any] = {"log_count": 10, "filling": 0.2, "run_in": 0, "revolutions": 1, "drum_speed": 2.0, "time_step_fraction": 0.4,
                        "frames": 4}


def setup(**values: Any) -> Setup:
    return prepare(CASE, resolve(CASE, changes=TINY | values))


@pytest.fixture(scope="module")
def finished(simulate: Any) -> Any:
    """Folders of runs by engine and changed parameters, each done once."""
    return cache(lambda engine, **values: simulate("debarking_drum", engine, TINY | values).folder)


@pytest.mark.parametrize("engine", ENGINES)
def test_logs_are_those_that_the_case_asks_for(engine: str, finished: Any) -> None:
    prepared = setup()
    logs, radius = prepared.numbers["logs"], prepared.numbers["inner_radius"]
    assert logs == TINY["log_count"]
    frames = GrainsDump(finished(engine) / "grains.dump")
    assert len(frames) == TINY["frames"]
    frame = frames[-1]
    diameters = np.sort(2.0 * frame.radii)
    np.testing.assert_allclose(diameters, 0.10 + 0.15 * (np.arange(logs) + 0.5) / logs, rtol=1e-7)
    np.testing.assert_allclose(frame.masses, 850.0 * np.pi * frame.radii**2, rtol=1e-7)
    np.testing.assert_allclose((diameters**2).sum() / (2.0 * radius) ** 2, TINY["filling"], rtol=1e-6)
    assert (np.hypot(*frame.positions[:, [0, 2]].T) + frame.radii < 1.01 * radius).all()
    assert (frame.positions[:, 1] == 0.0).all()


@pytest.mark.parametrize("engine", ENGINES[1:])
def test_engines_go_the_same_way_until_chaos_takes_over(engine: str, finished: Any) -> None:
    """Rows with up to forty impacts; round-off grows with each of them."""
    tables = [read_times(finished(each) / "time.csv") for each in (ENGINES[0], engine)]
    early = (tables[0]["begun"] <= 40) & (tables[1]["begun"] <= 40)
    assert tables[0]["begun"][early].max() > 20
    for name in ("kinetic_energy", "potential_energy", "shell_fz", "torque", "impulse_sum", "dissipated_energy", "begun"):
        one, other = (table[name][early] for table in tables)
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-8 * np.abs(one).max(), err_msg=name)


@pytest.mark.parametrize("engine", ENGINES)
def test_energy_and_certificate(engine: str, finished: Any) -> None:
    times = read_times(finished(engine) / "time.csv")
    assert len(times["step"]) == 200
    assert times["certificate"][-1] <= 1e-10
    work = np.cumsum(times["torque"]) * TINY["drum_speed"] * np.diff(times["time"])[0]
    held = times["kinetic_energy"] + times["potential_energy"] + times["elastic_energy"] + times["dissipated_energy"]
    gap = np.abs(held - held[0] - (work - work[0]))
    assert gap.max() < 5e-3 * work[-1]
    assert times["dissipated_energy"][-1] > 0.5 * work[-1] > 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_only_friction_drives_the_logs(engine: str, finished: Any) -> None:
    times = read_times(finished(engine, shell_friction=0.0, friction=0.0) / "time.csv")
    packing, radius = setup().packing, setup().numbers["inner_radius"]
    scale = 9.81 * float((packing.densities * np.pi / 6.0 * packing.diameters**3).sum()) * radius
    assert np.abs(times["torque"]).max() < 1e-9 * scale
    assert times["kinetic_energy"][-20:].mean() < 0.05 * times["kinetic_energy"].max()
    assert times["shell_fz"][-50:].mean() == pytest.approx(scale / radius, rel=0.02)


@pytest.mark.parametrize("engine", ENGINES)
def test_radius_given_decides_how_many_logs(engine: str, finished: Any) -> None:
    given = {"drum_radius": 0.9, "filling": 0.15, "drum_speed": 20.0, "frames": 2}
    numbers = setup(**given).numbers
    assert (numbers["logs"], numbers["inner_radius"]) == (15, 0.9)
    assert len(GrainsDump(finished(engine, **given) / "grains.dump")[0].ids) == 15


@pytest.mark.full
@pytest.mark.parametrize("engine", ENGINES)
def test_killed_run_goes_on_to_the_same_end(engine: str, tmp_path: Path) -> None:
    try:
        engines.find(engine)
    except DembarkError as error:
        pytest.skip(str(error))
    found = compare(engine, TINY | {"time_step_fraction": 0.1}, 5000, tmp_path)
    assert 0 < found["went_on_from"] <= found["killed_at_step"] < found["steps"]
    assert found["same"] == dict.fromkeys(FILES, True)
    assert found["impacts"] > 100
