"""Names in README.md and docs/**/*.md are those of the code: modules, commands, options, styles, keywords, classes, variables, files."""

from __future__ import annotations

import importlib
import re
from functools import cache

import pytest
import typer
from blocks import FENCE, PAGES, ROOT, blocks, commands, logical_lines, parameter_names

from dembark import _physics
from dembark.postproc import cli as postproc
from dembark.validation import cli, engines
from dembark.validation.case.folders import discover

TEXTS = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in PAGES}
ALL = "\n".join(TEXTS.values())
# Words in backticks, outside of fenced blocks.
SPANS = sorted({span for text in TEXTS.values()
                for span in re.findall(r"`([^`\n]+)`", FENCE.sub("", text))})
PLACES = ("benchmarks", "build", "common", "docs", "input_decks", "packaging", "plugins", "postproc", "validation")
# What a build makes; the test runs without it.
BUILT = ("build/",)


@cache
def code(*folders: str) -> str:
    """The source of these folders, tests left out."""
    files = (path for folder in folders for path in sorted((ROOT / folder).rglob("*")))
    kinds = {".py", ".toml", ".h", ".hpp", ".cpp", ".sh", ".txt", ".cmake", ""}
    return "\n".join(path.read_text(encoding="utf-8", errors="replace") for path in files
                     if path.is_file() and path.suffix in kinds and "tests" not in path.parts)


def rows(text: str, *head: str) -> list[str]:
    """First cells of the rows of the tables in `text` whose first column has one of these heads."""
    found, wanted = [], False
    before = ""
    for line in text.splitlines():
        cell = line.split("|")[1].strip() if line.startswith("|") else ""
        if line.startswith("|") and not before.startswith("|"):
            wanted = cell in head
        elif wanted and cell.startswith("`"):
            found.append(cell)
        before = line
    return found


def test_modules_and_what_is_in_them() -> None:
    inside = "\n".join(path.read_text(encoding="utf-8") for path in sorted((ROOT / "plugins/yade/python/dembark").glob("*.py")))
    missing = []
    for name in sorted(set(re.findall(r"\bdembark(?:\.[A-Za-z_]\w*)+", ALL))):
        short = name.split(".")[1]
        if re.search(rf"^(?:def|class) {short}\b", inside, re.MULTILINE) or re.search(rf"\b{name}\.(?:json|mplstyle|md)\b", ALL):
            continue
        if not exists(name):
            missing.append(name)
    assert not missing


def exists(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


@cache
def subcommands() -> dict[str, set[str]]:
    """The commands of `dembark` with their options."""
    found = {}
    for app in (cli.app, postproc.app):
        for name, command in typer.main.get_command(app).commands.items():
            found[name] = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)} | {"--help"}
    return found


def test_commands_and_options_exist() -> None:
    given = [words for span in SPANS if re.match(r"dembark [a-z]", span) for words in commands(span.replace("…", ""))]
    given += [words for block in blocks("shell") for line in logical_lines(block.text, "\\") for words in commands(line)]
    # `--cases FOLDER` stands before the command.
    given = [[words[0], *words[3:]] if words[1:2] == ["--cases"] else words for words in given]
    wrong = [" ".join(words[:2]) for words in given if words[0] == "dembark" and words[1] not in subcommands()]
    wrong += [f"dembark {words[1]} {word}" for words in given if words[0] == "dembark" and words[1] not in ("yade", *wrong)
              for word in words[2:] if word.startswith("--") and word.partition("=")[0] not in subcommands().get(words[1], set())]
    assert not wrong


def test_table_of_options() -> None:
    for page, first, *more in (("fields", "fields", "walls"), ("debarking", "debark"), ("pictures", "render"), ("tracks", "tracks"),
                               ("clumps", "body")):
        named = {option for cell in rows(TEXTS[f"docs/how-to/{page}.md"], "option") for option in re.findall(r"`(--[a-z-]+)`", cell)}
        assert named <= subcommands()[first].union(*(subcommands()[name] for name in more))
        assert {option for option in subcommands()[first] if option.startswith("--")} - named == {"--help"}


def test_options_in_the_text_exist() -> None:
    benchmarks = code("benchmarks") + code("packaging") + (ROOT / "conftest.py").read_text(encoding="utf-8")
    common = {option for parameter in typer.main.get_command(cli.app).params for option in parameter.opts}
    known = common.union(*subcommands().values()) | set(re.findall(r'"(--[a-z-]+)"', benchmarks))
    # Words of other programs: of Slurm, srun, pytest and containers.
    known |= {"--partition", "--output", "--mpi", "--me", "--test-only", "--slow", "--full", "--bind", "--cleanenv"}
    unknown = {option for span in SPANS for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", span)} - known
    assert not unknown


def test_targets_of_make_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    named = {word for span in SPANS if span.startswith("make ") for word in span.split()[1:2]} - {"auto"}
    assert named and named <= targets


def test_variables_of_the_environment_exist() -> None:
    known = code("validation", "common", "postproc", "packaging", "plugins") + (ROOT / "Makefile").read_text(encoding="utf-8")
    named = set(re.findall(r"\b(?:DEMBARK|YADE|LIGGGHTS)_[A-Z_]+\b", ALL)) - {"LIGGGHTS_PUBLIC"}
    assert {name for name in named if name not in known} == set()
    # What a user may set is told.
    read = set(re.findall(r"environ(?:\.get\(|\[)\"(DEMBARK_[A-Z_]+)\"", code("validation", "postproc")))
    read |= {variable for name in engines.names() for variable in engines.facts(name).variables}
    assert read <= named


def test_files_exist() -> None:
    paths = [span for span in SPANS if re.fullmatch(rf"(?:{'|'.join(PLACES)})/[\w./-]+", span) and not span.startswith(BUILT)]
    assert len(paths) > 15
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_readme_names_every_style() -> None:
    main = (ROOT / "plugins/liggghts/main.cpp").read_text(encoding="utf-8")
    headers = code("plugins/liggghts")
    styles = {f"fix {name}" for name in re.findall(r'fixes\["([\w/]+)"\]', main)}
    styles |= set(re.findall(r'commands\(\*host\.input\)\["(\w+)"\]', main))
    styles |= {f"pair_style {name}" for name in re.findall(r'pair_map\)\["([\w/]+)"\]', main)}
    styles |= {f"tangential {name}" for name in re.findall(r"^TANGENTIAL_MODEL\(\w+,(\w+),", headers, re.MULTILINE)}
    styles |= {f"cohesion {name}" for name in re.findall(r"^COHESION_MODEL\(\w+,(\w+),", headers, re.MULTILINE)}
    table = {name for cell in rows(TEXTS["README.md"], "style") for name in re.findall(r"`([^`]+)`", cell)}
    assert len(styles) == 15 and table == styles


def test_readme_and_pages_name_every_class_of_yade() -> None:
    plugin = re.findall(r"YADE_PLUGIN\(\((.*)\)\);", code("plugins/yade"))
    names = {name for line in plugin for name in line.split(")(")}
    assert len(names) > 10
    # What writes the dumps and states of dembark's decks is no class for users.
    assert {name for name in names if name not in ALL} == {"DembarkSnapshot", "DembarkStates"}


def test_keywords_of_liggghts_exist() -> None:
    source = code("plugins/liggghts", "plugins/physics") + TABLE
    for page, text in TEXTS.items():
        if page.startswith(("docs/reference/liggghts_", "docs/reference/fix_")):
            cells = rows(text, "keyword", "property", "name")
            names = [name for cell in cells for name in re.findall(r"`(\w+)`", cell) if not name.startswith("_")]
            assert [name for name in names if f'"{name}"' not in source] == [], page
    registered = re.findall(r'register(?:OnOff|_choice|DoubleSetting)\((?:settings, )?"(\w+)"', source)
    assert len(registered) >= 4
    told = {name for text in TEXTS.values() for cell in rows(text, "keyword") for name in re.findall(r"`(\w+)`", cell)}
    assert set(registered) <= told


# The names that engines and Python make of the tables of parameters and choices.
TABLE = " ".join(f'"{row[key]}"' for row in (*_physics.contact_parameters(), *_physics.contact_choices())
                 for key in ("name", "camel_case", "liggghts") if key in row)


@pytest.mark.parametrize(("engine", "folders"), [
    ("LIGGGHTS", ("plugins/liggghts", "plugins/physics", "plugins/lammps_family")),
    ("LAMMPS", ("plugins/lammps", "plugins/physics", "plugins/lammps_family")), ("Python", ("plugins/python/physics",))])
def test_parameters_exist(engine: str, folders: tuple[str, ...]) -> None:
    named = {name for section in parameter_names(ROOT / "docs/reference/parameters.md", engine).values() for name in section}
    source = code(*folders) + TABLE
    # Those of the stock normal models.
    named -= {"coefficientRestitution", "tangential_damping", "limitForce"} if engine == "LIGGGHTS" else set()
    assert len(named) > 20 and [name for name in named if not re.search(rf'"{name}"|\b{name}: ', source)] == []


def test_every_case_is_in_the_gallery_and_in_the_results() -> None:
    cases = set(discover())
    listed = " ".join(re.findall(r"<!-- cases: ([\w ]+) -->", TEXTS["docs/gallery.md"])).split()
    assert sorted(listed) == sorted(cases)
    assert {name for name in cases if f"input_decks/{name}/README.md" not in TEXTS["docs/validation.md"]} == set()
