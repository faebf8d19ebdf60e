"""Contact laws of dembark on numpy arrays: the same headers that run in the engines.

All quantities are in SI units.
"""

from dembark.physics.adhesion import dmt_pull_off, jkr_force, jkr_loss, jkr_pull_off, jkr_rupture_distance
from dembark.physics.capillary import CAPILLARY_MODELS, capillary_force, rupture_distance
from dembark.physics.contact import Body, Contact, ContactForce, RollingResistance, Trajectory, collide, drop
from dembark.physics.events import HardGrains, HardMotion, HardWall
from dembark.physics.friction import FinnieRabinowicz, FrictionLaw, FrictionPath
from dembark.physics.impact import CapsuleSystem, Drum, Impact, ImpactChain, ImpactMotion, ImpactSystem, Plane
from dembark.physics.integration import AdamsEvent, AdamsSolution, LocalErrors, integrate_adams, local_errors
from dembark.physics.lcp import LCP_METHODS, LcpCertificate, LcpResult, LcpSolver, solve_lcp
from dembark.physics.liquid import LIQUID_RETURNS, LIQUID_SHARES, LiquidBridge, liquid_bridge, liquid_grant, liquid_share
from dembark.physics.motion import WallMotion
from dembark.physics.normal import effective_shear_modulus, effective_youngs_modulus
from dembark.physics.sph import SPH_BOUNDARIES, SPH_KERNELS, SPH_MOMENTS, SphBody, SphEnergies, SphFluid, sph_kernel, tait_pressure
from dembark.physics.viscous import ViscousResistance, viscous_resistance

__all__ = [
    "CAPILLARY_MODELS",
    "LCP_METHODS",
    "LIQUID_RETURNS",
    "LIQUID_SHARES",
    "SPH_BOUNDARIES",
    "SPH_KERNELS",
    "SPH_MOMENTS",
    "AdamsEvent",
    "AdamsSolution",
    "Body",
    "CapsuleSystem",
    "Contact",
    "ContactForce",
    "Drum",
    "FinnieRabinowicz",
    "FrictionLaw",
    "FrictionPath",
    "HardGrains",
    "HardMotion",
    "HardWall",
    "Impact",
    "ImpactChain",
    "ImpactMotion",
    "ImpactSystem",
    "LcpCertificate",
    "LcpResult",
    "LcpSolver",
    "LiquidBridge",
    "LocalErrors",
    "Plane",
    "RollingResistance",
    "SphBody",
    "SphEnergies",
    "SphFluid",
    "Trajectory",
    "ViscousResistance",
    "WallMotion",
    "capillary_force",
    "collide",
    "dmt_pull_off",
    "drop",
    "effective_shear_modulus",
    "effective_youngs_modulus",
    "integrate_adams",
    "jkr_force",
    "jkr_loss",
    "jkr_pull_off",
    "jkr_rupture_distance",
    "liquid_bridge",
    "liquid_grant",
    "liquid_share",
    "local_errors",
    "rupture_distance",
    "solve_lcp",
    "sph_kernel",
    "tait_pressure",
    "viscous_resistance",
]
