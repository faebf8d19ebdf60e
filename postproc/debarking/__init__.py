"""What impacts do to bark and wood: doses on each log and along its circumference, degree of debarking, wood loss.

Definitions, formulas and sources: docs/theory/debarking.md.
"""

from .dose import Doses, Logs, doses, plane_of
from .laws import BONDS, Bond, ForceRange, RemovalLaw, bark_force, bond, force_bound, peak_of_duration, peak_of_impulse, peak_of_speed
from .outcomes import Load, Outcome, outcome

__all__ = ["BONDS", "Bond", "Doses", "ForceRange", "Load", "Logs", "Outcome", "RemovalLaw", "bark_force", "bond", "doses", "force_bound",
           "outcome", "peak_of_duration", "peak_of_impulse", "peak_of_speed", "plane_of"]
