"""Triaxial test: stresses and strains of the cell, its strength, volume change and stiffness, and what theories give for them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dembark.input_decks.common.estimates import of_packing, values_and_halves
from dembark.input_decks.common.power_law import ordered
from dembark.physics import effective_youngs_modulus
from dembark.postproc import ContactFrame
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
from dembark.postproc.spheres import volume
from dembark.postproc.studies import measured, propagated

# Shares of the strain: the end, where the state is steady, and windows whose largest mean is the peak.
STEADY, WINDOW = 0.25, 0.04
# Strain over which the modulus is measured: few contacts slip then.
SMALL = 2e-4


@dataclass(frozen=True, eq=False)
class Test:
    """Rows of a test (rows,): strains (rows, 3), positive in compression, and stresses (rows, 3) in Pa along x, y, z; sides (rows, 3) in m.
    Of the frames: steps, stresses of their contacts (frames, 3) in Pa, solid fractions, contacts of a grain; `affine`: Young's modulus (Pa)
    along z if all contacts of the first frame moved as the mean strain."""

    step: Array
    strain: Array
    stress: Array
    sides: Array
    frame_steps: Array
    frame_stress: Array
    fraction: Array
    coordination: Array
    affine: float

    @property
    def axial(self) -> Array:
        """Strain along z."""
        return self.strain[:, 2]

    @property
    def ratio(self) -> Array:
        """q/p: stress along z less the mean of those across, over the mean of all."""
        return (self.stress[:, 2] - self.stress[:, :2].mean(axis=1)) / self.stress.mean(axis=1)

    def part(self, begin: float, end: float) -> Array:
        """Rows between two shares of the strain."""
        share = self.axial / self.axial[-1]
        return np.asarray((share > begin) & (share <= end))


def affine_stiffness(contacts: ContactFrame, p: Numbers, cell: float) -> Array:
    """Stiffnesses (3, 3) in Pa of normal stresses in normal strains, if all contacts of a cell (m³) move as the mean strain and none slips:
    C_ab = 1/V Σ l² (k_n n_a² n_b² + k_t (n_a² δ_ab − n_a² n_b²)), contacts with the branch l n. Of spheres of one radius."""
    length = np.linalg.norm(contacts.branch, axis=1)
    normal = contacts.branch / length[:, None]
    force = np.abs(np.einsum("ca,ca->c", contacts.forces, normal))
    nu, radius = p["poisson_ratio"], 0.25 * p["grain_diameter"]
    modulus = effective_youngs_modulus(p["youngs_modulus"], nu, p["youngs_modulus"], nu)
    # Hertz: k_n = 2 E* a, a³ = 3 F R* / (4 E*); Mindlin: k_t / k_n = 2 (1 − ν) / (2 − ν).
    stiffness = 2.0 * modulus * np.cbrt(0.75 * force * radius / modulus)
    tangential = 2.0 * (1.0 - nu) / (2.0 - nu) * stiffness
    squares = normal**2
    both = np.einsum("c,ca,cb->ab", length**2 * (stiffness - tangential), squares, squares)
    return np.asarray((both + np.diag(np.einsum("c,ca->a", length**2 * tangential, squares))) / cell)


def youngs_modulus(stiffness: Array) -> float:
    """Pa, along z: the stress for a strain along z while the stresses across do not change."""
    return float(1.0 / np.linalg.inv(stiffness)[2, 2])


def contact_stress(contacts: ContactFrame, cell: float) -> Array:
    """Normal stresses (3,) in Pa: 1/V Σ f l, with the force on a grain and the line to the other one (Love, Weber)."""
    return np.asarray(-(contacts.forces * contacts.branch).sum(axis=0) / cell)


@cached_per_replica
def read(replica: Replica) -> Test:
    """The test of a run."""
    rows, numbers = replica.times(), replica.derived
    now = rows["step"] >= numbers["start_step"]
    sides, stress = (np.column_stack([rows[f"{name}_{axis}"][now] for axis in "xyz"]) for name in ("size", "stress"))
    affine, rows_of_frames = math.nan, list[list[float]]()
    for grains, contacts in replica.paired_frames():
        cell = float(np.prod(grains.high - grains.low))
        if not rows_of_frames:
            affine = youngs_modulus(affine_stiffness(contacts, replica.parameters, cell))
        filled, met = float(volume(grains.radii).sum()) / cell, 2.0 * len(contacts.ids) / len(grains.ids)
        rows_of_frames.append([grains.step, filled, met, *contact_stress(contacts, cell)])
    frames = np.array(rows_of_frames)
    return Test(rows["step"][now], np.log(sides[0] / sides), stress, sides, frames[:, 0], frames[:, 3:], frames[:, 1], frames[:, 2], affine)


def modulus(test: Test) -> float:
    """Young's modulus (Pa): slope of the stress in the strain along z up to SMALL."""
    few = np.arange(max(3, int(np.searchsorted(test.axial, SMALL))))
    # Rows are means over their steps, so the sides at the middle of a row count.
    axial = 0.5 * (test.axial[few] + test.axial[few + 1])
    return float(np.polyfit(axial, test.stress[few + 1, 2], 1)[0])


def peak(test: Test) -> float:
    """The largest mean of q/p over a window."""
    width = max(1, round(WINDOW * len(test.axial)))
    return float(np.convolve(test.ratio, np.full(width, 1.0 / width), mode="valid").max())


def angle(ratio: float) -> float:
    """Angle of friction (°) of a ratio q/p in compression: sin φ = 3 M / (6 + M)."""
    return math.degrees(math.asin(3.0 * ratio / (6.0 + ratio)))


def sliding_ratio(sides: Array, friction: float) -> float:
    """Stress along z over that along x and y of a face-centred cubic lattice all of whose contacts between layers slide, after Thornton
    (1979): 2 (1 + μ t) / (t (t − μ)) with t, 1 at the beginning, by how much x and y grew against z; `sides` (3,) of a cell of two
    spheres."""
    t = 0.5 * math.sqrt(2.0) * float(sides[0] + sides[1]) / float(sides[2])
    return 2.0 * (1.0 + friction * t) / (t * (t - friction))


def estimates(replica: Replica) -> dict[str, Estimate]:
    """All that is measured of one run."""
    p, numbers, test = replica.parameters, replica.derived, read(replica)
    end = test.axial > (1.0 - STEADY) * test.axial[-1]
    late = test.frame_steps > test.frame_steps[-1] - STEADY * np.ptp(test.frame_steps)
    last, highest, slope = block_mean(test.ratio[end]), peak(test), modulus(test)
    engine = np.array([test.stress[np.argmin(np.abs(test.step - step))].mean() for step in test.frame_steps[1:]])
    lattice = p["arrangement"] == "fcc"
    # A lattice has no packing.
    known = exact if lattice else of_packing
    found = {
        "peak_ratio": known(highest),
        "peak_angle": known(angle(highest)),
        "last_ratio": last,
        "last_angle": Estimate(angle(last.value), angle(last.value + last.half) - angle(last.value), last.basis),
        "stress_across": block_mean((test.stress[:, :2].mean(axis=1) / test.stress[:, 2])[end]),
        "volume_change": known(float(test.strain[-1].sum())),
        "solid_fraction": known(float(test.fraction[0])),
        "last_fraction": block_mean(test.fraction[late]),
        "coordination": block_mean(test.coordination[late]),
        "modulus": known(slope),
        "modulus_over_affine": known(slope / test.affine),
        # A bound, which each packing has to keep.
        "affine_excess": exact(max(slope / test.affine - 1.0, 0.0)),
        "confining_error": block_mean(test.stress[end][:, :2].mean(axis=1) / p["confining_stress"] - 1.0),
        "contact_stress_error": block_mean(test.frame_stress[1:].mean(axis=1) / engine - 1.0),
    }
    if lattice:
        ratio = 2.0 * test.stress[:, 2] / test.stress[:, :2].sum(axis=1)
        top = int(np.argmax(ratio))
        cell = test.sides[top] / [numbers[f"cells_{axis}"] for axis in "xyz"]
        found |= {"lattice_ratio": exact(float(ratio[top])), "lattice_theory": exact(sliding_ratio(cell, numbers["grain_static"]))}
    return found


def measure(replicas: Replicas) -> Measurement:
    """Values and curves of all packings."""
    found, p = [estimates(replica) for replica in replicas], replicas[0].parameters
    over = {name: pooled(found, name) for name in found[0]}
    lattice = p["arrangement"] == "fcc"
    values = {name: Value(one) for name, one in over.items() if name != "lattice_theory"}
    if lattice:
        numbers = replicas[0].derived
        weaker = "" if numbers["grain_kinetic"] == numbers["grain_static"] else "sliding contacts have another friction than those at rest"
        values["lattice_ratio"] = Value(over["lattice_ratio"], over["lattice_theory"],
                                        inapplicable=weaker or ("liquid bridges" if p["bridge_volume"] > 0.0 else ""))
        del values["affine_excess"]
    other = "" if replicas[0].derived["grain_static"] else "grains without friction, whose contacts have no tangential stiffness"
    other = other if lattice else "grains in disorder"
    values["modulus_over_affine"] = Value(over["modulus_over_affine"], exact(1.0), inapplicable=other)
    for name in {"affine_excess", "confining_error", "contact_stress_error"} & set(values):
        values[name] = Value(over[name], exact(0.0))
    if p["bridge_volume"] > 0.0:
        # Affine contacts count as dry, their forces as those of springs alone.
        for name in {"modulus_over_affine", "affine_excess"} & set(values):
            del values[name]
    if p["condition"] != "constant_stress":
        # A cell of constant width has another modulus, and holds no stress across.
        for name in {"modulus_over_affine", "affine_excess", "confining_error"} & set(values):
            del values[name]
    return Measurement(values, curves(replicas))


def curves(replicas: Replicas) -> list[Curve]:
    """Stress ratio and volume against the strain along z."""
    tests = [read(replica) for replica in replicas]
    places = np.linspace(0.0, min(test.axial[-1] for test in tests), 101)[1:]
    return [profile("ratio", "Stress ratio", "strain along the axis", "q/p", places,
                    [np.interp(places, test.axial, test.ratio) for test in tests]),
            profile("volume", "Volume change", "strain along the axis", "ln(V₀/V)", places,
                    [np.interp(places, test.axial, test.strain.sum(axis=1)) for test in tests])]


def study(name: str, results: Points, along: str) -> Measurement:  # noqa: ARG001 (there is one study)
    """The line of Mohr and Coulomb through the states at the end, in which the stress along the axis is N times that across, and more if
    there is a cohesion."""
    results, across = ordered(results, along)
    ratios, halves = values_and_halves([measured(one, "last_ratio") for one in results])

    def along_axis(ratio: Array) -> Array:
        return across * (3.0 + 2.0 * ratio) / (3.0 - ratio)

    def fitted(ratio: Array) -> tuple[float, float]:
        # Stresses scatter in proportion to themselves.
        design = np.column_stack([1.0 / across, np.ones(len(across))])
        cut, slope = np.linalg.lstsq(design, along_axis(ratio) / across, rcond=None)[0]
        return float(cut), float(slope)

    def cut(ratio: Array) -> float:
        return fitted(ratio)[0] / float(across.mean())

    def mohr(ratio: Array) -> float:
        slope = fitted(ratio)[1]
        return math.degrees(math.asin((slope - 1.0) / (slope + 1.0)))

    wet = any(one["parameters"]["bridge_volume"] > 0.0 for one in results)
    cohesion = propagated(cut, ratios, halves, "the ratios")
    found = {"cohesion_ratio": Value(cohesion, exact(0.0), inapplicable="liquid bridges" if wet else ""),
             "mohr_angle": Value(propagated(mohr, ratios, halves, "the ratios"))}
    half = 0.5 * np.abs(along_axis(ratios + halves) - along_axis(ratios - halves))
    return Measurement(found, [profile("mohr", "Stresses at the end", "stress across (Pa)", "stress along the axis (Pa)", across,
                                       [along_axis(ratios)], half=half)])
