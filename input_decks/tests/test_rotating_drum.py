"""rotating_drum: flows that are known are measured as they are, wrong ones fail, and engines turn the drum alike."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dembark.input_decks.rotating_drum import side_view
from dembark.input_decks.rotating_drum.drum_profile import read
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names
from dembark.validation.case import deck
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

CASE = find("rotating_drum")
drum = module("rotating_drum")
FLOW = {"surface_speed", "zero_crossing", "layer_depth"}


def flow(angle: float = 27.0, surface: float = -0.03, turn: float = -0.066, speed: float = 0.345, carried: float = 1.0,
         power: float = 1.0, variant: str = "alizadeh", ring: bool = False) -> Any:
    """A run whose grains fill a segment, on a lattice that is shifted from frame to frame: they turn with the drum (times `carried`) below
    `turn`, and above it their speed falls to -`speed` at the `surface`, linearly or as a `power` of the height; of `alizadeh`, in drums of
    other sizes and speeds in proportion. `ring`: all turn with the drum, at the wall."""
    given = defaults("rotating_drum") | CASE.variants.get(variant, {"solid_filling": 0.2}) | {"frames": 12}
    random, radius, omega = np.random.default_rng(3), given["drum_radius"], given["drum_speed"]
    size = radius / 0.12
    surface, turn, speed = surface * size, turn * size, speed * size * omega / 1.2147
    t = np.radians(angle)
    along, normal = np.array([np.cos(t), np.sin(t)]), np.array([-np.sin(t), np.cos(t)])

    def frame(_: int) -> Any:
        lattice = np.linspace(-radius, radius, 160)
        place = np.stack(np.meshgrid(lattice, lattice), axis=-1).reshape(-1, 2) + random.uniform(-0.001, 0.001, 2) * size
        n = place @ normal
        place = place[(np.hypot(*place.T) < radius - 0.0015 * size) & (np.hypot(*place.T) > 0.09 * size if ring else n < surface)]
        n, s = place @ normal, place @ along
        back = np.clip((n - turn) / (surface - turn), 0.0, 1.0) ** power
        turning = ring | (n < turn)
        velocity = np.where(turning, -carried * omega * n, -omega * turn * (1.0 - back) - speed * back)[:, None] * along
        velocity += np.where(turning, carried * omega * s, 0.0)[:, None] * normal
        zero, ones = np.zeros(len(place)), np.ones(len(place))
        one = SimpleNamespace(positions=np.column_stack([place, zero]), velocities=np.column_stack([velocity, zero]),
                              radii=0.0015 * size * ones, types=ones)
        one.select = lambda kept: one if kept.all() else None
        return one

    frames = [frame(k) for k in range(given["frames"])]
    return SimpleNamespace(parameters=given, record={"variant": "any"}, grains=lambda: frames)


def verdicts(**changes: Any) -> dict[str, Any]:
    return judged("rotating_drum", drum.measure([flow(**changes)]))


def test_the_tracked_profile_says_what_it_is_quoted_for() -> None:
    found = drum.data()
    assert found["surface_speed"].value == pytest.approx(0.33, abs=0.01)
    assert found["zero_crossing"].value == pytest.approx(-0.0595, abs=0.0005)
    assert found["layer_depth"].value == pytest.approx(0.030, abs=0.001)
    # Of a layer whose speed falls linearly, 2/3.
    assert found["layer_shape"].value == pytest.approx(0.65, abs=0.005) and found["layer_shape"].half < 0.02


def test_the_tracked_layer_does_not_return_what_the_drum_carries_up() -> None:
    """The error of closure is in the uncertainty of the data: any of them changed by it alone would close the balance."""
    returned, carried = drum.fluxes()
    assert returned == pytest.approx(5.53e-3, rel=0.01) and carried == pytest.approx(6.60e-3, rel=0.01)
    found = drum.data()
    for name in ("surface_speed", "layer_depth"):
        assert found[name].half >= (carried / returned - 1.0) * found[name].value
    edge = found["zero_crossing"].value - found["zero_crossing"].half
    assert 0.5 * 1.2147 * (0.12**2 - edge**2) <= returned


def test_a_known_flow_is_measured_as_it_is() -> None:
    found = verdicts()
    assert found["surface_angle"]["value"] == pytest.approx(27.0, abs=0.3)
    up = 1.2147 * 0.066
    assert found["zero_crossing"]["value"] == pytest.approx(-0.066 + 0.036 * up / (up + 0.345), abs=6e-4)
    assert found["layer_shape"]["value"] == pytest.approx(2.0 / 3.0, abs=0.01)
    assert found["solid_body"]["value"] == pytest.approx(1.0, abs=0.01)
    assert {"layer_shape", "solid_body"} <= names(found, "pass")
    # What the data cannot decide is shown with its reason.
    assert all(found[name]["verdict"] == "info" and "conserve mass" in found[name]["reason"] for name in FLOW)


def test_of_other_drums_no_flow_is_judged() -> None:
    assert "layer_shape" not in names(verdicts(variant="other"), "pass") | names(verdicts(variant="other"), "fail")


def test_no_angle_is_judged_while_the_length_of_the_drum_is_unknown() -> None:
    found = verdicts(angle=26.1, variant="sunday_smooth")["repose_angle"]
    assert found["reference"] == 26.1 and found["verdict"] == "info" and "length" in found["reason"]


def test_the_drum_of_the_other_code_is_known_by_its_parameters() -> None:
    rows = drum.other_code()
    for variant in CASE.variants:
        given = defaults("rotating_drum") | CASE.variants[variant]
        assert drum.of_other_code(given) == (pytest.approx(rows[variant], nan_ok=True) if variant in rows else None)
    given = defaults("rotating_drum") | CASE.variants["sunday_smooth"]
    for change in ({"drum_speed": 1.0}, {"gravity": 1.62}, {"rolling_resistance": "constant_torque", "rolling_friction": 0.02},
                   {"drum_radius": 0.04}, {"grain_friction": 0.3}):
        assert drum.of_other_code(given | change) is None


def study(name: str, along: str, values: list[float], speeds: list[float]) -> dict[str, Any]:
    points = [{"parameters": defaults("rotating_drum", **{along: value}), "variant": "alizadeh" if speed == 0.345 else "other",
               "quantities": list(verdicts(speed=speed).values())}
              for value, speed in zip(values, speeds, strict=True)]
    return judged("rotating_drum", drum.study(name, points, along))


def test_the_study_adds_what_friction_makes_of_it() -> None:
    found = study("friction", "grain_friction", [0.27, 0.3, 0.33], [0.36, 0.345, 0.33])
    assert 0.005 < 0.5 * np.diff(found["surface_speed"]["interval"])[0] < 0.03
    assert "U_input = 0.01" in found["surface_speed"]["detail"] and "U_num = 0" in found["surface_speed"]["detail"]


SMALL = {"drum_radius": 0.03, "drum_speed": 4.0, "solid_filling": 0.15, "run_in": 0.25, "measure_time": 0.05, "frames": 10}


@pytest.mark.parametrize("engine", find("rotating_drum").engines)
def test_grains_go_up_with_the_lining_and_back_along_the_surface(engine: str, simulate: Any) -> None:
    one = simulate("rotating_drum", engine, SMALL)
    found = read(one)
    every = np.ones(len(found.solid), bool)
    assert 20.0 < found.surface_angle(every) < 50.0 and found.solid_body(every) > 0.8
    last = list(one.grains())[-1]
    glued = last.select(last.types == 2)
    np.testing.assert_allclose(np.hypot(*glued.positions[:, :2].T), 0.0315, rtol=1e-6)
    np.testing.assert_allclose(glued.velocities, np.cross([0.0, 0.0, 4.0], glued.positions), atol=2e-3 * 4.0 * 0.0315)


@pytest.mark.parametrize("engine", find("rotating_drum").engines)
def test_a_smooth_wall_holds_the_grains_and_drags_them_the_same_way(engine: str, simulate: Any) -> None:
    one = simulate("rotating_drum", engine, SMALL | {"wall_lining": "smooth", "run_in": 0.1})
    last = list(one.grains())[-1]
    off = 0.03 - last.radii - np.hypot(*last.positions[:, :2].T)
    assert off.min() > -0.05 * 0.003
    low = (off < 0.1 * 0.003) & (last.positions[:, 1] < -0.02)
    assert low.sum() > 20 and last.velocities[low, 0].mean() > 0.01


@pytest.mark.parametrize("engine", find("rotating_drum").engines)
def test_end_walls_hold_the_grains_and_drag_them_with_the_drum(engine: str, simulate: Any) -> None:
    one = simulate("rotating_drum", engine, SMALL | {"ends": "walls"})
    aligned = []
    for frame in one.grains():
        grains = frame.select(frame.types == 1)
        z, radii, force = grains.positions[:, 2], grains.radii, grains.wall_forces["ends"]
        assert (z - radii).min() > -1e-4 and (z + radii).max() < 0.012 + 1e-4
        touching = np.abs(force[:, 2]) > 0.0
        np.testing.assert_allclose(touching, np.minimum(z, 0.012 - z) < radii, atol=1e-9)
        # The velocity of the wall at the contact less that of the grain.
        arm = np.column_stack([np.zeros((len(z), 2)), np.where(z < 0.006, -radii, radii)])
        slip = np.cross([0.0, 0.0, 4.0], grains.positions) - grains.velocities - np.cross(grains.omegas, arm)
        slides = touching & (np.hypot(*slip[:, :2].T) > 0.01)
        pull = (force[:, :2] * slip[:, :2]).sum(axis=1) / np.hypot(*force[:, :2].T).clip(1e-300) / np.hypot(*slip[:, :2].T).clip(1e-300)
        aligned += list(pull[slides])
    assert len(aligned) > 20 and np.median(aligned) > 0.95


@pytest.mark.parametrize("variant", [SMALL | {"wall_lining": "grains"}, SMALL | {"ends": "walls"}, "alizadeh", "smooth", "sunday_smooth",
                                     "sunday_005_slice", "sunday_005_long", "sunday_15", "cellulose_15"], ids=str)
def test_all_grains_have_room_and_no_two_touch(variant: str | dict[str, Any]) -> None:
    """Nor one of them and the lining."""
    values = resolve(CASE, "standard", variant, {}) if isinstance(variant, str) else resolve(CASE, None, None, variant)
    packed = deck.prepare(CASE, values).packing
    assert packed is not None
    moving = packed.types == 1
    period, ended = values["drum_depth"], values["ends"] == "walls"
    drum_volume = np.pi * values["drum_radius"] ** 2 * period
    assert np.pi / 6.0 * (packed.diameters[moving] ** 3).sum() == pytest.approx(values["solid_filling"] * drum_volume, rel=0.01)
    images = np.vstack([packed.positions + np.array([0.0, 0.0, shift]) for shift in ([0.0] if ended else [0.0, period, -period])])
    far = cKDTree(images).query(packed.positions, 2)[0][:, 1]
    largest = values["grain_diameter"] * (1.0 + values["grain_diameter_spread"])
    assert far[moving].min() >= 1.005 * largest and far.min() >= values["grain_diameter"]
    shell = values["drum_radius"] - 0.5 * packed.diameters - np.hypot(*packed.positions[:, :2].T)
    assert shell[moving].min() > 0.0
    ends = np.minimum(packed.positions[:, 2], period - packed.positions[:, 2]) - 0.5 * packed.diameters
    assert not ended or ends[moving].min() > 0.0


def seen(turned: float = 0.0, bent: float = 1.0, higher: float = 0.0, rpm: float = 15.0) -> dict[str, Any]:
    """What is judged of grains below the photographed surface, which is `turned` (degrees), `bent` so many times as much about its middle
    line, and `higher` (m)."""
    _, surface = drum.seen(rpm * np.pi / 30.0)
    x, y = surface[:, 0], surface[:, 1]
    line = np.polyval(np.polyfit(x[np.abs(x) < 0.0084], y[np.abs(x) < 0.0084], 1), x)
    y = line + bent * (y - line) + np.tan(np.radians(turned)) * x / np.cos(np.radians(40.9)) ** 2 + higher
    random = np.random.default_rng(4)

    def frame(_: int) -> Any:
        place = np.stack(np.meshgrid(*[np.arange(-0.042, 0.042, 3e-4)] * 2), axis=-1).reshape(-1, 2) + random.uniform(-3e-4, 3e-4, 2)
        slope = np.polyfit(x, y, 1)
        inside = np.where(np.abs(place[:, 0]) < x.max(), np.interp(place[:, 0], x, y), np.polyval(slope, place[:, 0]))
        place = place[(place[:, 1] < inside - 2e-4) & (np.hypot(*place.T) < 0.0417)]
        one = SimpleNamespace(positions=np.column_stack([place, np.zeros(len(place))]), radii=np.full(len(place), 3e-4),
                              types=np.ones(len(place)))
        one.select = lambda kept: one
        return one

    frames = [frame(k) for k in range(16)]
    given = {"drum_radius": 0.042, "drum_speed": rpm * np.pi / 30.0}
    return judged("rotating_drum", drum.along_the_axis([SimpleNamespace(parameters=given, grains=lambda: frames)]))


@pytest.mark.parametrize("rpm", [10.0, 15.0])
def test_the_photographed_surface_is_measured_as_it_is(rpm: float) -> None:
    found = seen(rpm=rpm)
    assert abs(found["side_angle"]["deviation"]) < 0.4 and abs(found["side_bend"]["deviation"]) < 1.0
    assert found["side_distance"]["value"] < 1e-3 and abs(found["side_dark"]["deviation"]) < 0.006
    assert names(found, "pass") == {"side_angle", "side_bend", "side_distance"}
    # A fuller drum is seen as such, by what sets the filling.
    fuller = seen(higher=0.004, rpm=rpm)
    assert fuller["side_dark"]["deviation"] > 0.03 and names(fuller, "fail") == {"side_distance"}


def test_of_a_speed_that_was_not_photographed_nothing_is_judged() -> None:
    found = drum.seen(30.0 * np.pi / 30.0)
    assert found is None


def test_a_shadow_is_that_of_its_discs() -> None:
    at = np.linspace(-0.95, 0.95, 20)
    found = side_view.shadow(np.array([[0.0, 0.5]]), np.array([0.25]), at, 0.1)
    assert (found == (np.hypot(at[:, None], at - 0.5) <= 0.25)).all()


def controls_rotating_drum(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("a layer that slides as a plug", right, verdicts(power=0.2))
    yield Control("a wall that slips", right, verdicts(carried=0.85))
    yield Control("grains that vanish at the toe", verdicts(speed=0.41, variant="other"), verdicts(speed=0.25, variant="other"))
    right = verdicts(angle=26.1, variant="sunday_smooth")
    yield Control("grains carried over the top at a low speed", right, verdicts(ring=True, variant="sunday_smooth"))
    right = seen()
    yield Control("a surface that is turned by 8°", right, seen(turned=-8.0))
    yield Control("a straight surface", right, seen(bent=0.0))
    yield Control("grains that fall back at a high speed", verdicts(ring=True, variant="sunday_15"), verdicts(variant="sunday_15"))
