"""The frame of all benchmarks: subjects sampled in turn, ratios to the first of the same round, tables with the facts of the machine."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd

from dembark.common.errors import DembarkError
from dembark.common.files import write_json
from dembark.validation.provenance import commit, cpu, package_version

HERE = Path(__file__).parent
OUT, CACHE = HERE.parent / "results/bench", HERE.parent / "build/bench"
# One sample of a subject: seconds, or what else is measured, by name.
Sample = Mapping[str, float]
Subjects = Mapping[str, Callable[[], Sample]]


def say(line: str) -> None:
    """Progress, on stderr."""
    print(f"dembark: {line}", file=sys.stderr, flush=True)


def in_turn(title: str, subjects: Subjects, rounds: int) -> pd.DataFrame:
    """A row for each sample: `comparison` (the title), `subject`, `round`, and the sample; the first subject is the reference.

    Every second round runs backwards, so that a machine that slows down steadily favours nobody.
    """
    rows = []
    for turn in range(rounds):
        for name in list(subjects)[:: 1 if turn % 2 == 0 else -1]:
            say(f"{title}: round {turn + 1} of {rounds}, {name}")
            rows.append({"comparison": title, "subject": name, "round": turn, **subjects[name]()})
    return pd.DataFrame(rows)


def summary(samples: pd.DataFrame, parts: Sequence[str]) -> list[dict[str, Any]]:
    """An entry for each subject: median, least and greatest of each of `parts`, `<part>_median`, `<part>_min`, `<part>_max`, and, as
    `<part>_ratio_median` and so on, of its ratio to the reference's sample of the same round."""
    first = samples.groupby("comparison")["subject"].transform("first")
    reference = samples[samples["subject"] == first].set_index(["comparison", "round"])[list(parts)]
    rounds = pd.MultiIndex.from_frame(samples[["comparison", "round"]])
    ratios = (samples[list(parts)] / reference.reindex(rounds).to_numpy()).add_suffix("_ratio")
    found = samples.join(ratios).groupby(["comparison", "subject"], sort=False)[[*parts, *ratios]].agg(["median", "min", "max"])
    found.columns = ["_".join(names) for names in found.columns]
    return found.reset_index().to_dict("records")


def spread(row: Mapping[str, Any], part: str, form: str = ".3f") -> str:
    """`median (least-greatest)` of a part of an entry of `summary`."""
    middle, low, high = (format(row[f"{part}_{which}"], form) for which in ("median", "min", "max"))
    return f"{middle} ({low}-{high})"


def facts(versions: Iterable[str] = (), **more: Any) -> dict[str, Any]:
    """When and on what is measured: date, machine and its load, commit, versions of dembark and of Python packages, and `more`."""
    return {"date": datetime.now(UTC).isoformat(timespec="seconds"), "cpu": cpu(), "cores": len(os.sched_getaffinity(0)),
            "load": round(os.getloadavg()[0], 1), **commit(), "dembark": package_version("dembark"),
            **{name: package_version(name) for name in versions}, **more}


def markdown(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def write(out: Path, name: str, title: str, parts: Iterable[str], rows: Any, known: dict[str, Any]) -> None:
    """Print the page `title` with its `parts` (tables, paragraphs) and the facts `known`, and write it as `name`.md into the folder `out`,
    next to `name`.json with `rows` and facts."""
    known = {**known, "load_after": round(os.getloadavg()[0], 1)}
    about = ", ".join(f"{key} {value}" for key, value in known.items() if value is not None)
    page = "\n\n".join([f"# {title}", *parts, f"{about}."]) + "\n"
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / f"{name}.json", {"rows": rows, "provenance": known})
    (out / f"{name}.md").write_text(page, encoding="utf-8")
    print(page)
    say(f"wrote {out / name}.md and .json")


def parser(name: str, about: str | None, rounds: int) -> argparse.ArgumentParser:
    """The options that all benchmarks have."""
    found = argparse.ArgumentParser(prog=f"python -m benchmarks.{name}", description=(about or "").splitlines()[0])
    found.add_argument("--rounds", type=int, default=rounds, help="samples of each subject (default %(default)s)")
    found.add_argument("--out", type=Path, default=OUT, help="folder of the tables (default %(default)s)")
    return found


def at_least_one(given: argparse.Namespace, *names: str) -> None:
    """DembarkError when one of these options is smaller than 1."""
    for name in ("rounds", *names):
        if getattr(given, name) < 1:
            raise DembarkError(f"--{name} is too small", "", "give at least 1")


def ended(work: Callable[[], int | None]) -> int:
    """The exit code of `work`; the error of a failed run or a wrong option is one line."""
    try:
        return work() or 0
    except DembarkError as error:
        say(str(error))
        return error.exit_code
