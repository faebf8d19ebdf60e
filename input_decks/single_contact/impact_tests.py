"""What is measured in tests of single impacts, with what it is compared with, and the curves: elastic and head on, with a restitution
coefficient, of mirror images, and with friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dembark.physics.exact.impacts import Impacts, Rebounds, sliding_throughout
from dembark.postproc.measurement import Array, Value, number, profile

from .impacts import Flight, Solutions, materials, worst

Found = tuple[dict[str, Value], list[dict[str, Any]]]


def head_on(one: Impacts, flight: Flight, known: Solutions) -> Found:
    """Elastic and head on: Hertz in closed form, for the first sphere of each material."""
    after, due = flight.after.numbers(one), {"overlap": one.peak_overlap, "force": one.peak_force, "duration": one.duration}
    # Three frames about the top of something like a half wave: a parabola misses less than (pi h / t_c)^4 / 16 of it.
    sampled = (np.pi * (flight.times[1] - flight.times[0]) / one.duration) ** 4 / 16.0
    since_touch = flight.times[:, None] - flight.times[0] + flight.overlaps[0] / one.closing
    forces, pulse = one.force(flight.overlaps), one.pulse(since_touch)
    values, curves = {}, []
    for key, which in materials(len(one)).items():
        k = which.start
        values[f"force_law_error_{key}"] = number((np.abs(flight.forces - forces).max(axis=0) / one.peak_force)[k], 0.0)
        for name in due:
            values[name + f"_{key}" if name == "duration" else f"peak_{name}_{key}"] = number(
                after[name][k], due[name][k], scale=due[name][k],
                bound=known.bound(name, due[name])[k] / due[name][k] + (0.0 if name == "duration" else sampled[k]))
        values[f"restitution_{key}"] = number(after["restitution"][k], one.restitution[k],
                                              bound=known.bound("restitution", one.restitution)[k])
        inside, found = flight.overlaps[:, k] > -0.05 * one.peak_overlap[k], 1e-3 * flight.forces[:, k]
        curves += [
            profile(f"force_overlap_{key}", f"Force against overlap, {key.upper()}", "δ (µm)", "N (kN)", 1e6 * flight.overlaps[inside, k],
                    [found[inside]], reference=1e-3 * forces[inside, k], reference_label="Hertz"),
            profile(f"force_time_{key}", f"Force against time, {key.upper()}", "time since touch (µs)", "N (kN)", 1e6 * since_touch[:, k],
                    [found], reference=1e-3 * pulse[:, k], reference_label="Hertz")]
    return values, curves


def restitutions(one: Impacts, flight: Flight, known: Solutions) -> Found:
    """The coefficient that was asked for comes out."""
    found, asked = flight.after.numbers(one)["restitution"], one.restitution
    bound = known.bound("restitution", asked)
    values = {f"restitution_{key}_{asked[k]:.2g}": number(found[k], asked[k], bound=bound[k])
              for key, which in materials(len(one)).items() for k in range(len(one))[which]}
    return values, _curves([
        ("restitution", "Restitution", "prescribed e", "measured e", asked, found, asked, "equal"),
        ("restitution_error", "Its error", "prescribed e", "1000 (measured e − e)", asked, 1e3 * (found - asked), 0.0 * asked, "0")])


def mirror_symmetry(one: Impacts, flight: Flight, known: Solutions) -> Found:
    """The points of contact of mirror images do not slide on each other: nothing turns."""
    after, before, asked = flight.after.numbers(one), one.radius[0] * one.spin[0] / one.closing, one.restitution
    k, spin = worst(np.abs(after["restitution"] - asked)), one.spin[0]
    values = {
        "spin_change": number(np.abs(after["spin"] - before).max() / np.abs(before).max(), 0.0),
        "tangential_velocity": number(np.abs(after["slide"]).max(), 0.0),
        "restitution": number(after["restitution"][k], asked[k], bound=known.bound("restitution", asked).max()),
    }
    return values, _curves([
        ("spin", "Spin after", "ω (rad/s)", "ω after (rad/s)", spin, flight.after.spin[0], spin, "symmetry"),
        ("slide", "Tangential velocity after", "ω (rad/s)", "v_t after (m/s)", spin, flight.after.slide[0], 0.0 * spin, "symmetry")])


def oblique(one: Impacts, flight: Flight, known: Solutions, sweep: str, swept: Array) -> Found:
    """With friction: the law solved exactly, and what other theories say; `sweep` is "direction", "slide" or "spin", `swept` (n,) in
    degrees."""
    after, law, coarse, rigid = (each.numbers(one) for each in (flight.after, *known.law, sliding_throughout(one)))
    # Beyond this angle, rigid bodies slide to the end.
    gross = np.abs(one.sliding) > 3.5 * one.friction * (1.0 + one.restitution) * one.closing
    values = {}
    for key, which in materials(len(one)).items():
        for name in ("restitution", "slide", "spin"):
            allowed = (known.bound(name, law[name]) + np.abs(coarse[name] - law[name]))[which]
            found, due = after[name][which], law[name][which]
            k = worst(np.abs(found - due))
            values[f"{name}_{key}"] = number(
                found[k], due[k], bound=allowed.max(), scale=max(1.0, np.abs(due).max()),
                detail=f"at {swept[which][k]:.3g}°, the worst angle; the tolerance there is {allowed[k]:.2g}")
        if gross[which].any():
            values[f"rigid_sliding_difference_{key}"] = number(np.abs(after["patch"] - rigid["patch"])[which][gross[which]].max())
        if known.slip:
            slip = known.slip.numbers(one)
            values[f"partial_slip_difference_{key}"] = number(np.abs(after["patch"] - slip["patch"])[which].max())
    return values, _curves(_rebounds(one, flight.after, known, sweep, swept))


Entry = tuple[str, str, str, str, Array, Array, Array, str]


def _rebounds(one: Impacts, found: Rebounds, known: Solutions, sweep: str, swept: Array) -> list[Entry]:
    """The curves of the publication, with each theory as the reference of one of them."""
    rigid, law, exactly, throughout = sliding_throughout(one), known.law[0], "exact solution of the law", "sliding throughout"
    after, due, before = found.numbers(one), law.numbers(one), one.sliding / one.closing
    if sweep == "direction":
        angle, due_angle = (np.degrees(np.arctan2(each["patch"], each["restitution"])) for each in (after, due))
        entries: list[Entry] = [
            ("tangential_restitution", "Tangential restitution", "angle (°)", "v_t after / v_t", swept, found.slide[0] / one.slide[0],
             law.slide[0] / one.slide[0], exactly),
            ("spin", "Spin after", "angle (°)", "ω (rad/s)", swept, found.spin[0], rigid.spin[0], throughout),
            ("contact_angle", "Rebound angle of the point of contact", "angle (°)", "angle after (°)", swept, angle, due_angle, exactly)]
    elif sweep == "slide":
        entries = [("scaled_spin", "Spin after", "v_s / μ v_n", "r ω / μ v_n", before / one.friction, after["spin"] / one.friction,
                    due["spin"] / one.friction, exactly)]
    else:
        entries = [
            ("stick", "Reversed sliding", "7/2 μ (1+e) v_n / v_s", "−v_s after / v_s",
             3.5 * one.friction * (1.0 + one.restitution) / before, -after["patch"] / before, -due["patch"] / before, exactly),
            ("recoil_rigid", "Recoil", "v_s / v_n", "v_s after / v_n after", before, after["patch"] / one.restitution,
             rigid.numbers(one)["patch"] / one.restitution, throughout)]
    theory, label = (known.slip.numbers(one), "partial slip, elastic") if known.slip else (due, exactly)
    name, scale, mu = ("scaled_recoil", one.friction, "μ ") if sweep == "slide" else ("recoil", 1.0, "")
    return [*entries, (name, "Recoil", f"v_s / {mu}v_n", f"v_s after / {mu}v_n after", before / scale,
                       after["patch"] / after["restitution"] / scale, theory["patch"] / theory["restitution"] / scale, label)]


def _curves(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """A curve for each material of (name, title, label along, label across, place, values, reference, what the reference is); numbers are
    (n,)."""
    return [profile(f"{name}_{key}", f"{title}, {key.upper()}", along, across, place[which], [values[which]],
                    reference=reference[which], reference_label=label)
            for key, which in materials(len(entries[0][4])).items()
            for name, title, along, across, place, values, reference, label in entries]
