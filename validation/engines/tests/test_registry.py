"""One module knows an engine: no other Python code names one, and an engine that is registered is found everywhere."""

from __future__ import annotations

import ast
import io
import re
import subprocess
import tokenize
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest

from dembark.common.checkout import checkout
from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.validation import doctor, engines
from dembark.validation.case import folders
from dembark.validation.cli import main
from dembark.validation.engines import DeckNumber, Engine, EngineFacts, engine_class
from dembark.validation.engines.base import digest

NAMED = re.compile("liggghts|yade|lammps", re.IGNORECASE)
# The list of publications names what it cites.
CITATIONS = "references.py"
CASE = """
[case]
title = "A box"
engines = ["stub"]
[parameters.grain_count]
value = 10
doc = "number of grains"
[derived]
steps = "10 * grain_count"
time_step = "1e-5"
"""


def tree() -> Path:
    top = checkout()
    assert top
    return top


def docstrings(text: str) -> set[tuple[int, int]]:
    """Where the docstrings of a module begin, as (line, column)."""
    kinds = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    first = (node.body[0] for node in ast.walk(ast.parse(text)) if isinstance(node, kinds) and node.body)
    return {(one.value.lineno, one.value.col_offset) for one in first
            if isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant) and isinstance(one.value.value, str)}


def mentions(text: str) -> list[int]:
    """Lines of a module where a name, a comment or a string that is no docstring names an engine."""
    # What is neither code nor words, such as the end of a line, cannot match.
    left_out = docstrings(text)
    return [token.start[0] for token in tokenize.generate_tokens(io.StringIO(text).readline)
            if token.start not in left_out and NAMED.search(token.string)]


def modules() -> Iterator[Path]:
    for folder in ("validation", "common", "postproc"):
        for path in sorted((tree() / folder).rglob("*.py")):
            parts = path.relative_to(tree()).parts
            if "tests" not in parts and parts[:2] != ("validation", "engines"):
                yield path


@pytest.mark.parametrize(("text", "lines"), [
    ('"""Of YADE."""\ndef f():\n    """Like LAMMPS."""\n', []), ('x = 1\n"""yade"""\n', [2]), ("def run_yade(): ...\n", [1]),
    ("# LIGGGHTS does\n", [1]), ('x = 1\ny = f"{x} in Yade"\n', [2])])
def test_a_mention_is_seen_outside_docstrings_only(text: str, lines: list[int]) -> None:
    assert mentions(text) == lines


def test_no_other_module_names_an_engine() -> None:
    found = {str(path.relative_to(tree())): lines for path in modules() if (lines := mentions(path.read_text(encoding="utf-8")))}
    assert set(found) <= {f"validation/{CITATIONS}"}, found
    assert len(list(modules())) > 30


@pytest.mark.parametrize("engine", engines.ENGINES, ids=engines.names())
def test_a_registered_engine_fulfils_the_protocol(engine: type[Engine], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    facts = engine.facts
    assert issubclass(engine, Engine) and isinstance(facts, EngineFacts) and engines.facts(facts.name) is facts
    assert facts.name.isidentifier() and facts.name == facts.name.lower() and facts.title and facts.program and facts.measured_on
    assert re.fullmatch("#[0-9A-F]{6}", facts.colour) and re.compile(facts.version_pattern).groups == 1
    assert min(facts.relative_cost, facts.restart_rate, facts.typical_rate) > 0.0
    assert all(re.fullmatch("DEMBARK_[A-Z_]+", variable) for variable in facts.variables)
    program = tmp_path / "overlay/bin/program"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    found = engine(program, "1.0", "abc")
    assert found.name == facts.name and program in found.own_files() and list(found.build_folders())
    words = found.command(Path(facts.deck), {"size": 0.1, "count": 2, "unset": None}, threads=2)
    assert words[0] == str(program) and facts.deck in words and not any("unset" in word for word in words)
    assert any("0.1" in word for word in words) and found.environment(2)["OMP_NUM_THREADS"] == "2"
    assert set(facts.capabilities) <= set(engines.CAPABILITIES)
    assert facts.missing_capabilities(engines.CAPABILITIES) == [
        what for name, what in engines.CAPABILITIES.items() if name not in facts.capabilities]
    monkeypatch.delenv(facts.launcher, raising=False)
    if facts.ranks:
        assert found.command(Path(facts.deck), {}, ranks=2)[2] == "2"
        monkeypatch.setenv(facts.launcher, "starter --quiet")
        assert found.command(Path(facts.deck), {}, ranks=2)[:4] == ["starter", "--quiet", "-n", "2"]
    else:
        with pytest.raises(DembarkError, match=f"--ranks 2 with {facts.title}"):
            found.command(Path(facts.deck), {}, ranks=2)
    for variable in facts.variables:
        monkeypatch.setenv(variable, str(tmp_path / "nothing"))
        with pytest.raises(DembarkError, match=variable):
            engine.locate()
        program.chmod(0o755)
        monkeypatch.setenv(variable, str(program))
        assert engine.locate() == program


def test_the_engine_itself_counts_and_not_its_launcher_alone(tmp_path: Path) -> None:
    """A script that starts a program, as that of LAMMPS, a program with the engine in a library, as that of LIGGGHTS, and links to YADE's
    libraries."""
    program, launcher = tmp_path / "lmp", tmp_path / "bin" / "lammps-dembark"
    launcher.parent.mkdir()
    launcher.write_text(f'#!/bin/sh\nexec "{program}" "$@"\n')
    kinds = {"lammps": launcher, "liggghts": tmp_path / "liggghts-dembark", "yade": tmp_path / "overlay/bin/yade"}
    (tmp_path / "overlay/bin").mkdir(parents=True)
    (tmp_path / "overlay/lib").mkdir()
    kinds["yade"].touch()
    (tmp_path / "overlay/lib/libyade.so").symlink_to(tmp_path / "libyade.so")
    (tmp_path / "library.c").write_text("int answer(void) { return ANSWER; }\n")
    (tmp_path / "main.c").write_text("int answer(void);\nint main(void) { return answer(); }\n")

    def build(answer: int) -> dict[str, str]:
        for name, linked in (("lammps", program), ("liggghts", kinds["liggghts"]), ("yade", kinds["yade"])):
            library = tmp_path / f"lib{name}.so"
            subprocess.run(["gcc", "-shared", "-fPIC", f"-DANSWER={answer}", "-o", library, tmp_path / "library.c"], check=True)
            if not linked.exists():
                subprocess.run(["gcc", "-o", linked, tmp_path / "main.c", library, f"-Wl,-rpath,{tmp_path}"], check=True)
        return {name: digest(engine_class(name)(path, "1", "").own_files()) for name, path in kinds.items()}

    before, after = build(1), build(2)
    assert all(before[name] != after[name] for name in kinds)
    assert build(1) == before


def test_engines_are_told_apart() -> None:
    for what in ("name", "title", "deck", "colour", "marker"):
        assert len({getattr(engine.facts, what) for engine in engines.ENGINES}) == len(engines.ENGINES)


@pytest.mark.parametrize("ask", [engines.find, engines.facts])
def test_an_unknown_engine_is_refused_with_near_matches(ask: object) -> None:
    for name, expected in (("ligghts", "did you mean liggghts?"), ("esys", "known are lammps, liggghts, yade")):
        with pytest.raises(DembarkError) as caught:
            ask(name)  # type: ignore[operator]
        assert str(caught.value) == f"unknown engine '{name}', {expected}"


def test_titles_for_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    assert engines.titles("and") == "LIGGGHTS, YADE and LAMMPS" and engines.titles("or", lambda one: one.threads) == "YADE"
    assert engines.titles("and", lambda one: False) == ""
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, Stub))
    assert engines.titles("or") == "LIGGGHTS, YADE, LAMMPS or The Stub"


class Stub(Engine):
    """An engine that is a shell script."""

    facts = EngineFacts(
        name="stub", title="The Stub", program="the stub", deck="stub.txt", version_words=("--version",), version_pattern=r"stub (\S+)",
        restart_suffix="stub", colour="#000000", marker="x", relative_cost=2, restart_rate=1e3, typical_rate=1e3, measured_on="nothing",
        variables=("STUB",))
    program = Path("stub")

    @classmethod
    def locate(cls) -> Path:
        return cls.program

    @classmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        return source + "".join(f"{name} {number.value}\n" for name, number in numbers.items())

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        self.facts.check_ranks(ranks)
        return [str(self.executable), str(deck)]


@pytest.fixture
def stub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The stub, registered and installed, and a folder with one case for it."""
    program = tmp_path / "stub"
    program.write_text("#!/bin/sh\necho stub 4.2\n")
    program.chmod(0o755)
    folder = tmp_path / "decks/box"
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(CASE)
    (folder / "measure.py").write_text("def measure(replicas): ...\n")
    monkeypatch.setattr(Stub, "program", program)
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, Stub))
    monkeypatch.setenv("DEMBARK_DECKS", str(folder.parent))
    monkeypatch.setenv("DEMBARK_TOLD_BY_STUB", "")
    folders.load.cache_clear()
    engines.find.cache_clear()
    yield folder
    engines.find.cache_clear()


def test_a_new_engine_is_found_everywhere(stub: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    from dembark.validation.campaigns import estimate
    from dembark.validation.campaigns.plan import series
    from dembark.validation.case import deck
    from dembark.validation.report.figures import look

    assert main(["cases"]) == 0 and "stub" in capsys.readouterr().out
    told = {finding.what: finding.found for finding in doctor.examine()}
    assert told["the stub"] == f"4.2 ({Stub.program})"
    assert (look("stub").title, look("stub").colour, look("stub").marker) == ("The Stub", "#000000", "x")
    assert look("gone").title == "gone" and look("gone").colour not in {facts.colour for facts in map(engines.facts, engines.names())}
    assert estimate.Rates().of(folders.find("box"), "stub").value == 1e3
    monkeypatch.chdir(stub)
    for words, expected in ((["--engine", "stbu"], "did you mean stub?"),
                            (["--engine", "stub", "--ranks", "2"], "with The Stub, use --threads")):
        assert main(["run", "box", *words]) == 2
        assert expected in capsys.readouterr().err
    with pytest.raises(DembarkError, match=r"case box has no stub\.txt"):
        series(folders.find("box"), "default", None, engines.find("stub"))
    (stub / "stub.txt").write_text("deck\n")
    (run,) = series(folders.find("box"), "default", None, engines.find("stub")).runs
    assert run.engine.version == "4.2" and run.engine.command(run.case.deck("stub"), {})[1] == str(stub / "stub.txt")
    deck.write(run.case, "stub", run.values, stub.parent)
    assert (stub.parent / "stub.txt").read_text().splitlines()[:2] == ["deck", "grain_count 10"]
