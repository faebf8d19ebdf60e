"""The former place of dembark.validation.case."""

from dembark.validation.case.folders import discover, find, load
from dembark.validation.case.model import OUTPUTS, STANDARD_OUTPUTS, STUDY_PREFIX, Case, Constraint, PlannedRun, Study

__all__ = ["OUTPUTS", "STANDARD_OUTPUTS", "STUDY_PREFIX", "Case", "Constraint", "PlannedRun", "Study", "discover", "find", "load"]
