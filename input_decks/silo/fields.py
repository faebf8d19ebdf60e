"""Fields of a cylindrical silo over radius and height: stresses and Janssen's law, K from the axis to the wall, balance of momentum."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add
from typing import Any

import numpy as np

from dembark.postproc import ContactFrame, GrainFrame
from dembark.postproc.fields.rings import Rings, RingSums, Zones, coarse_grain
from dembark.postproc.measurement import Array, Measurement, Replica, Value
from dembark.postproc.output import cf_dataset, variable, with_interval
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.resampling import resampled
from dembark.postproc.statistics import Estimate, TimeBlocks, block_mean, over_replicas, time_blocks
from dembark.postproc.walls import CylinderWall, PlaneWall, wall_contacts
from dembark.postproc.walls.patches import cylinder_patches
from dembark.postproc.walls.stress import WallRecorder

from . import column, janssen
from .column import Column, Mask
from .silo_geometry import Cylinder, overlap

# Shares of the filling height that the radial profiles are averaged over.
BANDS = ((0.2, 0.3), (0.45, 0.55), (0.7, 0.8))
_MOST_SECTORS = 8
_STRESSES = {"zz": "vertical stress", "rr": "radial stress", "tt": "hoop stress", "zr": "shear stress, vertical momentum outward",
             "rz": "shear stress, radial momentum upward"}


@dataclass(frozen=True)
class Silo:
    """One replica. `zones` (frames, 1 + bands, sectors, rings, 2): stress times volume zz and rr, first of the bulk of the column;
    `column` (frames, layers): zz of all rings together; `wall` (layers, 2): normal and upward shear stress of the wall in Pa;
    `wall_error`: force of the wall on the grains less that of time.csv, over the `weight` (N)."""

    rings: Rings
    fields: RingSums
    zones: Array
    column: Array
    wall: Array
    wall_error: Estimate
    weight: float

    @cached_property
    def blocks(self) -> TimeBlocks:
        """Time blocks that are long against the memory of the stress."""
        return time_blocks(self.column.sum(axis=1))

    @property
    def section(self) -> Array:
        """sigma_zz (frames, layers) in Pa, mean over the cross-section; near the base over what the kernel sees above it."""
        rings = self.rings
        return np.asarray(self.column / (np.pi * rings.radius**2 * np.diff(rings.vertical) * rings.above))

    def up_to(self, tallest: Rings) -> Silo:
        """The same with empty layers above, as many as `tallest` has more."""
        more = ((0, 0), (0, len(tallest.heights) - len(self.rings.heights)))
        return replace(self, rings=tallest, fields=self.fields.padded(more), column=np.pad(self.column, more),
                       wall=np.pad(self.wall, more[::-1], constant_values=np.nan))

    def k(self, zone: int, rings: Any) -> Estimate:
        """sigma_rr over sigma_zz in a zone, for the chosen `rings`."""
        sectors = np.arange(self.zones.shape[2])

        def ratio(frames: Any, kept: Any) -> float:
            zz, rr = self.zones[frames, zone][:, kept][:, :, rings].sum(axis=(0, 1, 2))
            return float(rr / zz)

        return resampled(ratio, self.blocks, sectors, overlap(len(sectors)))


@cached_per_replica
def read(replica: Replica) -> Silo:
    """Measure one run folder; zones are shares of its own filling height."""
    given, height = replica.parameters, column.read(replica).height
    radius, diameter = float(given["cylinder_radius"]), float(given["grain_diameter"])
    # The same layers for all replicas, as many as this one needs.
    cells = Rings.around(radius, math.ceil(2.0 * height / diameter) * 0.5 * diameter, diameter, 0.5 * diameter)
    vessel, side, base = Cylinder(radius), CylinderWall("side", radius), PlaneWall("base")
    sectors = min(_MOST_SECTORS, vessel.sectors(diameter))
    zones = [(diameter, height - diameter), *((low * height, high * height) for low, high in BANDS)]
    low, high = cells.vertical[:-1, None], cells.vertical[1:, None]
    # Part of each layer that lies in each zone.
    layers = np.clip(np.minimum(high, [top for _, top in zones]) - np.maximum(low, [foot for foot, _ in zones]), 0.0, None) / (high - low)
    inside = np.nonzero((cells.heights > 0.0) & (cells.heights < height))[0]
    recorder = WallRecorder(side, cylinder_patches(side, 1, cells.vertical[inside[0] : inside[-1] + 2]), keep_series=False)

    def of_frame(grains: GrainFrame, contacts: ContactFrame) -> tuple[RingSums, Zones]:
        walls = [wall_contacts(grains, side), wall_contacts(grains, base)]
        return coarse_grain(grains, contacts, walls, cells, layers, lambda place: vessel.wall_shares(place, sectors))

    total, rows = [], []
    for grains, (found, zone) in replica.mapped(of_frame):
        recorder.add(grains)
        total.append(found)
        rows.append((zone.stress, zone.column, grains.wall_forces["side"][:, 2].sum(), grains.step, grains.masses.sum()))
    stresses, section, lift, steps, masses = (np.array(part) for part in zip(*rows, strict=True))
    times, weight = replica.times(), float(masses[-1]) * float(given["gravity"])
    wall = np.full((len(cells.heights), 2), np.nan)
    wall[inside] = recorder.result().mean[:, :2]
    error = block_mean((lift - np.interp(steps, times["step"], times["side_fz"])) / weight)
    return Silo(cells, reduce(add, total), stresses, section, wall, error, weight)


def _law(known: Mapping[str, Value], radius: float, depth: Array, specific: float) -> Array:
    """sigma_zz (Pa) at `depth` (m) by Janssen's law from the measured quantities of a case; `specific`: weight (N/m3) per volume."""
    k, friction, *adhesion = (known[name].estimate.value for name in ("stress_ratio_k", "wall_mobilisation", "wall_adhesion")
                              if name in known)
    weight = specific - 2.0 * friction * sum(adhesion) / radius
    return janssen.stress(np.maximum(depth, 0.0), radius / (2.0 * k * friction), weight)


def _deviation(silos: Sequence[Silo], columns: Sequence[Column]) -> Value:
    """Largest |law / field - 1| of the lower half, each packing with its own K and friction, which its stress is correlated with."""
    found = []
    for one, known in zip(silos, columns, strict=True):
        heights = one.rings.heights
        chosen = (heights > known.diameter) & (heights < 0.5 * known.height)

        def worst(frames: Mask, sectors: Mask, section: Array = one.section[:, chosen], known: Column = known,
                  depth: Array = known.height - heights[chosen]) -> float:
            return float(np.abs(known.predicted_stress(depth, frames, sectors) / section[frames].mean(axis=0) - 1.0).max())

        sectors = known.shear.shape[2]
        found.append(resampled(worst, one.blocks, np.arange(sectors), overlap(sectors)))
    return Value(over_replicas(found), Estimate(0.0, 0.0), detail="mean over the cross-section; law with K, μ_mob, ρ_b of the same column")


def measured(replicas: Sequence[Replica], known: Mapping[str, Value]) -> Measurement:
    """Fields of all replicas of a series and values drawn from them; `known`: the case's values, whose K, friction and height are used."""
    given = replicas[0].parameters
    radius, diameter, gravity = (float(given[name]) for name in ("cylinder_radius", "grain_diameter", "gravity"))
    height = known["filling_height"].estimate.value * radius
    found = [read(replica) for replica in replicas]
    cells = max((one.rings for one in found), key=lambda one: len(one.heights))
    silos = [one.up_to(cells) for one in found]
    specific = float(np.mean([one.weight for one in silos])) / (np.pi * radius**2 * height)
    law, zero = _law(known, radius, height - cells.heights, specific), Estimate(0.0, 0.0)
    near = {"axis": cells.radii < 0.5 * radius, "wall": (cells.radii > radius - diameter) & (cells.radii < radius)}

    def worst(one: Silo, accelerated: bool) -> Estimate:
        rest = one.fields.unbalanced(cells, gravity) - (one.fields.mean("net", cells) if accelerated else 0.0)
        return Estimate(float(np.abs(rest).max()) / specific, 0.0, "every ring of the mean over all frames")

    values = {
        "field_janssen_deviation": _deviation(silos, [column.read(one) for one in replicas]),
        "field_momentum_residual": Value(over_replicas([worst(one, True) for one in silos]), zero),
        "field_static_residual": Value(over_replicas([worst(one, False) for one in silos])),
        "wall_force_deviation": Value(over_replicas([one.wall_error for one in silos]), zero),
        **{f"stress_ratio_k_{place}": Value(over_replicas([one.k(0, chosen) for one in silos])) for place, chosen in near.items()},
    }
    remark = (f"The fields are coarse-grained with a Gaussian of width {diameter:g} m = 1 d and averaged around the axis in closed form, "
              "which conserves mass exactly and momentum but for the quadrature along the contacts; "
              "within one width of a wall they are means over the part of the kernel inside.")
    return Measurement(values, remarks=[remark], fields=_dataset(silos, law, height, diameter, gravity))


def _dataset(silos: Sequence[Silo], law: Array, height: float, diameter: float, gravity: float) -> Any:
    cells, (both, high), fields = silos[0].rings, (("radius", "height"), ("height",)), reduce(add, (one.fields for one in silos))
    stress = [over_replicas([block_mean(layer) for layer in layers]) for layers in zip(*(one.section.T for one in silos), strict=True)]
    ratio = [[over_replicas([one.k(1 + band, slice(ring, ring + 1)) for one in silos]) for ring in range(len(cells.radii))]
             for band in range(len(BANDS))]
    wall = np.mean([one.wall for one in silos], axis=0)
    borders = {"radius": cells.radial, "height": cells.vertical}
    variables = {f"stress_{part}": variable(both, fields.mean(part, cells), "Pa", f"{name}, compression positive")
                 for part, name in _STRESSES.items()}
    variables |= {
        "density": variable(both, fields.mean("mass", cells), "kg m-3", "bulk density"),
        "solid_fraction": variable(both, fields.mean("volume", cells), "1", "volume of grains per volume"),
        "coverage": variable(both, cells.coverage, "1", "part of the kernel that lies inside the vessel"),
        "wall_force": variable(both, fields.mean("wall", cells), "N m-3", "upward force density of walls on grains"),
        "unbalanced": variable(both, fields.unbalanced(cells, gravity), "N m-3",
                               "wall forces minus weight minus divergence of the vertical stresses"),
        "net_force": variable(both, fields.mean("net", cells), "N m-3", "upward force density that accelerates grains"),
        **with_interval("stress_zz_section", high, stress, "Pa", "vertical stress, mean over the cross-section"),
        "janssen": variable(high, law, "Pa", "vertical stress by Janssen's law with K and friction of the same column"),
        "wall_normal": variable(high, wall[:, 0], "Pa", "normal stress of the wall"),
        "wall_shear": variable(high, wall[:, 1], "Pa", "upward shear stress of the wall"),
        **with_interval("k_profile", ("band", "radius"), ratio, "1", "sigma_rr over sigma_zz"),
        "band_bounds": variable(("band", "bounds"), np.array(BANDS) * height, "m",
                                "heights between which k_profile is averaged, mean over packings"),
        **{f"{name}_bounds": variable((name, "bounds"), np.stack([edges[:-1], edges[1:]], axis=1), "m",
                                      f"borders of the {'rings' if name == 'radius' else 'layers'}") for name, edges in borders.items()},
    }
    coordinates = {"radius": variable(["radius"], cells.radii, "m", "distance from the axis"),
                   "height": variable(high, cells.heights, "m", "height above the base")}
    return cf_dataset(variables, coordinates, kernel="gaussian", width=cells.width, averaged="around the axis and over frames",
                      frames=fields.frames, replicas=len(silos), vessel_radius=cells.radius, filling_height=height,
                    grain_diameter=diameter)
