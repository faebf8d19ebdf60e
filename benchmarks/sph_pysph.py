"""The cube of water of sph.in in PySPH (delta-SPH, cubic spline): `python3 sph_pysph.py side steps sound dt` prints JSON.

A program of its own because Debian's PySPH belongs to the system's Python. The first call compiles its loops.
"""

import json
import logging
import sys
import time

import numpy as np
from compyle.config import get_config
from pysph.base.kernels import CubicSpline
from pysph.base.utils import get_particle_array_wcsph
from pysph.solver.application import Application
from pysph.sph.integrator import PECIntegrator
from pysph.sph.scheme import WCSPHScheme

SIDE, STEPS, SOUND, DT = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), float(sys.argv[4])


class Cube(Application):
    """Water in free fall."""

    def create_particles(self):
        """A cubic lattice."""
        dx = 1.0 / SIDE
        middles = dx * (np.arange(SIDE) + 0.5)
        x, y, z = (part.ravel() for part in np.meshgrid(middles, middles, middles, indexing="ij"))
        water = get_particle_array_wcsph(name="fluid", x=x, y=y, z=z, m=1000.0 * dx**3, rho=1000.0, h=1.3 * dx)
        self.scheme.setup_properties([water])
        return [water]

    def create_scheme(self):
        """Monaghan's artificial viscosity and the diffusion of Molteni & Colagrossi."""
        return WCSPHScheme(["fluid"], [], dim=3, rho0=1000.0, c0=SOUND, h0=1.3 / SIDE, hdx=1.3, gamma=7.0, gz=-9.81, alpha=0.02, beta=0.0,
                           delta=0.1, delta_sph=True)

    def configure_scheme(self):
        """Equal steps, no output."""
        self.scheme.configure_solver(kernel=CubicSpline(dim=3), integrator_cls=PECIntegrator, dt=DT, tf=1.0, adaptive_timestep=False,
                                     max_steps=STEPS, output_at_times=(), pfreq=10 * STEPS)


def main():
    """Time the steps after the first two."""
    logging.disable(logging.CRITICAL)
    get_config().use_openmp = False
    cube = Cube(fname="cube")
    cube.setup(argv=["--disable-output", "--quiet", "--no-openmp", "--loglevel", "none"])
    solver = cube.solver
    solver.set_max_steps(2)
    solver.solve(show_progress=False)
    solver.set_max_steps(2 + STEPS)
    begin = time.process_time()
    solver.solve(show_progress=False)
    print(json.dumps({"seconds": time.process_time() - begin, "steps": solver.count - 2}))


main()
