"""Which files a Python file depends on, read from its source."""

from pathlib import Path

import pytest

import dembark
from dembark.validation.case import imports


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Further modules of the package: a chain of two, a package of modules, one that nothing imports."""
    root = tmp_path / "package"
    (root / "tools").mkdir(parents=True)
    for name, text in {"one.py": "from dembark.two import x\n", "two.py": "import numpy\nx = 1\n", "other.py": "",
                       "tools/__init__.py": "y = 1\n",
                       "tools/saw.py": "from . import file\n", "tools/file.py": "", "table.csv": "1\n", "reads.py": "NAME = 'table.csv'\n",
                       "loop.py": "from dembark import loop\n"}.items():
        (root / name).write_text(text)
    monkeypatch.setattr(dembark, "__path__", [str(root), *dembark.__path__])
    for cache in (imports._read, imports._check_sum, imports.module_file):
        cache.cache_clear()
    return root


@pytest.mark.parametrize(("text", "files"), [
    ("from dembark.one import x", {"one.py", "two.py"}),
    ("import dembark.one", {"one.py", "two.py"}),
    ("from dembark import one as first, other", {"one.py", "two.py", "other.py"}),
    ("def f():\n    from dembark.two import x", {"two.py"}),
    ("if True:\n    import dembark.two", {"two.py"}),
    ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from dembark.one import x", set()),
    ("from dembark.tools.saw import z", {"tools/saw.py", "tools/file.py"}),
    ("from dembark.tools import saw", {"tools/saw.py", "tools/file.py"}),
    ("from dembark.tools import y", {"tools/__init__.py"}),
    ("from importlib import import_module\nimport_module('dembark.other')", {"other.py"}),
    ("from dembark.reads import NAME", {"reads.py", "table.csv"}),
    ("import dembark.loop", {"loop.py"}),
    ("import dembark.no_such_module, no_such_library", set()),
    ("def f(:", set()),
])
def test_dependencies(package: Path, text: str, files: set[str]) -> None:
    measure = package.parent / "measure.py"
    measure.write_text(text)
    found = imports.dependencies(measure)
    assert set(found.files) == files | {"measure.py"} and ("numpy" in found.libraries) == ("two.py" in files)
    assert len(found.digest()) == 64


def test_a_process_keeps_the_modules_that_it_imported_and_sees_changes_of_other_files(package: Path) -> None:
    measure = package.parent / "measure.py"
    measure.write_text("from dembark.one import x\n")
    before = imports.dependencies(measure).digest()
    (package / "two.py").write_text("x = 2\n")
    assert imports.dependencies(measure).digest() == before
    measure.write_text("from dembark.one import x  # it\n")
    assert imports.dependencies(measure).digest() != before
