"""vibro_finishing: known motions of bed and part are measured as they are, wrong ones fail, and both engines shake the trough."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dembark.common.errors import DembarkError
from dembark.input_decks.common.momentum import BRIDGED_PARTS
from dembark.input_decks.common.part_impacts import own_modulus
from dembark.input_decks.common.setup import friction, liquid
from dembark.input_decks.common.trough import sites_within
from dembark.input_decks.common.trough import trough as trough_mesh
from dembark.input_decks.common.vibratory_trough import Trough, joined, read
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, octave_left_out, point
from dembark.input_decks.tests.synthetic_bed import trough
from dembark.input_decks.tests.synthetic_part import BALL, COUNT, DUMBBELL, MASS, PART_MASS, PART_MOMENT, RADIUS, SLIP, SPEED, SURFACE
from dembark.input_decks.tests.synthetic_part import hits as hits_on_part
from dembark.input_decks.vibro_finishing.free_body import FreeBody, free_body
from dembark.input_decks.vibro_finishing.touches import FreeRecord
from dembark.postproc.replica import Replica
from dembark.postproc.tests.packings import frame_of
from dembark.postproc.walls.mesh import cut, read_stl
from dembark.validation.case.deck import prepare, stl
from dembark.validation.case.folders import find, load
from dembark.validation.case.resolve import resolve

finishing = module("vibro_finishing")
hits_of_ball = cache(lambda lost=0: hits_on_part(BALL, lost=lost).record)
GRAIN = {"part_diameter": 0.005, "part_density": 2500.0}


def account(rows: dict[str, Any], booked: float = 1.0, wet: float = 0.0) -> dict[str, Any]:
    """Energies whose works balance, but for the part of the damping that is not `booked`; liquid does the part `wet` of it."""
    time = rows["time"]
    table = dict.fromkeys(("first_kinetic", "gravity", *BRIDGED_PARTS, "balance"), 0.0 * time)
    table |= {"walls": 2.0 * time, "normal_viscous": -1.5 * (booked - wet) * time, "liquid_viscous": -1.0 * wet * time,
              "capillary": -0.5 * wet * time, "kinetic_energy": 0.5 * time, "scale": 4.0 * time + 1.0}
    return rows | table


def with_hits(run: Trough, hits: FreeRecord) -> dict[Any, Any]:
    """What a replica has read of both."""
    return {read.__wrapped__: run, finishing.contact_record.__wrapped__: hits, finishing.part_surface.__wrapped__: SURFACE}


def of_contacts(parameters: dict[str, Any]) -> dict[str, Any]:
    """What a deck derives from parameters: coefficients of friction and whether there are bridges."""
    p = SimpleNamespace(**parameters)
    return {**friction(p), **liquid(p)}


def measured(run: Trough, booked: float = 1.0, hits: FreeRecord | None = None, *, wet: float = 0.0,
             **parameters: Any) -> dict[str, Any]:
    given = defaults("vibro_finishing", motion_frequency=12.5, **parameters)
    replica = Replica(Path(), {"parameters": given, "derived": of_contacts(given)})
    replica.__dict__["_read"] = with_hits(replace(run, rows=account(dict(run.rows), booked, wet)), hits or hits_of_ball())
    return judged("vibro_finishing", finishing.measure([replica]))


def measured_body(folder: Path, weight: float = 1.0, noise: float = 0.0) -> dict[str, Any]:
    """A bed whose last three grains are taken for the spheres of a body; `weight` times that of the bed, with `noise` of each grain."""
    run = trough(folder, noise=noise)
    given = defaults("vibro_finishing", motion_frequency=12.5, part="cylinder")
    replica = Replica(folder, {"parameters": given, "derived": {"body_spheres": 3, **of_contacts(given)}})
    replica.__dict__["_read"] = with_hits(replace(run, weight=weight * run.weight), hits_of_ball())
    return judged("vibro_finishing", finishing.measure([replica]))


def sense_study(back: float = -0.01, none: float = 0.0, fore: float = 0.01) -> dict[str, Any]:
    return judged("vibro_finishing", finishing.study("sense", points("drive_sense", (-1, back), (0, none), (1, fore)), "drive_sense"))


def step_study(*values: float) -> dict[str, Any]:
    steps = [(0.11 / 2**k, value) for k, value in enumerate(values)]
    return judged("vibro_finishing", finishing.study("step", points("time_step_fraction", *steps), "time_step_fraction"))


def points(along: str, *pairs: tuple[float, float]) -> list[dict[str, Any]]:
    return [point({along: place}, dict.fromkeys(("circulation", "spin", "revolution"), value), 2e-4) for place, value in pairs]


def test_a_bed_that_turns_as_a_body(tmp_path: Path) -> None:
    found = measured(trough(tmp_path, noise=5e-5), **GRAIN)
    assert names(found, "pass") == {"energy_balance", "momentum_balance", "likeness", "octave_sum"}
    omega = 2.0 * np.pi * 12.5
    assert found["circulation"]["value"] == pytest.approx(0.5 / omega, rel=0.05)
    assert found["revolution"]["value"] == pytest.approx(0.5 / omega, rel=0.1)
    assert found["power"]["value"] == pytest.approx(0.3)


def test_the_work_of_bridges_is_in_the_balance(tmp_path: Path) -> None:
    assert "energy_balance" in names(measured(trough(tmp_path), wet=0.3), "pass")


def test_a_large_part_is_not_taken_for_a_grain(tmp_path: Path) -> None:
    assert "likeness" not in measured(trough(tmp_path, noise=5e-5))


SMALL = {"grain_count": 60, "trough_width": 0.08, "part_diameter": 0.02, "strips": 12, "motion_ramp": 1, "settle_time": 0.1, "periods": 8}
# So much of what moves the part is recorded.
SMOOTH = {"static_friction": 0.0}


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_trough_shakes_bed_and_part_in_their_plane(engine: str, simulate: Any) -> None:
    run = simulate("vibro_finishing", engine, SMALL | SMOOTH)
    found = judged("vibro_finishing", finishing.measure([run]))
    assert {"energy_balance", "touch_balance"} <= names(found, "pass") and found["impact_rate"]["value"] > 10.0, found
    frames = list(run.grains())
    assert all((frame.positions[:, 1] == 0.0).all() and np.hypot(*frame.positions[:, [0, 2]].T).max() < 0.05 for frame in frames)
    assert frames[0].radii[-1] == pytest.approx(0.01) and len(frames[0].ids) == 61
    assert 0.001 < found["power"]["value"] < 1.5 and found["noise"]["value"] > 0.0


@pytest.mark.parametrize("shape", [BALL, DUMBBELL])
def test_impacts_on_a_part_that_falls_and_turns_are_known(shape: Any) -> None:
    record, spheres, normals = hits_on_part(shape)
    chosen = record.begins
    assert chosen.sum() == COUNT and abs(record.gap) < 0.01 and hits_on_part(shape, lost=1).record.gap > 0.05
    # Until the first sample, up to a twelfth of an impact is over.
    speeds, angle = record.paths()
    closing, slip = speeds * np.sin(angle), speeds * np.cos(angle)
    assert (closing < 1.001 * SPEED).all() and (closing > 0.87 * SPEED).all() and closing.max() > 0.99 * SPEED
    np.testing.assert_allclose(slip, SLIP, rtol=0.05)
    # Where on the part, as it was before it turned.
    places, radius = shape
    touch = places[spheres] + radius * normals
    np.testing.assert_allclose(record.points[chosen], np.column_stack([touch.imag, 0.0 * speeds, touch.real]), atol=1e-5)
    lever = np.cross(record.points[chosen], record.normals[chosen])[:, 1]
    np.testing.assert_allclose(record.masses[chosen], 1.0 / (1.0 / MASS + 1.0 / PART_MASS + lever**2 / PART_MOMENT))
    assert (np.abs(lever).max() > 0.005) == (len(places) > 1)
    reduced = 1.0 / (1.0 / RADIUS + 1.0 / radius)
    np.testing.assert_allclose(record.run_radii, reduced)
    np.testing.assert_allclose(record.radii, reduced if len(places) == 1 else RADIUS)
    # The forces are those of single grains, of which a sample may miss the peak, and the first one some speed.
    alone, _ = record.shadows(record.run_radii, own_modulus(defaults("vibro_finishing")), 0.5)
    np.testing.assert_allclose(record.peaks(), alone, rtol=0.1)


def test_momentum_balances_and_a_body_stays_rigid(tmp_path: Path) -> None:
    found = measured_body(tmp_path)
    assert names(found, "pass") == {"momentum_balance", "rigidity", "octave_sum"} and "energy_balance" not in found


def part(**changes: Any) -> FreeBody:
    return free_body(SimpleNamespace(**defaults("vibro_finishing", part_density=2500.0, **changes)))


@pytest.mark.parametrize("spacing", [0.0025, 0.004])
def test_the_cylinder_has_its_own_mass_and_moment(spacing: float) -> None:
    """Those of a prism with 48 corners, 0.29 % less than the cylinder, whatever the spheres."""
    body = part(part="cylinder", part_sphere=spacing)
    assert body.mass == pytest.approx(2500.0 * np.pi * 0.02**2 * 0.005, rel=0.003)
    assert body.moment == pytest.approx(0.5 * body.mass * 0.02**2, rel=0.003)
    assert len(body.places) * spacing**2 == pytest.approx(np.pi * 0.02**2, rel=0.05)
    assert 0.0195 < body.reach < 0.02 + 0.5 * spacing


def test_the_section_is_that_of_the_file_about_its_centre_of_mass() -> None:
    """An angle of 30 mm by 20 mm, 6 mm thick: two rectangles with known moments."""
    body = part(part="file")
    areas, centres = np.array([180.0, 84.0]), np.array([[15.0, 3.0], [3.0, 13.0]])
    middle = areas @ centres / areas.sum()
    second = (areas * (np.array([30.0**2 + 6.0**2, 6.0**2 + 14.0**2]) / 12.0 + ((centres - middle) ** 2).sum(axis=1))).sum()
    assert body.mass == pytest.approx(2500.0 * 264e-6 * 0.005, rel=1e-6)
    assert body.moment == pytest.approx(2500.0 * 0.005 * second * 1e-12, rel=1e-6)
    x, z = 1e3 * body.places.T + middle[:, None]
    assert ((x > 0.0) & (z > 0.0) & (x < 30.0) & (z < 20.0) & ((x < 6.0) | (z < 6.0))).all()


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.9])
def test_spheres_of_a_body_are_one_part(turn: float) -> None:
    """Its centre of mass, velocity and spin, however it has turned."""
    rest, centre, velocity, spin = part(part="file").places, np.array([0.01, -0.03]), np.array([0.2, -0.1]), 12.0
    arm = np.column_stack([rest[:, 0] * np.cos(turn) + rest[:, 1] * np.sin(turn), rest[:, 1] * np.cos(turn) - rest[:, 0] * np.sin(turn)])
    speed = velocity + spin * np.column_stack([arm[:, 1], -arm[:, 0]])

    def rows(plane: Any) -> Any:
        return np.insert(np.vstack([[[0.1, 0.1]], plane]), 1, 0.0, axis=1)

    frame = frame_of(rows(centre + arm), 0.001, {}, step=0, velocities=rows(speed))
    numbers = {"body_spheres": len(rest), "body_mass": 0.7} | {
        f"{which}_{axis}": value for which, row in (("first", 0), ("last", -1)) for axis, value in zip("xz", rest[row], strict=True)}
    found = joined(frame, numbers)
    assert len(found.ids) == 2 and found.masses[-1] == 0.7 and (found.positions[0] == frame.positions[0]).all()
    np.testing.assert_allclose(found.positions[-1], [centre[0], 0.0, centre[1]], atol=1e-12)
    np.testing.assert_allclose(found.velocities[-1], [velocity[0], 0.0, velocity[1]], atol=1e-12)
    assert found.omegas[-1] == pytest.approx([0.0, spin, 0.0])


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
@pytest.mark.parametrize("part", ["cylinder", "file"])
def test_the_part_is_a_body_of_spheres(part: str, engine: str, simulate: Any) -> None:
    smooth = SMOOTH if part == "file" else {}
    run = simulate("vibro_finishing", engine, {**SMALL, **smooth, "trough_width": 0.1, "part": part, "part_density": 2500.0})
    found = judged("vibro_finishing", finishing.measure([run]))
    due = {"momentum_balance", "rigidity", "octave_sum"} | ({"touch_balance"} if smooth else set())
    assert names(found, "pass") == due and "energy_balance" not in found, found
    places = np.array([frame.positions for frame in run.grains()])
    assert places.shape[1] == 60 + run.derived["body_spheres"]
    assert np.abs(places[..., 1]).max() < 1e-11 and np.hypot(places[..., 0], places[..., 2]).max() < 0.06
    assert np.abs(read(run).run.frames[0].omegas[-1, 1]) > 0.0


@pytest.mark.parametrize(("changes", "line"), [({"part": "cylinder", "part_sphere": 0.05}, "lower part_sphere"),
                                               ({"part": "file", "trough_width": 0.02}, "write the file in m")])
def test_a_body_that_is_none_is_refused(changes: dict[str, Any], line: str) -> None:
    with pytest.raises(DembarkError, match=line):
        part(**changes)


@pytest.mark.parametrize("trough", ["round", "file"])
def test_the_box_has_room_for_grains_that_part_and_side_pinch(trough: str, decks: Any, tmp_path: Path) -> None:
    """The variant `small` lost one that flew up with 5.6 times the drive's speed, and was within the sides of the trough still."""
    motion = {"round": "circular", "file": "table"}[trough]
    folder = decks("vibro_finishing", "liggghts", tmp_path, {**SMALL, "trough_width": 0.14, "trough": trough, "motion": motion}).folder
    box = [line.split() for line in (folder / "packing.data").read_text().splitlines() if line.endswith("zlo zhi")]
    sides = read_stl(folder / "trough.stl").triangles[..., 2].max()
    assert float(box[0][1]) > sides + (5.6 * 2.0 * np.pi * 19.3 * 0.002) ** 2 / (2.0 * 9.81) + 0.0055


@pytest.mark.full
def test_a_cylinder_turns_with_its_own_moment_of_inertia(simulate: Any) -> None:
    """In YADE, whose account balances with it; the others refuse it."""
    cylinder, sphere = (simulate("vibro_finishing", "yade", {**SMALL, "part_inertia": value}) for value in (0.5, 0.4))
    assert "energy_balance" in names(judged("vibro_finishing", finishing.measure([cylinder])), "pass")
    spins = [np.array([frame.omegas[-1, 1] for frame in run.grains()]) for run in (cylinder, sphere)]
    assert np.abs(spins[0] - spins[1]).max() > 0.01 * np.abs(spins[1]).max()
    for engine in ("liggghts", "lammps"):
        assert find("vibro_finishing").missing_capabilities(engine, cylinder.parameters) == ["moments of inertia other than a sphere's"]


RECORDED = {"grain_count": 60, "part_diameter": 0.02, "motion_ramp": 1, "settle_time": 0.1}


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_a_machine_as_it_was_recorded(engine: str, simulate: Any) -> None:
    """The trough is that of the file, and is where the table has it."""
    run = simulate("vibro_finishing", engine, RECORDED, "recorded")
    found = judged("vibro_finishing", finishing.measure([run]))
    assert "energy_balance" in names(found, "pass"), found
    rows, table = run.times(), np.loadtxt(run.folder / "motion.csv", delimiter=",")
    begun = run.time_step * run.derived["begin"]
    due = CubicSpline(table[:, 0], table[:, 1:], bc_type="clamped")(np.maximum(rows["time"] - begun, 0.0))
    for k, axis in enumerate("xyz"):
        assert np.abs(rows[f"motion_{axis}"] - due[:, k]).max() < 1e-8
    assert np.abs(rows["motion_x"]).max() > 1e-3
    places = np.array([frame.positions for frame in run.grains()])
    assert np.abs(places[..., 0]).max() < 0.09 and places[..., 2].min() > -0.075 and found["power"]["value"] > 0.001


def test_sites_lie_within_a_trough_of_any_shape() -> None:
    p = SimpleNamespace(grain_diameter=0.005, grain_diameter_spread=0.1, grain_count=10000)
    mesh = trough_mesh(0.2, 0.05, 24, 0.02)
    lines = cut(mesh + np.array([0.3, 0.0, -0.1]))
    # Two triangles a strip.
    assert lines.shape == (52, 2, 2)
    places = sites_within(p, lines, (0.3, -0.14, 0.02)) - np.array([0.3, 0.0, -0.1])
    x, z = places[:, 0], places[:, 2]
    assert (np.hypot(x, np.minimum(z, 0.0)) < 0.1 - 0.64 * 0.0055).all() and (z < 0.05).all()
    assert (np.hypot(x, z + 0.04) > 0.02 + 0.64 * 0.0055).all()
    # They fill it.
    area = 0.5 * np.pi * 0.1**2 + 0.2 * 0.05 - np.pi * 0.02**2
    assert len(places) * (1.15 * 0.0055) ** 2 == pytest.approx(area, rel=0.15)


@pytest.fixture
def own_machine(tmp_path: Path) -> tuple[Path, Any]:
    """A copy of the case that someone has put a trough and a motion of theirs into, and its set-up."""
    folder = tmp_path / "my_machine"
    shutil.copytree(find("vibro_finishing").folder, folder, ignore=shutil.ignore_patterns("__pycache__"))

    def sizes(**changes: Any) -> Any:
        case = load(folder / "case.toml")
        return prepare(case, resolve(case, "quick", "recorded", changes))
    return folder, sizes


def test_a_table_begins_when_grains_have_settled(own_machine: tuple[Path, Any]) -> None:
    """Its highest speed is that of the table however long they settle, and whatever separates its columns."""
    folder, sizes = own_machine
    first = sizes(settle_time=0.1).numbers["drive_speed"]
    assert sizes(settle_time=3.0).numbers["drive_speed"] == pytest.approx(first, rel=1e-3)
    table = folder / "motion.csv"
    table.write_text(table.read_text().replace(",", " "))
    assert sizes(settle_time=0.1).numbers["drive_speed"] == pytest.approx(first, rel=1e-12)
    table.write_text("0,0,0,0\n1,0,0,0\n")
    with pytest.raises(DembarkError, match=r"motion\.csv moves nothing"):
        sizes()


@pytest.mark.parametrize(("change", "line"), [
    ((1.0, (0.0, 1.0, 0.0)), "trough.stl is not cut by the plane y = 0"), ((1000.0, (0.0, 0.0, 0.0)), "write the file in m")])
def test_a_trough_of_other_places_or_units_is_refused(own_machine: tuple[Path, Any], change: Any, line: str) -> None:
    folder, sizes = own_machine
    triangles = change[0] * read_stl(folder / "trough.stl").triangles + np.array(change[1])
    (folder / "trough.stl").write_bytes(stl("trough", triangles))
    with pytest.raises(DembarkError, match=line):
        sizes()


def controls_vibro_finishing(folder: Path) -> Iterator[Control]:
    folder.mkdir(exist_ok=True)
    run = trough(folder, noise=5e-5)
    right = measured(run, **GRAIN)
    yield Control("a hundredth of the damping that is not booked", right, measured(run, 0.99, **GRAIN))
    yield Control("a body whose weight is counted for each of two spheres", measured_body(folder), measured_body(folder, weight=1.1))
    yield Control("a sphere that leaves its body", measured_body(folder), measured_body(folder, noise=5e-5))
    smooth = {"static_friction": 0.0, **GRAIN}
    yield Control("a tenth of the touches lost", measured(run, **smooth), measured(run, hits=hits_of_ball(1), **smooth))
    yield octave_left_out(lambda: measured(run, **GRAIN))
    yield Control("a part that is held", right, measured(trough(folder, noise=5e-5, still=True), **GRAIN))
    yield Control("a bed that turns the same way whatever the drive", sense_study(), sense_study(0.01, 0.01, 0.01))
    yield Control("a bed that turns faster with every halving of the step",
                  step_study(0.01, 0.0101, 0.0102), step_study(0.01, 0.012, 0.014))
