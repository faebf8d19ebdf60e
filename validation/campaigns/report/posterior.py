"""Which parameters reproduce measured targets: a Gaussian process for each quantity, and samples of the posterior by emcee."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Many walkers that start as samples of the posterior: a step of all costs as much as one of few.
_PRIOR, _WALKERS, _BURN, _STEPS, _THIN = 4096, 200, 100, 200, 10
_FOLDS = 10


@dataclass(frozen=True)
class Output:
    """A quantity at the points of a sample: `values` (points) and `variances` of these means over packings (0 where not known); the
    `target` that it is to reach, with its standard `uncertainty`."""

    name: str
    values: Array
    variances: Array
    target: float
    uncertainty: float


Allowed = Callable[[Array], NDArray[np.bool_]]


def everywhere(places: Array) -> NDArray[np.bool_]:
    """All points are allowed."""
    return np.ones(len(places), bool)


class Surrogate:
    """A Gaussian process of one quantity over the quantiles of the parameters, with the scatter of packings as measured at each point.

    `explained` is the share of the variance that it predicts of points that it has not seen (ten folds).
    """

    def __init__(self, places: Array, output: Output) -> None:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
        from sklearn.model_selection import KFold, cross_val_predict

        spread = float(output.values.var())
        # The white noise is what scatters and was not measured.
        kernel = ConstantKernel(1.0, (1e-2, 1e3)) * Matern(np.ones(places.shape[1]), (0.05, 50.0), nu=2.5) + WhiteKernel(1e-3, (1e-9, 1.0))
        # In the units of the normalised values.
        noise = 1e-10 + output.variances / spread
        self._process = GaussianProcessRegressor(kernel, alpha=noise, normalize_y=True, n_restarts_optimizer=2, random_state=0)
        with warnings.catch_warnings():
            # A parameter without effect has a length at its bound.
            warnings.simplefilter("ignore", ConvergenceWarning)
            self._process.fit(places, output.values)
        self._white = float(self._process.kernel_.k2.noise_level) * spread
        fixed = GaussianProcessRegressor(self._process.kernel_, alpha=1e-10 + float(noise.mean()), optimizer=None, normalize_y=True)
        folds = KFold(min(_FOLDS, len(places)), shuffle=True, random_state=0)
        self.explained = 1.0 - float(np.mean((cross_val_predict(fixed, places, output.values, cv=folds) - output.values) ** 2)) / spread

    def __call__(self, places: Array) -> tuple[Array, Array]:
        """Mean and variance of the mean over packings at `places` (n, parameters)."""
        mean, deviation = self._process.predict(places, return_std=True)
        return mean, np.maximum(deviation**2 - self._white, 0.0)


@dataclass(frozen=True)
class Posterior:
    """Samples of the posterior: `quantiles` (n, parameters) and log `density` (n), by the surrogate of each output."""

    quantiles: Array
    density: Array
    surrogates: Sequence[Surrogate]

    @property
    def best(self) -> Array:
        """The most probable sample."""
        return self.quantiles[int(self.density.argmax())]


def log_density(surrogates: Sequence[Surrogate], outputs: Sequence[Output], places: Array,
                allowed: Allowed = everywhere) -> Array:
    """Log of the posterior density at `places` (n, parameters) but for a constant: the prior is uniform in the quantiles where a point is
    `allowed`, the targets are normal, and what the surrogate does not know adds to their variance."""
    inside: NDArray[np.bool_] = np.asarray(((places >= 0.0) & (places <= 1.0)).all(axis=1))
    inside[inside] = allowed(places[inside])
    found = np.where(inside, 0.0, -math.inf)
    if inside.any():
        for surrogate, one in zip(surrogates, outputs, strict=True):
            mean, variance = surrogate(places[inside])
            total = variance + one.uncertainty**2
            found[inside] -= 0.5 * ((mean - one.target) ** 2 / total + np.log(total))
    return found


def posterior(places: Array, outputs: Sequence[Output], allowed: Allowed = everywhere, seed: int = 0) -> Posterior:
    """Samples of the quantiles of the parameters that reproduce the targets of `outputs`, from what was measured at `places`."""
    from threadpoolctl import threadpool_limits

    # Matrices of some hundred points: threads cost more than they save.
    with threadpool_limits(1):
        return _sampled(places, outputs, allowed, seed)


def _sampled(places: Array, outputs: Sequence[Output], allowed: Allowed, seed: int) -> Posterior:
    import emcee

    surrogates = [Surrogate(places, one) for one in outputs]
    count = places.shape[1]
    random = np.random.RandomState(seed)
    prior = random.random_sample((_PRIOR, count))
    weights = np.exp((density := log_density(surrogates, outputs, prior, allowed)) - density.max())
    begin = prior[random.choice(_PRIOR, _WALKERS, p=weights / weights.sum())]
    near = begin + 1e-3 * random.standard_normal((_WALKERS, count))
    inside = np.isfinite(log_density(surrogates, outputs, near, allowed))
    begin[inside] = near[inside]
    sampler = emcee.EnsembleSampler(_WALKERS, count, lambda these: log_density(surrogates, outputs, these, allowed), vectorize=True)
    sampler.run_mcmc(emcee.State(begin, random_state=random.get_state()), _BURN + _STEPS)
    given: dict[str, Any] = {"discard": _BURN, "thin": _THIN, "flat": True}
    return Posterior(sampler.get_chain(**given), sampler.get_log_prob(**given), surrogates)
