"""What the impacts of a load do to bark and wood, where the case says which forces do: see docs/theory/debarking.md."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dembark.postproc import debarking
from dembark.postproc.debarking import ForceRange, Load, Logs, Outcome, RemovalLaw, outcome
from dembark.postproc.impacts import RECORD
from dembark.postproc.measurement import Curve, Numbers, Replica, profile
from dembark.postproc.replica import cached_per_replica

SECTORS = 12  # of the circumference


def force_bound(given: Numbers, radius: float) -> float:
    """N; that no impact of one or two logs exceeds in the drum of the `radius` (m)."""
    mass = 0.25 * math.pi * given["log_density"] * given["log_length"] * given["log_diameter_max"] ** 2
    return debarking.force_bound(given["drum_speed"], radius, given["log_stiffness"], mass, given["gravity"])


@cached_per_replica
def debarked(replica: Replica) -> Outcome | None:
    """The outcome of the measuring window of a load; None where the case has no forces."""
    given = replica.parameters
    if given["bark_force"] is None:
        return None
    period, width = 2.0 * math.pi / given["drum_speed"], given["cleared_width"]
    frame = next(iter(replica.grains()))
    impacts = np.ascontiguousarray(replica.impacts()).view(RECORD)[:, 0]
    load = Load(impacts, Logs(frame.ids, frame.radii, frame.masses, given["log_length"]), given["run_in"] * period,
                (given["run_in"] + given["revolutions"]) * period, period, given["impact_speed"], given["log_stiffness"])
    return outcome(load, ForceRange(given["bark_force"], given["wood_force"]), RemovalLaw(width) if width else None, SECTORS)


def debarking_profiles(results: Sequence[Outcome]) -> list[Curve]:
    """Degree of debarking against revolutions and residence time, and where the logs are hit."""
    first = results[0]
    doses = [one.doses.effective.sum(axis=(0, 1)) / one.doses.effective.sum() * SECTORS for one in results]
    angle = (np.arange(SECTORS) + 0.5) * 360.0 / SECTORS
    found = [profile("effective_around", "Effective impacts around the logs", "angle in the log's own frame (°)", "over the mean", angle,
                     doses, reference=np.ones(SECTORS), reference_label="even")]
    if first.law is None:
        return found
    turns = first.revolutions
    found.append(profile("debarking", "Degree of debarking", "revolutions", "degree of debarking (%)", turns,
                         [100.0 * one.degree for one in results], reference=100.0 * np.mean([one.even(turns) for one in results], axis=0),
                         reference_label="hit evenly around"))
    far = 1.5 * max(one.values["debarking_time"].value for one in results)
    if math.isfinite(far):
        minutes = np.linspace(0.0, far / 60.0, 41)
        found.append(profile("debarking_residence", "Degree of debarking at long times", "residence time (min)", "degree of debarking (%)",
                             minutes, [100.0 * one.even(60.0 * minutes / one.load.period) for one in results],
                             note="mean rates of the window, logs hit evenly around"))
    return found
