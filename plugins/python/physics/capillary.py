"""Capillary force of a liquid bridge between two spheres, or a sphere and a wall."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import contact_number, numbers, together

CAPILLARY_MODELS: tuple[str, ...] = tuple(_physics.capillary_models())


@lru_cache(maxsize=64)
def _bridge(model: str, contact_angle: float) -> _physics.BridgeForce:
    return _physics.BridgeForce(model, contact_angle)


def check_model(model: str) -> None:
    """ValueError, with the names there are, for a model that is not known."""
    if model not in CAPILLARY_MODELS:
        raise ValueError(f"capillary model {model!r} is unknown; it can be {', '.join(CAPILLARY_MODELS)}")


def bridge_radius(radius_i: ArrayLike, radius_j: ArrayLike) -> NDArray[np.float64]:
    """R = 2 R* = 2 Ri Rj / (Ri + Rj), 2 Ri against a wall (Rj = inf)."""
    a, b = _radii(radius_i, radius_j)
    return 2.0 / (1.0 / a + 1.0 / b)


def _radii(radius_i: ArrayLike, radius_j: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a = numbers("radius_i", radius_i, "m", low=0.0, low_open=True, infinite=True)
    b = numbers("radius_j", radius_j, "m", low=0.0, low_open=True, infinite=True)
    together(radius_i=a, radius_j=b)
    if (np.isinf(a) & np.isinf(b)).any():
        raise ValueError("radius_i and radius_j must not both be infinite: two walls hold no pendular bridge")
    return a, b


def _volumes(volume: ArrayLike, radius_i: NDArray[np.float64], radius_j: NDArray[np.float64]) -> NDArray[np.float64]:
    """`volume` (m^3) as float64; ValueError for less than 0 and, as in the engines, for more than 100 cubes of the largest radius."""
    array = numbers("volume", volume, "m^3", low=0.0)
    each, *pair = together(volume=array, radius_i=radius_i, radius_j=radius_j)
    radius = np.maximum(*(np.where(np.isinf(one), 0.0, one) for one in pair))
    worst = int(np.argmax(each / radius**3)) if each.size else None
    if worst is not None and (line := _physics.wrong_bridge_volume("volume", float(each.flat[worst]), float(radius.flat[worst]))):
        raise ValueError(line)
    return array


def _by_angle(contact_angle: NDArray[np.float64], model: str, call: Callable[..., NDArray[np.float64]],
              **arrays: NDArray[np.float64]) -> NDArray[np.float64] | float:
    angle, *columns = together(contact_angle=contact_angle, **arrays)
    shape = angle.shape
    angle = angle.ravel()
    columns = [np.ascontiguousarray(c.ravel()) for c in columns]
    result = np.empty(angle.size)
    for value in np.unique(angle):
        chosen = angle == value
        result[chosen] = call(_bridge(model, float(value)), *(np.ascontiguousarray(c[chosen]) for c in columns))
    return result.reshape(shape) if shape else float(result[0])


def capillary_force(radius_i: ArrayLike, radius_j: ArrayLike, gap: ArrayLike, volume: ArrayLike, surface_tension: ArrayLike,
                    contact_angle: ArrayLike, *, model: str = "exact") -> NDArray[np.float64] | float:
    """Attractive force of a liquid bridge (N, positive = attractive).

    Parameters broadcast against each other; a scalar comes back for scalars.

    radius_i, radius_j : m, > 0; ``inf`` is a wall
    gap : m, surface to surface; zero or negative (overlap) is the force at touching
    volume : m^3 of liquid in the bridge, >= 0; more than 100 cubes of the larger radius are refused as a wrong unit
    surface_tension : N/m, >= 0, <= 10
    contact_angle : rad, 0 to pi/2, mean of the two surfaces
    model : 'exact' (stable axisymmetric solution of Young and Laplace for the two radii; for V/R^3 = 1e-6...0.1 and angles up to 60
        degrees within 0.1 % up to 0.9 of the rupture distance), 'willett', 'willett_full' (Willett et al., Langmuir 16 (2000) 9396),
        'rabinovich' (Langmuir 21 (2005) 10992), 'bagheri' (2024), 'constant'; R = 2 R* = 2 Ri Rj / (Ri + Rj), all that the closed
        forms know of the radii

    Zero beyond the rupture distance (see `rupture_distance`). Raises ValueError or TypeError for arguments out of range.

    >>> f = capillary_force(1e-3, 1e-3, [0.0, 1e-4, 1e-2], 1e-11, 0.072, 0.0)
    >>> bool(f[0] > f[1] > f[2] == 0.0)
    True
    """
    check_model(model)
    angle = numbers("contact_angle", contact_angle, "rad", low=0.0, high=np.pi / 2)
    a, b = _radii(radius_i, radius_j)
    return _by_angle(angle, model, _physics.BridgeForce.force, radius_i=a, radius_j=b, gap=numbers("gap", gap, "m", infinite=True),
                     volume=_volumes(volume, a, b), surface_tension=contact_number("surface_tension", surface_tension))


def rupture_distance(volume: ArrayLike, contact_angle: ArrayLike, radius_i: ArrayLike, radius_j: ArrayLike, *,
                     model: str = "exact") -> NDArray[np.float64] | float:
    """Gap (m) at which a stretched bridge breaks; arguments as in `capillary_force`.

    'exact': where the Young-Laplace bridge ceases to be stable. 'rabinovich' and 'constant':
    (1 + theta/2) V^(1/3) (Lian, Thornton & Adams, J. Colloid Interface Sci. 161 (1993) 138). Others: Willett et al. (2000).
    """
    check_model(model)
    angle = numbers("contact_angle", contact_angle, "rad", low=0.0, high=np.pi / 2)
    a, b = _radii(radius_i, radius_j)
    return _by_angle(angle, model, _physics.BridgeForce.rupture_distance, radius_i=a, radius_j=b, volume=_volumes(volume, a, b))
