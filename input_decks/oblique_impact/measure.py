"""Oblique impact: the motion of each sphere after it, compared with the measurement. V&V 20: E = S − D is known within U_val, U_val² =
U_num² + U_input² + U_D². A run has U_input, by spheres with changed inputs; the study of three time steps adds U_num and U_D and judges."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from dembark.input_decks.common.estimates import reference_rows
from dembark.postproc.convergence import refinement
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.replica import Array, Replica
from dembark.postproc.resampling import profile
from dembark.postproc.statistics import Estimate, student
from dembark.postproc.studies import compared, numerical

MEASURED = Path(__file__).with_name("reference") / "kharaz_2001.csv"
# The experiment's: speed (m/s) and radius (m) that its e_t and its spin have in common.
SPEED, RADIUS = 3.9, 0.0025
TITLES = {"tangential_restitution": ("Tangential restitution", "e_t"), "spin": ("Rebound spin", "ω (rad/s)"),
          "centre_angle": ("Rebound angle of the centre", "angle after (°)"),
          "contact_angle": ("Rebound angle of the point of contact", "angle after (°)")}
# Angles of incidence (°), for the nominal inputs, below which the contact sticks when it is touched first, tan α = μ E* / (4 G*), and
# beyond which it slides to the end, tan α = 7/2 μ (1 + e): R. D. Mindlin, J. Appl. Mech. 16 (1949) 259; N. Maw, J. R. Barber,
# J. N. Fawcett, Wear 38 (1976) 101.
STICKS_BELOW, SLIDES_BEYOND = 6.11, 32.52


@dataclass(frozen=True)
class Datum:
    """A point measured at the `angle` (°). U_D has a part that differs from point to point, `scatter`, and one that is `common` to all."""

    quantity: str
    angle: float
    value: float
    scatter: float
    common: float

    @property
    def name(self) -> str:
        """Of the quantity in case.toml."""
        return f"{self.quantity}_{self.angle:.0f}"

    @property
    def half(self) -> float:
        """U_D."""
        return math.hypot(self.scatter, self.common)

    def as_restitution(self, spin: float) -> float:
        """e_t of a sphere with this spin, from the balance of angular momentum."""
        return 1.0 - 0.4 * RADIUS * spin / (SPEED * math.sin(math.radians(self.angle)))


def misclosure(rows: Sequence[Mapping[str, Any]]) -> Array:
    """(2/5) R ω − v sin α (1 − e_t) in m/s at each angle at which ω was measured; e_t between its own angles by a monotone cubic. Friction
    is the only force with a moment about the centre, so that this is zero for a rigid sphere under any contact law: what is left is the
    error of the measurement."""
    (angles, kept), (at, spins) = (np.array([(row["angle"], row["value"]) for row in rows if row["quantity"] == name]).T
                                   for name in ("tangential_restitution", "spin"))
    return 0.4 * RADIUS * spins - SPEED * np.sin(np.radians(at)) * (1.0 - PchipInterpolator(angles, kept)(at))


def measured() -> list[Datum]:
    """The measured points. U_D of e_t and spin comes from their misclosure, a velocity: its mean is a common part of both; its scatter is
    shared, half of the variance in each. U_D of the angles is that of the file, common to all."""
    rows = [{key: text if key == "quantity" else row.number(key, 0.0) for key, text in row.items()} for row in reference_rows(MEASURED)]
    open_by = misclosure(rows)
    common, scatter = abs(float(open_by.mean())), student(len(open_by) - 1) * float(open_by.std(ddof=1)) / math.sqrt(2.0)

    def datum(row: Mapping[str, Any]) -> Datum:
        per_velocity = {"tangential_restitution": 1.0 / (SPEED * math.sin(math.radians(row["angle"]))), "spin": 1.0 / (0.4 * RADIUS)}
        scale = per_velocity.get(row["quantity"], 0.0)
        return Datum(row["quantity"], row["angle"], row["value"], math.hypot(row["value_digitised"], scatter * scale),
                     row["value_measured"] + common * scale)

    return [datum(row) for row in rows]


def rebounds(replica: Replica) -> dict[str, Array]:
    """What is measured of each sphere, (spheres,) by quantity, in the order of their numbers."""
    first, *_, last = replica.grains()
    (v, _), (v_after, w_after) = ((frame.velocities[order], frame.omegas[order, 0]) for frame in (first, last)
                                  for order in [np.argsort(frame.ids)])
    along, away = v_after[:, 1], v_after[:, 2]
    return {"tangential_restitution": along / v[:, 1], "spin": -w_after, "centre_angle": np.degrees(np.arctan2(along, away)),
            "contact_angle": np.degrees(np.arctan2(along + replica.parameters["radius"] * w_after, away))}


def measure(replicas: Sequence[Replica]) -> Measurement:
    """Each quantity at its angles, with U_input: the root of the sum of squares of what each input's uncertainty changes."""
    data, found = measured(), rebounds(replicas[0])
    values = {}
    for k, datum in enumerate(data):
        nominal, *changed = found[datum.quantity][k :: len(data)]
        values[datum.name] = Value(Estimate(nominal, math.dist([nominal] * len(changed), changed), "uncertainty of the inputs"))
    return Measurement(values, remarks=["Verdicts are given by the study, which includes the error of the time step."])


@dataclass(frozen=True)
class Point:
    """The simulation with the smallest time step at the angle of a `datum`; U_input and U_num in `inputs` and `steps`."""

    datum: Datum
    value: float
    inputs: float
    steps: float

    def as_restitution(self) -> Point:
        """The same for e_t, of a point for the spin."""
        at, change = self.datum, 0.4 * RADIUS / (SPEED * math.sin(math.radians(self.datum.angle)))
        return Point(Datum("tangential_restitution", at.angle, at.as_restitution(at.value), at.scatter * change, at.common * change),
                     at.as_restitution(self.value), self.inputs * change, self.steps * change)


def study(_name: str, points: Sequence[Mapping[str, Any]], along: str) -> Measurement:
    """The simulation with the smallest time step against the measurement: all points without a verdict, and what is judged, each curve
    where the contact slips and then sticks, each curve where it slides, and the three points for e_t where it sticks first."""
    steps = [refinement(along, point["parameters"][along]) for point in points]
    runs = [{one["name"]: one for one in point["quantities"]} for point in points]
    fine = runs[int(np.argmin(steps))]

    def at(datum: Datum) -> Point:
        one = fine[datum.name]
        return Point(datum, one["value"], 0.5 * (one["interval"][1] - one["interval"][0]),
                     numerical(steps, [run[datum.name]["value"] for run in runs]))

    every = [at(datum) for datum in measured()]
    values = {one.datum.name: _alone(one) for one in every}
    seen = sum("exceeds" in one.detail for one in values.values())
    for quantity in TITLES:
        curve = [one for one in every if one.datum.quantity == quantity]
        relative = quantity == "spin"
        values[f"{quantity}_mixed"] = _together([one for one in curve if STICKS_BELOW < one.datum.angle < SLIDES_BEYOND], relative)
        values[f"{quantity}_sliding"] = _together([one for one in curve if one.datum.angle > SLIDES_BEYOND], relative)
    first = [one for one in every if one.datum.angle < STICKS_BELOW]
    values["sticking"] = _together([one for one in first if one.datum.quantity == "tangential_restitution"]
                                   + [one.as_restitution() for one in first if one.datum.quantity == "spin"])
    return Measurement(values, [_curve(quantity, [one for one in every if one.datum.quantity == quantity]) for quantity in TITLES], [
        f"At {seen} of {len(every)} points |E| exceeds U_val: a model error is detected there, whether or not the tolerance allows it.",
        "Friction was inferred from the same experiment, in gross sliding (beyond 32°); below that angle the values are predictions."])


def _alone(one: Point) -> Value:
    """A point, which has no verdict of its own."""
    datum = Estimate(one.datum.value, one.datum.half, "misclosure, measurement and reading of the figure")
    return Value(Estimate(one.value, math.hypot(one.inputs, one.steps), "inputs and time step"), datum,
                 detail=compared(one.value, datum, num=one.steps, input=one.inputs).text)


def _together(points: Sequence[Point], relative: bool = False) -> Value:
    """The root mean square of E over `points`, without the scatter of the data; `relative`: over the mean of the data. Points are weighted
    by the inverse squares of U_D; with the variance s² of the scatter it is (mean² + max(0, variance − s²))^½, as in the random-effects
    model of R. DerSimonian and N. Laird, Control. Clin. Trials 7 (1986) 177; never below the mean, so that nothing cancels. U_val is that
    of the mean: scatter falls with the number of points; common parts of U_D, inputs and steps act on all points alike."""
    errors, values, scatter, common, inputs, steps = np.array([
        (one.value - one.datum.value, one.datum.value, one.datum.scatter, one.datum.common, one.inputs, one.steps) for one in points]).T
    weights = 1.0 / (scatter**2 + common**2)
    weights /= weights.sum()
    scale = float(weights @ values) if relative else 1.0
    mean = float(weights @ errors)
    # Scatter is a 95 % limit, twice the standard deviation.
    beyond = float(weights @ (errors - mean) ** 2) * len(points) / (len(points) - 1) - float(weights @ (0.5 * scatter) ** 2)
    found = math.sqrt(mean**2 + max(0.0, beyond)) / scale
    of_data = math.hypot(np.linalg.norm(weights * scatter), weights @ common) / scale
    of_inputs, of_steps = float(weights @ inputs) / scale, float(weights @ steps) / scale
    datum = Estimate(0.0, of_data, "misclosure, measurement and reading of the figure")
    return Value(Estimate(found, math.hypot(of_inputs, of_steps), "inputs and time step"), datum,
                 detail=f"{compared(found, datum, num=of_steps, input=of_inputs).text}; at "
                        f"{', '.join(f'{one.datum.angle:.0f}° {error:.2g}' for one, error in zip(points, errors, strict=True))}")


def _curve(quantity: str, points: Sequence[Point]) -> dict[str, Any]:
    angles, simulated, half, datum, datum_half = np.array([
        (one.datum.angle, one.value, math.hypot(one.inputs, one.steps), one.datum.value, one.datum.half) for one in points]).T
    return profile(quantity, TITLES[quantity][0], "angle of incidence (°)", TITLES[quantity][1], angles, [simulated], half=half,
                   reference=datum, reference_half=datum_half, reference_label="Kharaz et al. (2001)")
