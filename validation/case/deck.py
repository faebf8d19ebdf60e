"""Complete deck folders: derived numbers, packing and meshes are made once, and every engine's deck gets the same bits."""

from __future__ import annotations

import csv
import importlib.util
import math
import re
import shutil
import sys
import traceback
from collections.abc import Mapping
from functools import cache
from numbers import Integral, Real
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np

from dembark.common.choices import Value, nearest, no_parameter
from dembark.common.errors import DembarkError
from dembark.common.extras import advice
from dembark.validation import engines

from . import imports
from .folders import package_root

if TYPE_CHECKING:
    from dembark.input_decks.common.setup import Array, Setup

    from .model import Case

PACKING = "packing.data"
# Years on any machine; beyond it not every number of a step is exact in double precision.
MOST_STEPS = 1e15
_INCLUDED = re.compile(r"{%-?\s*include\s+[\"'](.+?)[\"']")


def load_module(path: Path, name: str) -> ModuleType:
    """The Python file `path` of a case folder, as a module of the package `name`, which holds the other modules of that folder: these are
    imported by `from . import ...`, anew each time. DembarkError with file and line when it cannot be loaded."""
    spec = importlib.util.spec_from_file_location(f"{name}.{path.stem}", path)
    if spec is None or spec.loader is None:
        raise DembarkError(f"{path} cannot be loaded")
    # From a copy: another thread may be importing.
    for known in [one for one in tuple(sys.modules) if one.startswith(f"{name}.")]:
        del sys.modules[known]
    importlib.invalidate_caches()
    package, module = ModuleType(name), importlib.util.module_from_spec(spec)
    package.__path__ = [str(path.parent)]
    sys.modules |= {name: package, module.__name__: module}
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # noqa: BLE001 - the file may be the user's: whatever is wrong in it becomes one line
        raise failed(path, error) from None
    return module


def failed(path: Path, error: Exception) -> DembarkError:
    """One line about an `error` that came up in the Python file `path` of a case folder: what, file and line."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
    return DembarkError(f"{path}{f', line {line}' if line else ''}", *(advice(error) or [f"{type(error).__name__}: {error}"]))


class _Known(SimpleNamespace):
    """Parameters and derived numbers, as setup.py gets them."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(no_parameter(name, vars(self)))


@cache
def _setup_module(path: Path) -> ModuleType:
    return load_module(path, f"dembark_setup_{path.parent.name}")


def prepare(case: Case, values: Mapping[str, Value]) -> Setup:
    """Derived numbers, packing and meshes of a run with the parameters `values`; DembarkError with file and line when they cannot be
    made, or when the run would have no step or never end."""
    setup = _prepared(case, values)
    for name, value, kind, right in (("steps", setup.steps, Integral, "an integer of at least 1"),
                                     ("time_step", setup.time_step, Real, "a positive number of seconds")):
        if not isinstance(value, kind) or not 0 < value < math.inf:
            own = case.folder / "setup.py"
            raise DembarkError(f"{name} = {value!r} of a run of case {case.name}", f"from {own if own.is_file() else '[derived]'}",
                               f"it must be {right}: is a time of the run too short?")
    if setup.steps > MOST_STEPS:
        raise DembarkError(f"a run of case {case.name} would have 1e{math.log10(setup.steps):.0f} steps",
                           f"it may have {MOST_STEPS:.0e}", "take shorter times")
    return setup


def _prepared(case: Case, values: Mapping[str, Value]) -> Setup:
    from dembark.input_decks.common.packing import MOST_SITES
    from dembark.input_decks.common.setup import Setup

    path = case.folder / "setup.py"
    if (count := case.particle_count(values) or 0) > MOST_SITES:
        raise DembarkError(f"case {case.name} would have {count:.2g} bodies", f"a packing may have {MOST_SITES:.0e}", "take fewer")
    known = case.with_derived(values)
    if not path.is_file():
        require_steps(case, values)
        return Setup(round(float(known["steps"])), float(known["time_step"]), None,  # type: ignore[arg-type]
                     {name: known[name] for name in case.derived})  # type: ignore[misc]
    try:
        return _setup_module(path).setup(_Known(**known))
    except DembarkError:
        raise
    except MemoryError as error:
        raise DembarkError(f"the packing of case {case.name} needs more memory than there is", str(error),
                           "take fewer or larger bodies, or a smaller vessel") from None
    except Exception as error:  # noqa: BLE001 - as above
        raise failed(path, error) from None


def write(case: Case, engine: str, values: Mapping[str, Value], folder: Path) -> Setup:
    """Write everything that `engine` needs for a run with the parameters `values` into `folder`; returns what was derived."""
    require_capable(case, engine, values)
    setup = prepare(case, values)
    # Nothing is written before the deck is known to be right.
    files = _files(case, engine, values, setup)
    folder.mkdir(parents=True, exist_ok=True)
    # Parts of decks are in the decks already.
    for name, path in _companions(case).items():
        if path.suffix == ".in":
            continue
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, folder / name)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return setup


def require_steps(case: Case, values: Mapping[str, Value]) -> None:
    """DembarkError when neither a setup.py nor [derived] gives the steps of a run with the parameters `values`."""
    known = {} if (case.folder / "setup.py").is_file() else case.with_derived(values)
    if missing := [name for name in ("steps", "time_step") if known and not isinstance(known.get(name), int | float)]:
        raise DembarkError(f"case {case.name} does not say its {' and '.join(missing)}", f"[derived] of {case.folder / 'case.toml'}",
                           "add expressions there, or a setup.py")


def require_measure(case: Case) -> None:
    """DembarkError when `case` has no measure.py, or that names a table that nobody can read: its runs could not be measured. Nothing is
    imported."""
    code = case.folder / "measure.py"
    if not code.is_file():
        raise DembarkError(f"case {case.name} has no measure.py", str(case.folder),
                           "add one with measure(replicas), see docs/how-to/cases.md")
    for path, line, name, table in imports.named_tables(code):
        named = f"read by {path}, line {line}"
        if table is None:
            raise DembarkError(f"case {case.name} has no file {name}", named, f"put it into {case.folder / 'reference'}")
        if fault := _fault(table):
            raise DembarkError(f"{table}{fault}", named)


def _fault(table: Path) -> str:
    """Why nobody can read a table, for an error line: it is empty or no text, or a row of a CSV has more fields than its header."""
    try:
        lines = table.read_text(encoding="utf-8").splitlines(keepends=True)
    except UnicodeDecodeError:
        return " is not UTF-8 text"
    if not "".join(lines).strip():
        return " is empty"
    header: list[str] = []
    reader = csv.reader(lines if table.suffix == ".csv" else [])
    for row in reader:
        if not row or row[0].startswith("#"):
            continue
        header = header or row
        # Without a comma in the header something else may separate the fields.
        if 1 < len(header) < len(row):
            return f", line {reader.line_num}, has {len(row)} fields, the header {len(header)}"
    return ""


def require_capable(case: Case, engine: str, values: Mapping[str, Value]) -> None:
    """DembarkError when `case` has no deck of `engine`, or the engine cannot do what a run with the parameters `values` needs."""
    if engine not in case.engines or not case.deck(engine).is_file():
        raise DembarkError(f"case {case.name} has no {engines.facts(engine).deck}", f"in {case.folder}",
                           f"it has decks for {' and '.join(case.engines)}")
    if lacking := case.missing_capabilities(engine, values):
        others = [name for name in case.engines if not case.missing_capabilities(name, values)]
        raise DembarkError(f"{engines.facts(engine).title} has no {' and no '.join(lacking)}",
                           f"which these parameters of case {case.name} need", f"take {' or '.join(others)}" if others else "")


def derived(setup: Setup) -> dict[str, Value]:
    """The numbers of `setup` by name, with `steps` and `time_step` (s), as decks of all engines can read them."""
    return {name: _plain(value) for name, value in {**setup.numbers, "steps": setup.steps, "time_step": setup.time_step}.items()}


def sources(case: Case, engine: str) -> dict[str, str]:
    """What makes the deck of `engine` apart from the parameters: checksums of the files by name, and the expressions of derived numbers.

    Files of the folder `reference` are for measurements. They count here only where setup.py reads them, so names that folder.
    """
    shared, setup = package_root() / "common", case.folder / "setup.py"
    files = {path.name: path for path in (case.deck(engine),) if path.is_file()} | _companions(case)
    if setup.is_file():
        files |= imports.dependencies(setup).files
        files |= reference_files(case) if imports.names(setup, "reference") else {}
    if case.deck(engine).suffix == ".in":
        files |= {f"common/{path.relative_to(shared)}": path for pattern in ("*.in", f"{engine}/*") for path in shared.glob(pattern)}
    found = {name: imports.check_sum(path) for name, path in sorted(files.items())}
    return found | {f"derived {name}": expression.text for name, expression in case.derived.items()} | {"outputs": " ".join(case.outputs)}


def included_sources(case: Case, engine: str) -> dict[str, str]:
    """The source of the deck of `engine` and of every file that it includes, directly or through others, by file name."""
    found: dict[str, str] = {}
    waiting = [engines.facts(engine).deck]
    while waiting:
        name = waiting.pop()
        path = next((path for folder in _folders(case, engine) if (path := folder / name).is_file()), None)
        if name not in found and path is not None:
            found[name] = path.read_text(encoding="utf-8", errors="replace")
            waiting += _INCLUDED.findall(found[name])
    return found


def _folders(case: Case, engine: str) -> list[Path]:
    """Where what a deck of `engine` includes is looked for."""
    shared = package_root() / "common"
    return [case.folder, shared / engine, shared]


def reference_files(case: Case) -> dict[str, Path]:
    """What the case is compared with, in its folder `reference`: data by their names in the case folder, without what only people read."""
    return {str(path.relative_to(case.folder)): path for path in sorted((case.folder / "reference").rglob("*"))
            if path.is_file() and path.suffix != ".md" and not path.name.startswith(".")}


def _companions(case: Case) -> dict[str, Path]:
    """Other files of the case folder that decks may read, by their names in it: meshes, tables, what they include; of Python modules, which
    measure.py and setup.py import, only those that a deck imports, too, or names."""
    decks = {engines.facts(name).deck for name in engines.names()}
    known = {"case.toml", "setup.py", "measure.py", *decks}
    texts = [path.read_text(encoding="utf-8", errors="replace") for name in sorted(decks) if (path := case.folder / name).is_file()]
    relative = {path.relative_to(case.folder): path for path in case.folder.rglob("*") if path.is_file()}
    return {str(name): path for name, path in sorted(relative.items())
            if str(name) not in known and name.suffix not in (".md", ".pyc") and name.parts[0] not in ("tests", "campaigns", "reference")
            and not any(part.startswith(".") for part in name.parts)
            and (name.suffix != ".py" or any(_names_module(text, name) for text in texts))}


def _names_module(text: str, module: Path) -> bool:
    return module.name in text or re.search(rf"^\s*(?:import|from) \.?{module.stem}\b", text, re.MULTILINE) is not None


def archive(case: Case, folder: Path) -> None:
    """Copy the files that a run was made and is measured by into `folder`/case, as they are."""
    code = [path for name in ("setup.py", "measure.py") if (path := case.folder / name).is_file()]
    own = {path.resolve() for path in imports.dependencies(*code).files.values()}
    for path in (case.folder / "case.toml", *case.folder.glob("*.py")):
        if path.name == "case.toml" or path.resolve() in own:
            (folder / "case").mkdir(exist_ok=True)
            shutil.copyfile(path, folder / "case" / path.name)


def _files(case: Case, engine: str, values: Mapping[str, Value], setup: Setup) -> dict[str, bytes]:
    kind = engines.engine_class(engine)
    source = case.folder / kind.facts.deck
    try:
        text = source.read_text(encoding="utf-8")
    except OSError as error:
        raise DembarkError(f"{source} cannot be read", error.strerror or str(error),
                           f"add the deck, or take {engine} from engines in case.toml") from None
    known = {name: _plain(value) for name, value in values.items() if name != "replicas"} | derived(setup)
    numbers = {name: engines.DeckNumber(value, _meaning(case, name)) for name, value in known.items()}
    numbers |= {name: engines.DeckNumber(tuple(map(_plain, row))) for name, row in setup.tables.items()}
    try:
        deck = kind.deck_text(text, numbers, _folders(case, engine))
    except jinja2.TemplateError as error:
        raise _wrong_template(case, engine, source, set(numbers), error) from None
    if unknown := _unknown_variables(deck):
        raise DembarkError(f"{source} uses ${{{unknown[0]}}}, which nothing defines", nearest(unknown[0], _DEFINED.findall(deck)),
                           "make it a parameter, or one of the numbers of setup.py")
    files = {kind.facts.deck: deck.encode()}
    if setup.packing is not None:
        files[PACKING] = setup.packing.text().encode()
    return files | {f"{name}.stl": stl(name, triangles) for name, triangles in setup.meshes.items()}


# By dembark's command line: the steps between states.
_GIVEN = {"restart_every"}
_DEFINED = re.compile(r"^\s*variable\s+(\w+)\s", re.MULTILINE)
# Names that a template sets, or takes where they are set.
_NAMED = re.compile(r"{%-?\s*set\s+([\w, ]+?)\s*=|\b(\w+)\s*\|\s*default")


def _unknown_variables(deck: str) -> list[str]:
    """Names of `${name}` in a list of commands that no `variable` there defines; none when the engine reads more files."""
    if re.search(r"^\s*(include|jump)\s", deck, re.MULTILINE):
        return []
    code = "\n".join(line.partition("#")[0] for line in deck.splitlines())
    known = {*_DEFINED.findall(code), *_GIVEN}
    return [name for name in re.findall(r"\$\{(\w+)\}", code) if name not in known]


def _wrong_template(case: Case, engine: str, source: Path, known: set[str], error: jinja2.TemplateError) -> DembarkError:
    """One line about an error in a deck or in a part that it includes: which file, line, and a name that may have been meant."""
    frames = [(frame.filename, frame.lineno) for frame in traceback.extract_tb(error.__traceback__)
              if frame.filename == "<template>" or frame.filename.endswith(".in")]
    if isinstance(error, jinja2.TemplateSyntaxError):
        frames = [(error.filename or "<template>", error.lineno)]
    file, line = frames[-1] if frames else ("<template>", None)
    place = f"{source if file == '<template>' else file}{f', line {line}' if line else ''}"
    if undefined := re.fullmatch(r"'(\w+)' is undefined", str(error)):
        names = known.union(*(re.findall(r"\w+", part) for text in included_sources(case, engine).values()
                              for found in _NAMED.findall(text) for part in found))
        return DembarkError(place, str(error), nearest(undefined.group(1), names))
    return DembarkError(place, str(error))


def _meaning(case: Case, name: str) -> str:
    if name not in case.parameters:
        return ""
    unit = case.parameters[name].unit
    return f"{'' if unit == '1' else unit + '; '}{' '.join(case.parameters[name].doc.split())}"


def _plain(value: Value) -> Value:
    """A number as decks of all engines can read it: unlimited is 1e300."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return int(value)
    return math.copysign(1e300, value) if isinstance(value, float) and math.isinf(value) else value


def stl(name: str, triangles: Array) -> bytes:
    """Triangles (n, 3, 3) as an STL text with all digits."""
    lines = [f"solid {name}"]
    for corners in np.asarray(triangles, float):
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        lines += ["facet normal " + " ".join(f"{x:.17g}" for x in normal / np.linalg.norm(normal)), "outer loop"]
        lines += ["vertex " + " ".join(f"{x:.17g}" for x in corner) for corner in corners]
        lines += ["endloop", "endfacet"]
    return ("\n".join([*lines, f"endsolid {name}"]) + "\n").encode()
