"""The force on the floor over the weight, and the number of contacts."""

import numpy as np

from dembark.postproc.measurement import Estimate, Measurement, Value, block_mean, over_replicas


def measure(replicas):
    """The values by their names in case.toml, from replicas[k].parameters, .grains(), .contacts() and .times()."""
    forces, touching = [], []
    for run in replicas:
        grains, times = run.grains(), run.times()
        weight = grains[-1].masses.sum() * run.parameters["gravity"]
        window = times["time"] >= run.derived["first"] * run.time_step
        forces.append(block_mean(times["floor_fz"][window] / weight))
        touching.append(block_mean(np.array([2.0 * len(frame.ids) / run.parameters["grain_count"] for frame in run.contacts()])))
    return Measurement({"floor_force": Value(over_replicas(forces), Estimate(1.0, 0.0)), "contacts": Value(over_replicas(touching))})
