"""What reads and measures knows nothing of the harness above it."""

import ast
import re
import tomllib
from pathlib import Path

from dembark.postproc.convergence import REFINEMENT

POSTPROC = Path(__file__).resolve().parents[1]


def test_postproc_does_not_import_the_harness():
    known = re.compile(r"^\s*(from|import) dembark\.(validation|input_decks)\b", re.MULTILINE)
    assert [str(path) for path in POSTPROC.rglob("*.py")
            if "tests" not in path.parts and known.search(path.read_text(encoding="utf-8"))] == []


def own_parameters():
    """Names of the parameters that cases declare themselves, or get by a group of parameters."""
    files = [*(POSTPROC.parent / "input_decks").glob("*/case.toml"), POSTPROC.parent / "input_decks" / "common" / "groups.toml"]
    tables = [tomllib.loads(path.read_text(encoding="utf-8")) for path in files]
    groups = [one.get("parameters", {}) for one in tables[-1].values()]
    return {name for table in [*(one.get("parameters", {}) for one in tables[:-1]), *groups] for name in table}


# Names that a case shares with a field, a column of time.csv, a function, or a key of every run.json.
SHARED = {"bark_force", "solid_fraction", "grain_count", "liquid_content", "motion_angle", "time_step"}


def test_postproc_knows_no_case():
    """It reads no parameter of a run: `parameters` are passed on by Replica alone, and no compound name of one stands in a string. What
    refines a method, whichever case has it, is in REFINEMENT."""
    named = {name for name in own_parameters() if "_" in name} - {*REFINEMENT, *SHARED}
    assert {"cylinder_radius", "silo_width", "base_speed"} <= named
    nodes = [(path.name, node) for path in POSTPROC.rglob("*.py") if "tests" not in path.parts
             for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]
    assert [(file, node.value) for file, node in nodes if isinstance(node, ast.Constant) and node.value in named] == []
    words = [(file, {getattr(node, key, None) for key in ("id", "attr", "value", "arg")}) for file, node in nodes
             if isinstance(node, ast.Name | ast.Attribute | ast.Constant | ast.arg)]
    assert {file for file, found in words if "parameters" in found} == {"replica.py"}
