"""GrainLearning's iterative Bayesian filter on the stand-ins: `python calibration_grainlearning.py samples seed ...` prints JSON.

A program of its own because GrainLearning 2.0.5 requires NumPy 1: run it with a Python that has it.
"""

import contextlib
import json
import sys

import numpy as np
from calibration_stand_ins import STAND_INS
from grainlearning import BayesianCalibration
from grainlearning.dynamic_systems import DynamicSystem

# Iterations at most, and the sigma with which they begin: a variance over the square of a target.
ITERATIONS, WIDEST = 10, 1e4


def calibrated(stand_in, seed, samples):
    """Runs, mean and standard deviation of the posterior of the last iteration, and whether sigma came down to that of the targets; None
    where it fails."""
    _, targets = stand_in.experiment(seed)
    # Its error measures divide by the range of the targets, so each is given as 1 and as -1, half of the information in each: a sigma of 1
    # is then the uncertainty of the targets.
    random, count = np.random.default_rng([seed, samples]), 0

    def simulate(calibration):
        nonlocal count
        count += len(calibration.system.param_data)
        means, _ = stand_in.runs(calibration.system.param_data, random)
        away = (means - targets) / stand_in.uncertainty / np.sqrt(2.0)
        calibration.system.set_sim_data(np.concatenate([1.0 + away, -1.0 - away], axis=1)[..., None])

    known = BayesianCalibration.from_dict({
        "num_iter": ITERATIONS, "callback": simulate, "save_fig": -1,
        "system": {"system_type": DynamicSystem, "param_names": ["a", "b"], "param_min": [0.0, 0.0], "param_max": [1.0, 1.0],
                   "num_samples": samples, "obs_data": np.repeat([1.0, -1.0], len(targets))[:, None], "sigma_max": WIDEST, "sigma_tol": 1.0,
                   "sigma_lower_bound": 0.1},
        "inference": {"Bayes_filter": {"ess_target": 0.3}, "sampling": {"max_num_components": 1, "random_state": seed}}})
    try:
        known.run()
    except ValueError:
        # All weight on one sample: the mixture of the next iteration cannot be trained.
        return None
    weights, places = known.inference.Bayes_filter.posteriors[-1], known.system.param_data
    mean = weights @ places
    deviation = np.sqrt(weights @ (places - mean) ** 2)
    reached = bool(known.system.sigma_max < 1.0)
    return {"runs": count, "mean": mean.tolist(), "deviation": deviation.tolist(), "reached": reached}


def main(samples, seeds):
    """Calibrate each stand-in once for each seed of its targets."""
    with contextlib.redirect_stdout(sys.stderr):
        found = {name: [calibrated(one, seed, samples) for seed in seeds] for name, one in STAND_INS.items()}
    print(json.dumps(found))


main(int(sys.argv[1]), [int(word) for word in sys.argv[2:]])
