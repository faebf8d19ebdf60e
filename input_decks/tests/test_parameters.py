"""Every parameter of every case changes what the engines read."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Any

import pytest

from dembark.common.choices import Value
from dembark.validation import engines
from dembark.validation.case import deck
from dembark.validation.case.folders import discover, find, package_root
from dembark.validation.case.model import Case, Parameter
from dembark.validation.case.resolve import merged, portable
from dembark.validation.cli import main
from dembark.validation.engines.input_script import UNREAD_NOTE

SCENE = Path(__file__).resolve().parents[2] / "plugins/yade/python/dembark/scene.py"
# What parameters need to do anything.
LIQUID = {"bridge_volume": 8e-11, "liquid_viscosity": 0.01}
BASES: dict[str, dict[str, Any]] = {
    "silo": {"grain_count": 40, "bridge_volume": 8e-11, "rolling_resistance": "elastic_plastic"},
    "plane_silo": {"grain_count": 40, "bridge_volume": 8e-11},
    "plug_flow": {"grain_count": 40, "bridge_volume": 8e-11},
    "gravity_channel": {"channel_width": 0.04, "channel_depth": 0.021, "channel_length": 0.02, "bridge_volume": 8e-11},
    "column_collapse": {"grain_count": 60, **LIQUID},
    "log_pair": {"offset": 0.05},
    "log_cradle": {},
    "log_pile": {},
    "debarking_drum": {},
    "single_contact": {"partner": "rest", "sweep": "spin", "points": 3, "duration": 0.01},
    "liquid_exchange": {},
    "oblique_impact": {},
    "penetration": {"grain_count": 100, "box_length": 0.02, "box_width": 0.02, "ball_diameter": 0.008},
}
# How many packings there are is the harness's, for a deck makes one; what counts as an impact, and what it does to bark and wood, is the
# measurement's.
NOT_READ = {"replicas", "impact_speed", "bark_force", "wood_force", "cleared_width"}
# Where a deck uses a number, and where the numbers at its top end.
USE = {"liggghts": (r"\$\{NAME\}", "\n\n"), "lammps": (r"\$\{NAME\}", "\n\n"), "yade": (r'\bp\.NAME\b|"NAME"', "\n)\n")}


def other(parameter: Parameter, value: Value) -> Value:
    """Another value that the parameter may have."""
    if parameter.values:
        return next(word for word in parameter.values if word != value)
    if parameter.name == "liquid_content":
        return 0.004
    if value is None:
        return 0.9
    return value + 1 if isinstance(value, int) else 0.9 * value or 0.5  # type: ignore[operator]


def inputs(case: Case, engine: str, values: dict[str, Value], folder: Path) -> dict[str, str]:
    """What the engine reads: all files of a run's folder, but of the numbers at the top of the deck only those that are used."""
    deck.write(case, engine, values, folder)
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir()}
    name, (use, end) = engines.facts(engine).deck, USE[engine]
    head, body = texts[name].split(end, 1)
    body += SCENE.read_text(encoding="utf-8") if engine == "yade" else ""
    numbers = {match.group(1): match.group() for match in re.finditer(r"^(?:variable| {3}) +(\w+).*", head, re.MULTILINE)}
    return texts | {name: body} | {key: line for key, line in numbers.items() if re.search(use.replace("NAME", key), body)}


@pytest.mark.parametrize(("case", "engine"), [pytest.param(case, engine, marks=pytest.mark.full if case == "penetration" else ())
                                              for case in BASES for engine in find(case).engines])
def test_every_parameter_changes_the_input(case: str, engine: str, tmp_path: Path) -> None:
    found = find(case)
    values = portable(merged(found, None, None, BASES[case]))
    before = inputs(found, engine, values, tmp_path)
    for name in found.parameters.keys() - NOT_READ:
        changed = values | {name: other(found.parameters[name], values[name])}
        if found.missing_capabilities(engine, changed):
            continue  # refused, see the tests of engines
        assert inputs(found, engine, changed, tmp_path) != before, name


@pytest.mark.parametrize(("case", "engine"), [(case, engine) for case in ("silo", "vibro_sieve", "single_contact")
                                              for engine in ("liggghts", "lammps")])
def test_numbers_that_no_command_reads_stand_below_a_line_that_says_so(case: str, engine: str, tmp_path: Path) -> None:
    """All stay variables, so that -var of them is refused."""
    found = find(case)
    values = portable(merged(found, "quick" if "quick" in found.profiles else None, None, {}))
    deck.write(found, engine, values, tmp_path)
    head, body = (tmp_path / engines.facts(engine).deck).read_text(encoding="utf-8").split("\n\n", 1)
    read, unread = (re.findall(r"^variable +(\w+)", part, re.MULTILINE) for part in head.split(UNREAD_NOTE))
    code = re.sub("#.*", "", body)
    assert read and unread
    assert all(re.search(rf"\${{{name}}}|\bv_{name}\b", code) for name in read)
    assert not re.search(rf"\${{({'|'.join(unread)})}}|\bv_({'|'.join(unread)})\b", code)
    assert {name for name, value in values.items() if value is not None} - {"replicas"} <= {*read, *unread}


@pytest.mark.parametrize(("source", "marked"), [
    ("print ${size}\n# ${count}\n", ["count"]), ("variable n equal 2*v_count\njump SELF end\n", ["size"]), ("print ${size}${count}\n", []),
    ("print ${size}\ninclude more.in\n", []), ("jump more.in\n", [])])
def test_what_another_file_may_read_is_not_marked(source: str, marked: list[str]) -> None:
    numbers = {name: engines.DeckNumber(2.0, "m") for name in ("size", "count")}
    _, _, below = engines.engine_class("lammps").deck_text(source, numbers, []).partition(UNREAD_NOTE)
    assert re.findall(r"^variable +(\w+) +string", below, re.MULTILINE) == marked


@pytest.mark.parametrize("name", [one.name for one in discover().values() if {"liggghts", "lammps"} & set(one.engines)])
def test_every_text_that_a_deck_includes_is_an_input(name):
    """Otherwise runs made with an older text would be kept."""
    case, common = find(name), package_root() / "common"
    for engine in {"liggghts", "lammps"} & set(case.engines):
        folders, known = [case.folder, common / engine, common], deck.sources(case, engine).values()
        waiting, read = [case.deck(engine)], set()
        while waiting:
            path = waiting.pop()
            assert hashlib.sha256(path.read_bytes()).hexdigest() in known, f"{engine}: {path.relative_to(package_root())}"
            read.add(path)
            for included in re.findall(r'{%\s*include\s+"([^"]+)"', path.read_text(encoding="utf-8")):
                waiting += {next(one / included for one in folders if (one / included).is_file())} - read
        assert len(read) > 1


@pytest.mark.parametrize(("name", "module"), [("vibrated_layer", "input_decks/common/drive_levels.py"),
                                              ("vibro_finishing", "postproc/walls/mesh.py")])
def test_what_a_setup_shares_with_the_measurement_is_an_input(name, module):
    content = (package_root().parent / module).read_bytes()
    assert hashlib.sha256(content).hexdigest() in deck.sources(find(name), "liggghts").values()


def test_a_deck_of_several_packings_says_that_it_has_one(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["deck", "bulk_density", "--engine", "lammps", "--set", "grain_count=100", "--set", "seed=7"]
    assert main([*words, "--out", str(tmp_path / "one")]) == 0 and "note" not in capsys.readouterr().out
    assert main([*words, "--set", "replicas=3", "--out", str(tmp_path / "other")]) == 0
    assert "note: a deck has one packing, here that of seed 7" in capsys.readouterr().out
