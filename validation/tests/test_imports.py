"""Which files a Python file depends on, read from its source."""

import gc
import sys
import threading
import time
from pathlib import Path
from types import ModuleType

import pytest

import dembark
from dembark.validation.case import deck, folders, imports, syntax
from dembark.validation.judge import measurement


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
    ("from . import helper", {"helper.py", "two.py", "deeper/file.py"}),
    ("from .helper import f", {"helper.py", "two.py", "deeper/file.py"}),
    ("from .deeper import file", {"deeper/file.py"}),
    ("from . import no_such_module", set()),
    ("import helper", set()),
])
def test_dependencies(package: Path, text: str, files: set[str]) -> None:
    measure = package.parent / "measure.py"
    measure.write_text(text)
    (package.parent / "helper.py").write_text("from dembark.two import x\nfrom .deeper.file import f\n")
    (package.parent / "deeper").mkdir()
    (package.parent / "deeper" / "file.py").touch()
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


@pytest.mark.parametrize(("case", "module"), [("silo", "silo/column.py"), ("plane_silo", "silo/column.py"),
                                               ("plane_silo", "common/power_law.py")])
def test_the_modules_of_a_case_are_inputs_of_its_measurement(case: str, module: str) -> None:
    measure = folders.find(case).folder / "measure.py"
    assert any(path.match(f"input_decks/{module}") for path in imports.dependencies(measure).files.values())


def test_a_module_next_to_an_own_measure_is_imported_hashed_kept_and_no_part_of_the_deck(decks: Path, tmp_path: Path) -> None:
    box = decks / "box"
    (box / "helper.py").write_text("NUMBER = 1.0\n")
    (box / "measure.py").write_text("from dembark.postproc.measurement import Measurement, Value, exact\nfrom . import helper\n\n"
                                    "def measure(replicas):\n    return Measurement({'x': Value(exact(helper.NUMBER))})\n")
    case, before = folders.find("box"), deck.sources(folders.find("box"), "liggghts")
    digests = []
    for text in ("NUMBER = 1.0\n", "NUMBER = 22.0\n"):
        (box / "helper.py").write_text(text)
        assert measurement.measure(case, []).values["x"].estimate.value == float(text.split()[-1])
        digests.append(imports.dependencies(box / "measure.py").digest())
    assert digests[0] != digests[1]
    assert "helper.py" not in before and deck.sources(case, "liggghts") == before
    deck.archive(case, tmp_path)
    assert {path.name for path in (tmp_path / "case").iterdir()} == {"case.toml", "measure.py", "helper.py"}
    # A deck that imports the module runs with it.
    (box / "yade.py").write_text("import helper\np = dembark.parameters()\ndembark.run(p.steps)\n")
    assert "helper.py" in deck.sources(case, "yade")


def test_cases_may_have_modules_of_one_name(tmp_path: Path) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "helper.py").write_text(f"NAME = {name!r}\n")
        (tmp_path / name / "measure.py").write_text("from .helper import NAME\n")
    found = [deck.load_module(tmp_path / name / "measure.py", f"dembark_measure_{name}") for name in ("first", "second")]
    assert [one.NAME for one in found] == ["first", "second"]


def test_a_module_is_loaded_while_another_thread_imports(tmp_path: Path) -> None:
    (tmp_path / "measure.py").write_text("x = 1\n")
    ended, before = threading.Event(), sys.getswitchinterval()

    def import_others() -> None:
        while not ended.is_set():
            for number in range(100):
                sys.modules[f"dembark_other_{number}"] = ModuleType("other")
            for number in range(100):
                del sys.modules[f"dembark_other_{number}"]

    other = threading.Thread(target=import_others)
    sys.setswitchinterval(1e-6)
    try:
        other.start()
        for _ in range(200):
            assert deck.load_module(tmp_path / "measure.py", "dembark_measure_box").x == 1
    finally:
        ended.set()
        other.join()
        sys.setswitchinterval(before)


def test_modules_of_one_name_in_two_folders_of_a_case_are_both_inputs(tmp_path: Path) -> None:
    """Its own and that of the folder above."""
    (tmp_path / "own").mkdir()
    for folder in (tmp_path, tmp_path / "own"):
        (folder / "util.py").write_text("x = 1\n")
    code = tmp_path / "own" / "measure.py"
    code.write_text("from . import util\nfrom .. import util as shared\n")
    assert set(imports.dependencies(code).files.values()) == {code, tmp_path / "util.py", tmp_path / "own" / "util.py"}


def test_a_neighbour_that_comes_later_is_found(tmp_path: Path) -> None:
    """A user's case may change while a process runs."""
    code = tmp_path / "measure.py"
    code.write_text("from .later import number\n")
    assert set(imports.dependencies(code).files) == {"measure.py"}
    (tmp_path / "later.py").write_text("number = 1\n")
    assert set(imports.dependencies(code).files) == {"measure.py", "later.py"}


def test_threads_may_read_sources_at_the_same_time() -> None:
    """In Python 3.11.2 two of them could end with a SystemError."""
    sources = [path.read_bytes() for path in sorted(Path(imports.__file__).parents[1].rglob("*.py"))]
    failed: list[str] = []

    class Yielding:
        """Garbage that lets another thread go on while it is collected, which may be in the middle of a tree."""

        def __init__(self) -> None:
            self.cycle = self

        def __del__(self) -> None:
            time.sleep(0.0)

    def read() -> None:
        for source in sources:
            try:
                Yielding()
                syntax.module(source)
            except SystemError as error:
                failed.append(str(error))

    before, collected = sys.getswitchinterval(), gc.get_threshold()
    sys.setswitchinterval(1e-6)
    gc.set_threshold(10)
    try:
        threads = [threading.Thread(target=read) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(before)
        gc.set_threshold(*collected)
    assert not failed
