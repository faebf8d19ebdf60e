"""Where plans come from: a profile of the cases, or the file of a campaign. A profile is a campaign that comes with the cases."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.validation.campaigns import expand, spec
from dembark.validation.runs.plan import Plan, campaign


def plan(profile: str | None = None, file: Path | None = None, cases: Sequence[str] = (), engines: Sequence[str] = ()) -> Plan:
    """What a profile, or else the campaign in `file`, runs: all of it, or that of some cases and engines."""
    if (profile is None) == (file is None):
        raise DembarkError("neither a profile nor a campaign is given, or both", "", "give --profile or --campaign")
    whole = not (cases or engines)
    if file is not None:
        found = of_campaign(file, tuple(cases), tuple(engines))
        facts = {"campaign": found.spec.name, "description": found.spec.description, "sweeps": found.sweeps()}
        return Plan(found.spec.name, found.series, facts, ("--campaign", str(file)), found.resources, found.spec.retries,
                    found.spec.measure, whole)
    series = tuple(campaign(str(profile), cases, engines))
    return Plan(str(profile), series, {"profile": profile}, ("--profile", str(profile)), whole=whole)


@cache
def of_campaign(file: Path, cases: tuple[str, ...] = (), engines: tuple[str, ...] = ()) -> expand.Plan:
    """The plan of a campaign with its points; the same however often it is asked for."""
    return expand.plan(spec.read(file), cases, engines)
