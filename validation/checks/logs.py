"""Names under which checks that are not converted yet know what is common to runs in which nothing is random."""

from dembark.postproc.statistics import exact
from dembark.postproc.studies import fitted_exponent

__all__ = ["ROUND_OFF", "SAME", "exact", "fitted_exponent"]

# How far apart the engines may be, of the largest such number in the run.
SAME = 1e-9
# Sums over a run to round-off: 1e-16 a step and log, over some ten thousand steps.
ROUND_OFF = 1e-12
