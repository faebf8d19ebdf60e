"""Published statements and formulas that results are shown beside, each with what of it was read.

Only what was seen in the source or in its abstract stands here; no number is quoted from memory, and nothing is tuned to any of them.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Reference:
    """`short` name for tables, full `citation`, what was `read` of it, and the `statement` it is cited for."""

    short: str
    citation: str
    read: str
    statement: str


JANSSEN = Reference(
    "Janssen 1895",
    "H. A. Janssen, Versuche über Getreidedruck in Silozellen, Z. Ver. dtsch. Ing. 39 (1895) 1045; translated by M. Sperl, "
    "Granular Matter (2006), arXiv:cond-mat/0511618.",
    "abstract of the translation",
    "the pressure in a silo saturates with depth because the walls carry part of the weight.",
)

LANDRY = Reference(
    "Landry et al. 2003",
    "J. W. Landry, G. S. Grest, L. E. Silbert, S. J. Plimpton, Confined granular packings: structure, stress, and forces, "
    "arXiv:cond-mat/0302115.",
    "abstract",
    "Janssen's law does not describe simulated packings in every respect: there is a hydrostatic-like zone at the top, and the "
    "forces at the wall are close to incipient failure while those of the interior are far from it.",
)

CAMBAU = Reference(
    "Cambau et al. 2013",
    "T. Cambau, J. Hure, J. Marthelot, Local stresses in the Janssen granular column, arXiv:1308.5833.",
    "abstract",
    "wall stresses measured locally in a vertical cylinder confirm Janssen's description for several bead diameters and with a "
    "load on top.",
)

WALKER = Reference(
    "two-parameter form",
    "Two-parameter form of Janssen's law: hydrostatic to a depth a, exponential below. It is usually named after D. M. Walker "
    "(1966) and after L. Vanel and E. Clément (1999); neither paper was read for this report, the formula follows from Janssen's "
    "balance with a = the depth where the walls begin to carry.",
    "nothing; derived here",
    "",
)

DEBNATH = Reference(
    "Debnath et al. 2022",
    "B. Debnath, K. K. Rao, V. Kumaran, Different shear regimes in the dense granular flow in a vertical channel, "
    "J. Fluid Mech. (2022), published online 22 July 2022.",
    "abstract",
    "between flat frictional walls and periodic along the flow the scaled velocity profile is one exponential function for all "
    "widths, the ratio of greatest and slip velocity depends neither on the width nor on the mean solid fraction, and there is no "
    "shear in the plug at the centre; for sufficiently wide channels the greatest and the slip velocity grow as the square root of the "
    "width and the shear zones' thickness as the width.",
)

CHUNG = Reference(
    "Chung & Ooi 2011",
    "Y. C. Chung, J. Y. Ooi, Benchmark tests for verifying discrete element modelling codes at particle impact level, Granular Matter 13 "
    "(2011) 643-656.",
    "not the paper; its set-ups and materials in the public implementations of YADE (examples/Benchmarks_Chung_and_Ooi, tests 1-4), "
    "Kratos Multiphysics (DEM benchmarks, tests 1-8) and PySPH (DEM examples, tests 4, 5, 7, 8)",
    "eight impacts of one sphere on a plane or another sphere verify a code at the level of one contact. Its curves from experiments and "
    "finite elements could not be read and are left out.",
)

LYASHENKO = Reference(
    "Lyashenko & Popov 2015",
    "I. A. Lyashenko, V. L. Popov, Impact of an elastic sphere with an elastic half space revisited: numerical analysis based on the "
    "method of dimensionality reduction, Sci. Rep. 5 (2015) 8479.",
    "abstract",
    "the oblique impact of an elastic sphere is solved by the method of dimensionality reduction.",
)

KOLESNIKOV = Reference(
    "Kolesnikov 2013",
    "G. N. Kolesnikov, Decomposition algorithm of linear complementarity problem and its application for simulation of pulpwood "
    "collisions in debarking drum, Resources and Technology (2013), published 16 November 2013.",
    "full text (in Russian)",
    "each step of the motion of logs on springs, by backward differences, is a linear complementarity problem with a positive definite "
    "matrix, solved by exchanges chosen by their energy.",
)

LUBE = Reference(
    "Lube et al. 2005",
    "G. Lube, H. E. Huppert, R. S. J. Sparks, A. Freundt, Collapses of two-dimensional granular columns, Phys. Rev. E 72 (2005) 041301.",
    "not the paper; its laws as several public programs quote them, alike",
    "columns in a channel run out (L − W)/W = 1.2 a for a = H/W < 1.8 and 1.9 a^(2/3) for a > 2.8, where the deposit is W a^(2/5) high, "
    "whatever the grains and the roughness of the floor.",
)

LAJEUNESSE = Reference(
    "Lajeunesse et al. 2005",
    "E. Lajeunesse, J. B. Monnier, G. M. Homsy, Granular slumping on a horizontal surface, Phys. Fluids 17 (2005) 103302.",
    "nothing",
    "measured the same with glass beads; its constants could not be read and are left out.",
)

SARLIN = Reference(
    "Sarlin et al. 2021",
    "W. Sarlin, C. Morize, A. Sauret, P. Gondret, Collapse dynamics of dry granular columns: from free-fall to quasistatic flow, "
    "Phys. Rev. E 104 (2021) 064904.",
    "abstract",
    "the speed at which a column is released governs its collapse: released fast it leaves the deposits of the classical power laws.",
)

STARON = Reference(
    "Staron & Hinch 2005",
    "L. Staron, E. J. Hinch, Study of the collapse of granular columns using two-dimensional discrete-grain simulation, J. Fluid Mech. 545 "
    "(2005) 1-27.",
    "abstract",
    "the collapse is mostly controlled by the free fall of the column, and the energy left for the flow sideways is proportional to the "
    "initial potential energy.",
)

UTILI = Reference(
    "Utili et al. 2015",
    "S. Utili, T. Zhao, G. T. Houlsby, 3D DEM investigation of granular column collapse: evaluation of debris motion and its destructive "
    "power, Eng. Geol. 186 (2015) 3-16.",
    "abstract",
    "in simulations most of a column's energy is dissipated by friction between grains, the more the higher the column.",
)
