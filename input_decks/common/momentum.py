"""Momentum and energy of a run as its history holds them: impulses of the walls from forces of every step, and how well the sums balance.
All engines move a grain by kicks: over the steps from m to n, M (v(n) - v(m)) = dt (F(m)/2 + F(m+1) + ... + F(n-1) + F(n)/2) at any step.
So the force at the ends of a row and its mean over the row give the impulse to round-off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from dembark.postproc.grains import GrainFrame
from dembark.postproc.measurement import Array

# Parts of the contact forces in the energy account: of dry contacts without rolling resistance, the same with liquid bridges, and all.
CONTACT_PARTS = ("normal_elastic", "normal_viscous", "tangential_elastic", "tangential_viscous")
BRIDGED_PARTS = (*CONTACT_PARTS, "capillary", "liquid_viscous")
PARTS = (*CONTACT_PARTS, "rolling_elastic", "rolling_viscous", "capillary", "liquid_viscous")
Rows = Mapping[str, Array]


def impulses(rows: Rows, wall: str, axis: str, time_step: float) -> Array:
    """N s, (rows - 1,): impulse of a wall on the grains along an axis in each row but the first, from the columns <wall>_f<axis> (N, at the
    end of the row) and <wall>_m<axis> (N, mean over the steps of the row)."""
    force, mean = rows[f"{wall}_f{axis}"], rows[f"{wall}_m{axis}"]
    return time_step * (np.diff(rows["step"]) * mean[1:] - 0.5 * np.diff(force))


def walls_of(rows: Rows) -> list[str]:
    """Names of the walls of a history, in its order."""
    return [name.removesuffix("_mx") for name in rows if name.endswith("_mx")]


def left_to(rows: Rows, wall: str, axis: str, time_step: float, weight: float, since: int = 0) -> float:
    """N s, impulse of a wall since the row `since` as the balance of momentum has it: what the grains gained, less the impulse of their
    `weight` (N, along the axis) and of all other walls."""
    momentum = rows[f"momentum_{axis}"]
    others = sum(float(impulses(rows, one, axis, time_step)[since:].sum()) for one in walls_of(rows) if one != wall)
    duration = time_step * float(rows["step"][-1] - rows["step"][since])
    return float(momentum[-1] - momentum[since]) - weight * duration - others


def unaccounted(first: GrainFrame, last: GrainFrame, rows: Rows, walls: Sequence[str], axis: str, gravity: float,
                time_step: float) -> float:
    """N s, along an axis: what the grains gained from one frame to another, less the impulses of their weight by `gravity` (m/s², along the
    axis) and of the `walls`, from the columns <wall>_j<axis> (N s), which count every step."""
    start, end = np.searchsorted(rows["step"], [first.step, last.step])
    pushed = sum(float(rows[f"{wall}_j{axis}"][end] - rows[f"{wall}_j{axis}"][start]) for wall in walls)
    before, after = (float(frame.masses @ frame.velocities[:, "xyz".index(axis)]) for frame in (first, last))
    return after - before - pushed - float(last.masses.sum()) * gravity * (last.step - first.step) * time_step


def imbalance(rows: Rows, parts: Sequence[str] = PARTS) -> float:
    """Largest difference between kinetic energy and the works of known forces in any row, over the energy turned over so far; what an
    account found besides, `other` and `imposed`, counts as unexplained."""
    works = rows["gravity"] + rows["walls"] + sum(rows[name] for name in parts)
    left = np.maximum(np.abs(rows["kinetic_energy"] - rows["first_kinetic"] - works), np.abs(rows["balance"]))
    return float((left / rows["scale"]).max())


def unexplained_energy(rows: Rows) -> float:
    """Largest energy in a row of time.csv that no known force gave, over the energy turned over so far."""
    left = np.max([np.abs(rows[name]) for name in ("balance", "other", "imposed")], axis=0)
    return float((left / rows["scale"]).max())
