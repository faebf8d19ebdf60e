"""The decks of every case agree with its case.toml, start from the same grains in both engines, and write what readers expect."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.postproc import ContactsDump, GrainsDump, read_times
from dembark.validation import engines
from dembark.validation.checks import column_collapse
from dembark.validation.checks.run import Replica

ROOT = Path(__file__).resolve().parents[1]
WALLS = {"silo": ("side", "base"), "plane_silo": ("left", "right", "base"), "plug_flow": ("left", "right", "base"),
         "gravity_channel": ("left", "right"), "column_collapse": ("back", "base", "gate")}
# Columns of time.csv, where they are not the forces of the walls.
ENERGIES = ["first_kinetic", "gravity", "normal_elastic", "normal_viscous", "tangential_elastic", "tangential_viscous", "capillary",
            "liquid_viscous", "walls", "other", "imposed", "balance", "normal_stored", "tangential_stored", "step_error", "scale",
            "potential_energy", "weight_height"]
COLUMNS = {"column_collapse": ENERGIES}
# The cases of grains; those of logs have other columns and tests of their own.
CASES = sorted(WALLS)
# Axes along which the dumps say that the box is periodic.
PERIODIC = {"silo": [], "plane_silo": [1], "plug_flow": [1], "gravity_channel": [1, 2], "column_collapse": [1]}
# Keys for the harness alone: a deck makes one packing.
HARNESS_ONLY = {"replicas"}
# How a run is saved and resumed is no input of it.
STATES = {"restart_every": "0", "resume": "no"}
# In LIGGGHTS's input an unset key must be a number; no friction is negative.
UNSET = -1.0
TINY: dict[str, dict[str, Any]] = {
    "silo": {"grain_count": 40, "cylinder_radius": 0.018, "settle_time": 0.5, "measure_time": 0.02, "frames": 3},
    "plane_silo": {"grain_count": 40, "silo_width": 0.03, "slab_depth": 0.021, "settle_time": 0.5, "measure_time": 0.02, "frames": 3},
    "plug_flow": {"grain_count": 40, "channel_width": 0.03, "settle_time": 0.5, "run_in": 0.05, "travel": 0.05, "base_speed": 0.005,
                  "frames": 3},
    "gravity_channel": {"channel_width": 0.04, "channel_depth": 0.021, "channel_length": 0.02, "youngs_modulus": 5e6, "solid_fraction": 0.62,
                        "pack_time": 10.0, "run_in": 8.0, "measure": 0.1, "frames": 3},
    "column_collapse": {"grain_count": 60, "column_width": 0.021, "column_depth": 0.021, "settle_time": 0.15, "collapse_time": 0.15, "frames": 11},
}
CHANGES: dict[str, dict[str, Any]] = {"dry": {}, "wet": {"bridge_volume": 8e-11}, "rough": {"wall_roughness": "rough"},
                                      "viscous": {"bridge_volume": 8e-11, "liquid_viscosity": 0.01}}
VARIANTS = {"silo": ("dry", "wet"), "plane_silo": ("dry", "wet"), "plug_flow": ("dry", "wet", "rough"), "gravity_channel": ("dry", "wet"),
            "column_collapse": ("dry", "viscous")}
RUNS = [(case, engine, variant) for case in CASES for engine in ("liggghts", "yade") for variant in VARIANTS[case]]


def parameters(case: str) -> dict[str, dict[str, Any]]:
    return tomllib.loads((ROOT / case / "case.toml").read_text(encoding="utf-8"))["parameters"]


def deck_defaults(case: str) -> dict[str, str]:
    text = (ROOT / case / "liggghts.in").read_text(encoding="utf-8")
    return dict(re.findall(r"^variable\s+(\w+)\s+index\s+(\S+)\s*$", text, re.MULTILINE))


@pytest.mark.parametrize("case", CASES)
def test_liggghts_defaults_are_those_of_the_case_file(case: str) -> None:
    declared, defaults = parameters(case), deck_defaults(case)
    assert STATES.items() <= defaults.items()
    defaults = {key: text for key, text in defaults.items() if key not in STATES}
    assert defaults.keys() == declared.keys() - HARNESS_ONLY
    for key, text in defaults.items():
        wanted = declared[key].get("value", UNSET)
        assert (text if declared[key]["type"] == "choice" else float(text)) == wanted, key


@pytest.mark.parametrize("case", CASES)
def test_both_decks_use_every_key(case: str) -> None:
    for deck, pattern in (("liggghts.in", r"\$\{%s\}"), ("yade.py", r"\bp\.%s\b")):
        text = (ROOT / case / deck).read_text(encoding="utf-8")
        unused = [key for key in parameters(case).keys() - HARNESS_ONLY if not re.search(pattern % key, text)]
        assert not unused, f"{deck} ignores {unused}"


def run_by_hand(case: str, engine_name: str, folder: Path, values: dict[str, Any]) -> tuple[int, float]:
    """Run a deck the way the README says; steps and time step from its first line."""
    try:
        engine = engines.find(engine_name)
    except DembarkError as error:
        pytest.skip(str(error))
    if engine_name == "liggghts":
        given = (word for key, value in values.items() for word in ("-var", key, str(value)))
        words = [str(engine.executable), "-in", str(ROOT / case / "liggghts.in"), *given]
    else:
        words = [str(engine.executable), "-n", "-x", str(ROOT / case / "yade.py"), *(f"{key}={value}" for key, value in values.items())]
    done = engines.call(words, folder, engine.environment())
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    lines = [line.strip() for line in done.stdout.splitlines() if line.strip()]
    assert "dembark: finished" in lines
    start = next(re.fullmatch(r"dembark: steps (\d+) time_step (\S+)", line) for line in lines if line.startswith("dembark:"))
    assert start is not None
    steps = int(start.group(1))
    progress = [int(words[0]) for line in lines if (words := line.split())[0].isdigit()]
    assert progress and max(progress) <= steps
    return steps, float(start.group(2))


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Tiny runs by (case, engine, variant), each done once: (folder, steps, time step, values)."""
    done: dict[tuple[str, str, str], tuple[Path, int, float, dict[str, Any]]] = {}

    def get(case: str, engine: str, variant: str) -> tuple[Path, int, float, dict[str, Any]]:
        key = (case, engine, variant)
        if key not in done:
            folder = tmp_path_factory.mktemp("-".join(key))
            values = TINY[case] | CHANGES[variant]
            done[key] = (folder, *run_by_hand(case, engine, folder, values), values)
        return done[key]

    return get


@pytest.mark.parametrize(("case", "engine", "variant"), RUNS)
def test_outputs_have_the_common_schema(case: str, engine: str, variant: str, finished: Any) -> None:
    folder, steps, time_step, values = finished(case, engine, variant)
    grains, contacts, times = GrainsDump(folder / "grains.dump"), ContactsDump(folder / "contacts.dump"), read_times(folder / "time.csv")
    assert len(grains) == len(contacts) == values["frames"]
    assert grains[-1].step == steps
    gaps = np.diff([frame.step for frame in grains])
    assert (gaps == gaps[0]).all()
    for frame, contact in zip(grains, contacts, strict=True):
        assert frame.step == contact.step
        if "grain_count" in values:
            assert (frame.types == 1).sum() == values["grain_count"]
        assert (frame.types == 2).any() == (variant == "rough")
        assert set(frame.wall_forces) == set(WALLS[case])
        assert np.nonzero(frame.periodic)[0].tolist() == PERIODIC[case]
        assert np.isin(contact.ids, frame.ids).all()
    assert list(times)[3:] == COLUMNS.get(case, [f"{wall}_f{axis}" for wall in WALLS[case] for axis in "xyz"])
    assert len(times["step"]) >= 200
    np.testing.assert_allclose(times["time"], times["step"] * time_step, rtol=1e-8)


@pytest.mark.parametrize("case", CASES)
def test_engines_start_from_the_same_grains(case: str, finished: Any) -> None:
    tables = []
    for engine in ("liggghts", "yade"):
        folder, *_ = finished(case, engine, "dry")
        frame = GrainsDump(folder / "grains.dump")[0]
        free = frame.select(frame.types == 1)
        tables.append(np.sort(free.radii))
        np.testing.assert_allclose(free.masses, 2500.0 * 4.0 / 3.0 * np.pi * free.radii**3, rtol=1e-6)
    np.testing.assert_allclose(tables[0], tables[1], rtol=1e-7)


@pytest.mark.parametrize(("case", "engine", "variant"), [run for run in RUNS if run[0] != "column_collapse"])
def test_forces_on_each_grain_add_up(case: str, engine: str, variant: str, finished: Any) -> None:
    """Contacts, walls and gravity make up the engine's own total; liquid bridges over a gap are contacts too.

    Dashpots see the velocities at the time of the dump, half a step later than the engine's total; the grains hardly move here.
    """
    folder, *_ = finished(case, engine, variant)
    for grains, contacts in zip(GrainsDump(folder / "grains.dump"), ContactsDump(folder / "contacts.dump"), strict=True):
        total = sum(grains.wall_forces.values()) + grains.masses[:, None] * np.array([0.0, 0.0, -9.81])
        place = np.searchsorted(grains.ids, contacts.ids)
        np.add.at(total, place[:, 0], contacts.forces)
        np.add.at(total, place[:, 1], -contacts.forces)
        free = grains.types == 1
        np.testing.assert_allclose(total[free], grains.forces[free], rtol=0.0, atol=0.02 * 9.81 * grains.masses.mean())


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_other_seed_makes_another_packing(case: str, engine: str, finished: Any, tmp_path: Path) -> None:
    folder, *_, values = finished(case, engine, "dry")
    run_by_hand(case, engine, tmp_path, values | {"seed": 12345})
    one, other = (np.sort(GrainsDump(path / "grains.dump")[0].radii) for path in (folder, tmp_path))
    assert not np.allclose(one, other)


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_the_gravity_channel_holds_its_solid_fraction(engine: str, finished: Any) -> None:
    """The period follows from the volume of the grains, and what was compressed stays in the channel (and jams, at this fraction)."""
    folder, *_ = finished("gravity_channel", engine, "dry")
    for frame in GrainsDump(folder / "grains.dump"):
        volume = 4.0 / 3.0 * np.pi * np.sum(frame.radii**3)
        np.testing.assert_allclose(volume / (0.04 * 0.021 * (frame.high[2] - frame.low[2])), 0.62, rtol=1e-5)
        assert (frame.positions[:, 0] > 0.0).all() and (frame.positions[:, 0] < 0.04).all()
    times = read_times(folder / "time.csv")
    # Nothing but the walls holds the grains once gravity acts.
    packed = times["time"] < 9.0 * np.sqrt(0.005 / 9.81)
    assert np.abs((times["left_fz"] + times["right_fz"])[packed]).mean() < np.abs((times["left_fz"] + times["right_fz"])[~packed]).mean()


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
@pytest.mark.parametrize("variant", VARIANTS["column_collapse"])
def test_energies_of_a_collapse_balance(engine: str, variant: str, finished: Any) -> None:
    folder, _, time_step, values = finished("column_collapse", engine, variant)
    given = {key: table.get("value") for key, table in parameters("column_collapse").items()} | values
    found, _, _ = column_collapse.quantities([Replica(folder, {"parameters": given, "time_step": time_step, "engine": engine})])
    measured = {one.name: one.estimate.value for one in found}
    verdicts = {one.name: one.judged()[0] for one in found if one.tolerance is not None}
    assert verdicts == dict.fromkeys(("energy_balance", "potential_error", "dissipation_sign"), "pass"), measured
    # All of it happens, and the shares are all that becomes of the potential energy but for the error of the step.
    ways = ("friction_share", "normal_viscous_share", "tangential_viscous_share", *(("liquid_viscous_share",) if variant == "viscous" else ()))
    assert all(measured[name] > 0.01 for name in ways) and abs(measured["gate_share"]) > 1e-5
    assert sum(value for name, value in measured.items() if name.endswith("_share")) == pytest.approx(1.0, abs=2 * measured["step_error"])
    rows = read_times(folder / "time.csv")
    assert (rows["other"] <= 1e-13 * rows["scale"][-1]).all() and (rows["imposed"] == 0.0).all()
    assert measured["run_out"] > 0.1


@pytest.mark.parametrize("engine", ["liggghts", "yade"])
def test_viscosity_without_liquid_is_refused(engine: str, tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="liquid_viscosity"):
        run_by_hand("column_collapse", engine, tmp_path, {"liquid_viscosity": 0.01})
