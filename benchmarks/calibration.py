"""Known parameters of three cheap stand-ins, found again from synthetic targets; and how many runs that takes, next to GrainLearning.

`python -m benchmarks.calibration` writes both tables. GrainLearning 2.0.5 requires NumPy 1, dembark NumPy 2, so it needs a Python of its
own: `python3 -m venv DIR; DIR/bin/pip install grainlearning==2.0.5`, then `--grainlearning DIR/bin/python`. Without it, it is left out.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from benchmarks import frame
from benchmarks.calibration_stand_ins import STAND_INS, StandIn
from dembark.common.errors import DembarkError, RunError
from dembark.validation.campaigns.report.calibration import IDENTIFIED
from dembark.validation.campaigns.report.posterior import Array, Output, Posterior, log_density, posterior

POINTS = 32
# Points of the surrogate, and samples of an iteration of GrainLearning.
SURROGATE, SAMPLES = (10, 16, 32, 64), (10, 20, 40, 80, 160)


def fitted(stand_in: StandIn, seed: int, points: int = POINTS) -> tuple[Posterior, Array, list[Output]]:
    """The posterior from the targets of `seed` and Sobol `points` of the stand-in, the true parameters, and what was fitted."""
    truth, targets = stand_in.experiment(seed)
    random = np.random.default_rng([seed, points])
    places = qmc.Sobol(2, seed=random).random(2 ** int(np.ceil(np.log2(points))))[:points]
    means, variances = stand_in.runs(places, random)
    outputs = [Output(str(k), means[:, k], variances[:, k], float(targets[k]), float(stand_in.uncertainty[k])) for k in range(len(targets))]
    return posterior(places, outputs, seed=seed), truth, outputs


@dataclass(frozen=True)
class Recovery:
    """Of `repetitions`: how often the known parameters are in the joint 95 % region of the posterior, each parameter in its 95 % interval,
    and each is reported as identified; `widths`: median standard deviations of the posterior of the quantiles, over that of the prior."""

    repetitions: int
    joint: int
    single: tuple[int, ...]
    identified: tuple[int, ...]
    widths: tuple[float, ...]


def recovered(stand_in: StandIn, seeds: Iterable[int]) -> Recovery:
    """Calibrations of the stand-in, each with its own known parameters, targets and packings."""
    joint, single, widths = [], [], []
    for seed in seeds:
        result, truth, outputs = fitted(stand_in, seed)
        joint.append(log_density(result.surrogates, outputs, truth[None])[0] >= np.quantile(result.density, 0.05))
        low, high = np.quantile(result.quantiles, [0.025, 0.975], axis=0)
        single.append((low <= truth) & (truth <= high))
        widths.append(result.quantiles.std(axis=0) * np.sqrt(12.0))
    known = [[width < IDENTIFIED for width in each] for each in widths]
    inside, found = (tuple(map(int, np.sum(each, axis=0))) for each in (single, known))
    return Recovery(len(joint), int(np.sum(joint)), inside, found, tuple(map(float, np.median(widths, axis=0))))


def row(name: str, method: str, calibrations: Sequence[dict[str, Any] | None], seeds: Sequence[int]) -> dict[str, Any]:
    """An entry of the table: mean number of runs; `error`: distance of the mean of the posterior from that of the exact one, over the
    standard deviation of that, root mean square over parameters; `width`: median of the ratio of the deviations; share of calibrations that
    `reached` the uncertainty of the targets. None is a calibration that failed, of which only `reached` takes account; RunError when all
    did."""
    errors, ratios, done = [], [], [one for one in calibrations if one]
    if not done:
        raise RunError(f"{method}: no calibration of {name} came to its end", "", "give more --targets")
    for one, seed in zip(calibrations, seeds, strict=True):
        if not one:
            continue
        mean, deviation = STAND_INS[name].exact(STAND_INS[name].experiment(seed)[1])
        errors.append((np.array(one["mean"]) - mean) / deviation)
        ratios.append(np.array(one["deviation"]) / deviation)
    return {"stand_in": name, "method": method, "runs": float(np.mean([one["runs"] for one in done])),
            "error": float(np.sqrt(np.mean(np.square(errors)))), "width": float(np.median(ratios)),
            "reached": sum(bool(one["reached"]) for one in done) / len(calibrations)}


def of_surrogate(name: str, points: int, seeds: Sequence[int]) -> dict[str, Any]:
    """The entry of dembark's fit."""
    found = [fitted(STAND_INS[name], seed, points)[0].quantiles for seed in seeds]
    return row(name, "surrogate", [{"runs": points, "mean": one.mean(axis=0), "deviation": one.std(axis=0), "reached": True}
                                   for one in found], seeds)


def of_grainlearning(python: Path, samples: int, seeds: Sequence[int]) -> list[dict[str, Any]]:
    """The entries of GrainLearning in `python`, one for each stand-in; RunError when it fails."""
    words = [str(python), str(frame.HERE / "calibration_grainlearning.py"), str(samples), *map(str, seeds)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=3600)
    if done.returncode:
        raise RunError("GrainLearning", (done.stderr.strip().splitlines() or ["no message"])[-1])
    found = json.loads(done.stdout.splitlines()[-1])
    return [row(name, f"GrainLearning, {samples} an iteration", found[name], seeds) for name in STAND_INS]


def grainlearning(python: Path | None) -> str:
    """The version that `python` has, "" where none is given; DembarkError when it has none."""
    if python is None:
        return ""
    words = [str(python), "-c", "from importlib.metadata import version; import grainlearning; print(version('grainlearning'))"]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    except OSError as error:
        raise DembarkError(f"--grainlearning {python} cannot be started", error.strerror or "") from None
    if done.returncode:
        raise DembarkError(f"--grainlearning {python} has no GrainLearning", (done.stderr.strip().splitlines() or ["no message"])[-1],
                           f"{python} -m pip install grainlearning")
    return done.stdout.strip()


def run(words: Sequence[str] | None) -> None:
    """Measure, print and write both tables."""
    parser = frame.parser("calibration", __doc__, rounds=100)
    parser.add_argument("--targets", type=int, default=20, help="synthetic experiments of each comparison (default %(default)s)")
    parser.add_argument("--grainlearning", type=Path, metavar="PYTHON", help="a Python that has GrainLearning")
    given = parser.parse_args(words)
    frame.at_least_one(given, "targets")
    version, seeds = grainlearning(given.grainlearning), range(given.targets)
    if not version:
        frame.say("GrainLearning is left out: give --grainlearning PYTHON, a Python that has it")
    found = {name: recovered(one, range(given.rounds)) for name, one in STAND_INS.items()}
    heads = ("stand-in", "repetitions", "in the joint 95 % region", "in the 95 % intervals", "identified", "width over prior")
    first = frame.markdown(heads, (
        [name, one.repetitions, one.joint, *("{}, {}".format(*each) for each in (one.single, one.identified)),
         "{:.2f}, {:.2f}".format(*one.widths)] for name, one in found.items()))
    rows = [of_surrogate(name, points, seeds) for points in SURROGATE for name in STAND_INS]
    if version:
        rows += [entry for samples in SAMPLES for entry in of_grainlearning(given.grainlearning, samples, seeds)]
    second = frame.markdown(("stand-in", "method", "runs", "error of the mean", "width", "reached"), (
        [one["stand_in"], one["method"], f"{one['runs']:.0f}", f"{one['error']:.2f}", f"{one['width']:.2f}", f"{one['reached']:.0%}"]
        for name in STAND_INS for one in rows if one["stand_in"] == name))
    known = frame.facts(("numpy", "scikit-learn", "emcee"), grainlearning=version or None, targets=given.targets)
    frame.write(given.out, "calibration", "Calibrations of stand-ins", [first, second], rows, known)


def main(words: Sequence[str] | None = None) -> int:
    """The exit code is 1 when GrainLearning fails, 2 when an option is wrong."""
    return frame.ended(lambda: run(words))


if __name__ == "__main__":
    sys.exit(main())
