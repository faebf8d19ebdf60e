"""Where impacts take energy from the logs: power over the drum's cross-section and along its shell, and peak forces along the shell.

All of it comes from the records of single contacts: where each was, the peak of its force and what was lost in it. A contact counts as
an impact when it begins with an approach of `impact_speed` or more; what rolling and sliding contacts lose has no single place and is told
by its share only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dembark.validation.checks import debarking_drum as drums
from dembark.validation.checks.debarking_drum import ANGLES, ROWS, contacts_in_window, geometry, quarters
from dembark.validation.checks.fields_result import FieldResult, labelled, variable
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Array, Replica, pooled, resampled, time_blocks
from dembark.postproc.statistics import Estimate
from numpy.typing import NDArray

CELLS = 32  # of the map, across the drum
FORCES = np.logspace(1.0, 6.0, 26)  # N, five bins a decade


@dataclass(frozen=True)
class Impacts:
    """Impacts of one replica's window: `place` (n, 2) x and z in m, `angle` in degrees past the lowest point, `peak` N, `lost` J, `quarter` of a
    revolution, `shell`: on the shell. `recorded`: J lost in all contacts that ended, `total`: J lost by all in each quarter (quarters,)."""

    place: Array
    angle: Array
    peak: Array
    lost: Array
    quarter: NDArray[np.int64]
    shell: NDArray[np.bool_]
    recorded: float
    total: Array
    duration: float

    def quarterly(self, chosen: NDArray[np.bool_]) -> Array:
        """J lost in the chosen impacts of each quarter."""
        return np.bincount(self.quarter[chosen], self.lost[chosen], len(self.total))


def read(replica: Replica) -> Impacts:
    """The impacts of one run folder."""
    given = replica.parameters
    contacts = contacts_in_window(given, replica.impacts())
    hits = contacts[contacts[:, 6] >= given["impact_speed"]]
    turns = int(given["revolutions"])
    lost = np.diff(replica.times()["dissipated_energy"], prepend=0.0)[ROWS * int(given["run_in"]) :]
    return Impacts(hits[:, [8, 10]], drums.angles(hits), hits[:, 4], hits[:, 7], quarters(given, hits), hits[:, 1] < 0,
                   float(contacts[:, 7].sum()), lost.reshape(4 * turns, -1).sum(axis=1), turns * 2.0 * math.pi / given["drum_speed"])


def measure(replicas: Sequence[Replica]) -> FieldResult:
    """Maps and quantities of all replicas of a series."""
    found = [read(replica) for replica in replicas]
    scalars = [_scalars(one) for one in found]

    def over(name: str) -> Estimate:
        return pooled(scalars, name)

    limit = replicas[0].parameters["impact_speed"]
    quantities = [
        Quantity("impact_loss_share", "share of the energy lost that is lost in impacts", "1", over("share"),
                 detail=f"contacts that begin with {limit:g} m/s or more; the rest is lost in rolling and sliding contacts"),
        Quantity("shell_loss_share", "share of the impacts' loss that is lost on the shell", "1", over("shell")),
        Quantity("shell_power_angle", "where on the shell impacts lose most: mean direction", "°", over("angle"), compared=False,
                 detail="past the lowest point the way the drum turns; mean direction of the shell impacts weighted with their loss"),
    ]
    recorded = np.mean([one.recorded / one.total.sum() for one in found])
    remarks = [f"The records of contacts that ended hold {recorded:.0%} of the energy lost in the window; contacts that last are not in them."]
    return FieldResult(_dataset(found, replicas), quantities, remarks)


def _scalars(one: Impacts) -> dict[str, Estimate]:
    everywhere = np.ones(len(one.lost), bool)
    hits, shell = one.quarterly(everywhere), one.quarterly(one.shell)
    blocks = time_blocks(hits)
    turn = np.radians(one.angle)
    east, north = (np.bincount(one.quarter[one.shell], (one.lost * part)[one.shell], len(hits)) for part in (np.sin(turn), np.cos(turn)))
    return {
        "share": resampled(lambda keep, _: float(hits[keep].sum() / one.total[keep].sum()), blocks),
        "shell": resampled(lambda keep, _: float(shell[keep].sum() / hits[keep].sum()) if hits[keep].any() else math.nan, blocks),
        "angle": resampled(lambda keep, _: math.degrees(math.atan2(east[keep].sum(), north[keep].sum())), blocks),
    }


def _dataset(found: Sequence[Impacts], replicas: Sequence[Replica]) -> Any:
    given, frame = replicas[0].parameters, list(replicas[0].grains())[-1]
    _, radius = geometry(given)
    length = float(given["log_length"])
    edges = np.linspace(-radius, radius, CELLS + 1)
    middle, place = 0.5 * (edges[1:] + edges[:-1]), 0.5 * (ANGLES[1:] + ANGLES[:-1])
    patch = radius * math.radians(float(np.diff(ANGLES)[0])) * length

    def mean(values: Sequence[Array]) -> Array:
        return np.mean(values, axis=0)

    cells = mean([np.histogram2d(*one.place.T, bins=(edges, edges), weights=one.lost)[0] / one.duration for one in found])
    along = [_along_shell(one, patch) for one in found]
    peaks = mean([np.histogram2d(one.angle[one.shell], np.log10(np.maximum(one.peak[one.shell], 1e-300)), bins=(ANGLES, np.log10(FORCES)))[0]
                  / (len(one.total) / 4.0) for one in found])
    shell = [pooled([{"power": one} for one in cell], "power") for cell in zip(*along, strict=True)]
    variables = {
        "impact_power": variable(("x", "z"), cells / (edges[1] - edges[0]) ** 2, "W m-2",
                                 "energy lost in impacts per time and area of the cross-section"),
        "shell_power": variable(["angle"], np.array([one.value for one in shell]), "W m-2",
                                "energy lost in impacts on the shell per time and area of it"),
        "shell_power_half": variable(["angle"], np.array([one.half for one in shell]), "W m-2", "half-width of its 95 % interval"),
        "shell_peaks": variable(("angle", "force"), peaks, "1", "impacts on the shell per revolution, angle bin and force bin"),
        "log_x": variable(["log"], frame.positions[:, 0], "m", "logs of the last frame"),
        "log_z": variable(["log"], frame.positions[:, 2], "m", "logs of the last frame"),
        "log_radius": variable(["log"], frame.radii, "m", "radius of the logs"),
    }
    coordinates = {"x": variable(["x"], middle, "m", "across the drum"), "z": variable(["z"], middle, "m", "upward"),
                   "angle": variable(["angle"], place, "degree", "angle past the lowest point, the way the drum turns"),
                   "force": variable(["force"], np.sqrt(FORCES[1:] * FORCES[:-1]), "N", "peak force, middle of the bin on a logarithmic scale")}
    return labelled(variables, coordinates, kind="drum", drum_radius=radius, drum_speed=float(given["drum_speed"]), log_length=length,
                    impact_speed=float(given["impact_speed"]), revolutions=int(given["revolutions"]), replicas=len(found),
                    impacts=sum(len(one.lost) for one in found))


def _along_shell(one: Impacts, patch: float) -> list[Estimate]:
    """Power per area (W/m2) of each bin of angle on the shell, with what varies among quarter revolutions; `patch`: its area in m2."""
    bins = np.clip(np.digitize(one.angle, ANGLES) - 1, 0, len(ANGLES) - 2)
    table = np.zeros((len(one.total), len(ANGLES) - 1))
    np.add.at(table, (one.quarter[one.shell], bins[one.shell]), one.lost[one.shell])
    table /= patch * one.duration / len(one.total)
    blocks = time_blocks(table.sum(axis=1))
    return [resampled(lambda keep, _, column=column: float(column[keep].mean()), blocks) for column in table.T]
