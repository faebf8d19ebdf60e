"""Tangential laws, driven along a given path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dembark import _physics
from dembark.physics._checks import CONTACT_PARAMETERS, Limits, contact_number, numbers


@dataclass(frozen=True)
class FrictionPath:
    """What a contact went through along a path; arrays of n steps, forces shaped like the displacement."""

    force: NDArray[np.float64]  # N
    slip: NDArray[np.float64]  # m, since the contact last stuck
    dissipated_energy: NDArray[np.float64]  # J, up to each step


class FrictionLaw:
    """A friction law by the numbers and choices that the engines know, under their names in the table of parameters.

    given : numbers (SI units) and words; what a law needs and does not get, and what no law knows, is a ValueError

    >>> law = FrictionLaw(static_friction=0.5, kinetic_friction=0.4, critical_slip_distance=1e-5)
    >>> law.drive(1.0, 1e5, 1e-6, [1e-6, 1e-3]).round(6).tolist()
    [0.1, 0.4]
    """

    _law: _physics.Friction

    def __init__(self, **given: float | str) -> None:
        object.__setattr__(self, "_law", _physics.Friction({
            name: value if name not in CONTACT_PARAMETERS else float(contact_number(name, value)) for name, value in given.items()}))

    def friction_coefficient(self, slip: ArrayLike) -> NDArray[np.float64] | float:
        """mu(s) for the slip s (m, >= 0)."""
        values = numbers("slip", slip, "m", low=0.0)
        result = np.vectorize(self._law.friction_coefficient, otypes=[float])(values)
        return result if values.shape else float(result)

    def drive(self, normal_force: ArrayLike, tangential_stiffness: ArrayLike, contact_area: ArrayLike, displacement: ArrayLike, *,
              time_step: ArrayLike = 1.0) -> NDArray[np.float64]:
        """Tangential force (N) that a contact answers a path of tangential displacement with.

        normal_force : N, repulsive; negative values count as none
        tangential_stiffness : k_t, N/m, > 0
        contact_area : A, m^2, >= 0
        displacement : (n,) along a line, or (n, 2) or (n, 3) in the contact plane, m; the contact begins unloaded at zero
        time_step : s per point of the path, used by the healing time only

        The first three may be scalars or (n,). Returns the force in the direction of the displacement, shaped like it: positive while
        a positive displacement is resisted. The force on the moving body is its negative.
        """
        return self.follow(normal_force, tangential_stiffness, contact_area, displacement, time_step=time_step).force

    def follow(self, normal_force: ArrayLike, tangential_stiffness: ArrayLike, contact_area: ArrayLike, displacement: ArrayLike, *,
               time_step: ArrayLike = 1.0) -> FrictionPath:
        """Like `drive`, with slip and dissipated energy at each point of the path."""
        path = numbers("displacement", displacement, "m")
        if path.ndim not in (1, 2) or (path.ndim == 2 and path.shape[1] not in (2, 3)):
            raise ValueError(f"displacement must have the shape (n,), (n, 2) or (n, 3), not {path.shape}")
        n = path.shape[0]
        points = np.zeros((n, 3))
        points[:, : 1 if path.ndim == 1 else path.shape[1]] = path[:, None] if path.ndim == 1 else path

        # Of a path along a line any plane through it will do. The factor R has the plane of the points, in nine numbers at most.
        normal = tuple(map(float, np.linalg.svd(np.linalg.qr(points, mode="r"))[2][-1])) if n else (0.0, 0.0, 1.0)

        def column(name: str, value: ArrayLike, unit: str, **limits: Unpack[Limits]) -> NDArray[np.float64]:
            array = numbers(name, value, unit, **limits)
            if array.shape not in ((), (n,)):
                raise ValueError(f"{name} must be a number or have one value a point of the path, shape ({n},), not {array.shape}")
            return np.ascontiguousarray(np.broadcast_to(array, (n,)))

        force, slip, energy = self._law.drive(
            column("normal_force", normal_force, "N"), column("tangential_stiffness", tangential_stiffness, "N/m", low=0.0, low_open=True),
            column("contact_area", contact_area, "m^2", low=0.0), points, column("time_step", time_step, "s", low=0.0, low_open=True),
            normal)
        shaped = force[:, 0] if path.ndim == 1 else force[:, : path.shape[1]]
        return FrictionPath(np.array(shaped), slip, energy)


@dataclass(frozen=True, kw_only=True)
class FinnieRabinowicz(FrictionLaw):
    """Friction that falls with slip from a static to a kinetic coefficient and saturates at the interface's shear strength.

        mu(s) = mu_k + (mu_s - mu_k) exp(-s / s_c)
        T_max = tau_s A [1 - exp(-mu(s) N / (tau_s A))]

    A reconstruction from Rabinowicz (J. Appl. Phys. 22 (1951) 1373; Proc. Phys. Soc. 71 (1958) 668) and Finnie & Shaw (Trans. ASME
    78 (1956) 1649): no source writes the law under both names.

    static_friction, kinetic_friction : mu_s >= mu_k >= 0
    critical_slip_distance : s_c, m, >= 0
    interface_shear_strength : tau_s, Pa, > 0; inf = unlimited (Coulomb)
    presliding : 'linear' (T = k_t u up to the limit), 'exponential' (T = T_max (1 - exp(-k_t u / T_max)), Dahl) or 'partial_slip' (a
        Hertzian contact whose rim slips first; Mindlin and Deresiewicz, with the loading history)
    friction_limit : what limits friction in a contact, N above: 'total', the normal force with its dashpot, or 'elastic', that of its
        spring alone; `drive` and `follow` are given N
    healing_time : s, time constant with which a contact that sticks forgets its slip; 0 = at once

    >>> law = FinnieRabinowicz(static_friction=0.5, kinetic_friction=0.4, critical_slip_distance=1e-5, interface_shear_strength=np.inf)
    >>> law.drive(1.0, 1e5, 1e-6, [1e-6, 1e-3]).round(6).tolist()
    [0.1, 0.4]
    """

    static_friction: float
    kinetic_friction: float
    critical_slip_distance: float
    interface_shear_strength: float = np.inf
    presliding: str = "linear"
    healing_time: float = 0.0
    friction_limit: str = "total"

    def __post_init__(self) -> None:
        super().__init__(**vars(self))
