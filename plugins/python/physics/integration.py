"""How wrong the steps of an integration are: Adams' predictor-corrector as the reference, and the local error of velocity Verlet."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import numbers

Function = Callable[[float, NDArray[np.float64]], ArrayLike]


class AdamsEvent(NamedTuple):
    """When (s) a function of `events` changed its sign, which one, and the state there, of shape (k,)."""

    time: float
    number: int
    state: NDArray[np.float64]


class AdamsSolution(NamedTuple):
    """What :func:`integrate_adams` returns; n rows, of the beginning and of each step.

    time : (n,), s
    state : (n, k)
    error : (n, k): Milne's estimate of the local error of the step that ends here, exact minus computed; 0 in a Runge-Kutta step
    corrections : (n,): how many the step took; 0 in a Runge-Kutta step
    signal : (n,), bool: two iterates still differed by more than the tolerance: the step is too long
    events : list of :class:`AdamsEvent`
    """

    time: NDArray[np.float64]
    state: NDArray[np.float64]
    error: NDArray[np.float64]
    corrections: NDArray[np.int64]
    signal: NDArray[np.bool_]
    events: list[AdamsEvent]


def integrate_adams(derivative: Function, state: ArrayLike, end: float, step: float, *, start: float = 0.0, corrections: int = 2,
                    tolerance: float = 1e-9, scale: ArrayLike = 1.0, events: Function | None = None,
                    at_event: Callable[[AdamsEvent], bool | None] | None = None) -> AdamsSolution:
    """Integrate y' = f(t, y) from `start` to `end` by P(EC)^m E of Adams, Bashforth and Moulton, fourth order.

    derivative : f(t, y) with y of shape (k,); returns k numbers
    state : (k,), y at `start`
    start, end, step : s; the step is constant, only the last one and those up to events are shorter
    corrections : m, >= 1; fewer where two iterates differ by no more than the tolerance
    tolerance, scale : > 0; the largest difference of two iterates, each component over its `scale`, (k,) or one number. Beyond it the
        step carries the signal
    events : g(t, y), returns any fixed number of values; where one changes its sign, the step ends, located to round-off, and the
        integrator starts anew. A value that comes and goes within one step is not seen
    at_event : called at each event, where the caller may change what `derivative` computes; True ends the run

    Returns :class:`AdamsSolution`. Raises ValueError for arguments out of range and for derivatives that are not finite.
    Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, 2nd ed. 1993, ch. III.1.

    >>> run = integrate_adams(lambda t, y: -y, [1.0], 1.0, 0.05)
    >>> bool(abs(run.state[-1, 0] - np.exp(-1.0)) < 1e-6)
    True
    """
    first = np.atleast_1d(numbers("state", state, ""))
    if first.ndim != 1 or not first.size:
        raise ValueError(f"state must have shape (k,), not {first.shape}")
    begin, last = float(numbers("start", start, "s")), float(numbers("end", end, "s"))
    if last < begin:
        raise ValueError(f"end must be >= start = {begin:g} s, not {last:g}")
    scales = numbers("scale", scale, "", low=0.0, low_open=True)
    if scales.shape not in {(), (1,), first.shape}:
        raise ValueError(f"scale must be one number or have the shape of the state, {first.shape}, not {scales.shape}")
    count = 0 if events is None else np.atleast_1d(np.asarray(events(begin, first.copy()), dtype=np.float64)).size
    adams = _physics.Adams(derivative, None if events is None else lambda t, y: np.atleast_1d(events(t, y)), count,
                           float(numbers("step", step, "s", low=0.0, low_open=True)), corrections,
                           float(numbers("tolerance", tolerance, "", low=0.0, low_open=True)), begin, first.tolist(),
                           np.broadcast_to(scales, first.shape).tolist())
    times, states, errors, made, signals, found = [begin], [first], [np.zeros_like(first)], [0], [False], []
    while adams.time < last:
        taken, _, signal, index = adams.advance(last)
        times.append(adams.time)
        states.append(adams.state)
        errors.append(adams.error)
        made.append(taken)
        signals.append(signal)
        if index >= 0:
            found.append(AdamsEvent(adams.time, index, states[-1]))
            if at_event is not None:
                if at_event(found[-1]):
                    break
                adams.restart()
    return AdamsSolution(np.array(times), np.array(states), np.array(errors), np.array(made), np.array(signals), found)


class LocalErrors(NamedTuple):
    """Exact minus computed of each step, shape (n - 3, k): of positions (m) and velocities (m/s)."""

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]


def local_errors(accelerations: ArrayLike, step: float) -> LocalErrors:
    """Local errors of the steps of velocity Verlet, or of leapfrog, from the accelerations that they met.

    accelerations : (n, k), m/s^2: of k components at n >= 4 successive steps; forces of a trajectory that was written every step, over
        the masses. Angular accelerations give errors of angular velocities
    step : s

    Rows of the answer are those of the steps that end at the fourth, fifth ... acceleration. To leading order:

        position h^2/6 [a(n+1) - a(n)],   velocity h/24 [-3 a(n+1) + 7 a(n) - 5 a(n-1) + a(n-2)],

    the next term of Taylor's series, and what the corrector of Adams and Moulton has beyond the trapezoid. Raises ValueError for arguments
    out of range.

    >>> import numpy as np
    >>> t = 0.1 * np.arange(5)
    >>> bool(abs(local_errors((t**3)[:, np.newaxis], 0.1).velocity[0, 0] - (0.3**4 - 0.2**4) / 4 + 0.05 * (0.2**3 + 0.3**3)) < 1e-15)
    True
    """
    table = numbers("accelerations", accelerations, "m/s^2")
    if table.ndim != 2 or len(table) < 4:
        raise ValueError(f"accelerations must have shape (n, k) with n >= 4, not {table.shape}")
    return LocalErrors(*_physics.local_errors(np.ascontiguousarray(table), float(numbers("step", step, "s", low=0.0, low_open=True))))
