"""What is measured of any silo: quantities with intervals from its columns, the curves with Janssen's law, and the remarks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from dembark.input_decks.common.power_law import PowerLawFit, ordered
from dembark.postproc.measurement import Array, Measurement, Value
from dembark.postproc.replica import cached_per_replica
from dembark.postproc.resampling import pooled, profile, resampled
from dembark.postproc.statistics import Estimate, block_mean, exact, time_blocks
from dembark.postproc.studies import measured as of_point
from dembark.postproc.studies import propagated

from . import janssen
from .column import Column, Mask
from .silo_geometry import overlap

Fit = Callable[[Mask, Mask], Any]
ZERO = Estimate(0.0, 0.0)
# Share of its kinetic friction that a wall must mobilise for Janssen's law with that friction to be a reference: the force on the base
# changes relatively by no more than the friction does, which so takes at most half of the tolerance of 10 %.
MOBILISED = 0.95


def _kept(fit: Fit) -> Fit:
    """`fit` done once for each pair of masks: fits are the slowest step here, and several quantities come from one."""
    found: dict[bytes, Any] = {}

    def get(frames: Mask, sectors: Mask) -> Any:
        key = frames.tobytes() + sectors.tobytes()
        if key not in found:
            found[key] = fit(frames, sectors)
        return found[key]

    return get


@cached_per_replica
def scalars(one: Column) -> dict[str, Estimate]:
    """Quantities of one replica by name, lengths over the vessel's size; names with _ are what references and intervals are made of."""
    frames, (_, whole), size = time_blocks(one.shear.sum(axis=(1, 2))), one.everything, one.vessel.size
    sectors, fitted, pair = np.arange(len(whole)), _kept(one.fitted_length), _kept(one.fitted_pair)

    def coulomb(f: Mask, s: Mask) -> float:
        return one.janssen_base_share(one.friction, f, s)

    def mobilised(f: Mask, s: Mask) -> float:
        return one.janssen_base_share(one.mobilisation(f, s), f, s)

    measures = {
        "janssen_profile_deviation": one.worst_deviation,
        "janssen_length_predicted": lambda f, s: one.predicted_length(f, s) / size,
        "janssen_length_measured": lambda f, s: fitted(f, s) / size,
        "_length_error": lambda f, s: one.predicted_length(f, s) / fitted(f, whole) - 1.0,
        "_base_predicted": coulomb,
        "_base_mobilised": mobilised,
        "_base_error": lambda f, s: one.base_share(f) / coulomb(f, s) - 1.0,
        "stress_ratio_k": one.stress_ratio,
        "stress_ratio_k_contacts": one.contact_ratio,
        "k_mu_contacts": lambda f, s: one.contact_ratio(f, s) * one.mobilisation(f, s),
        "wall_mobilisation": one.mobilisation,
        "wall_adhesion": one.adhesive_stress,
        "_hanging_weight": one.hanging_weight,
        "solid_fraction": one.solid_fraction,
        "_pair_length": lambda f, s: pair(f, s)[0] / size,
        "hydrostatic_height": lambda f, s: pair(f, s)[1] / size,
        "two_parameter_gain": lambda f, s: pair(f, s)[2],
    }
    unknown = "only other packings show how much this varies"
    return {
        **{name: resampled(measure, frames, sectors, overlap(len(sectors))) for name, measure in measures.items()},
        "apparent_mass_ratio": resampled(one.base_share, frames),
        "sliding_load": resampled(one.sliding_load, frames),
        "sliding_friction": resampled(one.sliding_friction, frames),
        "field_balance_deviation": block_mean(one.field_errors()),
        "force_balance_error": one.force_error,
        "filled_mass": Estimate(one.mass, math.inf, unknown),
        "filling_height": Estimate(one.height / size, math.inf, unknown),
    }


def base_prediction(points: Sequence[Mapping[str, Any]]) -> Measurement:
    """The force on the base of cylinders of other fillings or radii (results `points`), predicted from that of the variant `dry`, and K mu
    fitted to them. Of `dry` come K of the contact stress, mobilised friction and bulk density; of the others filled mass and radius."""
    known = next(point for point in points if point["variant"] == "dry")
    held = [point for point in points if point is not known]
    k_mu = of_point(known, "k_mu_contacts")

    def height(point: Mapping[str, Any]) -> float:
        """Of the filling over R, at the bulk density of `dry`."""
        wider = float(point["parameters"]["cylinder_radius"]) / float(known["parameters"]["cylinder_radius"])
        masses = [of_point(one, "filled_mass").value for one in (point, known)]
        return of_point(known, "filling_height").value * masses[0] / masses[1] / wider**3

    def law(depth: float) -> Estimate:
        return propagated(lambda values: float(janssen.base_share(2.0 * depth * values[0])), np.array([k_mu.value]), np.array([k_mu.half]),
                          "K and μ_mob of dry")

    depth = np.array([height(point) for point in held])
    base = PowerLawFit.of(held, "apparent_mass_ratio", depth)
    fitted = propagated(lambda values: janssen.fitted_friction(depth, values), base.values, base.halves, "the apparent masses")
    values = {"held_out_k_mu": Value(fitted, k_mu, detail=f"fitted to {len(held)} other silos; reference: K and μ_mob of dry alone")}
    for point, y in zip(held, depth, strict=True):
        values[f"held_out_mass_{point['variant']}"] = Value(of_point(point, "apparent_mass_ratio"), law(y),
                                                            detail=f"filled {y:.2f} R high; reference: Janssen with K, μ_mob, ρ_b of dry")
    points = sorted(points, key=height)
    place = np.array([height(point) for point in points])
    every = PowerLawFit.of(points, "apparent_mass_ratio", place, place)
    if len({point["parameters"]["cylinder_radius"] for point in points}) == 1:
        pair = janssen.fitted_pair(place, every.values, [(2.0, 0.02), (2.0, 0.5)], ((0.05, 100.0), (0.0, 0.9 * place[-1])), 1.0)
        one = janssen.fitted_length(place, every.values, 2.0)
        values["filling_two_parameter_gain"] = Value(exact(janssen.gain(place, every.values, one, pair)), detail=(
            f"all {len(points)} silos; with it λ is {pair[0]:.2f} R, the zone {pair[1]:.2f} R deep"))
    curve = profile("apparent_mass", "Apparent mass", "filled mass / (ρ_b π R³)", "force on the base / (g ρ_b π R³)", place, [every.values],
                    half=every.halves, reference=place * janssen.base_share(2.0 * k_mu.value * place),
                    reference_label="Janssen, K and μ_mob of dry alone")
    remark = ("K of the contact stress, μ_mob and ρ_b are calibrated with `dry` alone; every other point is a prediction. Each is a "
              "separate packing, filled by rain, with the wall creeping upward, so that all have the same history.")
    return Measurement(values, [curve], [remark])


def mobilisation(points: Sequence[Mapping[str, Any]]) -> Measurement:
    """How much of its kinetic friction the wall mobilises, over the static friction of the wall, which the results `points` differ in."""
    points, place = ordered(points, "wall_friction")
    kinetic = place * np.array([point["parameters"]["kinetic_friction_ratio"] for point in points], float)
    share = PowerLawFit.of(points, "wall_mobilisation", place, 1.0 / kinetic)
    sliding = PowerLawFit.of(points, "sliding_load", place)
    along = "static friction of the wall"
    return Measurement({}, [
        profile("mobilisation", "Mobilised friction", along, "μ_mob / kinetic friction", place, [share.values], half=share.halves,
                reference=np.full_like(place, MOBILISED), reference_label="above, Janssen's law with it is a reference"),
        sliding.curve("sliding_load", "Normal force in contacts that slide", along, "share of the wall's normal force")])


def measured(columns: Sequence[Column], size: str, across: str, friction: Mapping[str, float]) -> Measurement:
    """Values, profiles and remarks of all columns of a series. `size`: symbol of the length in Janssen's law; `across`: letter of the
    direction to the wall; `friction`: the coefficients `wall_static` and `wall_kinetic`."""
    found, wet = [scalars(column) for column in columns], bool(columns[0].adhesion.any())
    over = {name: pooled(found, name) for name in found[0]}
    kinetic = friction["wall_kinetic"]
    predicts, slides = over["wall_mobilisation"].value >= MOBILISED * kinetic > 0.0, math.isfinite(over["sliding_friction"].value)
    references: dict[str, tuple[Estimate, float | None]] = {
        "janssen_profile_deviation": (ZERO, None),
        "janssen_length_predicted": (over["janssen_length_measured"], over["_length_error"].half),
        "apparent_mass_ratio": (over["_base_predicted"], over["_base_error"].half),
        **({"sliding_friction": (exact(kinetic), None)} if kinetic > 0.0 else {}),
        "force_balance_error": (ZERO, None),
        "field_balance_deviation": (ZERO, None),
    }
    undue = {} if predicts else {"apparent_mass_ratio": f"the wall mobilises less than {MOBILISED:.0%} of its kinetic friction"}
    unknown = {} if slides else {"sliding_friction": "no contact with the wall slides"}
    details = {"wall_mobilisation": f"the wall's static friction is {friction['wall_static']:g}, its kinetic one {kinetic:g}",
               "apparent_mass_ratio": "Janssen with K of the contact stress and the wall's kinetic friction",
               "two_parameter_gain": f"with it λ is {over['_pair_length'].value:.2f} {size}"}
    values = {name: Value(one, reference, half, detail=details.get(name, ""), reason=unknown.get(name, ""),
                          inapplicable=undue.get(name, ""))
              for name, one in over.items() for reference, half in [references.get(name, (None, None))]
              if not name.startswith("_") and (wet or name != "wall_adhesion")}
    return Measurement(values, _profiles(columns, over, across, friction["wall_static"]), _remarks(columns, over, wet, friction))


def _remarks(columns: Sequence[Column], over: Mapping[str, Estimate], wet: bool, friction: Mapping[str, float]) -> list[str]:
    static, kinetic, mobilised = friction["wall_static"], friction["wall_kinetic"], over["wall_mobilisation"].value
    measured, predicted, own = (over[name].value for name in ("apparent_mass_ratio", "_base_predicted", "_base_mobilised"))
    share = f"{mobilised / kinetic:.0%} of its kinetic" if kinetic > 0.0 else "no"
    judged = ("Janssen's law with the kinetic friction is a reference for the force on the base." if mobilised >= MOBILISED * kinetic > 0.0
              else "Janssen's law with the kinetic friction is not a reference here; along a wall with less friction, or where they resist "
                   "rolling, all grains slide.")
    remarks = [
        (f"The wall mobilises {share} friction (μ_mob = {mobilised:.3f}; static {static:g}, kinetic {kinetic:g}): "
         f"{over['sliding_load'].value:.0%} of its normal force is in contacts that slide; at others spheres stick and roll, and their "
         f"friction is smaller or not vertical. {judged}"),
        (f"The base carries {measured:.3f} of the weight, by Janssen's law {predicted:.3f} with the kinetic friction and {own:.3f} with "
         f"μ_mob: friction that is not mobilised explains {own / predicted - 1.0:+.1%} of {measured / predicted - 1.0:+.1%}. The rest is "
         "what the law with one K leaves out, above all the lowest diameter: the base orders its grains, and less of the load presses on "
         "the wall."),
        ("Calibrated in the same column, and therefore counted as identities: λ = size / (2 K μ_mob), where K μ_mob is the wall "
         "shear over σ_zz, and Janssen's profile with it. They hold for any shear that is proportional to σ_zz and do not test its "
         "magnitude, which the friction of the sliding contacts does.")]
    if wet:
        hanging = 1.0 - over["_hanging_weight"].value / float(np.mean([column.weight for column in columns]))
        remarks.append(f"Liquid bridges pull the grains to the wall with {over['wall_adhesion'].value:.3g} Pa; the friction due to this "
                       f"pull alone carries {hanging:.0%} of the weight, and Janssen's law is applied to the remaining weight.")
    if len(columns) < 3:
        remarks.append("With fewer than three packings the intervals come from time blocks and from sectors of the walls within the "
                       "packing; they do not include variations from packing to packing.")
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

    free = "Janssen, K and μ_mob of this column"
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
