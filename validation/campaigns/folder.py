"""The folder of a campaign: whose it is, the copy of the campaign's file that counts in it, and how it was submitted."""

from __future__ import annotations

import getpass
import hashlib
import os
import socket
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dembark.common.errors import DembarkError
from dembark.common.files import read_json, write_json, write_whole
from dembark.validation import engines, provenance
from dembark.validation.campaigns.expand import Plan
from dembark.validation.campaigns.spec import read
from dembark.validation.case.folders import shipped_root
from dembark.validation.runs.perform import LOCK
from dembark.validation.runs.steps import CAMPAIGN_FILE as FILE

FACTS = "campaign.json"
LOG = "campaign.log"


@dataclass(frozen=True)
class Options:
    """How a campaign is run: `local`, `slurm` or the file of a site; cores of this host and jobs at a time (None = all)."""

    executor: str = "local"
    cores: int | None = None
    jobs: int | None = None


def choose(executor: str, cores: int | None, jobs: int | None) -> Options:
    """Options with the path of a site's file made absolute, for a later `resume` from elsewhere."""
    return Options(str(Path(executor).resolve()) if Path(executor).is_file() else executor, cores, jobs)


def default(name: str) -> Path:
    """Where a campaign goes unless told otherwise."""
    return Path("results") / "campaigns" / name


def refuse_foreign(folder: Path, name: str) -> None:
    """DembarkError when `folder` holds anything but an earlier state of the campaign `name`."""
    if not folder.exists():
        return
    if not folder.is_dir():
        raise DembarkError(f"{folder} is a file", "", "choose a folder with --out")
    copy = folder / FILE
    if copy.is_file():
        owner = read_name(folder)
        if owner != name:
            raise DembarkError(f"{folder} belongs to the campaign {owner}", f"this one is {name}", "choose another folder with --out")
    elif any(path.name != LOCK for path in folder.iterdir()):
        raise DembarkError(f"{folder} is not empty and holds no campaign", "", "choose a new folder with --out")


def read_name(folder: Path) -> str:
    """Name of the campaign whose folder it is."""
    facts = read_json(folder / FACTS)
    return str(facts["name"]) if facts and "name" in facts else read(folder / FILE).name


def own_file(folder: Path) -> Path:
    """The campaign's file in its folder; DembarkError when it is no campaign's folder."""
    copy = folder / FILE
    if not copy.is_file():
        raise DembarkError(f"{folder} is no campaign's folder", f"it has no {FILE}", "start one with 'dembark submit FILE --out FOLDER'")
    return copy.resolve()


def _last(folder: Path, what: str) -> dict[str, Any]:
    submissions = (read_json(folder / FACTS) or {}).get("submissions", [])
    return dict(submissions[-1].get(what, {})) if submissions else {}


def options(folder: Path) -> Options:
    """How the campaign was submitted last."""
    return Options(**{key: value for key, value in _last(folder, "options").items() if key in Options.__dataclass_fields__})


def _variables() -> list[str]:
    """What else says which engines and cases are meant; `resume` takes it over where the shell says nothing."""
    return [*(variable for name in engines.names() for variable in engines.facts(name).variables), "DEMBARK_DECKS", "DEMBARK_MPIRUN"]


def restore(folder: Path) -> None:
    """Set the variables for engines and cases as they were at the last submission, unless they are set."""
    for name, value in _last(folder, "environment").items():
        if name in _variables():
            os.environ.setdefault(name, value)


def enter(folder: Path, file: Path, plan: Plan, chosen: Options) -> None:
    """Write the copy of the campaign's file into `folder` and add to `campaign.json` who submits it, from where, with what."""
    text = file.read_bytes()
    write_whole(folder / FILE, text)
    facts = read_json(folder / FACTS) or {}
    submission: dict[str, Any] = {
        "at": datetime.now(UTC).isoformat(timespec="seconds"), "file": str(file), "sha256": hashlib.sha256(text).hexdigest(),
        "options": asdict(chosen), "host": socket.gethostname(), "user": _user(), "decks": str(shipped_root()),
        "environment": {name: os.environ[name] for name in _variables() if name in os.environ},
        **provenance.commit(), "versions": versions(plan)}
    write_json(folder / FACTS, {"name": plan.spec.name, "description": plan.spec.description,
                                "submissions": [*facts.get("submissions", []), submission]})


def versions(plan: Plan) -> Mapping[str, str | None]:
    """Versions of dembark and the engines of a plan."""
    used = {run.engine.name: run.engine.version for one in plan.series for run in one.runs}
    return {"dembark": provenance.package_version("dembark"), **used}


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return str(os.getuid())
