"""Where runs come from: a profile of the cases, or the file of a campaign; the steps of a workflow work on both alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError
from dembark.validation.campaigns.expand import Plan
from dembark.validation.campaigns.expand import plan as plan_of
from dembark.validation.campaigns.spec import RunResources, read
from dembark.validation.plan import Series
from dembark.validation.plan import campaign as of_profile


@cache
def _plan(path: Path, cases: tuple[str, ...], engines: tuple[str, ...]) -> Plan:
    return plan_of(read(path), cases, engines)


@dataclass(frozen=True)
class Source:
    """A profile, or else a campaign's file; exactly one of them."""

    profile: str | None = None
    file: Path | None = None

    def __post_init__(self) -> None:
        if (self.profile is None) == (self.file is None):
            raise DembarkError("neither a profile nor a campaign is given, or both", "", "give --profile or --campaign")

    @property
    def words(self) -> list[str]:
        """How the steps of a workflow are told."""
        return ["--campaign", str(self.file)] if self.file else ["--profile", str(self.profile)]

    @property
    def label(self) -> str:
        """Name of the campaign or the profile."""
        return read(self.file).name if self.file else str(self.profile)

    def facts(self) -> dict[str, Any]:
        """What `runs.json` says beside the runs: the profile, or the campaign's name and sweeps."""
        plan = self.plan()
        if plan is None:
            return {"profile": self.profile}
        return {"campaign": plan.spec.name, "description": plan.spec.description, "sweeps": plan.sweeps()}

    def plan(self) -> Plan | None:
        """The whole plan of a campaign; None for a profile."""
        return _plan(self.file, (), ()) if self.file else None

    def series(self, cases: Sequence[str] = (), engines: Sequence[str] = ()) -> list[Series]:
        """All series, or those of some cases and engines, longest first."""
        return list(_plan(self.file, tuple(cases), tuple(engines)).series) if self.file else of_profile(str(self.profile), cases, engines)

    def resources(self, cases: Sequence[str] = (), engines: Sequence[str] = ()) -> Mapping[Path, RunResources]:
        """Resources by place of a series; those of a profile's runs are what RunResources says without any."""
        return _plan(self.file, tuple(cases), tuple(engines)).resources if self.file else {}
