"""moving_walls: forces of plates and vessels with known errors are judged as they must be, and both engines have none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.input_decks.common.motion import motion
from dembark.input_decks.moving_walls.measure import Contact, heights_over_plate, landings
from dembark.input_decks.tests.measuring import Control, Verdicts, defaults, judged, module, names
from dembark.postproc.tests.packings import frame_of
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import portable, resolve

walls = module("moving_walls")
ALONG = np.array([0.3, -0.2, 0.005])


def parameters(variant: str) -> dict[str, Any]:
    return defaults("moving_walls") | dict(portable(resolve(find("moving_walls"), None, variant, {})))


def replica(variant: str, frames: list[Any], derived: dict[str, Any], step: float, rows: Any = None) -> Any:
    return SimpleNamespace(parameters=parameters(variant), derived=derived, time_step=step, grains=lambda: frames, times=lambda: rows)


def frame(places: Any, step: int, **columns: Any) -> Any:
    return replace(frame_of(places, 0.0025, step=step), **{name: np.asarray(column, float) for name, column in columns.items()})


def shaken(late: float = 0.0) -> Verdicts:
    """A held grain on a plate that comes `late` (s)."""
    run = replica("shaken", [], {}, 1e-4)
    law, wall = walls.contact(run), motion(SimpleNamespace(**run.parameters))
    frames = []
    for step in range(0, 22000, 50):
        overlap = 3e-4 + float(wall.displacement(max(0.0, 1e-4 * step - late))[2])
        force = float(law.force(np.array([overlap]), np.zeros(1))[0])
        frames.append(frame([[0.0, 0.0, law.radius - 3e-4]], step, forces=[[0.0, 0.0, force]]))
    return judged("moving_walls", walls.measure([replica("shaken", frames, {}, 1e-4)]))


def strip(arm: float = 1.0) -> Verdicts:
    """Held grains on a plate that turns, at contacts that see the velocity at `arm` times their distance from the axis."""
    p = parameters("strip")
    run = replica("strip", [], {}, 1e-5)
    law, places, times = walls.contact(run), np.array([[-0.01, 0.0, 0.0022], [0.012, 0.004, 0.0022]]), 1e-5 * np.arange(0, 2000, 50)
    height, _ = heights_over_plate(places, times, p["turning"], ALONG)
    _, speed = heights_over_plate(arm * places, times, p["turning"], ALONG)
    push = law.force(law.radius - height, speed)
    frames = [frame(places, 50 * k, forces=[[0.0, 0.0, f] for f in row]) for k, row in enumerate(push)]
    derived = {f"along_{axis}": speed for axis, speed in zip("xyz", ALONG, strict=True)}
    return judged("moving_walls", walls.measure([replica("strip", frames, derived, 1e-5)]))


def bed(missed: float = 0.0) -> Verdicts:
    """Two grains that a vessel pushes with 2 and 3 N, of whose impulse the part `missed` is not counted."""
    frames = [frame([[0, 0, 0], [0.01, 0, 0]], step, velocities=[[0, 0, 2.0 * step * 1e-5], [0, 0, 3.0 * step * 1e-5]])
              for step in (0, 500, 1000)]
    mass = frames[0].masses[0]
    impulse = mass * np.array([0.0, 0.01 * (5.0 + 2 * 9.81)]) * (1.0 - missed)
    rows = {"step": np.array([0, 1000]), "plate_jx": 0.0 * impulse, "plate_jy": 0.0 * impulse, "plate_jz": impulse}
    derived = {"gravity_x": 0.0, "gravity_y": 0.0, "gravity_z": -9.81}
    return judged("moving_walls", walls.measure([replica("rest", frames, derived, 1e-5, rows)]))


def vessels(speed: float = 0.0, push: float = 0.0) -> Verdicts:
    """Forces that differ by these parts of the largest from those at rest."""
    forces = np.sin(np.arange(30.0))
    changes = {"rest": 0.0, "speed": speed, "tilt": 0.0, "push": push}
    points = [{"parameters": {"reference_frame": frame}, "profiles": [{"name": "forces", "value": (forces + part).tolist()}]}
              for frame, part in changes.items()]
    return judged("moving_walls", walls.study("frames", points, "reference_frame"))


def bounce(phase: float = 0.0) -> Verdicts:
    """A grain that lands as on a plate whose phase is off by this (rad)."""
    p = parameters("bounce")
    run = replica("bounce", [], {}, 2e-6)
    wall = motion(SimpleNamespace(**(p | {"motion_phase": phase})))
    law = walls.contact(run)
    times = [t for t, _ in landings(5, lambda t: float(wall.displacement(t)[2]), lambda t: float(wall.velocity(t)[2]), 0.01, 9.81, law)]
    rows = {"time": 4e-5 * np.arange(1, 10001), "plate_fz": np.zeros(10000)}
    for t in times:
        rows["plate_fz"][(rows["time"] > t) & (rows["time"] < t + law.duration(0.3))] = 1.0
    return judged("moving_walls", walls.measure([replica("bounce", [], {"gap": 0.01}, 2e-6, rows)]))


def test_the_prescribed_is_found() -> None:
    for found in (shaken(), strip(), bed(), vessels(), bounce()):
        assert names(found, "pass") == set(found), found


def test_a_contact_that_hits_elastically() -> None:
    law = Contact(0.0025, 1.6e-4, 2.7e6, 1.0)
    force = law.force(np.array([1e-4, 0.0, -1e-4]), np.array([1.0, 1.0, 1.0]))
    assert force[1:].tolist() == [0.0, 0.0] and law.overlap(force[:1])[0] == pytest.approx(1e-4)


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
@pytest.mark.parametrize(("variant", "changes"), [
    ("strip", {}), ("joints", {}), ("bounce", {}), ("shaken", {"run_time": 0.3, "frames": 30})])
def test_engines_move_walls_as_prescribed(engine: str, variant: str, changes: dict[str, Any], simulate: Any) -> None:
    found = judged("moving_walls", walls.measure([simulate("moving_walls", engine, changes, variant)]))
    assert len(found) == 1 and names(found, "pass") == set(found), found


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_a_vessel_that_moves_is_one_at_rest(engine: str, simulate: Any) -> None:
    points = []
    for variant in ("rest", "speed", "push", "tilt"):
        run = simulate("moving_walls", engine, {}, variant)
        found = walls.measure([run])
        assert names(judged("moving_walls", found), "pass") == {"impulse_error"}, judged("moving_walls", found)
        points.append({"parameters": run.parameters, "profiles": found.profiles})
    found = judged("moving_walls", walls.study("frames", points, "reference_frame"))
    assert names(found, "pass") == {"speed_error", "push_error"}, found


def controls_moving_walls(_folder: Path) -> Iterator[Control]:
    yield Control("a plate that starts a step late", shaken(), shaken(late=1e-4))
    yield Control("a contact that uses the velocity of the middle of the plate", strip(), strip(arm=0.0))
    yield Control("a contact that is not counted", bed(), bed(missed=0.01))
    yield Control("a vessel whose walls do not transfer their velocity", vessels(), vessels(speed=0.1, push=0.1))
    yield Control("a plate with another phase", bounce(), bounce(phase=0.3))
