"""The decks of every case of grains start from the same grains in all engines, and write what readers expect."""

from __future__ import annotations

import re
import shutil
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dembark.postproc import ContactsDump, GrainsDump, read_times
from dembark.postproc.replica import Replica
from dembark.validation.case.deck import derived, prepare, write
from dembark.validation.case.folders import discover, find
from dembark.validation.case.resolve import resolve
from dembark.validation.engines import names
from dembark.validation.judge import measurement, verdict

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
TINY: dict[str, dict[str, Any]] = {
    "silo": {"grain_count": 40, "cylinder_radius": 0.018, "settle_time": 0.5, "measure_time": 0.02, "frames": 3},
    "plane_silo": {"grain_count": 40, "silo_width": 0.03, "slab_depth": 0.021, "settle_time": 0.5, "measure_time": 0.02, "frames": 3},
    "plug_flow": {"grain_count": 40, "channel_width": 0.03, "settle_time": 0.5, "run_in": 0.05, "travel": 0.05, "base_speed": 0.005,
                  # Weak dashpots, for the sum of forces on each grain below.
                  "restitution": 0.9, "frames": 3},
    "gravity_channel": {"channel_width": 0.04, "channel_depth": 0.021, "channel_length": 0.02, "youngs_modulus": 5e6,
                        "solid_fraction": 0.62, "pack_time": 10.0, "run_in": 8.0, "measure": 0.1, "frames": 3},
    "column_collapse": {"grain_count": 60, "column_width": 0.021, "column_depth": 0.021, "settle_time": 0.15, "collapse_time": 0.15,
                        "frames": 11},
}
CHANGES: dict[str, dict[str, Any]] = {"dry": {}, "wet": {"bridge_volume": 8e-11}, "rough": {"wall_roughness": "rough"},
                                      "viscous": {"bridge_volume": 8e-11, "liquid_viscosity": 0.01}}
VARIANTS = {"silo": ("dry", "wet"), "plane_silo": ("dry", "wet"), "plug_flow": ("dry", "wet", "rough"), "gravity_channel": ("dry", "wet"),
            "column_collapse": ("dry", "viscous")}
# One wet silo, one rough channel and one collapse are run by default, and all of them in all engines with --full.
QUICK = {("silo", "liggghts", "wet"), ("plug_flow", "yade", "rough"), ("column_collapse", "lammps", "viscous")}


def marked(*run: str) -> Any:
    """A run that only --full includes, unless it is one of QUICK."""
    return pytest.param(*run, marks=() if run in QUICK else pytest.mark.full)


RUNS = [marked(case, engine, variant) for case in CASES for engine in find(case).engines for variant in VARIANTS[case]]
ENGINES = [(case, engine) for case in CASES for engine in find(case).engines]


@pytest.fixture(scope="module")
def finished(decks: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Tiny runs by (case, engine, variant), each done once: the deck that was run."""
    @cache
    def get(case: str, engine: str, variant: str) -> Any:
        one = decks(case, engine, tmp_path_factory.mktemp(f"{case}-{engine}-{variant}"), TINY[case] | CHANGES[variant])
        lines = [line.strip() for line in one.run().splitlines() if line.strip()]
        start = next(re.fullmatch(r"dembark: steps (\d+) time_step (\S+)", line) for line in lines if line.startswith("dembark:"))
        assert start is not None
        assert int(start.group(1)) == one.setup.steps and float(start.group(2)) == pytest.approx(one.setup.time_step, rel=1e-12)
        progress = [int(words[0]) for line in lines if (words := line.split())[0].isdigit()]
        assert progress and max(progress) <= one.setup.steps
        return one

    return get


@pytest.mark.parametrize(("case", "engine", "variant"), RUNS)
def test_outputs_have_the_common_schema(case: str, engine: str, variant: str, finished: Any) -> None:
    run = finished(case, engine, variant)
    folder, values = run.folder, run.values
    grains, contacts, times = GrainsDump(folder / "grains.dump"), ContactsDump(folder / "contacts.dump"), read_times(folder / "time.csv")
    assert len(grains) == len(contacts) == values["frames"]
    assert grains[-1].step == run.setup.steps
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
    np.testing.assert_allclose(times["time"], times["step"] * run.setup.time_step, rtol=1e-8)


@pytest.mark.full
@pytest.mark.parametrize("case", CASES)
def test_engines_start_from_the_same_grains(case: str, finished: Any) -> None:
    tables = []
    for engine in find(case).engines:
        frame = GrainsDump(finished(case, engine, "dry").folder / "grains.dump")[0]
        free = frame.select(frame.types == 1)
        tables.append(np.sort(free.radii))
        np.testing.assert_allclose(free.masses, 2500.0 * 4.0 / 3.0 * np.pi * free.radii**3, rtol=1e-6)
    for table in tables[1:]:
        np.testing.assert_allclose(tables[0], table, rtol=1e-7)


@pytest.mark.parametrize(("case", "engine", "variant"), [run for run in RUNS if run.values[0] != "column_collapse"])
def test_forces_on_each_grain_add_up(case: str, engine: str, variant: str, finished: Any) -> None:
    """Contacts, walls and gravity make up the engine's own total; liquid bridges over a gap are contacts too. Dashpots see the velocities
    at the time of the dump, half a step later than the engine's total; the grains hardly move here."""
    folder = finished(case, engine, variant).folder
    for grains, contacts in zip(GrainsDump(folder / "grains.dump"), ContactsDump(folder / "contacts.dump"), strict=True):
        total = sum(grains.wall_forces.values()) + grains.masses[:, None] * np.array([0.0, 0.0, -9.81])
        place = np.searchsorted(grains.ids, contacts.ids)
        np.add.at(total, place[:, 0], contacts.forces)
        np.add.at(total, place[:, 1], -contacts.forces)
        free = grains.types == 1
        np.testing.assert_allclose(total[free], grains.forces[free], rtol=0.0, atol=0.02 * 9.81 * grains.masses.mean())


@pytest.mark.parametrize(("case", "engine"), ENGINES)
def test_other_seed_makes_another_packing(case: str, engine: str, decks: Any, tmp_path: Path) -> None:
    one, other = (decks(case, engine, tmp_path, TINY[case] | {"seed": seed}).setup.packing for seed in (1, 12345))
    assert not np.allclose(np.sort(one.diameters), np.sort(other.diameters))


@pytest.mark.full
@pytest.mark.parametrize("engine", find("gravity_channel").engines)
def test_the_gravity_channel_holds_its_solid_fraction(engine: str, finished: Any) -> None:
    """The period follows from the volume of the grains, and what was compressed stays in the channel (and jams, at this fraction)."""
    folder = finished("gravity_channel", engine, "dry").folder
    for frame in GrainsDump(folder / "grains.dump"):
        volume = 4.0 / 3.0 * np.pi * np.sum(frame.radii**3)
        np.testing.assert_allclose(volume / (0.04 * 0.021 * (frame.high[2] - frame.low[2])), 0.62, rtol=1e-5)
        assert (frame.positions[:, 0] > 0.0).all() and (frame.positions[:, 0] < 0.04).all()
    times = read_times(folder / "time.csv")
    # Nothing but the walls holds the grains once gravity acts.
    packed = times["time"] < 9.0 * np.sqrt(0.005 / 9.81)
    assert np.abs((times["left_fz"] + times["right_fz"])[packed]).mean() < np.abs((times["left_fz"] + times["right_fz"])[~packed]).mean()


@pytest.mark.parametrize(("engine", "variant"), [
    pytest.param(*one, marks=marked("column_collapse", *one).marks)
    for one in product(find("column_collapse").engines, VARIANTS["column_collapse"])])
def test_energies_of_a_collapse_balance(engine: str, variant: str, finished: Any) -> None:
    run = finished("column_collapse", engine, variant)
    case = find("column_collapse")
    record = {"parameters": run.values, "time_step": run.setup.time_step, "engine": engine, "derived": derived(prepare(case, run.values))}
    found = verdict.quantities(case, measurement.measure(case, [Replica(run.folder, record)]))
    measured = {one.name: one.value for one in found}
    verdicts = {one.name: one.verdict for one in found if one.tolerance is not None}
    assert verdicts == dict.fromkeys(("energy_balance", "potential_error", "dissipation_sign"), "pass"), measured
    # All of it happens, and the shares are all that becomes of the potential energy but for the error of the step.
    ways = ["friction_share", "normal_viscous_share", "tangential_viscous_share"] + ["liquid_viscous_share"] * (variant == "viscous")
    assert all(measured[name] > 0.01 for name in ways) and abs(measured["gate_share"]) > 1e-5
    assert sum(value for name, value in measured.items() if name.endswith("_share")) == pytest.approx(1.0, abs=2 * measured["step_error"])
    rows = read_times(run.folder / "time.csv")
    assert (rows["other"] <= 1e-13 * rows["scale"][-1]).all() and (rows["imposed"] == 0.0).all()
    assert measured["run_out"] > 0.1


@pytest.mark.parametrize(("case", "engine"), [
    pytest.param(path.parent.name, path.stem, marks=() if path.parent.name == "silo" else pytest.mark.full)
    for path in sorted(Path(__file__).parents[1].glob("*/*.in")) if path.stem in names()])
def test_a_template_that_is_run_as_it_is_says_what_to_do(case: str, engine: str, decks: Any, tmp_path: Path) -> None:
    """The engine shows the first command that it does not know."""
    one = decks("single_contact", engine, tmp_path, {})
    shutil.copyfile(find(case).deck(engine), tmp_path / one.engine.facts.deck)
    assert one.start().wait(60) != 0
    assert f"This is a template. Write the deck with: dembark deck {case} --engine {engine}" in one.said()


@pytest.mark.parametrize("engine", find("single_contact").engines)
def test_a_parameter_changed_on_the_command_line_is_refused(engine: str, decks: Any, tmp_path: Path) -> None:
    """Other numbers of the deck were computed from it; some parameters stand in no command."""
    one = decks("single_contact", engine, tmp_path, {})
    assert one.start(restitution=0.3).wait(60) != 0
    assert "finished" not in one.said() and ("restitution" in one.said() or "different style" in one.said()), one.said()


HELD = {"liggghts": "setforce NULL 0.0 NULL", "lammps": "setforce NULL 0.0 NULL", "yade": "dembark.block(ids[1]"}


@pytest.mark.parametrize("case", sorted(set(discover()) - {"debarking_drum", "oblique_impact", "penetration", "single_contact"}))
def test_layers_of_spheres_are_held_in_their_plane(case: str, tmp_path: Path) -> None:
    """Beds whose grains have one y; those left out have logs, a deep bed, or grains that meet once."""
    one = find(case)
    for variant in one.variants:
        values = resolve(one, "quick", variant)
        if values.get("part_inertia", 0.4) != 0.4:  # for one engine only
            continue
        packed = prepare(one, values).packing
        if packed is None or len(packed.diameters) < 50 or np.ptp(packed.positions[:, 1]) > 0.0 or np.ptp(packed.positions[:, 2]) == 0.0:
            continue
        for engine in (name for name in HELD if one.deck(name).is_file()):
            folder = tmp_path / f"{variant}-{engine}"
            folder.mkdir()
            write(one, engine, values, folder)
            assert HELD[engine] in (folder / one.deck(engine).name).read_text(encoding="utf-8"), (variant, engine)


@pytest.mark.parametrize("case", ["gravity_channel", "debarking_drum", "silo", "single_contact", "liquid_exchange"])
def test_the_number_of_particles_is_that_of_the_packing(case: str) -> None:
    one = find(case)
    for variant in one.variants:
        values = resolve(one, "quick", variant)
        packed = prepare(one, values).packing
        assert packed is not None
        assert one.particle_count(values) == len(packed.diameters), variant
