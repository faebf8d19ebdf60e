"""triaxial: states that are known are measured as they are, wrong ones fail; lattices of the real decks fail as the theory has it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.common.setup import friction as common_friction
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.validation.case.deck import derived, prepare
from dembark.validation.case.folders import find
from dembark.validation.case.resolve import resolve

triaxial = module("triaxial")
D, CELLS, START, ROWS, EVERY = 0.001, (4, 4, 3), 500, 400, 10
LATTICE: dict[str, Any] = {"arrangement": "fcc", "grain_diameter_spread": 0.0, "static_friction": 0.3, "strain": 0.012}


def lattice_contacts(sides: Any, force: float) -> Any:
    """Contacts of a face-centred cubic lattice, each pair once, which push with one `force` (N)."""
    ways = np.array([(1, 0, 0), (0, 1, 0), (0.5, 0.5, 0.5), (-0.5, 0.5, 0.5), (0.5, -0.5, 0.5), (-0.5, -0.5, 0.5)])
    branch = np.tile(ways * (np.asarray(sides) / CELLS), (2 * math.prod(CELLS), 1))
    forces = -force * branch / np.linalg.norm(branch, axis=1)[:, None]
    return SimpleNamespace(branch=branch, forces=forces, ids=np.zeros((len(branch), 2), int))


def compressed(*, friction: float = 0.3, stiffness: float = 1.0, cohesion: float = 0.0, held: float = 1.0, lost: float = 0.0,
               ratio: float = 0.8, **changes: Any) -> Any:
    """A run whose stress ratio rises to a steady state. A lattice (`arrangement`) begins with `stiffness` times its affine modulus and ends
    where contacts with this `friction` slide; grains in disorder end at q/p = `ratio` under `cohesion` (Pa). The stress across is `held`
    times what it should be; `lost`: share of the stress that the contacts of the frames lack."""
    p = defaults("triaxial", **changes)
    fcc = p["arrangement"] == "fcc"
    across, strain = held * p["confining_stress"], p["strain"]
    sides = np.array(CELLS) * D * [1.0, 1.0, math.sqrt(2.0)]
    force = p["confining_stress"] * D**2 / math.sqrt(8.0)
    cell = float(np.prod(sides))
    affine = triaxial.youngs_modulus(triaxial.affine_stiffness(lattice_contacts(sides, force), p, cell))
    # Slowly at first, as the decks have it.
    axial = strain * np.linspace(0.0, 1.0, ROWS) ** 2
    strains = np.column_stack([-0.4 * axial, -0.4 * axial, axial])
    shapes = sides * np.exp(-strains)
    if fcc:
        top = across * np.array([triaxial.sliding_ratio(one / CELLS, friction) for one in shapes])
    else:
        top = np.full(ROWS, across * (3.0 + 2.0 * ratio) / (3.0 - ratio) + cohesion)
    middle = 0.5 * (axial + np.append(0.0, axial[:-1]))
    along = np.minimum(p["confining_stress"] + stiffness * affine * middle, top)
    steps = START + EVERY * np.arange(ROWS)
    times = {"step": steps, **{f"size_{axis}": shapes[:, k] for k, axis in enumerate("xyz")},
             "stress_x": np.full(ROWS, across), "stress_y": np.full(ROWS, across), "stress_z": along}
    frames = []
    for row in range(0, ROWS, 19):
        here = lattice_contacts(shapes[row], force)
        mean = -(here.forces * here.branch).sum() / 3.0 / float(np.prod(shapes[row]))
        wanted = (2.0 * across + along[row]) / 3.0 if row else p["confining_stress"]
        here.forces *= (1.0 - lost * (row > 0)) * wanted / mean
        grains = SimpleNamespace(step=steps[row], low=np.zeros(3), high=shapes[row], ids=np.arange(96), radii=np.full(96, 0.5 * D))
        frames.append((grains, here))
    return SimpleNamespace(parameters=p, time_step=1e-5, times=lambda: times, grains=lambda: [one for one, _ in frames],
                           paired_frames=lambda: iter(frames),
                           derived={"start_step": START, **common_friction(SimpleNamespace(**p)),
                                    **dict(zip(("cells_x", "cells_y", "cells_z"), CELLS, strict=True))})


def verdicts(**changes: Any) -> dict[str, dict[str, Any]]:
    return judged("triaxial", triaxial.measure([compressed(**changes)]))


def of_stresses(cohesion: float, bridge_volume: float = 0.0) -> dict[str, dict[str, Any]]:
    """The study of runs with a friction of q/p = 0.8 and this cohesion over the mean stress across."""
    stresses = np.array([500.0, 2000.0, 8000.0])
    along = 2.0 * stresses + cohesion * stresses.mean()
    ratios = 3.0 * (along - stresses) / (along + 2.0 * stresses)
    return judged("triaxial", triaxial.study("confinement", [
        point({"confining_stress": stress, "bridge_volume": bridge_volume}, {"last_ratio": ratio}, half=1e-4)
        for stress, ratio in zip(stresses, ratios, strict=True)],
        "confining_stress"))


def controls_triaxial(_: Path) -> Iterator[Control]:
    lattice = verdicts(**LATTICE)
    yield Control("a fiftieth of the friction of the lattice lost", lattice, verdicts(**LATTICE, friction=0.294))
    yield Control("contacts of the lattice a tenth softer", lattice, verdicts(**LATTICE, stiffness=0.9))
    yield Control("contacts four times as stiff", verdicts(stiffness=0.7), verdicts(stiffness=2.8))
    yield Control("cohesion of a twentieth of the stress", of_stresses(0.0), of_stresses(0.05))
    yield Control("stress across that is not held", verdicts(), verdicts(held=1.02))
    yield Control("a fiftieth of the contacts lost", verdicts(), verdicts(lost=0.02))


def test_a_known_state_is_found() -> None:
    found = verdicts(ratio=0.75)
    assert found["last_ratio"]["value"] == pytest.approx(0.75) and found["peak_ratio"]["value"] == pytest.approx(0.75)
    # sin φ = (N − 1)/(N + 1), N = (3 + 2 M)/(3 − M) = 2.
    assert found["last_angle"]["value"] == pytest.approx(math.degrees(math.asin(1.0 / 3.0)))
    assert found["stress_across"]["value"] == pytest.approx(0.5)
    assert found["volume_change"]["value"] == pytest.approx(0.2 * 0.25)
    assert found["solid_fraction"]["value"] == pytest.approx(math.pi / math.sqrt(18.0))
    assert found["coordination"]["value"] == pytest.approx(12.0)
    assert "lattice_ratio" not in found and found["modulus_over_affine"]["reason"] == "grains in disorder"


def test_the_line_of_mohr_and_coulomb_is_found() -> None:
    found = of_stresses(0.1)
    assert found["cohesion_ratio"]["value"] == pytest.approx(0.1, abs=1e-6)
    assert found["mohr_angle"]["value"] == pytest.approx(math.degrees(math.asin(1.0 / 3.0)), abs=1e-6)


def test_a_lattice_fails_at_the_published_ratio() -> None:
    cube = np.array([1.0, 1.0, math.sqrt(2.0)])
    for friction in (0.0, 0.25, 0.3):
        assert triaxial.sliding_ratio(cube, friction) == pytest.approx(2.0 * (1.0 + friction) / (1.0 - friction))
    assert triaxial.sliding_ratio(cube * [1.01, 1.01, 0.99], 0.3) < triaxial.sliding_ratio(cube, 0.3)


def test_the_stiffness_of_a_lattice_is_that_of_its_springs() -> None:
    """Of a cubic lattice with springs k along its edges of length d the moduli are k/d, and no stress acts across."""
    p = defaults("triaxial", poisson_ratio=0.0)
    # Each contact once, in a cell of d³: one along each axis.
    contacts = SimpleNamespace(branch=D * np.eye(3), forces=-np.eye(3) * 1e-4)
    found = triaxial.affine_stiffness(contacts, p, D**3)
    # Hertz: k_n = 1.5 F / overlap, F = 4/3 E* √(d/4) overlap^(3/2).
    overlap = (0.75e-4 / (0.5 * p["youngs_modulus"] * math.sqrt(0.25 * D))) ** (2.0 / 3.0)
    np.testing.assert_allclose(found, np.eye(3) * 1.5e-4 / overlap / D, rtol=1e-6, atol=1e-3)
    assert triaxial.youngs_modulus(found) == pytest.approx(1.5e-4 / overlap / D)


def test_what_holds_for_dry_grains_with_friction_is_not_asked_of_others() -> None:
    wet = verdicts(bridge_volume=1e-13)
    assert {"modulus_over_affine", "affine_excess"} & set(wet) == set() and wet["confining_error"]["verdict"] == "pass"
    assert of_stresses(0.2, bridge_volume=1e-13)["cohesion_ratio"]["reason"] == "liquid bridges"
    slippery = compressed(**LATTICE)
    slippery.derived["grain_static"] = 0.0
    assert "without friction" in judged("triaxial", triaxial.measure([slippery]))["modulus_over_affine"]["reason"]


def test_the_theory_of_the_lattice_is_not_asked_of_other_contacts() -> None:
    assert verdicts(**LATTICE)["lattice_ratio"]["verdict"] == "pass"
    weaker = verdicts(**LATTICE, kinetic_friction=0.2)["lattice_ratio"]
    assert weaker["verdict"] == "info" and "another friction" in weaker["reason"] and weaker["reference"] is not None
    assert verdicts(**LATTICE, bridge_volume=1e-13)["lattice_ratio"]["reason"] == "liquid bridges"


def test_one_packing_does_not_show_its_spread() -> None:
    disorder, lattice = verdicts(), verdicts(**LATTICE)
    for name in ("peak_ratio", "volume_change", "solid_fraction", "modulus"):
        assert disorder[name]["interval"] is None and lattice[name]["interval"] is not None


@pytest.mark.parametrize(("values", "expected"), [
    ({"grain_count": 0}, "grain_count = 0 is out of range"),
    ({"confining_stress": -5.0}, "confining_stress = -5"),
    ({"confining_stress": 1e5}, "overlap by more than 3 %"),
    ({"confining_stress": 8000.0, "inertial_number": 0.1}, "the test lasts 150 steps, and time.csv has 1000 rows"),
    ({"grain_count": 50, "strain": 0.5}, "the cell becomes 0.00209 m high, grains are up to 0.0012 m large"),
    ({**LATTICE, "grain_count": 96, "static_friction": 1.2}, "a lattice with a friction of 1 and more does not fail"),
    ({**LATTICE, "grain_count": 100}, "the lattice has 96 n³ equal grains")])
def test_a_mistake_gets_one_line(values: dict[str, Any], expected: str) -> None:
    case = find("triaxial")
    with pytest.raises(DembarkError) as refused:
        prepare(case, resolve(case, None, None, values))
    assert expected in str(refused.value) and "\n" not in str(refused.value)


def test_a_cell_of_constant_width_is_an_oedometer() -> None:
    found = verdicts(condition="constant_width", held=0.7)
    assert "confining_error" not in found and "modulus_over_affine" not in found and names(found, "fail") == set()


def test_the_gas_shrinks_with_its_cell() -> None:
    case = find("triaxial")
    made = prepare(case, resolve(case, "quick", "dry"))
    rate = derived(made)["closing_rate"]
    np.testing.assert_allclose(made.packing.velocities, -rate * (made.packing.positions - made.packing.box.mean(axis=1)))
    closed = derived(made)["closed_step"] * made.time_step
    assert made.packing.volume / np.prod(np.ptp(made.packing.box, axis=1)) / (1.0 - rate * closed) ** 3 == pytest.approx(0.5, rel=1e-2)


@pytest.mark.parametrize("engine", ["liggghts", "lammps", "yade"])
def test_the_real_lattice_fails_as_the_theory_has_it(engine: str, simulate: Any) -> None:
    case = find("triaxial")
    values = {name: resolve(case, "quick", "fcc")[name] for name in case.variants["fcc"]}
    found = judged("triaxial", triaxial.measure([simulate("triaxial", engine, values)]))
    assert names(found, "pass") == {"lattice_ratio", "modulus_over_affine", "confining_error", "contact_stress_error"}


@pytest.mark.parametrize("engine", ["liggghts", *(pytest.param(one, marks=pytest.mark.full) for one in ("lammps", "yade"))])
def test_grains_in_disorder_are_pressed_together_and_held(engine: str, simulate: Any) -> None:
    values = {"grain_count": 100, "inertial_number": 0.01, "strain": 0.1, "frames": 21}
    run = simulate("triaxial", engine, values)
    found = judged("triaxial", triaxial.measure([run]))
    assert 0.5 < found["solid_fraction"]["value"] < 0.64 and 0.4 < found["last_ratio"]["value"] < 1.2
    assert abs(found["contact_stress_error"]["value"]) < 0.02 and abs(found["confining_error"]["value"]) < 0.2
    assert found["affine_excess"]["verdict"] == "pass"
