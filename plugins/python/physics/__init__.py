"""Contact laws of dembark on numpy arrays: the same headers that run in LIGGGHTS and YADE.

All quantities are in SI units.
"""

from dembark.physics.capillary import CAPILLARY_MODELS, capillary_force, rupture_distance
from dembark.physics.contact import Body, Contact, ContactForce, RollingResistance, Trajectory, collide, drop
from dembark.physics.friction import FinnieRabinowicz, FrictionPath
from dembark.physics.impact import Drum, Impact, ImpactChain, ImpactMotion, ImpactSystem, Plane
from dembark.physics.lcp import LCP_METHODS, LcpCertificate, LcpResult, LcpSolver, solve_lcp
from dembark.physics.liquid import LIQUID_RETURNS, LIQUID_SHARES, LiquidBridge, liquid_bridge, liquid_grant, liquid_share
from dembark.physics.normal import effective_shear_modulus, effective_youngs_modulus
from dembark.physics.viscous import ViscousResistance, viscous_resistance

__all__ = [
    "CAPILLARY_MODELS",
    "LCP_METHODS",
    "LIQUID_RETURNS",
    "LIQUID_SHARES",
    "Body",
    "Contact",
    "ContactForce",
    "Drum",
    "FinnieRabinowicz",
    "FrictionPath",
    "Impact",
    "ImpactChain",
    "ImpactMotion",
    "ImpactSystem",
    "LcpCertificate",
    "LcpResult",
    "LcpSolver",
    "LiquidBridge",
    "Plane",
    "RollingResistance",
    "Trajectory",
    "ViscousResistance",
    "capillary_force",
    "collide",
    "drop",
    "effective_shear_modulus",
    "effective_youngs_modulus",
    "liquid_bridge",
    "liquid_grant",
    "liquid_share",
    "rupture_distance",
    "solve_lcp",
    "viscous_resistance",
]
