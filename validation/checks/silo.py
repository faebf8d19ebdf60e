"""Silo: stresses of a packing in a vertical cylinder whose wall creeps upward, against Janssen's law with nothing fitted.

Janssen (Z. Ver. dtsch. Ing. 39 (1895) 1045; translation: Sperl, arXiv:cond-mat/0511618): sigma_zz = rho_b g lambda (1 - exp(-h / lambda)),
lambda = R / (2 K mu_mob), h the depth below the surface. Everything is defined at the wall, r = R: the cross-section is pi R^2, the wall's
area 2 pi R dz, the solid fraction counts the volume up to r = R, although the grains' centres reach R - d/2 only. K is the wall's normal
stress over the mean sigma_zz of the cross-section, mu_mob the wall's shear over its normal stress: both measured in the lower half
(from one diameter above the base to half the height), none taken from the material's friction.

Wet grains are also pulled to the wall by their liquid bridges, with a stress a that adds to the pressure in the contacts but not to the
wall's net normal stress. Janssen's balance d sigma / dh = rho_b g - 2 tau / R with tau = mu_mob (K sigma + a) then gives the same law with
the specific weight rho_b g - 2 mu_mob a / R, and mu_mob = tau / (sigma_rr + a). The stress a is measured too: each grain at the wall
contributes the force of its bridge. Dry grains have a = 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dembark.validation.checks.carried_liquid import liquid_quantities
from dembark.validation.checks.column import Array, Column, Mask, janssen, read
from dembark.validation.checks.filling import filling_study
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, pooled, profile, resampled, time_blocks
from dembark.validation.checks.vessel import overlap
from dembark.validation.references import CAMBAU, JANSSEN, LANDRY, WALKER
from dembark.postproc.statistics import Estimate, block_mean, over_replicas

REFERENCES = (JANSSEN, LANDRY, CAMBAU, WALKER)
TOLERANCE = 0.10
BALANCE_TOLERANCE = 1e-3


def _scalars(column: Column) -> dict[str, Estimate]:
    frames = time_blocks(column.shear.sum(axis=(1, 2)))
    sectors = np.arange(column.shear.shape[2])
    pairs: dict[bytes, tuple[float, float, float]] = {}

    whole = np.ones(len(sectors), bool)
    fits: dict[bytes, float] = {}

    def fitted(keep: Mask) -> float:
        if keep.tobytes() not in fits:
            fits[keep.tobytes()] = column.fitted_length(keep, whole)
        return fits[keep.tobytes()]

    def pair(keep: Mask, places: Mask, part: int) -> float:
        # Three quantities come from one fit, which is the slowest step here.
        key = keep.tobytes() + places.tobytes()
        if key not in pairs:
            pairs[key] = column.fitted_pair(keep, places)
        return pairs[key][part]

    measures = {
        "predicted": column.predicted_length,
        "fitted": column.fitted_length,
        "length_error": lambda keep, places: column.predicted_length(keep, places) / fitted(keep) - 1.0,
        "worst": column.worst_deviation,
        "k": column.stress_ratio,
        "mobilisation": column.mobilisation,
        "adhesion": column.adhesive_stress,
        "hanging": column.hanging_weight,
        "fraction": column.solid_fraction,
        "base_predicted": column.predicted_base_share,
        "base_error": lambda keep, places: column.base_share(keep) / column.predicted_base_share(keep, places) - 1.0,
        "pair_length": lambda keep, places: pair(keep, places, 0),
        "onset": lambda keep, places: pair(keep, places, 1),
        "gain": lambda keep, places: pair(keep, places, 2),
    }
    result = {name: resampled(measure, frames, sectors, overlap(len(sectors))) for name, measure in measures.items()}
    result["base"] = resampled(column.base_share, frames)
    result["field_error"] = block_mean(column.field_errors())
    result["force_error"] = column.force_error
    return result


def picture(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """How the report shows the packing."""
    return {"colour_by": "stress", "scale": 1e3, "cut": True, "radius": parameters["cylinder_radius"]}


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, profiles and remarks for the report from all replicas of a series."""
    remarks = [f"{one.short}: {one.statement}" for one in (LANDRY, CAMBAU)]
    found, drawn, said = results([read(replica) for replica in replicas], "R", "r")
    return [*found, *liquid_quantities(replicas)], drawn, [said[0], *remarks, *said[1:]]


def fields(replicas: Sequence[Replica], found: Sequence[Quantity]) -> Any:
    """Fields over radius and height, with quantities drawn from them."""
    from dembark.validation.checks.fields_silo import measure

    return measure(replicas, {one.name: one for one in found}, TOLERANCE, BALANCE_TOLERANCE)


def results(columns: Sequence[Column], length: str, across: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The same from the measured columns of any vessel, whose size has the symbol `length` and whose direction across is `across`."""
    scalars = [_scalars(column) for column in columns]
    size, normal = columns[0].size, f"σ_{across}{across}"

    def over(name: str, factor: float = 1.0) -> Estimate:
        found = pooled(scalars, name)
        return Estimate(found.value * factor, found.half * factor, found.basis)

    def known(values: list[float]) -> Estimate:
        # Within a packing nothing says how much it differs from others.
        return over_replicas([Estimate(value, math.inf, "only other packings tell how far this varies") for value in values])

    zero, wet = Estimate(0.0, 0.0), bool(columns[0].adhesion.any())
    found = [
        Quantity(
            "janssen_profile_deviation",
            "σ_zz(z) in the lower half: largest deviation from Janssen",
            "1",
            over("worst"),
            reference=zero,
            tolerance=TOLERANCE,
            absolute=True,
            source=JANSSEN.short,
            detail="Janssen's law with measured K, μ_mob, ρ_b" + (" and adhesion a" if wet else "") + ", nothing fitted",
            compared=False,
        ),
        Quantity(
            "janssen_length_predicted",
            f"λ = {length} / (2 K μ_mob), over {length}",
            length,
            over("predicted", 1 / size),
            reference=over("fitted", 1 / size),
            tolerance=TOLERANCE,
            deviation_half=over("length_error").half,
            source=JANSSEN.short,
            detail="reference: the λ fitted to the same run's apparent-mass curve",
        ),
        Quantity(
            "janssen_length_measured",
            f"λ fitted to the apparent-mass curve, over {length}",
            length,
            over("fitted", 1 / size),
            detail="one parameter; ρ_b and the surface are measured",
        ),
        Quantity(
            "apparent_mass_ratio",
            "force on the base over the weight",
            "1",
            over("base"),
            reference=over("base_predicted"),
            tolerance=TOLERANCE,
            deviation_half=over("base_error").half,
            source=JANSSEN.short,
            detail="reference: Janssen's law with the predicted λ",
        ),
        Quantity(
            "force_balance_error",
            "(base + wall friction) / weight − 1",
            "1",
            over("force_error"),
            reference=zero,
            tolerance=BALANCE_TOLERANCE,
            absolute=True,
            source="Newton's second law",
            detail="mean over the measuring window of time.csv",
            compared=False,
        ),
        Quantity(
            "field_balance_deviation",
            "contact-stress field over balance stress − 1",
            "1",
            over("field_error"),
            reference=zero,
            absolute=True,
            tolerance=BALANCE_TOLERANCE,
            source="momentum balance",
            compared=False,
            detail="balance: weight above, less what the wall carries, plus what accelerates grains; so it holds in each frame",
        ),
        Quantity(
            "stress_ratio_k",
            f"K = {normal} / σ_zz",
            "1",
            over("k"),
            detail="wall's normal stress over the mean vertical stress, lower half",
        ),
        Quantity(
            "wall_mobilisation",
            f"μ_mob = τ / ({normal} + a)" if wet else f"μ_mob = τ / {normal}",
            "1",
            over("mobilisation"),
            detail=f"lower half; the wall's static friction is {columns[0].wall_friction:g}",
        ),
        *(
            [
                Quantity(
                    "wall_adhesion",
                    "a: pull of the liquid bridges on the wall",
                    "Pa",
                    over("adhesion"),
                    detail="lower half; force of the bridges of all grains at the wall over its area",
                )
            ]
            if wet
            else []
        ),
        Quantity(
            "solid_fraction",
            "solid fraction",
            "1",
            over("fraction"),
            detail="by exact sphere slices up to the wall, without one diameter at base and surface",
        ),
        Quantity("filled_mass", "mass of the grains", "kg", known([column.mass for column in columns]), compared=False),
        Quantity("filling_height", f"filling height over {length}", length, known([column.height / size for column in columns])),
        Quantity(
            "hydrostatic_height",
            f"depth of the hydrostatic zone (two-parameter form), over {length}",
            length,
            over("onset", 1 / size),
            source=WALKER.short,
            compared=False,
        ),
        Quantity(
            "two_parameter_gain",
            "share of Janssen's squared residuals that the second parameter removes",
            "1",
            over("gain"),
            source=WALKER.short,
            compared=False,
            detail=f"with it λ is {over('pair_length').value / size:.2f} {length}",
        ),
    ]
    static, kinetic = columns[0].wall_friction, columns[0].kinetic_friction
    mobilised = over("mobilisation").value
    limits = f"{mobilised / static:.0%} of its static and {mobilised / kinetic:.0%} of its kinetic" if static > 0 and kinetic > 0 else "no"
    # Spheres that slide reach the kinetic limit; a clear shortfall means that they roll.
    manner = (
        "The grains at the wall slide, close to the kinetic limit."
        if mobilised > 0.85 * kinetic
        else "Spheres roll along a smooth wall instead of sliding, which keeps the shear below Coulomb's limit."
    )
    if wet:
        share = 1.0 - over("hanging").value / float(np.mean([column.weight for column in columns]))
        manner += (
            f" Liquid bridges pull the grains to the wall with {over('adhesion').value:.3g} Pa; the friction of that pull alone carries "
            f"{share:.0%} of the weight, and Janssen's law is taken with what is left of it."
        )
    remarks = [
        (
            f"The wall carries {limits} friction (μ_mob = {mobilised:.3f}; static {static:g}, kinetic {kinetic:g}). {manner} Janssen's "
            "law is therefore checked with the measured mobilisation; with the static coefficient in its place λ would come out shorter by the first "
            "of these shares."
        ),
    ]
    if len(columns) < 3:
        remarks.append(
            "With fewer than three packings the intervals come from time blocks and from sectors of the walls within the packing; "
            "what varies from packing to packing as a whole is not in them."
        )
    return found, _profiles(columns, over, normal), remarks


def study(name: str, points: Sequence[dict[str, Any]], along: str) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """The study `filling`: apparent mass against filled mass."""
    del name, along
    return filling_study(points, TOLERANCE)


def _moving_mean(values: Array) -> Array:
    """Mean over five bands, over fewer at the ends; one value a band, however short the column is."""
    # Of two arrays, "same" has the length of the longer one.
    kernel = np.ones(min(5, len(values)))
    return np.convolve(values, kernel, "same") / np.convolve(np.ones_like(values), kernel, "same")


def _profiles(columns: Sequence[Column], over: Any, stress: str) -> list[dict[str, Any]]:
    first = columns[0]
    place = np.linspace(0.02, 0.98, 40)

    everything = [(np.ones(len(one.base), bool), np.ones(one.shear.shape[2], bool)) for one in columns]

    height = float(np.mean([column.height for column in columns]))
    law = janssen(height * (1.0 - place), over("predicted").value, over("hanging").value)
    k, friction, adhesion = over("k").value, over("mobilisation").value, over("adhesion").value

    def entry(
        name: str, title: str, across: str, get: Any, reference: Array | None = None, label: str = "", note: str = ""
    ) -> dict[str, Any]:
        rows = [
            np.interp(place * column.height, column.middle, get(column, *whole)) for column, whole in zip(columns, everything, strict=True)
        ]
        return profile(
            name,
            title,
            "height z / d",
            across,
            place * height / first.diameter,
            rows,
            vertical=True,
            reference=reference,
            reference_label=label,
            note=note,
        )

    moving, nothing_fitted = "moving mean over 5 d", "Janssen, nothing fitted"
    return [
        entry("sigma_zz_balance", "Vertical stress, balance", "σ_zz (Pa)", lambda c, f, s: c.balance(f), law, nothing_fitted),
        entry("sigma_zz_field", "Vertical stress, contacts", "σ_zz (Pa)", lambda c, f, s: c.field.mean(axis=0), law, nothing_fitted),
        entry(
            stress.replace("σ", "sigma"),
            "Wall normal stress",
            f"{stress} (Pa)",
            lambda c, f, s: _moving_mean(c.wall(c.normal, f, s)),
            k * law,
            "K × Janssen",
            moving,
        ),
        entry(
            "tau",
            "Wall shear stress",
            "τ (Pa)",
            lambda c, f, s: _moving_mean(c.wall(c.shear, f, s)),
            friction * (k * law + adhesion),
            "μ_mob (K × Janssen + a)" if adhesion else "K μ_mob × Janssen",
            moving,
        ),
        entry(
            "mobilisation",
            "Mobilised wall friction",
            f"τ / ({stress} + a)" if adhesion else f"τ / {stress}",
            lambda c, f, s: _moving_mean(c.wall(c.shear, f, s)) / _moving_mean(c.wall(c.normal, f, s) + c.wall(c.adhesion, f, s)),
            np.full_like(place, first.wall_friction),
            "static friction of the wall",
            moving,
        ),
        entry("solid_fraction", "Solid fraction", "φ", lambda c, f, s: c.volume.sum(axis=2).mean(axis=0) / (c.area * np.diff(c.edges))),
    ]
