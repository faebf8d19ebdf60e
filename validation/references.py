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
