"""vibro_hardening: impacts that are known are counted, weighed and placed, wrong records fail, and all engines hammer the part."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.common import vibratory_trough
from dembark.input_decks.common.bodies import read_body
from dembark.input_decks.common.part_impacts import (
    lone_impacts,
    mean_pressures,
    nearest,
    outline,
    own_modulus,
    strips,
    surface_map,
)
from dembark.input_decks.common.part_noise import Noise, octave_curves
from dembark.input_decks.common.trough import polygon, prism
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, octave_left_out, point
from dembark.input_decks.tests.synthetic_bed import PERIOD, PERIODS, trough
from dembark.input_decks.tests.test_vibro_finishing import account
from dembark.input_decks.vibro_hardening.throws import angles
from dembark.input_decks.vibro_hardening.touches import RubbedRecord, read_record
from dembark.postproc.replica import Replica
from dembark.postproc.tests.dumps import grains_text
from dembark.postproc.third_octaves import half_sine
from dembark.postproc.walls import MeshWall
from dembark.postproc.wear import removed_volume
from dembark.validation.case.deck import prepare, stl
from dembark.validation.case.folders import find, load
from dembark.validation.case.resolve import resolve

hardening = module("vibro_hardening")
STEP, STRIDE, LASTS = 1e-5, 2, 12
DEPTH, RADIUS, SPEED, SLIP = 0.005, 0.0025, 0.8, 0.3
MASS = 2500.0 * 4.0 / 3.0 * np.pi * RADIUS**3
WINDOW = round(PERIOD / STEP) * PERIODS
ASIDE = np.array([0.0, 0.02, 0.0])
SQUARE = MeshWall("part", prism(polygon(0.04, 4, (0.0, 0.0)), 2.0 * DEPTH))
SPAR = MeshWall("part", read_body(find("vibro_hardening").folder / "part.stl").triangles)


def moving() -> Any:
    """A part that moves along z at a constant speed."""
    return SimpleNamespace(displacement=lambda t: np.asarray(t)[:, None] * [0.0, 0.0, 0.1],
                           velocity=lambda t: np.ones((len(t), 1)) * [0.0, 0.0, 0.1])


def record(folder: Path, count: int = 60, lost: int = 0, part: MeshWall = SQUARE) -> RubbedRecord:
    """`count` impacts on the upper side of a part, one after the other, each of a half sine of force; grains alternate. Of `lost` impacts
    nothing was recorded."""
    top, text = part.triangles[..., 2].max(), []
    for k in range(lost, count):
        begin = (k * WINDOW // count // STRIDE + 3) * STRIDE
        for sample in range(LASTS):
            step = begin + STRIDE * sample
            phase = np.pi * (sample + 0.5) / LASTS
            push = MASS * 2.0 * SPEED / (STRIDE * STEP * np.sum(np.sin(np.pi * (np.arange(LASTS) + 0.5) / LASTS))) * np.sin(phase)
            height = top + 0.1 * step * STEP + RADIUS * (1.0 - 1e-6)
            text.append(grains_text(step, [[0.001, 0.0, height]], [RADIUS], velocities=np.array([[SLIP, 0.0, 0.1 - SPEED * np.cos(phase)]]),
                                    walls={"vessel": np.array([[-0.2 * push, 0.0, push]])}))
    folder.mkdir(exist_ok=True)
    path = folder / "touches.dump"
    path.write_text("".join(text))
    return read_record(path, moving(), part, stride=STRIDE, time_step=STEP, first=0, periods=PERIODS, period=PERIOD, depth=DEPTH)


def throws(folder: Path, *, turned: bool = False, heavier: float = 1.0) -> list[RubbedRecord]:
    """Six grains that meet the upper side of a square part at known angles, or at these from the normal; the forces are those of `heavier`
    grains."""
    top, speed, p = SQUARE.triangles[..., 2].max(), 1.0, defaults("vibro_hardening")
    angle = 0.5 * np.pi - angles(6) if turned else angles(6)
    forces, _ = lone_impacts(np.full(6, heavier * MASS), np.full(6, RADIUS), speed * np.sin(angles(6)), own_modulus(p),
                             p["restitution"])
    zero, still = np.zeros(6), SimpleNamespace(displacement=lambda t: np.zeros((len(t), 3)), velocity=lambda t: np.zeros((len(t), 3)))
    places = np.column_stack([0.0065 * (np.arange(6) - 2.5) / 2.0, zero, np.full(6, top + RADIUS * (1.0 - 1e-6))])
    folder.mkdir(exist_ok=True)
    (folder / "touches.dump").write_text("".join(
        grains_text(step, places, np.full(6, RADIUS), velocities=speed * np.column_stack([np.cos(angle), zero, sign * np.sin(angle)]),
                    walls={"vessel": np.column_stack([zero, zero, share * forces])})
        for step, sign, share in ((2, -1, 0.1), (4, -1, 1.0), (6, 1, 0.3))))
    return [read_record(folder / "touches.dump", still, SQUARE, stride=2, time_step=STEP, first=0, periods=1, period=1e-3, depth=DEPTH)]


def thrown(folder: Path, **changes: Any) -> dict[str, Any]:
    parameters = defaults("vibro_hardening", thrown_speed=1.0, grain_count=6)
    return judged("vibro_hardening", hardening.thrown(throws(folder, **changes), parameters))


def measured(folder: Path, booked: float = 1.0, lost: int = 0, *, lighter: float = 1.0, packings: int = 3,
             wet: float = 0.0) -> dict[str, Any]:
    folder.mkdir(exist_ok=True)
    run, hits = trough(folder, part=False), record(folder, lost=lost)
    rows = account(dict(run.rows), booked, wet)
    share = rows["time"] / rows["time"][-1]
    both = 60 * MASS * 2.0 * SPEED
    rows |= {"part_work": 0.0 * share, "part_jx": -0.2 * both * share, "part_jy": 0.0 * share, "part_jz": both * share}
    # As heavy as the impacts on the part are strong.
    light = replace(run, rows=rows, weight=both / (PERIODS * PERIOD))
    p = defaults("vibro_hardening")
    # Grains so soft that each alone would have the recorded peak force.
    softer = hits.peaks()[0] / hits.shadows(hits.radii, own_modulus(p), p["restitution"])[0][0]
    p["youngs_modulus"] *= softer**2.5
    replicas = []
    for packing in range(packings):
        replica = Replica(Path(), {"parameters": p})
        own = replace(hits, masses=lighter * (1.0 + 1e-4 * packing) * hits.masses)
        replica.__dict__["_read"] = {vibratory_trough.read.__wrapped__: light, hardening.part_wall.__wrapped__: SQUARE,
                                     hardening.contact_record.__wrapped__: own}
        replicas.append(replica)
    return judged("vibro_hardening", hardening.measure(replicas))


def points(along: str, *pairs: tuple[float, float], half: float = 0.02) -> list[dict[str, Any]]:
    return [point({along: place}, dict.fromkeys(("stirring", "circulation", "impact_energy"), value), part=half) for place, value in pairs]


def amplitude_study(low: float, high: float, half: float = 0.02) -> dict[str, Any]:
    found = points("motion_amplitude", (0.002, low), (0.005, 0.5 * (low + high)), (0.01, high), half=half)
    return judged("vibro_hardening", hardening.study("amplitude", found, "motion_amplitude"))


def step_study(*values: float) -> dict[str, Any]:
    found = points("time_step_fraction", *((0.11 / 2**k, value) for k, value in enumerate(values)), half=0.005)
    return judged("vibro_hardening", hardening.study("step", found, "time_step_fraction"))


def test_places_belong_to_the_nearest_piece_of_the_section() -> None:
    pieces = np.array([[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]], [[1.0, 1.0], [0.0, 1.0]]])
    np.testing.assert_array_equal(nearest(pieces, np.array([[0.5, -1.0], [2.0, 0.4], [0.2, 0.9], [1.5, 0.3]])), [0, 1, 2, 1])


def test_known_impacts_are_counted_and_weighed(tmp_path: Path) -> None:
    hits = record(tmp_path)
    assert hits.begins.sum() == 60 and hits.rate().value == pytest.approx(60 / (PERIODS * PERIOD))
    first = np.cos(0.5 * np.pi / LASTS)
    np.testing.assert_allclose(hits.energies(), 0.5 * MASS * (SPEED * first) ** 2, rtol=1e-6)
    assert hits.energy().value == pytest.approx(0.5 * MASS * (SPEED * first) ** 2)
    np.testing.assert_allclose(hits.impulse(), [-0.2 * 60 * MASS * 2.0 * SPEED, 0.0, 60 * MASS * 2.0 * SPEED], atol=1e-9)
    # Friction of 0.2 of the push, against a slip of SLIP.
    area = 4.0 * 0.04 / np.sqrt(2.0) * DEPTH
    assert hits.area == pytest.approx(area)
    assert hits.friction().value == pytest.approx(0.2 * 60 * MASS * 2.0 * SPEED * SLIP / (PERIODS * PERIOD * area), rel=1e-6)


def test_the_path_the_peak_and_the_force_of_known_impacts(tmp_path: Path) -> None:
    hits, first = record(tmp_path), np.cos(0.5 * np.pi / LASTS)
    speeds, angle = hits.paths()
    np.testing.assert_allclose(speeds, np.hypot(SPEED * first, SLIP), rtol=1e-6)
    np.testing.assert_allclose(angle, np.arctan2(SPEED * first, SLIP), rtol=1e-6)
    push = MASS * 2.0 * SPEED / (STRIDE * STEP * np.sum(np.sin(np.pi * (np.arange(LASTS) + 0.5) / LASTS)))
    np.testing.assert_allclose(hits.peaks(), push * np.sin(0.5 * np.pi * (LASTS - 1) / LASTS), rtol=1e-6)
    force = hits.normal_force()
    assert force.shape == (WINDOW // STRIDE, 3) and np.count_nonzero(force[:, 2]) == 60 * LASTS
    np.testing.assert_allclose(force.sum(axis=0) * STRIDE * STEP, [0.0, 0.0, 60 * MASS * 2.0 * SPEED], atol=1e-9)


def test_peaks_belong_to_their_impacts_when_grains_take_turns(tmp_path: Path) -> None:
    """Two grains at once, one of which comes back later and harder."""
    text, top = [], SQUARE.triangles[..., 2].max()
    for step, ids, pushes in ((2, (1, 2), (1.0, 5.0)), (4, (1, 2), (3.0, 2.0)), (8, (1,), (9.0,)), (10, (1,), (4.0,))):
        one = grains_text(step, [[0.002 * k, 0.0, top + 0.9999 * RADIUS] for k in ids], [RADIUS] * len(ids),
                          velocities=np.array([[0.0, 0.0, -1.0]] * len(ids)), walls={"vessel": np.array([[0, 0, f] for f in pushes])})
        text.append(one)
    (tmp_path / "touches.dump").write_text("".join(text))
    still = SimpleNamespace(displacement=lambda t: np.zeros((len(t), 3)), velocity=lambda t: np.zeros((len(t), 3)))
    hits = read_record(tmp_path / "touches.dump", still, SQUARE, stride=2, time_step=STEP, first=0, periods=1, period=1e-3, depth=DEPTH)
    np.testing.assert_array_equal(np.sort(hits.peaks()), [3.0, 5.0, 9.0])


def test_the_work_of_bridges_is_in_the_balance(tmp_path: Path) -> None:
    assert "energy_balance" in names(measured(tmp_path / "wet", wet=0.3), "pass")


def test_lone_impacts_of_elastic_grains_are_those_of_hertz() -> None:
    """K. L. Johnson, Contact Mechanics (1985), equations 11.23 and 11.24."""
    mass, radius, speed, modulus = 2e-4, 0.0025, 1.2, 5e10
    stiffness = 4.0 / 3.0 * modulus * np.sqrt(radius)
    depth = (1.25 * mass * speed**2 / stiffness) ** 0.4
    force, _ = lone_impacts(*np.array([[mass], [radius], [speed]]), modulus, 1.0)
    assert force[0] == pytest.approx(stiffness * depth**1.5, rel=1e-4)
    # Of the contact's area pi a^2 = pi R depth.
    assert mean_pressures(force, np.array([radius]), modulus)[0] == pytest.approx(force[0] / (np.pi * radius * depth), rel=1e-4)


@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_half_sines_of_lone_impacts_have_their_impulse(restitution: float) -> None:
    """At low frequencies the spectrum of a pulse is its impulse, m v (1 + e)."""
    force, lasts = lone_impacts(*np.array([[2e-4], [0.0025], [1.2]]), 5e10, restitution)
    assert half_sine(0.0, force, lasts)[0] == pytest.approx(2e-4 * 1.2 * (1.0 + restitution), rel=1e-12)


def box(width: float, height: float, levels: tuple[float, ...]) -> Any:
    """Triangles of the sides of a box, from each of the `levels` of y to the next."""
    corners = 0.5 * np.array([[width, -height], [width, height], [-width, height], [-width, -height]])
    sides = prism(corners, 1.0)
    return np.concatenate([sides * [1.0, high - low, 1.0] + [0.0, 0.5 * (low + high), 0.0] for low, high in pairwise(levels)])


def test_the_outline_leaves_out_cavities_and_pieces_without_length() -> None:
    outer, inner = box(0.04, 0.02, (-0.01, 0.01)), box(0.03, 0.01, (-0.01, 0.01))
    ends = [box(0.04, 0.02, (-0.01, 0.0, 0.01)), box(0.02, 0.02, (-0.01, 0.01)) + np.array([0.05, 0.0, 0.0])]
    for triangles, length in ((outer, 0.12), (np.concatenate([inner[:, ::-1], outer]), 0.12), (np.concatenate(ends), 0.2)):
        part = MeshWall("part", triangles)
        sides = np.linalg.norm(np.diff(outline(part), axis=1), axis=2)
        assert sides.sum() == pytest.approx(length) and sides.min() > 1e-3
        assert np.linalg.norm(np.diff(strips(part, DEPTH), axis=1), axis=2).min() > 1e-4


def test_the_map_has_what_the_impacts_did_where_they_were(tmp_path: Path) -> None:
    """All on the upper flange of a spar, 1 mm from its middle: none in its pockets."""
    hits = record(tmp_path, part=SPAR)
    assert hits.area == pytest.approx(0.164 * DEPTH)
    volume = removed_volume(MASS, *hits.paths(), 1e9)
    made = surface_map(SPAR, [hits, hits], [np.arange(60.0)] * 2, [volume] * 2, DEPTH)
    assert made.areas.sum() == pytest.approx(hits.area) and (strips(SPAR, 0.5 * DEPTH).shape[0],) == made.areas.shape
    middles = made.vertices[made.cells].mean(axis=1)
    (hit,) = np.flatnonzero(made.values["impacts"][0])
    assert middles[hit, 2] == pytest.approx(0.02) and abs(middles[hit, 0] - 0.001) < 0.25 * DEPTH
    assert made.values["wear"][0][hit] * made.areas[hit] * hits.window == pytest.approx(volume.sum())
    assert made.values["energy"][0][hit] * made.areas[hit] * hits.window == pytest.approx(hits.energies().sum())
    assert made.values["largest_force"][0][hit] == 59.0 and made.values["mean_force"][0][hit] == pytest.approx(29.5)


def test_octaves_of_a_record_are_those_of_its_impacts_and_of_its_length(tmp_path: Path) -> None:
    """Impacts at even times that are half sines of the recorded peak and duration; and a window that is too short for low bands."""
    hits = record(tmp_path)
    pulses = hits.peaks() / np.sin(0.5 * np.pi * (LASTS - 1) / LASTS), np.full(60, LASTS * STRIDE * STEP)
    both = Noise(hits, pulses, pulses)
    assert both.ratio == pytest.approx(1.0, abs=0.1) and abs(both.unexplained) < 1e-12
    short = replace(hits, periods=1, period=0.02)
    with np.errstate(invalid="ignore"):
        few = Noise(short, pulses, pulses)
    recorded, hard = octave_curves([few, few])
    assert 10 ** recorded["place"][0] == pytest.approx(50.1, abs=0.1) and len(hard["place"]) == 31


def test_a_thrown_grain_that_misses_fails(tmp_path: Path) -> None:
    found = judged("vibro_hardening", hardening.thrown(throws(tmp_path), defaults("vibro_hardening", thrown_speed=1.0, grain_count=7)))
    assert names(found, "fail") == {"thrown_wear", "thrown_force"}


def set_up(folder: Path | None = None, **changes: Any) -> Any:
    case = load(folder / "case.toml") if folder else find("vibro_hardening")
    return prepare(case, resolve(case, None, "spar", changes))


def with_part(folder: Path, triangles: Any) -> Path:
    """A copy of the case with another part.stl."""
    shutil.copytree(find("vibro_hardening").folder, folder / "own")
    (folder / "own/part.stl").write_bytes(stl("part", triangles))
    return folder / "own"


def test_a_part_from_a_file_is_in_the_middle_and_free_of_grains() -> None:
    made = set_up()
    low, high = made.meshes["part"].min(axis=(0, 1)), made.meshes["part"].max(axis=(0, 1))
    np.testing.assert_allclose([low, high], [[-0.012, -0.01, -0.06], [0.012, 0.01, -0.02]], atol=1e-12)
    assert made.numbers["part_reach"] == pytest.approx(np.hypot(0.012, 0.02))
    away = np.hypot(made.packing.positions[:, 0], made.packing.positions[:, 2] + 0.04) - 0.5 * made.packing.diameters
    assert away.min() > made.numbers["part_reach"]


@pytest.mark.parametrize(("change", "said"), [
    (lambda mesh: 1e3 * mesh, "part.stl is 40 m wide, it was drawn in mm, maybe"),
    (lambda mesh: 1.8 * mesh, "the trough is too narrow for the part, which reaches 0.042 m from its centre"),
    (lambda mesh: mesh[:-1], "is no closed body"),
    (lambda mesh: np.concatenate([mesh + ASIDE, mesh - ASIDE]), "the layer of grains misses part.stl")])
def test_a_part_that_cannot_be_is_refused(change: Any, said: str, tmp_path: Path) -> None:
    folder = with_part(tmp_path, change(SPAR.triangles))
    with pytest.raises(DembarkError, match=said):
        set_up(folder, trough_width=0.16)


def test_a_part_at_rest_needs_more_room_by_the_amplitude() -> None:
    set_up(trough_width=0.13)
    with pytest.raises(DembarkError, match="too narrow"):
        set_up(trough_width=0.13, part_held="at_rest")
    # Without a ramp the circle is not about the place of rest: the trough goes as far as two amplitudes.
    set_up(trough_width=0.15, part_held="at_rest")
    with pytest.raises(DembarkError, match="too narrow"):
        set_up(trough_width=0.15, part_held="at_rest", motion_ramp=0.0)


def test_a_part_may_be_longer_than_the_trough_is_wide(tmp_path: Path) -> None:
    made = set_up(with_part(tmp_path, SPAR.triangles * [1.0, 100.0, 1.0]))
    np.testing.assert_allclose(made.packing.box[1], [-1.0, 1.0])


@pytest.mark.parametrize(("low", "high", "half", "verdict"), [
    (1.0, 3.0, 0.02, "pass"), (1.0, 1.0, 0.02, "info"), (1.0, 0.8, 0.02, "fail"), (1.0, 1.2, 0.3, "info")])
def test_hardening_stirs_more_than_finishing(low: float, high: float, half: float, verdict: str) -> None:
    assert amplitude_study(low, high, half)["stirring_gain"]["verdict"] == verdict


SMALL = {"grain_count": 60, "grain_diameter": 0.01, "trough_width": 0.13, "strips": 12, "youngs_modulus": 2e7,
         "motion_amplitude": 0.005, "motion_ramp": 1, "settle_time": 0.05, "periods": 8}


@pytest.mark.parametrize(("engine", "changes"), [
    ("liggghts", {}), ("yade", {}), ("lammps", {}), ("liggghts", {"part": "file", "part_held": "at_rest", "trough_width": 0.16}),
    ("yade", {"part": "file", "trough_width": 0.14}), ("lammps", {"part": "file", "part_held": "at_rest", "trough_width": 0.16})])
def test_grains_hammer_the_part_and_nothing_is_missed(engine: str, changes: Any, simulate: Any) -> None:
    run = simulate("vibro_hardening", engine, {**SMALL, **changes})
    made = hardening.measure([run])
    found = judged("vibro_hardening", made)
    assert names(found, "pass") == {"energy_balance", "touch_balance", "octave_sum"}, found
    assert found["wear_rate"]["value"] > 0.0 and made.surface.values["wear"][0].max() > 0.0
    assert found["impact_rate"]["value"] > 10.0 and 1e-4 < found["impact_energy"]["value"] < 4.0
    assert found["friction_power"]["value"] > 0.0


def controls_vibro_hardening(folder: Path) -> Iterator[Control]:
    folder.mkdir(exist_ok=True)
    right = measured(folder / "right")
    yield Control("a hundredth of the damping that is not booked", right, measured(folder / "booked", 0.99))
    yield Control("a tenth of the touches lost", right, measured(folder / "lost", lost=6))
    yield Control("impacts of half the mass", right, measured(folder / "half", lighter=0.5))
    yield Control("impacts of half the mass", thrown(folder / "thrown"), thrown(folder / "lighter", heavier=0.5))
    yield Control("angles from the normal", thrown(folder / "thrown"), thrown(folder / "turned", turned=True))
    yield octave_left_out(lambda: measured(folder / "octaves"))
    yield Control("a bed that is calmer at 10 mm than at 2 mm", amplitude_study(1.0, 3.0), amplitude_study(1.0, 0.8))
    yield Control("impacts that grow with every halving of the step", step_study(0.01, 0.0101, 0.0102), step_study(0.01, 0.012, 0.014))
