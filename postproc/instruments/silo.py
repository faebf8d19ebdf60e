"""What is measured of any silo: quantities with intervals from its columns, the curves beside Janssen's law, and the remarks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from dembark.postproc.instruments import janssen
from dembark.postproc.instruments.column import Column, Mask
from dembark.postproc.instruments.growth import Growth
from dembark.postproc.instruments.vessel import overlap
from dembark.postproc.measurement import Array, Measurement, Value
from dembark.postproc.replica import once
from dembark.postproc.resampling import pooled, profile, resampled
from dembark.postproc.statistics import Estimate, block_mean, exact, time_blocks
from dembark.postproc.studies import measured as of_point
from dembark.postproc.studies import propagated

Fit = Callable[[Mask, Mask], Any]
ZERO = Estimate(0.0, 0.0)


def _kept(fit: Fit) -> Fit:
    """`fit` done once for each pair of masks: fits are the slowest step here, and several quantities come from one."""
    found: dict[bytes, Any] = {}

    def get(frames: Mask, sectors: Mask) -> Any:
        key = frames.tobytes() + sectors.tobytes()
        if key not in found:
            found[key] = fit(frames, sectors)
        return found[key]

    return get


@once
def scalars(one: Column) -> dict[str, Estimate]:
    """Quantities of one replica by name, lengths over the vessel's size; names with _ are what references and intervals are made of."""
    frames, (_, whole), size = time_blocks(one.shear.sum(axis=(1, 2))), one.everything, one.vessel.size
    sectors, fitted, pair = np.arange(len(whole)), _kept(one.fitted_length), _kept(one.fitted_pair)
    measures = {
        "janssen_profile_deviation": one.worst_deviation,
        "janssen_length_predicted": lambda f, s: one.predicted_length(f, s) / size,
        "janssen_length_measured": lambda f, s: fitted(f, s) / size,
        "_length_error": lambda f, s: one.predicted_length(f, s) / fitted(f, whole) - 1.0,
        "_base_predicted": one.predicted_base_share,
        "_base_error": lambda f, s: one.base_share(f) / one.predicted_base_share(f, s) - 1.0,
        "stress_ratio_k": one.stress_ratio,
        "wall_mobilisation": one.mobilisation,
        "wall_adhesion": one.adhesive_stress,
        "_hanging_weight": one.hanging_weight,
        "solid_fraction": one.solid_fraction,
        "_pair_length": lambda f, s: pair(f, s)[0] / size,
        "hydrostatic_height": lambda f, s: pair(f, s)[1] / size,
        "two_parameter_gain": lambda f, s: pair(f, s)[2],
    }
    unknown = "only other packings tell how far this varies"
    return {
        **{name: resampled(measure, frames, sectors, overlap(len(sectors))) for name, measure in measures.items()},
        "apparent_mass_ratio": resampled(one.base_share, frames),
        "field_balance_deviation": block_mean(one.field_errors()),
        "force_balance_error": one.force_error,
        "filled_mass": Estimate(one.mass, math.inf, unknown),
        "filling_height": Estimate(one.height / size, math.inf, unknown),
    }


def fillings(points: Sequence[Mapping[str, Any]], size: str) -> Measurement:
    """The classical experiment: the mass that the base feels of several fillings, M_app = M_sat (1 - exp(-M / M_sat)) with that of lambda.

    `points` are the results of silos that differ in the mass filled in; `size` is the symbol of the length in Janssen's law.
    """
    points = sorted(points, key=lambda point: of_point(point, "filled_mass").value)
    mass = np.array([of_point(point, "filled_mass").value for point in points])
    base = Growth.of(points, "apparent_mass_ratio", mass, mass)
    # Mass of a piece of the column as high as `size`.
    per_size = mass[-1] / of_point(points[-1], "filling_height").value
    predicted, top = of_point(points[-1], "janssen_length_predicted"), float(base.values.max())
    fitted = propagated(lambda values: janssen.fitted_length(mass, values, values.max()) / per_size, base.values, base.halves,
                        "the apparent masses")
    starts, limits = [(top, 0.02 * top), (top, 0.3 * top)], ((0.05 * top, 50.0 * top), (0.0, 0.95 * top))
    pair = janssen.fitted_pair(mass, base.values, starts, limits, top)
    law = janssen.stress(mass, predicted.value * per_size)
    gain = Estimate(janssen.gain(mass, base.values, fitted.value * per_size, pair), 0.0)
    deepest = Estimate(float(base.values[-1]), float(base.halves[-1]), of_point(points[-1], "apparent_mass_ratio").basis)
    values = {
        "filling_length": Value(fitted, predicted),
        "largest_apparent_mass": Value(deepest, exact(law[-1])),
        "filling_two_parameter_gain": Value(gain, detail=f"with it λ is {pair[0] / per_size:.2f} {size} and the zone holds {pair[1]:.3g} "
                                                         f"kg; {len(points)} fillings"),
    }
    curve = profile("apparent_mass", "Apparent mass", "filled mass (kg)", "force on the base / g (kg)", mass, [base.values],
                    half=base.halves, reference=law, reference_label="Janssen, nothing fitted")
    remark = ("Each point is a packing of its own, filled by rain to that height, with the wall creeping upward, so that all have the same "
              "history.")
    return Measurement(values, [curve], [remark])


def measured(columns: Sequence[Column], size: str, across: str, friction: Mapping[str, float]) -> Measurement:
    """Values, profiles and remarks of all columns of a series.

    `size`: symbol of the length in Janssen's law; `across`: letter of the direction to the wall; `friction`: the wall's coefficients
    `wall_static` and `wall_kinetic`.
    """
    found, wet = [scalars(column) for column in columns], bool(columns[0].adhesion.any())
    over = {name: pooled(found, name) for name in found[0]}
    references: dict[str, tuple[Estimate, float | None]] = {
        "janssen_profile_deviation": (ZERO, None),
        "janssen_length_predicted": (over["janssen_length_measured"], over["_length_error"].half),
        "apparent_mass_ratio": (over["_base_predicted"], over["_base_error"].half),
        "force_balance_error": (ZERO, None),
        "field_balance_deviation": (ZERO, None),
    }
    details = {"wall_mobilisation": f"lower half; the wall's static friction is {friction['wall_static']:g}",
               "two_parameter_gain": f"with it λ is {over['_pair_length'].value:.2f} {size}"}
    values = {name: Value(one, reference, half, detail=details.get(name, ""))
              for name, one in over.items() for reference, half in [references.get(name, (None, None))]
              if not name.startswith("_") and (wet or name != "wall_adhesion")}
    return Measurement(values, _profiles(columns, over, across, friction["wall_static"]), _remarks(columns, over, wet, friction))


def _remarks(columns: Sequence[Column], over: Mapping[str, Estimate], wet: bool, friction: Mapping[str, float]) -> list[str]:
    static, kinetic, mobilised = friction["wall_static"], friction["wall_kinetic"], over["wall_mobilisation"].value
    limits = f"{mobilised / static:.0%} of its static and {mobilised / kinetic:.0%} of its kinetic" if static > 0 and kinetic > 0 else "no"
    # Spheres that slide reach the kinetic limit; a clear shortfall means that they roll.
    manner = ("The grains at the wall slide, close to the kinetic limit." if mobilised > 0.85 * kinetic
              else "Spheres roll along a smooth wall instead of sliding, which keeps the shear below Coulomb's limit.")
    if wet:
        share = 1.0 - over["_hanging_weight"].value / float(np.mean([column.weight for column in columns]))
        manner += (f" Liquid bridges pull the grains to the wall with {over['wall_adhesion'].value:.3g} Pa; the friction of that pull "
                   f"alone carries {share:.0%} of the weight, and Janssen's law is taken with what is left of it.")
    remarks = [(f"The wall carries {limits} friction (μ_mob = {mobilised:.3f}; static {static:g}, kinetic {kinetic:g}). {manner} Janssen's "
               "law is therefore checked with the measured mobilisation; with the static coefficient in its place λ would come out shorter "
               "by the first of these shares.")]
    if len(columns) < 3:
        remarks.append("With fewer than three packings the intervals come from time blocks and from sectors of the walls within the "
                       "packing; what varies from packing to packing as a whole is not in them.")
    return remarks


def moving_mean(values: Array) -> Array:
    """Mean over five bands, over fewer at the ends; one value a band, however short the column is."""
    # Of two arrays, "same" has the length of the longer one.
    kernel = np.ones(min(5, len(values)))
    return np.convolve(values, kernel, "same") / np.convolve(np.ones_like(values), kernel, "same")


def _profiles(columns: Sequence[Column], over: Mapping[str, Estimate], across: str, static: float) -> list[dict[str, Any]]:
    place, height, size = np.linspace(0.02, 0.98, 40), float(np.mean([column.height for column in columns])), columns[0].vessel.size
    law = janssen.stress(height * (1.0 - place), over["janssen_length_predicted"].value * size, over["_hanging_weight"].value)
    k, friction, adhesion = (over[name].value for name in ("stress_ratio_k", "wall_mobilisation", "wall_adhesion"))
    normal, adhesive = f"σ_{across}{across}", adhesion != 0.0

    def entry(name: str, title: str, label: str, get: Callable[[Column], Array], reference: Array | None = None, of: str = "",
              note: str = "") -> dict[str, Any]:
        rows = [np.interp(place * column.height, column.middle, get(column)) for column in columns]
        return profile(name, title, "height z / d", label, place * height / columns[0].diameter, rows, vertical=True, reference=reference,
                       reference_label=of, note=note)

    def smooth(name: str, title: str, label: str, get: Callable[[Column], Array], reference: Array, of: str) -> dict[str, Any]:
        return entry(name, title, label, get, reference, of, "moving mean over 5 d")

    def shear(c: Column) -> Array:
        return moving_mean(c.wall(c.shear, *c.everything))

    free = "Janssen, nothing fitted"
    return [
        entry("sigma_zz_balance", "Vertical stress, balance", "σ_zz (Pa)", lambda c: c.balance(c.everything[0]), law, free),
        entry("sigma_zz_field", "Vertical stress, contacts", "σ_zz (Pa)", lambda c: c.field.mean(axis=0), law, free),
        smooth(normal.replace("σ", "sigma"), "Wall normal stress", f"{normal} (Pa)", lambda c: moving_mean(c.wall(c.normal, *c.everything)),
               k * law, "K × Janssen"),
        smooth("tau", "Wall shear stress", "τ (Pa)", shear, friction * (k * law + adhesion),
               "μ_mob (K × Janssen + a)" if adhesive else "K μ_mob × Janssen"),
        smooth("mobilisation", "Mobilised wall friction", f"τ / ({normal} + a)" if adhesive else f"τ / {normal}",
               lambda c: shear(c) / moving_mean(c.pressure(*c.everything)), np.full_like(place, static), "static friction of the wall"),
        entry("solid_fraction", "Solid fraction", "φ", lambda c: c.fractions(*c.everything)),
    ]
