"""The group `motion`: a case that includes it has walls that move, in both engines alike, and what they do in time.csv."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.common.motion import amplitude, motion
from dembark.validation.case.folders import VARIABLE, find
from dembark.validation.case.resolve import portable, resolve

CASE = """
[case]
title = "A layer on a plate that moves, with a wall"
outputs = ["times"]
groups = ["grains", "friction", "bridges", "step", "motion"]

[parameters]
grain_count = { value = 24, min = 1, doc = "number of grains" }
motion = { value = "harmonic" }
motion_amplitude = { value = 5e-4 }
motion_frequency = { value = 40.0 }
motion_ramp = { value = 1.0 }
gap = { value = 0.022, unit = "m", doc = "between the walls" }
"""
SETUP = '''
from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import motion
from dembark.input_decks.common.setup import Setup, contacts, rectangle, time_step


def setup(p):
    """Grains above a plate; all of the box moves."""
    p.seed = 1
    d = packing.largest(p)
    sites, height = packing.slab(p, p.gap, 0.03, 0.15 * d, 0.15 * d)
    grains = packing.grains(p, sites, [(-0.01, p.gap + 0.01), (0.0, 0.03), (-0.01, height + 0.02)])
    sides = {"base": ((0.0, 0.0, 0.0), (p.gap, 0.0, 0.0)), "left": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.02))}
    meshes = {name: rectangle(corner, along, (0.0, 0.03, 0.0)) for name, (corner, along) in sides.items()}
    meshes["right"] = meshes["left"] + [p.gap, 0.0, 0.0]
    moving = motion(p, start=0.05, point=(0.5 * p.gap, 0.015, 0.01))
    numbers = {"every": 100, "first": 1000, "stride": 100000}
    return Setup(7000, 2e-5, grains, {**numbers, **contacts(p)}, meshes, {"motion_words": moving.words})
'''
LIGGGHTS = """# A layer on a plate.
{% set boundary, walls, vessel, moving, still = "f p f", ["vessel"], "vessel", ["base", "left"], ["right"] %}
{% include "start.in" %}
{% include "contacts.in" %}
fix weight all gravity ${gravity} vector 0 0 -1
{% include "motion.in" %}
fix motion all nve/sphere
{% include "output.in" %}
{% include "run.in" %}
"""
YADE = '''"""A layer on a plate."""
from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, _ = dembark.begin(p, weight, along=[1])
parts = {name: dembark.mesh(name + ".stl", materials[1]) for name in ("base", "left", "right")}
walls = {"vessel": sum(parts.values(), [])}
moving = dembark.motion(p, parts, ["base", "left"], still=["right"])
record = dembark.Recorder(p, walls, boundary="ff pp ff", gravity=weight, moving=moving)
O.engines = dembark.mesh_loop(p, materials, weight, moving=moving, periodic=True)
dembark.run(p.steps)
'''


@pytest.fixture
def shaken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    folder = tmp_path / "cases" / "shaken"
    folder.mkdir(parents=True)
    for name, text in {"case.toml": CASE, "setup.py": SETUP, "liggghts.in": LIGGGHTS, "yade.py": YADE}.items():
        (folder / name).write_text(text, encoding="utf-8")
    monkeypatch.setenv(VARIABLE, str(folder.parent))
    return folder.name


def parameters(case: str, **changes: Any) -> SimpleNamespace:
    return SimpleNamespace(**portable(resolve(find(case), None, None, changes)))


def test_both_engines_move_the_same_walls_and_tell_what_they_do(shaken: str, decks: Any, tmp_path: Path) -> None:
    found = {}
    for engine in ("liggghts", "yade"):
        one = decks(shaken, engine, tmp_path / engine, {})
        one.run()
        found[engine] = one.replica().times()
        table, wall = found[engine], motion(parameters(shaken), start=0.05)
        t = table["time"]
        np.testing.assert_allclose(table["motion_z"], wall.displacement(t)[:, 2], atol=1e-9)
        np.testing.assert_allclose(table["motion_vz"], wall.velocity(t)[:, 2], atol=1e-6)
        for name in ("base", "left", "right"):
            power = table[f"{name}_fz"] * table["motion_vz"] * (name != "right")
            np.testing.assert_allclose(table[f"{name}_power"], power, atol=1e-5 * np.abs(table["base_power"]).max())
        for axis in "xyz":
            whole = sum(table[f"{name}_f{axis}"] for name in ("base", "left", "right"))
            np.testing.assert_allclose(whole, table[f"vessel_f{axis}"], atol=1e-5 * table["base_fz"].max())
        # All walls together carry the weight, but for the momentum that is left.
        packing = one.setup.packing
        weight = 9.81 * float((packing.densities * math.pi / 6.0 * packing.diameters**3).sum())
        impulse = sum(table[f"{name}_jz"][-1] for name in ("base", "left", "right"))
        assert impulse == pytest.approx(weight * t[-1], rel=0.2)
    one, other = found["liggghts"], found["yade"]
    assert list(one) == list(other)
    np.testing.assert_allclose(other["motion_z"], one["motion_z"], atol=1e-15)
    assert other["base_jz"][-1] == pytest.approx(one["base_jz"][-1], rel=0.1)


@pytest.mark.parametrize(("changes", "shape"), [
    ({"motion_gamma": 3.0, "motion_frequency": 19.3}, "harmonic"),
    ({"motion": "circular", "motion_direction": "y", "motion_sense": -1}, "circular"),
    ({"motion": "rocking", "motion_direction": "y"}, "rocking"), ({"motion": "rotation"}, "rotation"),
    ({"motion": "uniform", "motion_direction": "x", "motion_acceleration": 2.0}, "uniform"),
    ({"motion": "jolts", "motion_direction": "x", "motion_acceleration": 5.0, "motion_signs": "+--+", "motion_count": 4}, "jolts")])
def test_words_are_the_motion_of_the_parameters(shaken: str, changes: dict[str, Any], shape: str) -> None:
    p = parameters(shaken, **changes)
    wall, t = motion(p, start=0.1), np.linspace(0.1, 1.1, 3001)
    assert wall.words[0] == shape
    if shape == "harmonic":
        assert amplitude(p) * (2.0 * math.pi * 19.3) ** 2 == pytest.approx(3.0 * 9.81)
        assert np.abs(wall.acceleration(t)[1500:, 2]).max() == pytest.approx(3.0 * 9.81, rel=1e-3)
    elif shape == "circular":
        x, v = wall.displacement(t), wall.velocity(t)
        assert (np.cross(x, v)[2000:, 1] < 0.0).all()
        np.testing.assert_allclose(np.linalg.norm(x[2000:], axis=1), 5e-4)
    elif shape == "uniform":
        np.testing.assert_allclose(wall.displacement(t)[:, 0], (t - 0.1) ** 2, atol=1e-12)
    elif shape == "jolts":
        assert abs(wall.velocity(1.0)[0]) < 1e-15 and abs(wall.displacement(1.0)[0]) < 1e-15
    else:
        assert np.abs(wall.angle(t)).max() > 0.0
        assert (wall.displacement(t) == 0.0).all()


def test_no_motion_has_no_words(shaken: str) -> None:
    assert motion(parameters(shaken, motion="none"), start=0.1).words == ()


def test_a_table_is_read_from_the_folder_of_the_case(shaken: str, tmp_path: Path) -> None:
    folder, p = tmp_path / "a folder", parameters(shaken, motion="table")
    folder.mkdir()
    (folder / "motion.csv").write_text("0,0,0,0\n0.1,0,0,1e-3\n0.2,0,0,0\n", encoding="ascii")
    wall = motion(p, start=0.5, until=2.0, folder=folder)
    assert wall.words == ("table", "file", "motion.csv", "start", "0.5")
    assert wall.displacement([0.5, 0.6, 0.7])[:, 2].tolist() == pytest.approx([0.0, 1e-3, 0.0], abs=1e-18)
    (folder / "motion.csv").write_text("0,0,0,0\n0,0,0,1e-3\n", encoding="ascii")
    with pytest.raises(ValueError, match=r"a folder/motion\.csv', line 2: the times do not ascend"):
        motion(p, folder=folder)
    with pytest.raises(DembarkError, match="motion = table"):
        motion(p)


@pytest.mark.parametrize(("changes", "line"), [
    ({"motion": "uniform"}, "neither motion_speed nor motion_acceleration"), ({"motion_sense": 0}, "motion_sense must be 1 or -1"),
    ({"motion": "jolts", "motion_acceleration": 1.0, "motion_duration": 0.2, "motion_interval": 0.1}, "shorter than a pulse"),
    ({"motion_frequency": 0.0}, "motion_frequency")])
def test_wrong_parameters_are_refused_in_one_line(shaken: str, changes: dict[str, Any], line: str) -> None:
    with pytest.raises(DembarkError, match=line):
        parameters(shaken, **changes)
