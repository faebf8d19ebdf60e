"""Names under which checks that are not converted yet know what is common to measuring."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dembark.postproc.replica import Array, Replica, once
from dembark.postproc.resampling import TimeBlocks, pooled, profile, resampled, time_blocks

__all__ = ["Array", "Replica", "TimeBlocks", "kinetic_friction", "once", "pooled", "profile", "resampled", "time_blocks", "wall_friction"]


def wall_friction(parameters: Mapping[str, Any]) -> float:
    """Static friction coefficient between grains and walls."""
    override = parameters.get("static_friction")
    return float(override if override is not None and override >= 0 else parameters["wall_friction"])


def kinetic_friction(parameters: Mapping[str, Any]) -> float:
    """Kinetic friction coefficient between grains and walls."""
    override = parameters.get("kinetic_friction")
    if override is not None and override >= 0:
        return float(override)
    return wall_friction(parameters) * float(parameters.get("kinetic_friction_ratio", 1.0))
