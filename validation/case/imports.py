"""Which files a Python file depends on: the modules of this package that it imports, directly or through others, and files that they name.

Dependencies are read from the source, so that nothing has to be imported for it.
"""

from __future__ import annotations

import ast
import hashlib
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

import dembark

from . import syntax

_PACKAGE = "dembark"
_COMPILED = (".so", ".pyd")
_TABLES = (".csv", ".dat", ".json", ".toml", ".txt")


@dataclass(frozen=True)
class _Names:
    """What the source of a module names: `modules`, `a.b.c` or relative `.b.c`, that it may import, other `words` of its text constants,
    and `data`: names of tables, with their lines, that are joined to a path made of `__file__`."""

    modules: frozenset[str]
    words: frozenset[str]
    data: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True)
class Dependencies:
    """Files by names that do not depend on where they are installed, and the libraries of others, by their import names."""

    files: Mapping[str, Path]
    libraries: frozenset[str]

    def digest(self) -> str:
        """Hash of the contents of all files and of the versions of all libraries."""
        facts = {"files": {name: check_sum(path) for name, path in sorted(self.files.items())},
                 "libraries": {name: _version(name) for name in sorted(self.libraries)}}
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def check_sum(path: Path) -> str:
    """SHA-256 of a file, computed once until it changes; of a module of this package once, for a process goes on with what it imported."""
    return _check_sum(path, *_state(path))


def _state(path: Path) -> tuple[int, ...]:
    if any(path.is_relative_to(root) for root in dembark.__path__):
        return ()
    facts = path.stat()
    return facts.st_mtime_ns, facts.st_ctime_ns, facts.st_size


@cache
def _check_sum(path: Path, *_state: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def dependencies(*roots: Path) -> Dependencies:
    """What the Python files `roots` depend on, themselves among it.

    Imports within functions count, those under TYPE_CHECKING do not. Of a package only what is imported from it counts. A module that names
    a file in its own folder depends on that file. A file that cannot be parsed counts alone: it is reported when it is loaded.
    """
    files: dict[str, Path] = {}
    libraries: set[str] = set()
    waiting = [(_label(path), path) for path in roots]
    while waiting:
        name, path = waiting.pop()
        if files.get(name, path) != path:  # another file of the same name, such as one of the folder above
            name = f"{path.parent.name}/{name}"
        if name in files:
            continue
        files[name] = path
        if path.suffix != ".py":
            continue
        found = _named(path)
        for module in found.modules:
            if module.startswith("."):
                place = _neighbour(path, module)
            elif module.split(".")[0] == _PACKAGE:
                place = module_file(module)
            else:
                libraries.add(module.split(".")[0])
                continue
            if place:
                waiting.append((_label(place, path.parent, name.rpartition("/")[0]), place))
        waiting += [(f"{name.rpartition('/')[0]}/{word}".lstrip("/"), path.parent / word) for word in found.words
                    if _is_file_of(path.parent, word)]
    return Dependencies(files, frozenset(libraries - sys.stdlib_module_names))


def names(path: Path, word: str) -> bool:
    """Whether a text constant of the Python file `path` is `word`, or a relative path that begins with it."""
    return any(one == word or one.startswith(f"{word}/") for one in _named(path).words)


def named_tables(code: Path) -> list[tuple[Path, int, str, Path | None]]:
    """Tables that the Python file `code` of a case, or a module of that case that it imports, names by a path made of `__file__`: file and
    line that name it, the name, and the table, which lies next to them or in the folder `reference`; None when there is none."""
    own = [path for path in dependencies(code).files.values() if path.suffix == ".py" and path.is_relative_to(code.parent)]
    return [(path, line, name, next((place for folder in (path.parent, code.parent, code.parent / "reference")
                                     if (place := folder / name).is_file()), None))
            for path in own for name, line in _named(path).data]


def _data(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Names of tables in `place / "name"`, `place.with_name("name")` and `place.joinpath("name")`, where `place` has `__file__` or a name
    that the module gives to such a path; and their lines."""
    anchors = {"__file__"}

    def anchored(node: ast.AST) -> bool:
        return any(isinstance(one, ast.Name) and one.id in anchors for one in ast.walk(node))

    for statement in tree.body:
        if isinstance(statement, ast.Assign) and anchored(statement.value):
            anchors |= {one.id for one in statement.targets if isinstance(one, ast.Name)}
    for node in _nodes(tree):
        match node:
            case ast.BinOp(left=place, op=ast.Div(), right=ast.Constant(value=str(name))):
                names = [name]
            case ast.Call(func=ast.Attribute(value=place, attr="with_name" | "joinpath"), args=given):
                names = [one.value for one in given[-1:] if isinstance(one, ast.Constant) and isinstance(one.value, str)]
            case _:
                continue
        yield from ((name, node.lineno) for name in names if name.endswith(_TABLES) and anchored(place))


def _named(path: Path) -> _Names:
    return _read(path, *_state(path))


@cache
def _read(path: Path, *_state: int) -> _Names:
    try:
        tree = syntax.module(path.read_bytes())
    except (SyntaxError, ValueError):
        return _Names(frozenset(), frozenset())
    modules, words = set[str](), set[str]()
    for node in _nodes(tree):
        match node:
            case ast.Import(names=found):
                modules |= {one.name for one in found}
            case ast.ImportFrom(module=module, names=found, level=0) if module:
                modules |= {f"{module}.{one.name}" for one in found}
            case ast.ImportFrom(module=module, names=found, level=level):
                modules |= {f"{'.' * level}{module + '.' if module else ''}{one.name}" for one in found}
            case ast.Constant(value=str(word)) if word.startswith(f"{_PACKAGE}.") and word.replace(".", "").isidentifier():
                modules.add(word)  # for import_module
            case ast.Constant(value=str(word)):
                words.add(word)
    return _Names(frozenset(modules), frozenset(words), tuple(dict.fromkeys(_data(tree))))


def _nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """All nodes but those that only type checkers see."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            yield from (inner for other in node.orelse for inner in (other, *_nodes(other)))
            continue
        yield node
        yield from _nodes(node)


def _neighbour(path: Path, name: str) -> Path | None:
    """File of the module that the file `path` calls `name`, with points in front; the folder of a case needs no __init__.py for it."""
    parts = name.lstrip(".").split(".")
    folder = path.parents[len(name) - len(name.lstrip(".")) - 1]
    for root in dembark.__path__:
        if folder.is_relative_to(root):
            return module_file(".".join((_PACKAGE, *folder.relative_to(root).parts, *parts)))
    # Of a user's own case, whose files may come while the process runs.
    package = folder / "__init__.py"
    return _module_in([folder], parts) or (package if package.is_file() else None)


@cache
def module_file(name: str) -> Path | None:
    """File of the module `name` of this package, or of the one that defines the name after its last point; None when there is none."""
    _, *parts = name.split(".")
    return _module_in(dembark.__path__, parts)


def _module_in(roots: Iterable[str | Path], parts: list[str]) -> Path | None:
    for count in range(len(parts), 0, -1):
        for root in roots:
            place = Path(root).joinpath(*parts[:count])
            for path in (place.with_name(f"{place.name}.py"), place / "__init__.py", *_compiled(place)):
                if path.is_file():
                    return path
    return None


def _compiled(place: Path) -> Iterable[Path]:
    return (path for path in place.parent.glob(f"{place.name}.*") if path.suffix in _COMPILED) if place.parent.is_dir() else ()


def _label(path: Path, folder: Path | None = None, label: str = "") -> str:
    """Name of a file wherever it is installed: its place in the package; else `label` and its place below `folder`; else its file name."""
    for root in map(Path, dembark.__path__):
        if path.is_relative_to(root):
            place = path.relative_to(root)
            # The ending of a compiled module says for which Python it is.
            return str(place.with_name(place.name.split(".")[0]) if path.suffix in _COMPILED else place)
    return str(Path(label, path.relative_to(folder))) if folder and path.is_relative_to(folder) else path.name


def _is_file_of(folder: Path, word: str) -> bool:
    return 0 < len(word) < 100 and "." in word and "/" not in word and "\0" not in word and (folder / word).is_file()


@cache
def _version(library: str) -> str:
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        # What is imported and what is installed may have different names, such as PIL and pillow.
        return " ".join(sorted({metadata.version(name) for name in metadata.packages_distributions().get(library, ())}))
