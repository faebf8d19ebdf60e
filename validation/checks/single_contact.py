"""Checks of case `single_contact`: the eight impact tests of Chung and Ooi (2011).

Nothing is random. Each engine is held against three things: the same scheme written down again, from which it may differ by round-off;
what is known exactly (Hertz; the restitution coefficient that was asked for; the contact law, integrated until the step does not matter);
and, for information, theories of another contact (rigid bodies that slide throughout; partial slip after Mindlin and Deresiewicz).
What is allowed beside the exact solution is twice what the scheme itself loses at this step, the worst of four phases of the touch within
a step, and what halving the parts changes in the exact solution.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from dembark.validation.checks.impact_exact import (
    Impacts,
    Rebounds,
    exact,
    hertz_force,
    impacts,
    partial_slip,
    sliding_throughout,
    stepped,
)
from dembark.validation.checks.logs import ROUND_OFF, SAME
from dembark.validation.checks.logs import exact as certain
from dembark.validation.checks.quantity import Quantity
from dembark.validation.checks.run import Replica, profile
from dembark.validation.references import CHUNG, LYASHENKO
from numpy.typing import NDArray

Array = NDArray[np.float64]
REFERENCES = (CHUNG, LYASHENKO)
_PHASES = (0.0, 0.25, 0.5, 0.75)
# Of the largest force: the overlap is a difference of positions with fifteen digits, some 1e4 times as large.
_FORCE_ERROR = 1e-9


@dataclass(frozen=True)
class Flight:
    """The spheres of a run: `overlaps`, `forces` (frames, n) in m and N along the line of centres; `times` (frames,) in s; the end."""

    times: Array
    overlaps: Array
    forces: Array
    after: Rebounds
    momentum_error: float | None


@dataclass(frozen=True)
class Measure:
    """A number of each impact: `name`, `label`, how it follows from the rebounds, and the scale of its error."""

    name: str
    label: str
    of: Callable[[Impacts, Rebounds], Array]


def _restitution(one: Impacts, after: Rebounds) -> Array:
    return (after.normal - after.normal_2) / one.closing


def _slide(one: Impacts, after: Rebounds) -> Array:
    return after.slide / one.closing


def _spin(one: Impacts, after: Rebounds) -> Array:
    return one.radius * after.spin / one.closing


def _patch(one: Impacts, after: Rebounds) -> Array:
    """Tangential velocity of the sphere's point of contact over the normal speed before."""
    return (after.slide + one.radius * after.spin) / one.closing


RESTITUTION = Measure("restitution", "speed of parting over speed of approach", _restitution)
OBLIQUE = (
    RESTITUTION,
    Measure("slide", "tangential velocity after over speed of approach", _slide),
    Measure("spin", "r ω after over speed of approach", _spin),
)


def quantities(replicas: Sequence[Replica]) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks of the run (there is one)."""
    run = replicas[0]
    return measured(run.parameters, read(run))


def read(replica: Replica) -> Flight:
    """What the spheres did."""
    frames = list(replica.grains())
    one = impacts(replica.parameters)
    n = len(one)
    order = np.argsort(frames[0].ids)
    x, v, w, f = (np.array([getattr(frame, name)[order] for frame in frames]) for name in ("positions", "velocities", "omegas", "forces"))
    masses = frames[0].masses[order]
    times = np.array([frame.step for frame in frames]) * replica.time_step
    plane = replica.parameters["partner"] == "plane"
    apart = x[:, :n] - (np.array([1.0, 1.0, 0.0]) * x[:, :n] if plane else x[:, n:])
    distance = np.linalg.norm(apart, axis=2)
    normal = apart / distance[..., None]
    overlaps = one.radius + np.where(np.isinf(one.radius_2), 0.0, one.radius_2) - distance
    forces = (f[:, :n] * normal).sum(axis=2)
    v_2, w_2 = (np.zeros_like(v), np.zeros_like(w)) if plane else (v[:, n:], w[:, n:])
    parting = ((v[-1, :n] - v_2[-1, :n]) * normal[-1]).sum(axis=1)
    # Both flights are free: the touch is known, and the way back to the release is straight.
    release = times[-1] + overlaps[-1] / parting
    after = Rebounds(
        v[-1, :n, 1], v[-1, :n, 2], w[-1, :n, 0], v_2[-1, :n, 1], v_2[-1, :n, 2], w_2[-1, :n, 0],
        _top(overlaps), _top(forces), release - replica.parameters["lead_steps"] * replica.time_step,
    )  # fmt: skip
    kept = None
    if not plane:
        momentum = (v[:, :n] * masses[:n, None] + v[:, n:] * masses[n:, None])
        kept = float(np.abs(momentum - momentum[0]).max() / (masses[:n] * one.closing).max())
    return Flight(times, overlaps, forces, after, kept)


def _top(values: Array) -> Array:
    """Largest value (n,) of each column of (frames, n), from the parabola through the three highest frames."""
    column = np.arange(values.shape[1])
    place = np.clip(values.argmax(axis=0), 1, len(values) - 2)
    low, middle, high = (values[place + step, column] for step in (-1, 0, 1))
    bend = 2.0 * middle - low - high
    return middle + np.where(bend > 0.0, (high - low) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)), 0.0)


@dataclass(frozen=True)
class Solutions:
    """What the impacts are held against: the `scheme` at each phase; with friction the law `due`, also in `coarse` parts, and `slip`."""

    scheme: Sequence[Rebounds]
    due: Rebounds | None = None
    coarse: Rebounds | None = None
    slip: Rebounds | None = None


@lru_cache(maxsize=16)
def _solutions(key: tuple[tuple[str, Any], ...]) -> Solutions:
    """Of the parameters as items; they are the same for both engines."""
    p = dict(key)
    one = impacts(p)
    length = float((1.4 * one.duration * (1.0 - np.log(one.restitution) / 4.0)).max())
    scheme = [stepped(one, p["time_step"], (p["lead_steps"] + phase) % 1.0, length) for phase in _PHASES]
    if not _slides(one):
        return Solutions(scheme)
    # Partial slip is known for an elastic impact on a plane.
    elastic = p["partner"] == "plane" and (one.restitution > 0.95).all()
    return Solutions(scheme, exact(one), exact(one, 500), partial_slip(one) if elastic else None)


def _slides(one: Impacts) -> bool:
    return bool((one.sliding != 0.0).any() and (one.friction > 0.0).any())


def measured(p: Mapping[str, Any], flight: Flight) -> tuple[list[Quantity], list[dict[str, Any]], list[str]]:
    """Quantities, curves and remarks of a run with parameters `p`."""
    one = impacts(p)
    known = _solutions(tuple(sorted(p.items())))
    scheme = known.scheme
    found = [_same_as_scheme(one, flight, scheme[0])]
    if flight.momentum_error is not None:
        label = "largest change of the momentum of a pair, over m v"
        found.append(_zero("momentum_error", label, flight.momentum_error, "conservation law"))
    remarks = [f"{one.duration.min() / p['time_step']:.0f} steps from touch to release in the shortest impact, after Hertz."]
    remarks += [f"{reference.short}: {reference.statement}" for reference in REFERENCES]
    if _slides(one):
        more, curves = _oblique(p, one, flight, known)
    elif p["sweep"] == "restitution":
        more, curves = _restitutions(one, flight, scheme)
    elif (one.spin != 0.0).any():
        more, curves = _mirrored(one, flight, scheme)
    else:
        more, curves = _head_on(one, flight, scheme)
    return found + more, curves, remarks


def _zero(name: str, label: str, error: float, source: str, tolerance: float = ROUND_OFF, detail: str = "") -> Quantity:
    return Quantity(name, label, "1", certain(error), reference=certain(0.0), tolerance=tolerance, absolute=True, compared=False,
                    source=source, detail=detail)


def _same_as_scheme(one: Impacts, flight: Flight, scheme: Rebounds) -> Quantity:
    worst = 0.0
    for measure in OBLIQUE:
        values, due = measure.of(one, flight.after), measure.of(one, scheme)
        worst = max(worst, float(np.abs(values - due).max() / max(1.0, np.abs(due).max())))
    return _zero("scheme_deviation", "largest deviation of a velocity from the scheme written down again, over the largest", worst,
                 "leapfrog with the contact law, at the same step and phase", SAME, "restitution, tangential velocity and spin")


def _materials(one: Impacts) -> list[tuple[str, NDArray[np.bool_]]]:
    return [("a", one.second == 0.0), ("b", one.second > 0.0)]


def _bound(values: Sequence[Array], due: Array) -> Array:
    """Twice the worst deviation of the scheme."""
    return 2.0 * np.max([np.abs(value - due) for value in values], axis=0)


def _head_on(one: Impacts, flight: Flight, scheme: Sequence[Rebounds]) -> tuple[list[Quantity], list[dict[str, Any]]]:
    """Elastic and head on: Hertz in closed form."""
    found, curves = [], []
    spacing = float(flight.times[1] - flight.times[0])
    for index, name in enumerate("ab"):
        material = f"material {name.upper()}"
        due = hertz_force(one.pick([index]), flight.overlaps[:, index])
        highest = float(one.peak_force[index])
        found.append(_zero(f"force_law_error_{name}", f"largest deviation of the force from that of its overlap, over the peak, {material}",
                           float(np.abs(flight.forces[:, index] - due).max() / highest), "Hertz, F = 4/3 E* √R* δ^(3/2)", _FORCE_ERROR))
        # Three frames about the top of something like a half wave: a parabola misses less than (pi h / t_c)^4 / 16 of it.
        sampled = (np.pi * spacing / float(one.duration[index])) ** 4 / 16.0
        for key, label, unit in (("overlap", "largest overlap", "m"), ("force", "largest force", "N")):
            reference = float(one.peak_overlap[index] if key == "overlap" else highest)
            allowed = float(_bound([getattr(each, key)[index : index + 1] for each in scheme], np.array([reference]))[0]) / reference
            found.append(Quantity(f"peak_{key}_{name}", f"{label}, {material}", unit, certain(getattr(flight.after, key)[index]),
                                  reference=certain(reference), tolerance=allowed + sampled, agreement=SAME * reference,
                                  source="Hertz"))
        duration = float(one.duration[index])
        late = float(_bound([each.duration[index] for each in scheme], np.array(duration)))
        found.append(Quantity(f"duration_{name}", f"from touch to release, {material}", "s", certain(flight.after.duration[index]),
                              reference=certain(duration), tolerance=late / duration, agreement=SAME * duration,
                              source="Hertz, 2.9433 δ_max / v"))
        found.append(Quantity(f"restitution_{name}", f"{RESTITUTION.label}, {material}", "1",
                              certain(RESTITUTION.of(one, flight.after)[index]), reference=certain(1.0), absolute=True, agreement=SAME,
                              tolerance=float(_bound([RESTITUTION.of(one, each) for each in scheme], np.ones(len(one)))[index]),
                              source="conservation of energy"))
        inside = flight.overlaps[:, index] > -0.05 * one.peak_overlap[index]
        curves.append(profile(f"force_overlap_{name}", f"Force over overlap, {name.upper()}", "δ (µm)", "N (kN)",
                              1e6 * flight.overlaps[inside, index], [1e-3 * flight.forces[inside, index]], reference=1e-3 * due[inside],
                              reference_label="Hertz"))
        curves.append(profile(f"force_time_{name}", f"Force over time, {name.upper()}", "time (µs)", "N (kN)", 1e6 * flight.times,
                              [1e-3 * flight.forces[:, index]], reference=1e-3 * _hertz_pulse(one, index, flight), reference_label="Hertz"))
    return found, curves


def _hertz_pulse(one: Impacts, index: int, flight: Flight) -> Array:
    """Force over time of an elastic impact: t = ∫ dδ / (v √(1 − (δ/δ_max)^(5/2))), in δ/δ_max = sin^(4/5) for a smooth integrand."""
    turn = np.linspace(0.0, 0.5 * np.pi, 4001)
    depth = np.sin(turn) ** 0.8
    # With δ/δ_max = (sin a)^(4/5) the integrand is 4/5 (sin a)^(-1/5), whose integral near 0 is that of a power.
    rate = 0.8 * np.sin(0.5 * (turn[1:] + turn[:-1])) ** -0.2
    time = np.concatenate([[0.0], np.cumsum(rate * np.diff(turn))])
    half = 0.5 * float(one.duration[index])
    touch = float(flight.times[0] - flight.overlaps[0, index] / one.closing[index])
    since = np.abs(flight.times - touch - half)
    depth_then = np.interp((half - since) / half, time / time[-1], depth, left=0.0)
    return hertz_force(one.pick([index]), depth_then * one.peak_overlap[index])


def _restitutions(one: Impacts, flight: Flight, scheme: Sequence[Rebounds]) -> tuple[list[Quantity], list[dict[str, Any]]]:
    """The coefficient that was asked for comes out."""
    values = RESTITUTION.of(one, flight.after)
    bounds = _bound([RESTITUTION.of(one, each) for each in scheme], one.restitution)
    found = [
        Quantity(f"restitution_{'b' if second else 'a'}_{e:.2g}", f"{RESTITUTION.label}, material {'B' if second else 'A'}, e = {e:.2g}",
                 "1", certain(value), reference=certain(e), tolerance=float(bound), absolute=True, agreement=SAME,
                 source="the damping is made for this coefficient")
        for second, e, value, bound in zip(one.second, one.restitution, values, bounds, strict=True)
    ]  # fmt: skip
    curves = []
    for name, which in _materials(one):
        e = one.restitution[which]
        curves.append(profile(f"restitution_{name}", f"Restitution, {name.upper()}", "e asked for", "e found", e, [values[which]],
                              reference=e, reference_label="equal"))
        curves.append(profile(f"restitution_error_{name}", f"Its error, {name.upper()}", "e asked for", "1000 (e found − e)", e,
                              [1e3 * (values - one.restitution)[which]], reference=np.zeros(len(e)), reference_label="0"))
    return found, curves


def _mirrored(one: Impacts, flight: Flight, scheme: Sequence[Rebounds]) -> tuple[list[Quantity], list[dict[str, Any]]]:
    """The points of contact of mirror images do not slide on each other: nothing turns."""
    after, before = flight.after, one.radius * one.spin / one.closing
    turned = float(np.abs(_spin(one, after) - before).max() / np.abs(before).max())
    bounds = _bound([RESTITUTION.of(one, each) for each in scheme], one.restitution)
    values = RESTITUTION.of(one, after)
    worst = int(np.abs(values - one.restitution).argmax())
    found = [
        _zero("spin_change", "largest change of a spin over the largest spin", turned, "symmetry"),
        _zero("tangential_velocity", "largest tangential velocity after, over speed of approach", float(np.abs(_slide(one, after)).max()),
              "symmetry"),
        Quantity("restitution", f"{RESTITUTION.label}, the worst", "1", certain(values[worst]), reference=certain(one.restitution[worst]),
                 tolerance=float(bounds.max()), absolute=True, agreement=SAME, source="the damping is made for this coefficient"),
    ]  # fmt: skip
    curves = []
    for name, which in _materials(one):
        spin = one.spin[which]
        curves.append(profile(f"spin_{name}", f"Spin after, {name.upper()}", "ω (rad/s)", "ω after (rad/s)", spin, [after.spin[which]],
                              reference=spin, reference_label="symmetry"))
        curves.append(profile(f"slide_{name}", f"Tangential velocity after, {name.upper()}", "ω (rad/s)", "v_t after (m/s)", spin,
                              [after.slide[which]], reference=np.zeros(which.sum()), reference_label="symmetry"))
    return found, curves


def _oblique(p: Mapping[str, Any], one: Impacts, flight: Flight, solutions: Solutions) -> tuple[list[Quantity], list[dict[str, Any]]]:
    """With friction: the law solved exactly, and what other theories say."""
    due, coarse, slip = solutions.due, solutions.coarse, solutions.slip
    assert due is not None and coarse is not None
    rigid = sliding_throughout(one)
    # Beyond this angle, rigid bodies slide to the end.
    gross = np.abs(one.sliding) > 3.5 * one.friction * (1.0 + one.restitution) * one.closing
    found = []
    for name, which in _materials(one):
        for measure in OBLIQUE:
            values, known = measure.of(one, flight.after)[which], measure.of(one, due)[which]
            allowed = _bound([measure.of(one, each)[which] for each in solutions.scheme], known)
            allowed += np.abs(measure.of(one, coarse)[which] - known)
            worst = int(np.abs(values - known).argmax())
            found.append(Quantity(f"{measure.name}_{name}", f"{measure.label}, material {name.upper()}, the worst angle", "1",
                                  certain(values[worst]), reference=certain(known[worst]), tolerance=float(allowed.max()), absolute=True,
                                  agreement=SAME * max(1.0, float(np.abs(known).max())), source="the contact law, solved exactly",
                                  detail=f"at {one.value[which][worst]:.3g}°; at this angle {allowed[worst]:.2g} would be allowed"))
        sides = [("rigid_sliding", "bodies that slide throughout, where rigid ones do", "impulse μ (1 + e) m* v", rigid, which & gross)]
        if slip is not None:
            sides.append(("partial_slip", "partial slip of an elastic contact", "Mindlin and Deresiewicz, without damping", slip, which))
        for key, label, source, theory, those in sides:
            if those.any():
                apart = np.abs(_patch(one, flight.after) - _patch(one, theory))[those]
                found.append(Quantity(f"{key}_difference_{name}", f"largest difference from {label}, of the velocity of the point of "
                                      f"contact over speed of approach, material {name.upper()}", "1", certain(apart.max()), compared=False,
                                      source=source, detail=_WHY[key]))
    return found, _rebound_curves(p, one, flight.after, due, rigid, slip)


_WHY = {
    "rigid_sliding": "the dash-pot presses before the spring does, pulls at the end, where friction is 0, and acts without limit until the "
    "contact slides; the lever arm is r − δ/2",
    "partial_slip": "the law's spring sticks as a whole until it slides as a whole, and gives back all that it stored; here slip spreads "
    "from the edge of the contact, so that what is below gross sliding differs most",
}


def _rebound_curves(
    p: Mapping[str, Any], one: Impacts, after: Rebounds, due: Rebounds, rigid: Rebounds, slip: Rebounds | None
) -> list[dict[str, Any]]:
    """The curves of the publication, with each theory as the reference of one of them."""
    curves = []
    e = one.restitution
    before = one.sliding / one.closing
    for name, which in _materials(one):

        def add(key: str, title: str, along: str, across: str, place: Array, values: Array, reference: Array, label: str,
                which: NDArray[np.bool_] = which, name: str = name) -> None:
            curves.append(profile(f"{key}_{name}", f"{title}, {name.upper()}", along, across, place[which], [values[which]],
                                  reference=reference[which], reference_label=label))

        if p["sweep"] == "direction":
            add("tangential_restitution", "Tangential restitution", "angle (°)", "v_t after / v_t", one.value, after.slide / one.slide,
                due.slide / one.slide, "the law, exactly")
            add("spin", "Spin after", "angle (°)", "ω (rad/s)", one.value, after.spin, rigid.spin, "sliding throughout")
        elif p["sweep"] == "slide":
            scale = one.friction * one.closing
            add("spin", "Spin after", "v_s / μ v_n", "r ω / μ v_n", one.sliding / scale, one.radius * after.spin / scale,
                one.radius * due.spin / scale, "the law, exactly")
        else:
            add("stick", "Sliding given back", "7/2 μ (1+e) v_n / v_s", "−v_s after / v_s", 3.5 * one.friction * (1.0 + e) / before,
                -_patch(one, after) / before, -_patch(one, due) / before, "the law, exactly")
            add("recoil_rigid", "Recoil", "v_s / v_n", "v_s after / v_n after", before, _patch(one, after) / e, _patch(one, rigid) / e,
                "sliding throughout")
        theory, label = (slip, "partial slip, elastic") if slip is not None else (due, "the law, exactly")
        scale = one.friction if p["sweep"] == "slide" else np.ones(len(one))
        words = ("v_s / μ v_n", "v_s after / μ v_n after") if p["sweep"] == "slide" else ("v_s / v_n", "v_s after / v_n after")
        add("recoil", "Recoil", *words, before / scale, _patch(one, after) / _restitution(one, after) / scale,
            _patch(one, theory) / _restitution(one, theory) / scale, label)
    return curves


def picture(parameters: Mapping[str, Any]) -> dict[str, Any] | None:
    """Spheres in a row are no picture."""
    del parameters
    return None
