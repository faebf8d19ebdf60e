"""The rebound, from the energy before and after the impact."""

import numpy as np

from dembark.postproc.measurement import Estimate, Measurement, Value


def measure(replicas):
    """The values by their names in case.toml, from replicas[k].parameters, .grains() and .times()."""
    run, p = replicas[0], replicas[0].parameters
    energies = [0.5 * frame.velocities[0, 2] ** 2 + 9.81 * (frame.positions[0, 2] - p["radius"]) for frame in run.grains()]
    ratio = np.sqrt(energies[-1] / energies[0])
    return Measurement({"rebound": Value(Estimate(ratio, 0.0), Estimate(p["restitution"], 0.0))})
