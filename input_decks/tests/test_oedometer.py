"""oedometer: layers that are known are measured as they are, wrong ones fail; the real decks follow their load."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point

oedometer = module("oedometer")
D, AREA, SIDE, LAYERS = 0.001, 3.6e-5, 6, 12
START, OCTAVE = 1000, 2000


def compressed(*, k0: float = 0.64, loose: float = 0.0, power: float = 1.0 / 3.0, stiffness: float = 1.0, carried: float = 1.0,
               **changes: Any) -> Any:
    """A run of a cubic lattice of grains between two plates. The stress across is `k0` of that along; the modulus on loading and unloading
    goes as the stress to this `power`, and is `stiffness` times the affine one at the peak. `carried`: share of the load that the grains
    carry; `loose`: their solid fraction."""
    p = defaults("oedometer", **{"octaves": 3, "frames": 56} | changes)
    peak, every = START + p["octaves"] * OCTAVE, 50
    fall = peak + OCTAVE
    steps = fall + p["octaves"] * OCTAVE

    def load(step: Any) -> Any:
        return p["normal_stress"] * 2.0 ** ((np.minimum(step, peak) - START - np.maximum(step - fall, 0)) / OCTAVE)

    rows = np.arange(every, steps + 1, every)
    force = carried * load(rows - 0.5 * every) * AREA
    times = {"step": rows, "lower_fz": force, "upper_fz": -force}
    sites = np.array([(i, j, k) for k in range(LAYERS) for j in range(SIDE) for i in range(SIDE)], float)
    layer = sites[:, 2].astype(int)
    order = np.argsort(np.where(layer == 0, 1, np.where(layer == LAYERS - 1, 2, 0)), kind="stable")
    sites, layer = sites[order], layer[order]
    types = np.where((layer > 0) & (layer < LAYERS - 1), 1, 2)
    near = {axis: [(a, b) for a in range(len(sites)) for b in [np.flatnonzero((sites == sites[a] + step).all(axis=1))] if len(b)]
            for axis, step in enumerate(np.eye(3))}
    pairs = {axis: np.array([(a, b[0]) for a, b in found]) for axis, found in near.items()}
    # Half a diameter farther, so that what is measured inside does not end in a layer.
    sites[:, 2] += 0.5 * (layer == LAYERS - 1) - 0.5 * (layer == 0)
    frames = []
    largest = float(load(peak))
    # Contacts of a grain, glued ones not counted.
    density = np.pi / 6.0 * sum((types[pair] == 1).sum() for pair in pairs.values()) / (SIDE**2 * (LAYERS - 2.0))
    top = stiffness * float(oedometer.affine_modulus(np.asarray(largest * (1.0 + 2.0 * k0) / 3.0), np.asarray(density), p))
    # The share of the volume that the grains fill.
    size = D * np.cbrt(loose / (np.pi / 6.0)) if loose else D
    for step in range(START + 250, steps + 1, 250):
        sigma = load(step)
        # M = top (σ / largest)^power.
        strain = largest**power / top * (sigma ** (1.0 - power) - p["normal_stress"] ** (1.0 - power)) / (1.0 - power)
        places = D * sites * [1.0, 1.0, np.exp(-strain)]
        # Along x and y a row has SIDE - 1 of its SIDE contacts.
        push = [carried * sigma * D**2 * share for share in (k0 * SIDE / (SIDE - 1.0), k0 * SIDE / (SIDE - 1.0), 1.0)]
        first, second = (np.concatenate([pairs[axis][:, side] for axis in range(3)]) for side in (0, 1))
        branch = places[second] - places[first]
        pushes = np.concatenate([np.full(len(pairs[axis]), push[axis]) for axis in range(3)])
        forces = -pushes[:, None] * branch / np.linalg.norm(branch, axis=1)[:, None]
        forces[:len(pairs[0]) + len(pairs[1])] *= np.exp(-strain)
        grains = SimpleNamespace(step=step, types=types, ids=np.arange(1, len(sites) + 1), positions=places,
                                 radii=np.full(len(sites), 0.5 * size))
        frames.append((grains, SimpleNamespace(first=places[first], branch=branch, forces=forces,
                                               ids=np.column_stack([first, second]) + 1)))
    return SimpleNamespace(parameters=p, time_step=1e-5, times=lambda: times, grains=lambda: [one for one, _ in frames],
                           paired_frames=lambda: iter(frames),
                           derived={"area": AREA, "start_step": START, "peak_step": peak, "fall_step": fall, "octave_steps": OCTAVE,
                                    "every": every,
                                    "grain_static": p["grain_friction"]})


def verdicts(packings: int = 3, **changes: Any) -> dict[str, dict[str, Any]]:
    alike = {"loose": 0.0, "stiffness": 1.0, "k0": 0.64} | changes
    # No two packings are alike.
    runs = [{name: alike[name] * (1.0 + 1e-4 * k) for name in ("loose", "stiffness", "k0")} for k in range(packings)]
    return judged("oedometer", oedometer.measure([compressed(**alike | one) for one in runs]))


def of_loads(power: float, bridge_volume: float = 0.0) -> dict[str, dict[str, Any]]:
    """The study of runs whose modulus goes as the load to this `power`, that of affine contacts as the load to 1/3."""
    loads = {octaves: 2.0**octaves for octaves in (2, 3, 4, 5)}
    return judged("oedometer", oedometer.study("load", [
        point({"octaves": octaves, "normal_stress": 500.0, "bridge_volume": bridge_volume},
              {"modulus": load**power, "modulus_over_affine": load ** (power - 1.0 / 3.0)})
        for octaves, load in loads.items()], "octaves"))


def controls_oedometer(_: Path) -> Iterator[Control]:
    yield Control("a fluid, with equal stresses", verdicts(), verdicts(k0=1.0))
    equal: dict[str, Any] = {"grain_diameter_spread": 0.0, "grain_friction": 0.3}
    yield Control("a packing that is a tenth looser", verdicts(**equal, loose=0.593), verdicts(**equal, loose=0.534))
    yield Control("contacts half as stiff", verdicts(), verdicts(stiffness=0.5))
    yield Control("linear springs", of_loads(1.0 / 3.0), of_loads(0.0))
    yield Control("a fiftieth of the load lost", verdicts(), verdicts(carried=0.98))


def test_known_stresses_and_strains_are_found() -> None:
    found = verdicts(k0=0.5)
    assert found["k0"]["value"] == pytest.approx(0.5, rel=1e-2) and found["k0_unloaded"]["value"] == pytest.approx(0.5, rel=1e-2)
    # ln(h0/h) from the first frame on; at the last one the load is the smallest again.
    assert found["residual_compression"]["value"] < 0.0 < found["compression"]["value"]
    assert found["modulus_over_affine"]["value"] == pytest.approx(1.0, abs=0.05)
    # M = 1.5 Δ(σ^(2/3)) σ^(1/3) / Δε, between the first frame and the peak.
    rise = 1.5 * (4000 ** (2 / 3) - (500 * 2**0.125) ** (2 / 3)) * 4000 ** (1 / 3) / found["compression"]["value"]
    assert found["modulus"]["value"] == pytest.approx(rise, rel=0.03)
    assert names(found, "fail") == {"k0"}


def test_the_exponent_of_the_modulus_is_found() -> None:
    found = of_loads(0.4)
    assert found["modulus_exponent"]["value"] == pytest.approx(0.4)
    assert found["modulus_over_affine_exponent"]["value"] == pytest.approx(0.4 - 1.0 / 3.0)


def test_the_affine_modulus_is_that_of_a_compressed_layer() -> None:
    """Under equal strains of all directions it is the bulk modulus of the same contacts: their normal springs alone."""
    p = defaults("oedometer", poisson_ratio=0.0)
    pressure, density = np.array([1e3, 8e3]), np.array([2.7, 2.7])
    one, eight = oedometer.affine_modulus(pressure, density, p)
    assert eight / one == pytest.approx(2.0)
    # Two spheres with n contacts in a volume: F = 3 p / (2 R n), overlap by Hertz, k_n = 1.5 F / overlap, k_t = k_n for ν = 0.
    radius, modulus = 0.5 * D, p["youngs_modulus"] / 2.0
    count = 2.7 / (8.0 / 3.0 * np.pi * radius**3)
    force = 1.5e3 / (radius * count)
    overlap = (force / (4.0 / 3.0 * modulus * np.sqrt(0.5 * radius))) ** (2.0 / 3.0)
    assert one == pytest.approx(4.0 * radius**2 * count * 1.5 * force / overlap / 3.0)
    assert oedometer.affine_modulus(pressure[:1], 8.0 * density[:1], p)[0] / one == pytest.approx(4.0)


def test_grains_without_friction_have_no_angle_to_compare_with() -> None:
    assert verdicts(grain_friction=0.0)["k0"]["reason"] == "grains without friction"


def test_one_packing_does_not_show_its_spread() -> None:
    one = verdicts(packings=1, grain_diameter_spread=0.0, grain_friction=0.3, loose=0.593)
    for name in ("compression", "modulus", "modulus_over_affine", "solid_fraction", "coordination"):
        assert one[name]["interval"] is None and one[name]["verdict"] == "info"


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # no stiffness without contacts
def test_wet_grains_are_not_judged_as_dry_ones_and_bridges_are_no_contacts() -> None:
    equal: dict[str, Any] = {"grain_diameter_spread": 0.0, "grain_friction": 0.3, "loose": 0.45}
    dry, wet = verdicts(**equal), verdicts(**equal, bridge_volume=1e-13)
    assert {"k0", "modulus_over_affine", "solid_fraction"} & names(wet, "pass") | names(wet, "fail") == set()
    assert {wet[name]["reason"] for name in ("k0", "modulus_over_affine", "solid_fraction")} == {"liquid bridges"}
    # These grains of the lattice have gaps between them, over which bridges pull.
    assert dry["coordination"]["value"] > 2.0 and wet["coordination"]["value"] == 0.0
    assert of_loads(0.4, bridge_volume=1e-13)["modulus_over_affine_exponent"]["reason"] == "liquid bridges"


def test_a_layer_too_thin_to_be_measured_gets_one_line() -> None:
    thin = compressed()
    for frame in thin.grains():
        frame.positions[:, 2] *= 0.4
    with pytest.raises(DembarkError, match=r"grain_diameter apart, nothing is measured within 2 .* raise grain_count") as refused:
        oedometer.measure([thin])
    assert "\n" not in str(refused.value)


TINY = {"grain_count": 150, "cell_length": 0.005, "cell_width": 0.004, "octaves": 2, "octave_time": 0.02, "rest_time": 0.02, "frames": 40}


@pytest.mark.parametrize("engine", ["liggghts", *(pytest.param(one, marks=pytest.mark.full) for one in ("lammps", "yade"))])
def test_the_plates_carry_the_load(engine: str, simulate: Any) -> None:
    found = judged("oedometer", oedometer.measure([simulate("oedometer", engine, TINY)]))
    assert abs(found["normal_balance_error"]["value"]) < 0.02 and abs(found["contact_stress_error"]["value"]) < 0.03
    assert 0.3 < found["k0"]["value"] < 1.0
    assert found["compression"]["value"] > found["residual_compression"]["value"] > 0.0
    assert 0.1 < found["modulus_over_affine"]["value"] < 1.0
