"""Siconos's LCP solvers on one stored problem, timed inside: `/usr/bin/python3 lcp_siconos.py problem.npz wall|cpu method ...` prints JSON.

A program of its own because Debian's Siconos belongs to the system's Python.
"""

import json
import sys
import time

import numpy as np
from siconos import numerics

METHODS = {"lemke": (numerics.SICONOS_LCP_LEMKE, numerics.lcp_lexicolemke),
           "newton_min": (numerics.SICONOS_LCP_NEWTONMIN, numerics.lcp_newton_min),
           "pgs": (numerics.SICONOS_LCP_PGS, numerics.lcp_pgs),
           "cpg": (numerics.SICONOS_LCP_CPG, numerics.lcp_cpg),
           "latin": (numerics.SICONOS_LCP_LATIN, numerics.lcp_latin)}


def main(path, wall, names):
    """Solve the stored problem by each of the named methods, timed; prints JSON."""
    with np.load(path) as stored:
        matrix, right = stored["M"], stored["q"]
    clock = time.perf_counter if wall else time.process_time
    found = {}
    for name in names:
        number, solve = METHODS[name]
        problem = numerics.LCP(matrix, right)
        options = numerics.SolverOptions(number)
        options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = 20000
        options.dparam[numerics.SICONOS_DPARAM_TOL] = 1e-12
        z, w = np.zeros(len(right)), np.zeros(len(right))
        before = clock()
        info = solve(problem, z, w, options)
        spent = clock() - before
        iterations = int(options.iparam[numerics.SICONOS_IPARAM_ITER_DONE])
        found[name] = {"seconds": spent, "info": int(info), "iterations": iterations, "z": z.tolist()}
    print(json.dumps(found))


main(sys.argv[1], sys.argv[2] == "wall", sys.argv[3:])
