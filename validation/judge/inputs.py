"""The inputs of results, as one hash each: it stands in the result's own file, and the result is up to date while it is the same.

Inputs of a measurement are the finished runs, the references of the case, and measure.py with the modules that it imports. Inputs of
verdicts are the measurement and the declarations of case.toml: tolerances, reasons, labels, kinds of evidence, families, controls,
findings.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dembark.common.files import read_json
from dembark.validation.case import deck, imports
from dembark.validation.case.model import Case

_HERE = Path(__file__).parent
KEY = "inputs_hash"
# Of what `measurement_file` keeps: another number measures everything anew.
_FORMAT = 4


def digest(*facts: Any) -> str:
    """Hash of `facts`, which JSON can hold."""
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()


def content(path: Path) -> str:
    """Hash of the content of a file; "" when there is none."""
    return imports.check_sum(path) if path.is_file() else ""


def of_code(*places: str) -> str:
    """Hash of the code in files or folders of this package, of all that they import, and of the layouts in their folders."""
    roots = [path for place in places for path in _files(_HERE.parents[1] / place)]
    return digest(imports.dependencies(*(path for path in roots if path.suffix == ".py")).digest(),
                  [content(path) for path in roots if path.suffix != ".py"])


def _files(place: Path) -> Iterable[Path]:
    return [place] if place.is_file() else (path for path in sorted(place.rglob("*.*")) if path.suffix in (".py", ".j2", ".css", ".js")
                                            and "tests" not in path.parts)


def of_measurement(case: Case, records: Iterable[Path]) -> str:
    """Hash of the inputs of a measurement: the finished runs with these `records`, their run.json."""
    return digest(_FORMAT, _of_measuring(case), [content(path) for path in records])


def _of_measuring(case: Case) -> list[Any]:
    return [imports.dependencies(case.folder / "measure.py").digest(),
            {name: content(path) for name, path in deck.reference_files(case).items()}]


def of_pictures(case: Case, records: Iterable[Path]) -> str:
    """Hash of the inputs of the pictures, which show the first run."""
    drawing = imports.dependencies(Path(imports.module_file("dembark.postproc.pictures") or "")).digest() if case.picture else ""
    return digest(drawing, dict(case.picture), [content(path) for path in records][:1])


def of_verdicts(case: Case) -> str:
    """Hash of what the verdicts of a case depend on apart from the measurement."""
    judging = imports.dependencies(_HERE / "verdict.py", _HERE.parent / "metrics.py").digest()
    return digest(judging, [asdict(one) for one in case.quantities.values()], [asdict(one) for one in case.findings],
                  case.references, case.paired)


def of_study(case: Case, points: Iterable[Path]) -> str:
    """Hash of the inputs of a study: the results of its variants."""
    return digest(_of_measuring(case), [content(path) for path in points], of_verdicts(case))


def stored_hash(path: Path) -> str:
    """The hash that stands in the result `path`, a JSON file or a report; "" when there is no such result, or it holds none."""
    if path.suffix == ".json":
        return str((read_json(path) or {}).get(KEY, ""))
    try:
        last = path.read_text(encoding="utf-8", errors="replace")[-200:]
    except OSError:
        return ""
    return last.partition(f"<!-- {KEY} ")[2].partition(" ")[0]


def stamp(text: str, inputs_hash: str) -> str:
    """The report `text` with its hash, see `stored_hash`."""
    return f"{text.rstrip()}\n<!-- {KEY} {inputs_hash} -->\n"
