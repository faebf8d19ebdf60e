"""Grains of several sorts: each pair of sorts, and each sort and steel, collide with the coefficients of that pair in every engine."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dembark.input_decks.common.setup import of_sort
from dembark.input_decks.tests.conftest import Deck
from dembark.postproc.history import reached
from dembark.validation import engines
from dembark.validation.case.folders import find, package_root
from dembark.validation.case.resolve import resolve

# The materials are those of the mixing drum; two grains meet head on, or graze each other.
PAIRS = ("small_small", "small_large", "large_large", "small_steel", "large_steel")
SPEED = 0.01

SETUP = '''
import numpy as np
from dembark.input_decks.common.packing import Packing
from dembark.input_decks.common.setup import Setup

PAIRS = [("small", "small"), ("small", "large"), ("large", "large"), ("small", None), ("large", None)]

def setup(p):
    rows = []
    for number, (one, other) in enumerate(PAIRS):
        radius, below = (0.5 * getattr(p, f"{sort}_diameter") if sort else 0.0 for sort in (one, other))
        height = 0.02 if other else 0.0
        for x, along in ((0.02 * number, 0.0), (0.02 * number + 0.01, 0.05)):
            if other:
                rows.append((other, (x, 0.0, height), (0.0, 0.0, 0.0)))
            rows.append((one, (x, 0.0, height + radius + below + 1e-6), (along, 0.0, -0.01)))
    sorts, places, velocities = zip(*rows)
    sizes, densities = ([getattr(p, f"{sort}_{name}") for sort in sorts] for name in ("diameter", "density"))
    types = [{"small": 1, "large": 3}[sort] for sort in sorts]
    box = [(-0.01, 0.11), (-0.01, 0.01), (-0.01, 0.04)]
    return Setup(6000, 1e-7, Packing(*map(np.array, (box, places, sizes, densities, types, velocities)), type_count=3),
                 {"stride": 10, "first": 10})
'''

DECK = """# Pairs of grains, and grains and steel, collide.
{% from "grains_and_steel.in" import materials, contacts with context %}
{% set boundary, hard, watched = "f f f", true, false %}
{% include "start.in" %}
neighbor        1e-4 bin
neigh_modify    delay 0
<< materials(["small", "large"]) >>
{% if engine == "lammps" %}
region          floor plane 0 0 0 0 0 1 units box
{% endif %}
<< contacts({"small": "${small_youngs_modulus}", "large": "${large_youngs_modulus}"},
            {"floor": "primitive type 2 zplane 0" if engine == "liggghts" else "region floor type 2"}) >>
fix motion      all nve/sphere
compute kinetic all ke
{% set columns = [("kinetic_energy", "c_kinetic")] %}
{% include "history.in" %}
{% include "all_digits.in" %}
{% include "run.in" %}
"""

YADE = '''"""Pairs of grains, and grains and steel, collide."""

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
materials = dembark.sort_materials(p, ["small", "large"])
ids = dembark.grains({1: materials["small"], 3: materials["large"]})
O.bodies.append(utils.wall(0, axis=2, sense=1, material=materials["steel"]))
friction = dembark.of_sorts(p, materials, "friction")
loop = SphereContactLoop(
    [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
    [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=dembark.of_sorts(p, materials, "restitution"), staticFriction=friction,
                                                kineticFriction=friction, criticalSlipDistance=0)],
    [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding=p.presliding)],
)
writer = dembark.FrameWriter(types=dict.fromkeys(ids[3], 3))
O.engines = dembark.engine_loop(loop, [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], 1e-4, (0, 0, 0), record="writer.write()", period=p.stride)
dembark.run(p.steps, outputs=("time.csv", "grains.dump"))
'''


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A case with the parameters of the mixing drum, and a scene of its own."""
    folder = tmp_path_factory.mktemp("cases") / "pairs"
    folder.mkdir()
    for name, text in (("setup.py", SETUP), ("liggghts.in", DECK), ("lammps.in", DECK), ("yade.py", YADE)):
        (folder / name).write_text(text, encoding="utf-8")
    shutil.copy(find("mixing_drum").folder / "case.toml", folder)
    return folder


def impact(p: Any, pair: str) -> float:
    """Duration (s) of a head-on impact: m* x'' = -4/3 E* sqrt(R*) x^(3/2) - 2 sqrt(5/6) beta sqrt(S m*) x', S = 2 E* sqrt(R* x)."""
    one, other = pair.split("_")
    sorts = [of_sort(p, name) for name in (one, other) if name != "steel"]
    masses = [math.pi / 6.0 * sort.grain_density * sort.grain_diameter**3 for sort in sorts]
    radius, mass = (1.0 / sum(1.0 / value for value in values) for values in ([0.5 * sort.grain_diameter for sort in sorts], masses))
    modulus = 1.0 / sum((1.0 - getattr(p, f"{name}_poisson_ratio") ** 2) / getattr(p, f"{name}_youngs_modulus") for name in (one, other))
    log = math.log(getattr(p, f"{one if one == other else pair}_restitution"))
    beta = -log / math.hypot(log, math.pi)

    def motion(_time: float, state: Any) -> list[float]:
        depth = max(state[0], 0.0)
        damping = 2.0 * math.sqrt(5.0 / 6.0) * beta * math.sqrt(2.0 * modulus * math.sqrt(radius * depth) * mass)
        force = 4.0 / 3.0 * modulus * math.sqrt(radius) * depth**1.5 + damping * state[1]
        return [state[1], -force / mass]

    def parted(_time: float, state: Any) -> float:
        return float(state[0])

    parted.terminal, parted.direction = True, -1.0  # type: ignore[attr-defined]
    done = solve_ivp(motion, (0.0, 1.0), [0.0, SPEED], events=parted, rtol=1e-9, atol=1e-15, max_step=1e-5)
    return float(done.t_events[0][0])


@pytest.mark.parametrize("engine", find("mixing_drum").engines)
def test_each_pair_collides_with_its_own_coefficients(case: Path, engine: str, decks: type[Deck], tmp_path: Path,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DEMBARK_CASES", str(case.parent))
    one = decks("pairs", engine, tmp_path / engine, {})
    one.run()
    frames, p = list(one.replica().grains()), SimpleNamespace(**one.values)
    times = np.array([frame.step for frame in frames]) * one.setup.time_step
    places, velocities, forces = (np.array([getattr(frame, name) for frame in frames]) for name in ("positions", "velocities", "forces"))
    types, radii = frames[0].types, frames[0].radii
    assert frames[0].masses == pytest.approx(np.where(types == 1, 2500.0, 2000.0) * 4.0 / 3.0 * math.pi * radii**3)
    first = 0
    for pair in PAIRS:
        wall, name = pair.endswith("steel"), "_".join(dict.fromkeys(pair.split("_")))
        for grazing in (False, True):
            upper = first + (not wall)
            way = places[:, upper] * [0, 0, 1] if wall else places[:, upper] - places[:, first]
            distance = np.linalg.norm(way, axis=1)
            gap, normal = distance - radii[first:upper + 1].sum(), way / distance[:, None]
            if grazing:
                # Gross sliding; the median leaves out where the contact begins, and where it pulls.
                pushing = np.einsum("ij,ij->i", forces[:, upper], normal)
                sliding = np.linalg.norm(forces[:, upper] - pushing[:, None] * normal, axis=1)[pushing > 0.0]
                assert np.median(sliding / pushing[pushing > 0.0]) == pytest.approx(getattr(p, f"{name}_friction"), rel=1e-6), pair
            else:
                apart = velocities[-1, upper, 2] - (0.0 if wall else velocities[-1, first, 2])
                assert apart / SPEED == pytest.approx(getattr(p, f"{name}_restitution"), rel=0.003), pair
                begin, end = reached(times, -gap, 0.0), times[-1] - reached(times[-1] - times[::-1], -gap[::-1], 0.0)
                assert end - begin == pytest.approx(impact(p, pair), rel=0.01), pair
            first = upper + 1


def test_one_of_several_sorts_has_the_names_of_equal_grains() -> None:
    large = of_sort(SimpleNamespace(**resolve(find("mixing_drum"))), "large")
    assert (large.grain_count, large.grain_diameter, large.grain_density, large.youngs_modulus) == (8000, 0.004, 2000.0, 5e8)
    assert large.grain_diameter_spread == 0.0 and large.gravity == 9.81


SORTED = """{% from "grains_and_steel.in" import materials, contacts with context %}
<< materials(["a", "b", "c"]) >>
<< contacts({"a": "1", "b": "2", "c": "3"}, {}) >>
"""


def written(engine: str) -> list[list[str]]:
    """Words of the lines of a deck of three sorts."""
    shared = package_root() / "common"
    text = engines.engine_class(engine).deck_text(SORTED, {"presliding": engines.DeckNumber("linear")}, [shared / engine, shared])
    return [line.split() for line in text.replace("&\n", "").splitlines()]


def test_each_pair_of_three_sorts_has_numbers_of_its_own() -> None:
    """Types are a, steel, b, c."""
    expected = [["a", "a_steel", "a_b", "a_c"], ["a_steel", "steel", "b_steel", "c_steel"], ["a_b", "b_steel", "b", "b_c"],
                ["a_c", "c_steel", "b_c", "c"]]
    lines = {words[1]: words for words in written("liggghts") if words[:1] == ["fix"]}
    assert lines["youngsModulus"][5:] == ["peratomtype", "1", "${steel_youngs_modulus}", "2", "3"]
    assert lines["poissonsRatio"][6:] == [f"${{{name}_poisson_ratio}}" for name in ("a", "steel", "b", "c")]
    for name, number in (("coefficientRestitution", "restitution"), ("staticFriction", "friction"), ("kineticFriction", "friction")):
        assert lines[name][5:7] == ["peratomtypepair", "4"]
        assert lines[name][7:] == [f"${{{owner}_{number}}}" for row in expected for owner in row]
    assert lines["criticalSlipDistance"][6:] == ["4", *["0"] * 16]
    pairs = {(words[1], words[2]): words[3:] for words in written("lammps") if words[:1] == ["pair_coeff"] and "restitution" in words}
    assert pairs == {(str(i + 1), str(j + 1)): ["restitution", f"${{{expected[i][j]}_restitution}}", "static_friction",
                                                f"${{{expected[i][j]}_friction}}", "kinetic_friction", f"${{{expected[i][j]}_friction}}"]
                     for i in range(4) for j in range(i, 4)}
    moduli = [words for words in written("lammps") if "youngs_modulus" in words]
    assert [words[1:5] for words in moduli] == [["1", "1", "youngs_modulus", "1"], ["2", "2", "youngs_modulus", "${steel_youngs_modulus}"],
                                                ["3", "3", "youngs_modulus", "2"], ["4", "4", "youngs_modulus", "3"]]
