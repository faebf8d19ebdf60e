"""Every block of README.md and docs/**/*.md is run, or stands in the table of those that are not, with the reason."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from blocks import NOT_RUN, ROOT, SUBSTITUTES, Block, blocks, built, commands, logical_lines, not_run, replaced

from dembark.common.errors import DembarkError
from dembark.validation import engines
from dembark.validation.case import folders
from dembark.validation.cli import main

TINY_CAMPAIGN = """
[campaign]
name = "silo-small"
profile = "quick"
replicas = 1
engines = ["liggghts"]

[[sweeps]]
case = "silo"
variants = ["dry"]
grid = { wall_friction = [0.4] }
fixed = { grain_count = 100, grain_diameter = "8 mm", settle_time = "0.1 s", measure_time = "0.05 s" }
"""
# Files that a page takes for granted, and the file of an earlier command that is taken for them.
TAKEN_FOR = {"run.dump": "out/small/replica-1/grains.dump", "contacts.dump": "out/small/replica-1/contacts.dump",
             "space.txt": "out/drum/replica-1/impacts.txt", "space.dump": "out/drum/replica-1/grains.dump",
             # What README.md has computed under another name is kept.
             "results/campaigns/silo-small": "study"}
RUNNERS = {
    "python": "test_docs.py", "cpp": "test_docs.py", "deck": "test_docs.py",
    "py": "validation/campaigns/tests/test_docs.py", "python yade": "test_yade_blocks.py", "YADE fragment": "test_yade_blocks.py",
    "LIGGGHTS fragment": "test_liggghts_blocks.py", "syntax": "test_liggghts_blocks.py", "python grains.bin": "test_liggghts_blocks.py",
    "LAMMPS deck": "test_lammps_blocks.py", "LAMMPS fragment": "test_lammps_blocks.py", "LAMMPS syntax": "test_lammps_blocks.py",
    "output": "test_liggghts_blocks.py, test_docs.py", "toml": "test_toml", "shell": "test_shell", "file": "test_shell",
    "{toctree}": "make docs", "listing": "test_listing", "template": "test_case_template.py", "picture": "test_architecture.py",
}
# Pages whose commands README.md and the page of restarts have in a similar form.
LONG = {f"docs/how-to/{page}.md" for page in ("fields", "pictures", "campaigns", "moving_walls")}
SHELL_PAGES = [pytest.param(page, id=page, marks=pytest.mark.full if page in LONG else ())
               for page in dict.fromkeys(block.page for block in blocks("shell"))]


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like the top of the checkout, with nothing of what its users make: the shell blocks of all pages run in it, in turn."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in ("input_decks", "validation", "benchmarks", "Makefile"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "tiny.toml").write_text(TINY_CAMPAIGN)
    return folder


@pytest.fixture
def user(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A user in that folder: environment, current folder and signals are put back after a page."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.chdir(checkout)
    home = checkout / "home"
    home.mkdir(exist_ok=True)
    for key, value in {"HOME": str(home), "PWD": str(checkout),
                       "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))}.items():
        monkeypatch.setenv(key, value)
    before = {name: os.environ.get(name) for name in ("DEMBARK_DECKS", "DEMBARK_CASES")}
    yield checkout
    for name, value in before.items():
        os.environ.pop(name, None)
        if value is not None:
            os.environ[name] = value
    folders.load.cache_clear()
    for number, handler in handlers.items():
        signal.signal(number, handler)


def write_files(page: str) -> None:
    """Write the page's blocks that are files: ```toml my-cases/bounce/case.toml."""
    for block in blocks():
        if block.page == page and "/" in block.kind:
            path = Path(block.kind.split()[1])
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")


def run(words: list[str], capture: pytest.CaptureFixture[str]) -> None:
    """Run one command as a shell would; AssertionError with what it said when it fails."""
    words = [os.path.expandvars(Path(word).expanduser() if word.startswith("~") else word) for word in words]
    program, *rest = words
    if program == "cd":
        os.chdir(rest[0])
        os.environ["PWD"] = str(Path.cwd())
    elif program == "mkdir":
        Path(rest[-1]).mkdir(parents="-p" in rest, exist_ok="-p" in rest)
    elif program == "export":
        for name, _, value in (word.partition("=") for word in rest):
            os.environ[name] = value
            folders.load.cache_clear()
    elif program == "dembark" and rest[0] != "yade":
        if "yade" in rest:
            built("yade")
        code = main(rest)
        assert code == 0, capture.readouterr().err
    else:
        if program == "liggghts-dembark":
            words[0] = str(built("liggghts").executable)
        elif program == "dembark":
            built("yade")
            words[0] = str(Path(sys.executable).with_name("dembark"))
        elif program == "python":
            words[0] = sys.executable
        done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, (done.stdout + done.stderr)[-2000:]
        assert "--help" not in words or options(words) <= options(done.stdout.split())


def options(words: list[str]) -> set[str]:
    """The options among `words`."""
    return {match.group() for word in words if (match := re.match(r"--[a-z][a-z-]*", word.strip("[],")))}


@pytest.mark.parametrize("page", SHELL_PAGES)
def test_shell(page: str, user: Path, capsys: pytest.CaptureFixture[str]) -> None:
    built("liggghts")
    write_files(page)
    without_yade = []
    for block in (block for block in blocks("shell") if block.page == page):
        for line in logical_lines(block.text, "\\"):
            if not_run(line):
                continue
            for name, source in TAKEN_FOR.items():
                if (user / source).exists() and not (user / name).exists():
                    (shutil.copytree if (user / source).is_dir() else shutil.copy)(user / source, user / name)
            for words in commands(replaced(line)[0]):
                if "yade" in words and not has_yade():
                    without_yade.append(line)
                    continue
                run(words, capsys)
    if without_yade:
        pytest.skip(f"all but {len(without_yade)} lines; YADE is not built")


def has_yade() -> bool:
    """Whether YADE with dembark's classes is there."""
    try:
        return bool(engines.find("yade"))
    except DembarkError:
        return False


@pytest.mark.parametrize("block", blocks("toml"), ids=lambda block: block.place)
def test_toml(block: Block, tmp_path: Path) -> None:
    if block.text.startswith("[case]"):
        path = tmp_path / "heap" / "case.toml"
        path.parent.mkdir()
        for deck in ("liggghts.in", "yade.py"):
            path.with_name(deck).touch()
        path.write_text(block.text)
        assert folders.load(path).name == "heap"
    elif re.search("^(submit|container) = ", block.text, re.MULTILINE):
        from dembark.validation.runs import site

        path = tmp_path / "site.toml"
        rest = "" if "submit = " in block.text else (site.SHIPPED / "slurm.toml").read_text(encoding="utf-8")
        path.write_text(f"{block.text}\n{rest}")
        assert site.read(path).submit
    else:
        from dembark.validation.campaigns.spec import read

        path = tmp_path / "campaign.toml"
        path.write_text(f"{TINY_CAMPAIGN}\n{block.text}")
        assert read(path).name == "silo-small"


@pytest.mark.parametrize("block", blocks("listing"), ids=lambda block: block.place)
def test_listing(block: Block) -> None:
    code = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "validation").rglob("*.py"))
    names = set(re.findall(r"[\w-]+\.(?:json|toml|log|sqlite|html|pdf)\b", block.text))
    assert names and not {name for name in names if name not in code and name.removesuffix(".pdf") + ".html" not in code}


@pytest.mark.parametrize("line", sorted({line for block in blocks("shell") for line in logical_lines(block.text, "\\")
                                         if re.search(r"\bmake [a-z]", line) and "$HOME/LIGGGHTS-PUBLIC/src &&" not in line}))
def test_make(line: str) -> None:
    words = [word for word in line.split("make ", 1)[1].split() if "$(" not in word and not word.endswith(")")]
    done = subprocess.run(["make", "--dry-run", *words], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    for name in (word.partition("=")[0] for word in line.split() if re.match(r"[A-Z_]+=", word)):
        assert f"$({name})" in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_every_block_is_run_or_in_the_table(capsys: pytest.CaptureFixture[str]) -> None:
    unknown = [block.place for block in blocks() if block.kind not in RUNNERS and block.kind != "formula" and "/" not in block.kind]
    assert not unknown, "neither known as a command nor as a formula"
    lines = [line for block in blocks("shell") for line in logical_lines(block.text, "\\")]
    rows = [f"  {why}: {', '.join(fitting)}" for pattern, why in NOT_RUN if (fitting := [line for line in lines if not_run(line) == why])]
    assert len(rows) == len(NOT_RUN), "a row of NOT_RUN has lost its command"
    changed = {why for line in lines if (why := replaced(line)[1])}
    assert changed == {why for _, _, why in SUBSTITUTES}, "a row of SUBSTITUTES has lost its command"
    with capsys.disabled():
        print(f"\nof the documentation, not run here:\n  mathematics: {len(blocks('formula'))} formulas", *rows, sep="\n")
