"""Names under which checks that are not converted yet know what is common to measuring."""

from dembark.postproc.replica import Array, Replica, once
from dembark.postproc.resampling import TimeBlocks, pooled, profile, resampled, time_blocks

__all__ = ["Array", "Replica", "TimeBlocks", "once", "pooled", "profile", "resampled", "time_blocks"]
