"""Fields of a cylindrical silo over radius and height: stresses beside Janssen's law, K from the axis to the wall, balance of momentum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Any

import numpy as np
from dembark.postproc.walls import CylinderWall, PlaneWall, wall_contacts
from dembark.postproc.walls.patches import cylinder_patches
from dembark.postproc.walls.stress import WallRecorder
from dembark.validation.checks import fields_axial as axial
from dembark.validation.checks.column import janssen
from dembark.validation.checks.fields_axial import Fields, Rings
from dembark.validation.checks.fields_result import FieldResult, labelled, variable
from dembark.validation.checks.filling import propagated
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Array, Replica, TimeBlocks, pooled, resampled, time_blocks
from dembark.validation.checks.vessel import Cylinder, overlap
from dembark.validation.references import JANSSEN
from dembark.postproc.statistics import Estimate, block_mean, combined
from threadpoolctl import threadpool_limits

# Shares of the filling height that the radial profiles are averaged over.
BANDS = ((0.2, 0.3), (0.45, 0.55), (0.7, 0.8))
_MOST_SECTORS = 8


@dataclass(frozen=True)
class Silo:
    """One replica. `zones` (frames, 1 + bands, sectors, rings, 2): stress times volume zz and rr, first of the lower half of the column;
    `column` (frames, layers): zz of all rings together; `wall` (layers, 2): normal and upward shear stress of the wall in Pa;
    `wall_error`: force of the wall on the grains less that of time.csv, over the weight."""

    rings: Rings
    fields: Fields
    zones: Array
    column: Array
    wall: Array
    wall_error: Estimate
    weight: float

    @property
    def blocks(self) -> TimeBlocks:
        """Time blocks that are long against the memory of the stress."""
        return time_blocks(self.column.sum(axis=1))

    def k(self, zone: int, rings: Any) -> Estimate:
        """sigma_rr over sigma_zz in a zone, for the chosen `rings`."""
        return self._resampled(lambda f, s: self._ratio(self.zones[f, zone][:, s][:, :, rings].sum(axis=(0, 1, 2))))

    def k_profile(self, zone: int) -> list[Estimate]:
        """The same for each ring."""
        return [self.k(zone, slice(ring, ring + 1)) for ring in range(self.zones.shape[3])]

    @staticmethod
    def _ratio(sums: Array) -> float:
        return float(sums[1] / sums[0])

    def _resampled(self, measure: Any) -> Estimate:
        sectors = np.arange(self.zones.shape[2])
        return resampled(measure, self.blocks, sectors, overlap(len(sectors)))


def read(replica: Replica, rings: Rings, height: float) -> Silo:
    """Measure one run folder; `height` (m) of the filling."""
    given = replica.parameters
    radius, diameter = float(given["cylinder_radius"]), float(given["grain_diameter"])
    vessel, side, base = Cylinder(radius), CylinderWall("side", radius), PlaneWall("base")
    sectors = min(_MOST_SECTORS, vessel.sectors(diameter))
    zones = [(diameter, 0.5 * height), *((low * height, high * height) for low, high in BANDS)]
    layers = np.stack([_shares(rings.vertical, low, high) for low, high in zones], axis=1)
    inside = (rings.heights > 0.0) & (rings.heights < height)
    first, count = int(np.argmax(inside)), int(inside.sum())
    recorder = WallRecorder(side, cylinder_patches(side, 1, rings.vertical[first : first + count + 1]), keep_series=False)
    total, of_zones, column, lift, steps, mass = [], [], [], [], [], 0.0
    # Products of tall thin matrices gain nothing from more threads, and a second measurement may run beside this one.
    with threadpool_limits(1, "blas"):
        for grains, contacts in replica.paired_frames():
            walls = [wall_contacts(grains, side), wall_contacts(grains, base)]
            found, zone = axial.coarse_grain(grains, contacts, walls, rings, layers, lambda place: vessel.wall_shares(place, sectors))
            total.append(found)
            of_zones.append(zone.stress)
            column.append(zone.column)
            recorder.add(grains)
            lift.append(grains.wall_forces["side"][:, 2].sum())
            steps.append(grains.step)
            mass = float(grains.masses.sum())
    times, weight = replica.times(), mass * float(given["gravity"])
    wall = np.full((len(rings.heights), 2), np.nan)
    wall[inside] = recorder.result().mean[:, :2]
    return Silo(rings, reduce(add, total), np.array(of_zones), np.array(column), wall,
                block_mean((np.array(lift) - np.interp(steps, times["step"], times["side_fz"])) / weight), weight)


def _shares(edges: Array, low: float, high: float) -> Array:
    """Part of each layer between `edges` that lies between `low` and `high`."""
    return np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None) / np.diff(edges)


def measure(replicas: Sequence[Replica], known: Mapping[str, Quantity], tolerance: float, balance_tolerance: float) -> FieldResult:
    """Fields and quantities of all replicas of a series; `known`: the case's quantities by name, whose K, friction and height are used."""
    given = replicas[0].parameters
    radius, diameter, gravity = float(given["cylinder_radius"]), float(given["grain_diameter"]), float(given["gravity"])
    height = known["filling_height"].estimate.value * radius
    rings = Rings.around(radius, height, diameter, 0.5 * diameter)
    silos = [read(replica, rings, height) for replica in replicas]
    specific = float(np.mean([one.weight for one in silos])) / (np.pi * radius**2 * height)
    law = _Janssen(known, radius, height, specific)
    scalars = [_scalars(one, radius, diameter, gravity, specific) for one in silos]
    fields = reduce(add, (one.fields for one in silos))
    zero = Estimate(0.0, 0.0)

    def over(name: str) -> Estimate:
        return pooled(scalars, name)

    deviation, where = _janssen_deviation(silos, law, diameter)
    quantities = [
        Quantity("field_janssen_deviation", "σ_zz of the field in the lower half: largest deviation from Janssen", "1", deviation,
                 reference=zero, tolerance=tolerance, absolute=True, source=JANSSEN.short, compared=False,
                 detail=f"mean over the cross-section, at the worst height (z = {where / diameter:.1f} d); law with measured K, μ_mob, ρ_b, "
                        "nothing fitted"),
        Quantity("field_momentum_residual", "momentum balance of the fields, worst ring: |∇·σ + ρ g − ρ a| / (ρ_b g)", "1", over("exact"),
                 reference=zero, tolerance=balance_tolerance, absolute=True, source="momentum balance", compared=False,
                 detail="flow through the faces of a ring, weight, walls and what accelerates grains; limit: that of the force balance"),
        Quantity("field_static_residual", "the same without what accelerates grains", "1", over("static"), compared=False,
                 detail="how far the slowly sliding packing is from rest"),
        Quantity("wall_force_deviation", "wall force summed over the wall's patches − that of the engine, over the weight", "1",
                 over("wall_error"), reference=zero, tolerance=balance_tolerance, absolute=True, source="Newton's third law", compared=False,
                 detail="engine: time.csv, between whose rows the force is interpolated"),
        Quantity("stress_ratio_k_axis", "K = σ_rr / σ_zz near the axis", "1", over("k_axis"),
                 detail="field, r < R/2, lower half"),
        Quantity("stress_ratio_k_wall", "K = σ_rr / σ_zz near the wall", "1", over("k_wall"),
                 detail="field, outermost diameter, lower half"),
    ]
    remarks = [f"The fields are coarse-grained with a Gaussian of width {diameter:g} m = 1 d and averaged around the axis in closed form, "
               "which conserves mass and momentum exactly; within one width of a wall they are means over what the kernel sees inside."]
    return FieldResult(_dataset(silos, fields, law, replicas[0], gravity), quantities, remarks)


class _Janssen:
    """Janssen's law from the measured quantities of a case, and how far it moves within their intervals."""

    def __init__(self, known: Mapping[str, Quantity], radius: float, height: float, specific: float) -> None:
        """`specific`: weight (N/m3) of the column per volume."""
        names = [name for name in ("stress_ratio_k", "wall_mobilisation", "wall_adhesion") if name in known]
        found = [known[name].estimate for name in names]
        self.values, self.halves = (np.array([getattr(one, part) for one in found]) for part in ("value", "half"))
        self._radius, self.height, self._specific = radius, height, specific

    def __call__(self, heights: Array, values: Array | None = None) -> Array:
        """sigma_zz (Pa) at `heights` (m), with other `values` of K, mu_mob and a."""
        k, friction, *adhesion = self.values if values is None else values
        weight = self._specific - 2.0 * friction * sum(adhesion) / self._radius
        return janssen(np.maximum(self.height - heights, 0.0), self._radius / (2.0 * k * friction), weight)


def _janssen_deviation(silos: Sequence[Silo], law: _Janssen, diameter: float) -> tuple[Estimate, float]:
    """Largest |Janssen / field - 1| of the lower half, and its height (m)."""
    heights = silos[0].rings.heights
    chosen = np.nonzero((heights > diameter) & (heights < 0.5 * law.height))[0]
    mean = np.mean([_column_stress(one).mean(axis=0) for one in silos], axis=0)
    worst = int(chosen[np.argmax(np.abs(law(heights) / mean - 1.0)[chosen])])
    series = [block_mean(_column_stress(one)[:, worst]) for one in silos]
    measured = pooled([{"stress": one} for one in series], "stress")
    known = propagated(lambda values: float(law(heights, values)[worst]) / measured.value - 1.0, law.values, law.halves)
    ratio = abs(known.value)
    half = combined([known.half, (1.0 + known.value) * measured.half / measured.value])
    return Estimate(ratio, half, f"propagated from K, μ_mob and σ_zz; {measured.basis}"), float(heights[worst])


def _column_stress(one: Silo) -> Array:
    """sigma_zz (frames, layers) in Pa, mean over the cross-section; near the base over what the kernel sees above it."""
    rings = one.rings
    return np.asarray(one.column / (np.pi * rings.radius**2 * np.diff(rings.vertical) * rings.above))


def _scalars(one: Silo, radius: float, diameter: float, gravity: float, specific: float) -> dict[str, Estimate]:
    rings, everywhere = one.rings, "every ring of the mean over all frames"
    unbalanced = one.fields.unbalanced(rings, gravity)
    return {
        "exact": Estimate(float(np.abs(unbalanced - one.fields.mean("net", rings)).max()) / specific, 0.0, everywhere),
        "static": Estimate(float(np.abs(unbalanced).max()) / specific, 0.0, everywhere),
        "wall_error": one.wall_error,
        "k_axis": one.k(0, rings.radii < 0.5 * radius),
        "k_wall": one.k(0, (rings.radii > radius - diameter) & (rings.radii < radius)),
    }


def _dataset(silos: Sequence[Silo], fields: Fields, law: _Janssen, replica: Replica, gravity: float) -> Any:
    rings, (rr, rl) = silos[0].rings, (("radius", "height"), ("height",))
    stress = pooled_columns([_column_stress(one) for one in silos])
    ratio = [[pooled([{"k": estimate} for estimate in column], "k") for column in zip(*(one.k_profile(zone) for one in silos), strict=True)]
             for zone in range(1, 1 + len(BANDS))]
    wall = np.mean([one.wall for one in silos], axis=0)
    names = {"zz": "vertical stress", "rr": "radial stress", "tt": "hoop stress", "zr": "shear stress, vertical momentum outward",
             "rz": "shear stress, radial momentum upward"}
    variables = {f"stress_{part}": variable(rr, fields.mean(part, rings), "Pa", f"{name}, compression positive") for part, name in names.items()}
    variables |= {
        "density": variable(rr, fields.mean("mass", rings), "kg m-3", "bulk density"),
        "solid_fraction": variable(rr, fields.mean("volume", rings), "1", "volume of grains per volume"),
        "coverage": variable(rr, rings.coverage, "1", "part of the kernel that lies inside the vessel"),
        "wall_force": variable(rr, fields.mean("wall", rings), "N m-3", "upward force density of walls on grains"),
        "unbalanced": variable(rr, fields.unbalanced(rings, gravity), "N m-3", "walls less weight less divergence of the vertical stresses"),
        "net_force": variable(rr, fields.mean("net", rings), "N m-3", "upward force density that accelerates grains"),
        "stress_zz_section": variable(rl, np.array([one.value for one in stress]), "Pa", "vertical stress, mean over the cross-section"),
        "stress_zz_section_half": variable(rl, np.array([one.half for one in stress]), "Pa", "half-width of its 95 % interval"),
        "janssen": variable(rl, law(rings.heights), "Pa", "vertical stress by Janssen's law, nothing fitted"),
        "wall_normal": variable(rl, wall[:, 0], "Pa", "normal stress of the wall"),
        "wall_shear": variable(rl, wall[:, 1], "Pa", "upward shear stress of the wall"),
        "k_profile": variable(("band", "radius"), np.array([[one.value for one in row] for row in ratio]), "1", "sigma_rr over sigma_zz"),
        "k_profile_half": variable(("band", "radius"), np.array([[one.half for one in row] for row in ratio]), "1", "half-width of its 95 % interval"),
        "band_bounds": variable(("band", "bounds"), np.array(BANDS) * law.height, "m", "heights between which k_profile is averaged"),
        "radius_bounds": variable(("radius", "bounds"), np.stack([rings.radial[:-1], rings.radial[1:]], axis=1), "m", "borders of the rings"),
        "height_bounds": variable(("height", "bounds"), np.stack([rings.vertical[:-1], rings.vertical[1:]], axis=1), "m", "borders of the layers"),
    }
    coordinates = {"radius": variable(["radius"], rings.radii, "m", "distance from the axis"),
                   "height": variable(["height"], rings.heights, "m", "height above the base")}
    given = replica.parameters
    return labelled(variables, coordinates, kind="silo", kernel="gaussian", width=rings.width, averaged="around the axis and over frames",
                    frames=fields.frames, replicas=len(silos), vessel_radius=rings.radius, filling_height=law.height,
                    grain_diameter=float(given["grain_diameter"]))


def pooled_columns(tables: Sequence[Array]) -> list[Estimate]:
    """An estimate for each column of tables (frames, columns), one a replica."""
    return [pooled([{"value": block_mean(table[:, column])} for table in tables], "value") for column in range(tables[0].shape[1])]
