"""Rotating drum: flow on the normal of the free surface through the axis, compared with particle tracking and another code. V&V 20: E = S −
D is known within U_val, U_val² = U_num² + U_input² + U_D²; the studies of friction and stiffness add U_input and U_num."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dembark.input_decks.common.estimates import divided, reference_rows
from dembark.input_decks.common.power_law import ordered
from dembark.postproc.history import reached
from dembark.postproc.measurement import Array, Curve, Estimate, Measurement, Points, Replicas, Value, exact, pooled, profile
from dembark.postproc.statistics import jackknife
from dembark.postproc.studies import compared, measured

from . import side_view
from .drum_profile import DrumFlow, estimates, layer_flux, read
from .side_view import SideView

HERE = Path(__file__).with_name("reference")
FLOW = ("surface_speed", "layer_depth", "layer_shape", "zero_crossing")
METHODS = {"surface_speed": "surface_speed", "zero_crossing": "turn", "layer_depth": "layer_depth", "layer_shape": "layer_shape",
           "surface_angle": "surface_angle", "flux_balance": "flux_balance", "solid_body": "solid_body"}
# 95 % limits of a point of the tracked profile: reading of the figure, and scatter about a smooth curve.
SPEED_READ, PLACE_READ = 0.01, 0.0005
# The angle depends on it by more than its limits.
UNKNOWN = "the length of the other code's drum is not known"
# What makes a run one of the tracked drum, of the other code's drum, and of the drum seen along its axis.
ALIZADEH = {"drum_radius": 0.12, "drum_speed": 1.2147, "solid_filling": 0.1962, "grain_diameter": 0.003}
SUNDAY = {"ends": "walls", "wall_lining": "grains", "drum_radius": 0.03, "drum_depth": 0.005, "solid_filling": 0.3,
          "grain_diameter": 0.001, "grain_diameter_spread": 0.1, "restitution": 0.97, "wall_restitution": 0.82, "grain_friction": 0.16,
          "wall_friction": 0.45, "static_friction": None, "kinetic_friction": None, "kinetic_friction_ratio": 1.0, "bridge_volume": 0.0}
SEEN = {"drum_radius": 0.042, "drum_depth": 0.02, "solid_filling": 0.262}
# 95 % limits over the standard uncertainty.
CONFIDENT = 1.96
# Standard uncertainty (m) of the height of the surface in the images, as in the fit to it.
READING = 7.5e-4


def tracked_profile() -> tuple[Array, Array]:
    """n (m), ascending, and speed (m/s) of the tracked points, without one that is out of line by 0.05 m/s."""
    rows = np.array(sorted((row.number("y"), row.number("u")) for row in reference_rows(HERE / "alizadeh_2013.csv", used="1")))
    return rows[:, 0], rows[:, 1]


def change_of_sign(n: Array, u: Array) -> float:
    """n (m) below the layer of the tracked points at which their speed is 0."""
    return reached(n, -u, 0.0)


def fluxes() -> tuple[float, float]:
    """m2/s: what the tracked layer returns, and what a bed that turns with the drum carries up below it. Equal if the profile is right."""
    n, u = tracked_profile()
    turn = change_of_sign(n, u)
    return (layer_flux(n, -u, turn, float(n[-1]))[0], 0.5 * ALIZADEH["drum_speed"] * (ALIZADEH["drum_radius"] ** 2 - turn**2))


def data() -> dict[str, Estimate]:
    """The quantities of the tracked points, by the same definitions. U_D includes the change that would close the balance of mass: a faster
    layer, a deeper one, or less of the bed below it. Errors of scale or origin do not affect the shape of the profile."""
    n, u = tracked_profile()
    turn, top = change_of_sign(n, u), float(n[-1])
    returned, carried = fluxes()
    missing = carried / returned - 1.0
    closed = -math.sqrt(ALIZADEH["drum_radius"] ** 2 - 2.0 * returned / ALIZADEH["drum_speed"])

    speed, basis = -float(u[n > top - 1.5 * ALIZADEH["grain_diameter"]].mean()), "reading of the figure, and balance of mass"
    shape = jackknife(lambda keep: layer_flux(n[keep], -u[keep], turn, top)[1], np.arange(len(n)), name="points")
    return {"surface_speed": Estimate(speed, math.hypot(SPEED_READ, missing * speed), basis),
            "zero_crossing": Estimate(turn, math.hypot(PLACE_READ, turn - closed), basis),
            "layer_depth": Estimate(top - turn, math.hypot(math.sqrt(2.0) * PLACE_READ, missing * (top - turn)), basis),
            "layer_shape": shape}


def missing_balance() -> str:
    """Why the flow has no verdict."""
    returned, carried = fluxes()
    return (f"the tracked profile does not conserve mass: the layer returns {1e3 * returned:.2f}e-3 m²/s, a bed that turns with the drum "
            f"carries up {1e3 * carried:.2f}e-3")


def other_code() -> dict[str, dict[str, float]]:
    """Rows of the table of Sunday et al. by variant: angle, its limit, depth of the layer; NaN where it has none."""
    return {row["variant"]: {key: row.number(key, math.nan) for key in ("angle", "angle_limit", "layer", "centrifuging")}
            for row in reference_rows(HERE / "sunday_2020.csv")}


def of_other_code(p: Mapping[str, Any]) -> dict[str, float] | None:
    """The row of that table for a run with the parameters `p`, by its Froude number and rolling resistance; None where there is none."""
    if any(p[name] != value for name, value in SUNDAY.items()) or p["wall_rolling_friction"] is not None:
        return None
    froude = p["drum_speed"] ** 2 * p["drum_radius"] / p["gravity"]
    rolling = p["rolling_friction"] if p["rolling_resistance"] != "off" else 0.0
    for row in reference_rows(HERE / "sunday_2020.csv"):
        if math.isclose(row.number("froude"), froude, rel_tol=0.01) and row.number("rolling_friction") == rolling:
            return other_code()[row["variant"]] if p["rolling_resistance"] in ("off", "constant_torque") else None
    return None


def seen(speed: float) -> tuple[dict[str, Estimate], Array] | None:
    """What images show of the drum that turns with `speed` (rad/s): quantities, and its surface as rows x, y, lower and upper level (m);
    None for a speed that was not published."""
    turns = speed * 30.0 / math.pi
    rpm = f"{turns:.0f}"
    rows = reference_rows(HERE / "granudrum.csv", rpm=rpm)
    if not rows or abs(turns - round(turns)) > 0.01 * turns:
        return None
    surface = [[*map(row.number, ("x", "y", "low", "high"))] for row in reference_rows(HERE / "granudrum_surface.csv", rpm=rpm)]
    found = {row["quantity"]: Estimate(row.number("value"), CONFIDENT * row.number("uncertainty"), "reading of the image") for row in rows}
    return found, np.array(surface)


def along_the_axis(replicas: Replicas) -> Measurement:
    """Values and the surface of a drum that was photographed."""
    views, data = [side_view.read(replica) for replica in replicas], seen(replicas[0].parameters["drum_speed"])
    found = [side_view.estimates(view, None if data is None else (data[1][:, 0], data[1][:, 1])) for view in views]
    known = {} if data is None else {**data[0], "side_distance": exact(0.0)}
    values = {name: Value(pooled(found, name), known.get(name)) for name in found[0]}
    return Measurement(values, [surfaces(views, None if data is None else data[1])])


def surfaces(views: list[SideView], data: Array | None) -> Curve:
    """The surface y(x), with the measured one."""
    half = 0.8 * SEEN["drum_radius"]
    place = np.linspace(-half, half, 68) if data is None else data[:, 0]
    every = np.ones(len(views[0].dark), bool)
    values = [view.heights(every, place) for view in views]
    title, along, across = "Surface seen along the axis", "x (m), grains go up on the right", "y (m)"
    if data is None:
        return profile("side_surface", title, along, across, place, values)
    return profile("side_surface", title, along, across, place, values, reference=data[:, 1],
                   reference_half=np.full(len(place), CONFIDENT * READING), reference_label="ACCES-GranuDrum images")


def measure(replicas: Replicas) -> Measurement:
    """Values and profiles of all replicas of a series."""
    drums, given = [read(replica) for replica in replicas], replicas[0].parameters
    tracked_drum = given["ends"] == "periodic" and all(given[name] == value for name, value in ALIZADEH.items())
    found = [dict(zip([*METHODS, "overhead"], estimates(drum, list(METHODS.values())).values(), strict=True)) for drum in drums]
    over = {name: pooled(found, name) for name in found[0]}
    # Nothing flows back steadily where grains are carried over the top.
    flows = over["overhead"].value < 0.1
    due = {"flux_balance": exact(0.0), "solid_body": exact(1.0)} if flows else {}
    values = {name: Value(over[name], due.get(name)) for name in METHODS if flows or name == "surface_angle"}
    values["froude"] = Value(exact(given["drum_speed"] ** 2 * given["drum_radius"] / given["gravity"]))
    if tracked_drum:
        for name, datum in data().items():
            values[name] = Value(over[name], datum, reason="" if name == "layer_shape" else missing_balance(),
                                 detail=compared(over[name].value, datum, sim=over[name].half).text)
    if row := of_other_code(given):
        values["centrifuging"] = Value(over["overhead"], exact(row["centrifuging"]))
        if flows:
            depth, angle, d = over["layer_depth"], over["surface_angle"], given["grain_diameter"]
            datum = Estimate(row["angle"], row["angle_limit"], "scatter in the other code")
            values["repose_angle"] = Value(angle, datum, reason=UNKNOWN, detail=compared(angle.value, datum, sim=angle.half).text)
            values["layer_over_diameter"] = Value(divided(depth, d), exact(row["layer"])
                                                  if math.isfinite(row["layer"]) else None)
    curves = [speeds(drums, tracked_drum), densities(drums)]
    if all(given[name] == value for name, value in SEEN.items()):
        view = along_the_axis(replicas)
        return Measurement(values | dict(view.values), [*view.profiles, *curves])
    return Measurement(values, curves)


def speeds(drums: list[DrumFlow], with_data: bool) -> Curve:
    """The speed along the surface over n, with the tracked points."""
    every = np.ones(len(drums[0].solid), bool)
    known = ~np.isnan([drum.velocity(every) for drum in drums]).any(axis=0)
    place = drums[0].middle[known]
    values = [drum.velocity(every)[known] for drum in drums]
    title, along, across = "Speed along the free surface", "distance from the axis along the normal (m)", "u (m/s), positive with the drum"
    if not with_data:
        return profile("velocity", title, along, across, place, values)
    n, u = tracked_profile()
    inside = (n > place[0]) & (n < place[-1])
    return profile("velocity", title, along, across, n[inside], [np.interp(n[inside], place, one) for one in values], reference=u[inside],
                   reference_half=np.full(inside.sum(), SPEED_READ), reference_label="Alizadeh et al. (2013)")


def densities(drums: list[DrumFlow]) -> Curve:
    """The solid fraction over n."""
    every = np.ones(len(drums[0].solid), bool)
    return profile("solid_fraction", "Solid fraction on the normal", "distance from the axis along the normal (m)", "φ", drums[0].middle,
                   [drum.fraction(every) for drum in drums])


def study(name: str, points: Points, along: str) -> Measurement:
    """Sensitivity of the flow to what is varied: half the range over the frictions is U_input, the range over the moduli U_num; or the
    angle against the Froude number."""
    points, places = ordered(points, along)
    if name == "froude":
        return angles(points)
    middle, datum = next(point for point in points if point["variant"] == "alizadeh"), data()
    values = {}
    for quantity in FLOW:
        found = [measured(point, quantity) for point in points]
        half = (0.5 if name == "friction" else 1.0) * float(np.ptp([one.value for one in found]))
        one = measured(middle, quantity)
        varied = {"input": half, "num": 0.0} if name == "friction" else {"input": 0.0, "num": half}
        values[quantity] = Value(Estimate(one.value, math.hypot(one.half, half), "scatter in time and effect of the varied parameter"),
                                 datum[quantity], reason="" if quantity == "layer_shape" else missing_balance(),
                                 detail=compared(one.value, datum[quantity], sim=one.half, **varied).text)
    curves = [profile(quantity, quantity.replace("_", " "), along, quantity, places,
                      [np.array([measured(point, quantity).value for point in points])]) for quantity in FLOW]
    return Measurement(values, curves)


def angles(points: Points) -> Measurement:
    """The curve of angles with that of the other code."""
    found, place = [measured(point, "repose_angle") for point in points], [measured(point, "froude").value for point in points]
    rows = [other_code()[point["variant"]] for point in points]
    datum, limit = (np.array([row[key] for row in rows]) for key in ("angle", "angle_limit"))
    return Measurement({}, [profile("repose_angle", "Dynamic angle of repose", "log₁₀ of the Froude number", "angle (°)", np.log10(place),
                                    [np.array([one.value for one in found])], half=np.array([one.half for one in found]), reference=datum,
                                    reference_half=limit, reference_label="Sunday et al. (2020), DEM")])
