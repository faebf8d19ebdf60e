"""The blocks of README.md and docs/**/*.md: where they stand, what they are, and what is run in their place.

A block is fenced, or indented by four spaces. Fenced ones say what they are; of indented ones the first word tells.
"""

from __future__ import annotations

import ast
import importlib.util
import re
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import pytest

from dembark.common.errors import DembarkError
from dembark.validation import engines

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]


def load_script(name: str = "capillary_errors") -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / f"docs/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FENCE = load_script("tutorials").FENCE
# After an empty line, or at the beginning of the page.
INDENTED = re.compile(r"(?:(?<=\n\n)|\A)    .*\n?(?:(?:    .*|[ \t]*)\n?)*?(?=^ {0,3}\S|\Z)", re.MULTILINE)
SHELL = {"dembark", "make", "liggghts-dembark", "yade", "python", ".venv/bin/python", "mkdir", "cd", "cp", "export", "module"}
LIGGGHTS = {"pair_style", "fix", "compute", "dump", "thermo_style", "wall", "resume_state", "if", "region", "run"}
# What a line of a page's "Syntax" has and no command that can be run.
TEMPLATE = re.compile(r"\bID\b|\bBASE\b|\bvalues? \.\.\.|\bNAME\b")
MATHEMATICS = re.compile(r"[=≥≤√·]|<=|>=")


@dataclass(frozen=True)
class Block:
    """One block: its page, the line it begins in, its kind, and its text without indentation."""

    page: str
    line: int
    kind: str
    text: str

    @property
    def place(self) -> str:
        """Page and line, as a test's name."""
        return f"{self.page}:{self.line}"


def blocks(*kinds: str) -> list[Block]:
    """All blocks of these kinds (all kinds when none is named), in the order of the pages, without those of tutorials."""
    pages = [page for page in PAGES if page.parent.name != "tutorials"]
    return [block for page in pages for block in map(_of_engine, _of_page(page)) if not kinds or block.kind in kinds]


def _of_engine(block: Block) -> Block:
    """LAMMPS and LIGGGHTS have one language; the styles tell which of them is meant."""
    kinds = {"deck": "LAMMPS deck", "syntax": "LAMMPS syntax", "LIGGGHTS fragment": "LAMMPS fragment"}
    lammps = block.page.startswith("docs/reference/lammps_") or re.search("dembark/granular|wall/dembark", block.text)
    return replace(block, kind=kinds.get(block.kind, block.kind)) if lammps else block


def _of_page(page: Path) -> list[Block]:
    name, text = str(page.relative_to(ROOT)), page.read_text(encoding="utf-8")
    found = []
    for one in FENCE.finditer(text):
        kind = one[1].strip()
        found.append(Block(name, text.count("\n", 0, one.start()) + 2, {"sh": "shell", "lammps": "deck"}.get(kind, kind), one[2]))
    rest = FENCE.sub(lambda one: "#" + "\n#" * one[0].count("\n"), text)
    for one in INDENTED.finditer(rest):
        inner = re.sub("^    ", "", one[0], flags=re.MULTILINE).rstrip() + "\n"
        found.append(Block(name, rest.count("\n", 0, one.start()) + 1, _kind(inner), inner))
    return sorted(found, key=lambda one: one.line)


def _kind(text: str) -> str:
    """What an indented block is."""
    lines = text.splitlines()
    word = lines[0].split()[0]
    if word in SHELL:
        return "shell"
    if word in LIGGGHTS:
        return "syntax" if TEMPLATE.search(text) else "LIGGGHTS fragment"
    if all(line.startswith(("dembark: ", "LCP: ")) for line in lines):
        return "output"
    if all(line.startswith("results/") for line in lines):
        return "listing"
    if _is_python(text):
        return "YADE fragment"
    return "formula" if MATHEMATICS.search(text) else "unknown"


def _is_python(text: str) -> bool:
    try:
        return bool(ast.parse(text).body)
    except SyntaxError:
        return False


def parameter_names(page: Path, engine: str) -> dict[str, list[str]]:
    """Of each section of a page the names in backticks that its tables give for an engine, in the column whose head names it.

    "`a`; YADE: `b`" is `b` in YADE and `a` elsewhere.
    """
    found: dict[str, list[str]] = {}
    section, at = "", None
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            section = line.removeprefix("## ")
        cells = line.strip("|").split("|") if line.startswith("|") else []
        if not cells:
            at = None
        elif at is None:
            at = next((number for number, cell in enumerate(cells) if re.search(rf"\b{engine}\b", cell)), -1)
        elif at >= 0 and not line.startswith("|---"):
            own, common = [], []
            for part in cells[at].split(";"):
                engines, colon, _ = part.partition(": ")
                (own if engine in engines and colon else [] if colon else common).append(part)
            # Those of materials and bodies are no names of the engine.
            found.setdefault(section, []).extend(name for part in own or common if " of the " not in part
                                                 for name in re.findall(r"`([a-z]\w+)`", part))
    return found


def logical_lines(text: str, continuation: str) -> list[str]:
    """Lines without comments, those that end with `continuation` joined to the next."""
    joined: list[str] = []
    going_on = False
    for written in text.splitlines():
        bare = re.sub(r"\s+#.*|^#.*", "", written).rstrip()
        ends, line = bare.endswith(continuation), bare.removesuffix(continuation).strip()
        if going_on:
            joined[-1] += f" {line}"
        elif line:
            joined.append(line)
        going_on = ends
    return joined


def commands(text: str) -> list[list[str]]:
    """The words of each command of a shell block; `&&` separates commands."""
    words = [part.split() if "$(" in part else shlex.split(part) for line in logical_lines(text, "\\") for part in line.split("&&")]
    return [each for each in words if each]


# What is run in place of a command as it is printed: pattern, replacement, and why.
SUBSTITUTES = (
    (r"(dembark run silo .*--set replicas)=3", r"\1=1", "one packing in place of three"),
    (r"(dembark run silo --engine (?:liggghts|yade) .*)", r"\1 --set replicas=1", "one packing in place of two"),
    (r"--grid 64,64,64", "--grid 16,16,16", "a hundredth of the cells"),
    (r"dembark (submit|run) silo-small\b", r"dembark \1 tiny.toml",
     "one run of 100 grains in place of eight: a campaign with report takes minutes"),
    (r"(dembark deck silo --engine \w+) .*--out", r"\1 --set grain_count=60 --set settle_time=0.05 --set measure_time=0.02 --out",
     "60 grains for 0.07 s in place of 2200 for 1 s"),
    (r"restart_every([ =])5000", r"restart_every\g<1>500", "states every 500 steps in place of 5000"),
)

# Commands that are not run here: pattern, and why. Their subcommands, options and targets are checked all the same.
NOT_RUN = (
    (r"make .*|cd \$HOME/LIGGGHTS-PUBLIC/src.*", "builds or runs everything; `make -n` must know the target and the variables"),
    (r"dembark submit .*--executor.*|dembark (status|resume) /scratch/.*",
     "needs a cluster; validation/campaigns/tests/test_slurm.py runs it on a Slurm of its own"),
    (r"module load .*|sinfo .*|sacctmgr .*|srun .*", "programs of a cluster"),
    (r"export (?!DEMBARK_DECKS).*", "one's own engines and modules; test_names.py looks the variables up in the code"),
    (r"dembark validate .*|python docs/impact_table\.py .*", "a case in both engines takes minutes; input_decks/tests run it"),
    (r"dembark calibrate cellulose.*|cd results/campaigns/cellulose/.*|dembark run rotating_drum .*--parameters .*",
     "takes half an hour; validation/tests/test_fitted.py and validation/campaigns/tests/test_targets.py do it with a stand-in"),
    (r"apt-get install .*", "changes the system"),
    (r"(ch-run|apptainer) .*|mkdir image && .*|bash /scratch/.*",
     "needs the image of `make container`; validation/campaigns/tests/test_user_without_root.py enters it"),
    (r"pip install .*", "changes the environment; packaging/tests/test_package.py installs the package"),
    (r"build/lammps-kokkos/.*", "needs a LAMMPS with KOKKOS; plugins/lammps/tests/test_kokkos.py runs such decks"),
    (r"cmake .*", "compiles LAMMPS or the plugin; plugins/lammps/tests/test_own_build.py configures it"),
    (r".*python -m benchmarks\..*", "takes minutes to hours; benchmarks/tests run and parse it"),
    (r".*pytest .*--(?:slow|full).*", "starts a Slurm as root and takes minutes; the folder exists"),
)


def replaced(command: str) -> tuple[str, str]:
    """The command that is run in place of `command`, and why; the command itself and nothing when it is run as it stands."""
    for pattern, replacement, why in SUBSTITUTES:
        if re.search(pattern, command):
            return re.sub(pattern, replacement, command), why
    return command, ""


def not_run(command: str) -> str:
    """Why a command is not run here; empty for those that are."""
    return next((why for pattern, why in NOT_RUN if re.fullmatch(pattern, command)), "")


def built(engine: str) -> engines.Engine:
    """The engine; the test is skipped where it was not built."""
    try:
        return engines.find(engine)
    except DembarkError as error:
        pytest.skip(str(error))
