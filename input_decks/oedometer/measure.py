"""Oedometer: stresses along and across, strain and stiffness of a layer whose load rises and falls, and what contacts would give that move
as the mean strain."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dembark.input_decks.common.estimates import of_packing, values_and_halves
from dembark.input_decks.common.inside_layer import inside
from dembark.input_decks.common.power_law import ordered
from dembark.physics import effective_youngs_modulus
from dembark.postproc.measurement import (
    Array,
    Curve,
    Estimate,
    Measurement,
    Numbers,
    Points,
    Replica,
    Replicas,
    Value,
    block_mean,
    exact,
    pooled,
    profile,
)
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.studies import fitted_exponent, measured, propagated

# Glass beads in slow flow, Jop et al. (2006): shear over normal stress.
BEADS = 0.383
# Solid fractions of equal spheres with this coefficient of friction, compressed at low pressure, Agnolin and Roux (2007).
FRACTIONS = {0.0: 0.639, 0.3: 0.593}


@dataclass(frozen=True, eq=False)
class Loading:
    """Frames of a test (frames,): the load in Pa, the normal stresses of the contacts inside along z and across in Pa, solid fraction,
    contacts of a grain without bridges over gaps, and the compression ln(h0/h) of the layer since the first frame; `peak`: number
    of the last frame of loading, `fall`: of the last one before the load falls; forces on both plates over the load (rows,)."""

    load: Array
    along: Array
    across: Array
    fraction: Array
    coordination: Array
    strain: Array
    peak: int
    fall: int
    lower: Array
    upper: Array


@cached_per_replica
def read(replica: Replica) -> Loading:
    """The test of a run."""
    p, numbers, rows = replica.parameters, replica.derived, replica.times()
    each = [(grains.step, inside(grains, contacts, p, numbers["area"])) for grains, contacts in replica.paired_frames()]
    steps, found = np.array([step for step, _ in each]), [one for _, one in each]
    height = np.array([one.height for one in found])

    def load(at: Array) -> Array:
        """Pa, as the deck has it."""
        rise = np.minimum(at, numbers["peak_step"]) - numbers["start_step"] - np.maximum(at - numbers["fall_step"], 0.0)
        return np.asarray(p["normal_stress"] * 2.0 ** (rise / numbers["octave_steps"]))

    now = rows["step"] > numbers["start_step"]
    # Rows are means over their steps.
    due = load(rows["step"][now] - 0.5 * numbers["every"]) * numbers["area"]
    stress = np.array([one.stress for one in found])
    return Loading(load(steps), stress[:, 2, 2], 0.5 * (stress[:, 0, 0] + stress[:, 1, 1]), np.array([one.fraction for one in found]),
                   np.array([one.touching for one in found]), np.log(height[0] / height), int(np.argmax(steps >= numbers["peak_step"])),
                   int(np.argmax(steps >= numbers["fall_step"])), rows["lower_fz"][now] / due, -rows["upper_fz"][now] / due)


def affine_modulus(pressure: Array, density: Array, p: Numbers) -> Array:
    """Uniaxial modulus (Pa) of an isotropic layer of spheres in Hertz-Mindlin contact, without slip, whose contacts all move as the mean
    strain, under the mean `pressure` (Pa); `density` is the solid fraction times the contacts of a grain. There are n = density / (2 · 4/3
    π R³) contacts in a volume, each with the force 3 p / (2 R n); the modulus is n (2R)² (k_n ⟨n_z⁴⟩ + k_t ⟨n_z² (1 − n_z²)⟩)."""
    radius, nu = 0.5 * p["grain_diameter"], p["poisson_ratio"]
    modulus = effective_youngs_modulus(p["youngs_modulus"], nu, p["youngs_modulus"], nu)
    count = density / (8.0 / 3.0 * math.pi * radius**3)
    force = 1.5 * pressure / (radius * count)
    # Hertz: F = 4/3 E* a³ / R* with the contact radius a, R* = R/2; k_n = 2 E* a. Mindlin: k_t / k_n = 2 (1 − ν) / (2 − ν).
    stiffness = 2.0 * modulus * np.cbrt(0.375 * force * radius / modulus)
    return np.asarray(4.0 * radius**2 * count * stiffness * (1.0 / 5.0 + 2.0 / 15.0 * 2.0 * (1.0 - nu) / (2.0 - nu)))


def moduli(test: Loading, p: Numbers) -> tuple[float, float]:
    """Pa, where the load begins to fall: slope of the stress in the strain over the first frame, in which few contacts slip, and the
    affine modulus."""
    part = slice(test.fall, test.fall + 2)
    pressure = np.mean(test.along[part] + 2.0 * test.across[part]) / 3.0
    density = np.mean(test.fraction[part] * test.coordination[part])
    slope = np.diff(test.load[part])[0] / np.diff(test.strain[part])[0]
    return float(slope), float(affine_modulus(np.asarray(pressure), np.asarray(density), p))


def estimates(replica: Replica) -> dict[str, Estimate]:
    """All that is measured of one run."""
    p, test = replica.parameters, read(replica)
    each = p["frames"] // (2 * p["octaves"] + 1)
    # The first doubling still remembers how the layer was made.
    loading, ratio = slice(each, test.peak + 1), test.across / test.along
    slope, affine = moduli(test, p)
    return {
        "k0": block_mean(ratio[loading]),
        "k0_unloaded": of_packing(float(ratio[-1])),
        "compression": of_packing(float(test.strain[test.fall])),
        "residual_compression": of_packing(float(test.strain[-1])),
        "modulus": of_packing(slope),
        "modulus_over_affine": of_packing(slope / affine),
        "solid_fraction": of_packing(float(test.fraction[0])),
        "coordination": of_packing(float(test.coordination[test.fall])),
        "normal_balance_error": max((block_mean(side - 1.0) for side in (test.lower, test.upper)), key=lambda one: abs(one.value)),
        "contact_stress_error": block_mean(test.along / test.load - 1.0),
    }


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all packings."""
    found, p = [estimates(replica) for replica in replicas], replicas[0].parameters
    slippery = not replicas[0].derived["grain_static"]
    over = {name: pooled(found, name) for name in found[0]}
    values = {name: Value(one) for name, one in over.items()}
    wet = "liquid bridges" if p["bridge_volume"] > 0.0 else ""
    rearranged = "grains without friction, whose contacts have no tangential stiffness" if slippery else wet
    values["k0"] = Value(over["k0"], exact(1.0 - math.sin(math.atan(BEADS))), inapplicable="grains without friction" if slippery else wet)
    values["modulus_over_affine"] = Value(over["modulus_over_affine"], exact(1.0), inapplicable=rearranged)
    if p["grain_diameter_spread"] == 0.0 and (known := FRACTIONS.get(replicas[0].derived["grain_static"])) is not None:
        values["solid_fraction"] = Value(over["solid_fraction"], exact(known), inapplicable=wet)
    for name in ("normal_balance_error", "contact_stress_error"):
        values[name] = Value(over[name], exact(0.0))
    return Measurement(values, curves(replicas))


def curves(replicas: Replicas) -> list[Curve]:
    """Stress and strain, and the stress across over that along; of loading and unloading."""
    tests = [read(replica) for replica in replicas]
    load, peak, fall = tests[0].load, tests[0].peak, tests[0].fall
    ways = {"loading": slice(0, peak + 1), "unloading": slice(fall, None)}
    strains = [profile(f"strain_{way}", f"Compression, {way}", "normal stress (Pa)", "ln(h₀/h)", load[part],
                       [test.strain[part] for test in tests]) for way, part in ways.items()]
    ratios = [profile(f"k0_{way}", f"Stress across over stress along, {way}", "normal stress (Pa)", "σ_h / σ_v", load[part],
                      [(test.across / test.along)[part] for test in tests]) for way, part in ways.items()]
    return strains + ratios


def study(name: str, results: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """How the modulus rises with the load."""
    results, octaves = ordered(results, along)
    stress = results[0]["parameters"]["normal_stress"] * 2.0**octaves
    wet = "liquid bridges" if any(one["parameters"]["bridge_volume"] > 0.0 for one in results) else ""
    found: dict[str, Value] = {}
    for quantity, due in (("modulus", None), ("modulus_over_affine", exact(0.0))):
        values, halves = values_and_halves([measured(one, quantity) for one in results])
        found[f"{quantity}_exponent"] = Value(propagated(lambda y: fitted_exponent(stress, y), values, halves, "the moduli"), due,
                                              inapplicable=wet if due else "")
    values, halves = values_and_halves([measured(one, "modulus") for one in results])
    return Measurement(found, [profile("modulus", "Modulus where the load begins to fall", "normal stress (Pa)", "Pa", stress, [values],
                                       half=halves)])
