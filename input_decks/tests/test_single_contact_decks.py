"""The decks of single_contact agree with the case file and do the same, which is what the contact law demands."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dembark.common.errors import DembarkError
from dembark.common.files import check_times, count_frames
from dembark.postproc import GrainsDump
from dembark.validation import engines
from dembark.validation.checks.impact_exact import impacts, stepped
from dembark.validation.checks.run import Replica
from dembark.validation.checks.single_contact import Flight, read

ROOT = Path(__file__).resolve().parents[1] / "single_contact"
CASE = tomllib.loads((ROOT / "case.toml").read_text(encoding="utf-8"))
ENGINES = ("liggghts", "yade")
SCENES: dict[str, dict[str, Any]] = {
    "test_3": {"time_step": 1e-7, "duration": 4e-5},
    "test_4": {"points": 2, "sweep_from": 20.0, "sweep_to": 60.0, "time_step": 1e-7},
    "test_7": {"points": 2, "time_step": 1e-5},
    "test_8_b": {"points": 3, "time_step": 1e-5},
}


def values(scene: str) -> dict[str, Any]:
    return {key: table.get("value") for key, table in CASE["parameters"].items()} | CASE["variants"][scene] | SCENES[scene]


def test_liggghts_defaults_are_those_of_the_case_file() -> None:
    text = (ROOT / "liggghts.in").read_text(encoding="utf-8")
    defaults = dict(re.findall(r"^variable\s+(\w+)\s+index\s+(\S+)\s*$", text, re.MULTILINE))
    declared = CASE["parameters"]
    assert defaults.keys() == declared.keys()
    for key, word in defaults.items():
        assert (word if declared[key]["type"] == "choice" else float(word)) == declared[key]["value"], key


def test_both_decks_use_every_key() -> None:
    for deck, pattern in (("liggghts.in", r"\$\{%s\}"), ("yade.py", r"\bp\.%s\b")):
        text = (ROOT / deck).read_text(encoding="utf-8")
        assert not [key for key in CASE["parameters"] if not re.search(pattern % key, text)], deck


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Short runs by (scene, engine), each done once: (folder, what the spheres did)."""
    done: dict[tuple[str, str], tuple[Path, Flight]] = {}

    def get(scene: str, name: str) -> tuple[Path, Flight]:
        if (scene, name) not in done:
            try:
                engine = engines.find(name)
            except DembarkError as error:
                pytest.skip(str(error))
            folder, given = tmp_path_factory.mktemp(f"{scene}-{name}"), CASE["variants"][scene] | SCENES[scene]
            if name == "liggghts":
                pairs = (word for key, value in given.items() for word in ("-var", key, str(value)))
                words = [str(engine.executable), "-in", str(ROOT / "liggghts.in"), *pairs]
            else:
                words = [str(engine.executable), "-n", "-x", str(ROOT / "yade.py"), *(f"{key}={value}" for key, value in given.items())]
            ended = engines.call(words, folder, engine.environment())
            assert ended.returncode == 0, ended.stdout[-2000:] + ended.stderr[-2000:]
            assert "dembark: finished" in ended.stdout
            p = values(scene)
            done[scene, name] = folder, read(Replica(folder, {"engine": name, "parameters": p, "time_step": p["time_step"]}))
        return done[scene, name]

    return get


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scene", SCENES)
def test_every_sphere_does_what_the_law_demands_in_this_scheme(scene: str, engine: str, finished: Any) -> None:
    """Material, restitution coefficient, partner and start of each one: the scheme, written down again, says where each ends."""
    folder, flight = finished(scene, engine)
    p = values(scene)
    one = impacts(p)
    assert count_frames(folder / "grains.dump", "ATOMS") == p["frames"]
    assert check_times(folder / "time.csv") >= 200
    frame = GrainsDump(folder / "grains.dump")[0]
    np.testing.assert_allclose(frame.masses[np.argsort(frame.ids)][: len(one)], one.mass, rtol=1e-12)
    due = stepped(one, p["time_step"], p["lead_steps"] % 1.0, p["duration"])
    after = flight.after
    for value, wanted in ((after.normal, due.normal), (after.slide, due.slide), (one.radius * after.spin, one.radius * due.spin)):
        np.testing.assert_allclose(value / one.closing, wanted / one.closing, rtol=0.0, atol=1e-10)
    # The flights before and after are free of forces.
    assert flight.overlaps[-1].max() < 0.0
    assert np.abs(flight.forces[[0, -1]]).max() == 0.0


@pytest.mark.parametrize("scene", SCENES)
def test_both_engines_do_the_same(scene: str, finished: Any) -> None:
    one, other = (finished(scene, engine)[1] for engine in ENGINES)
    np.testing.assert_allclose(one.overlaps, other.overlaps, rtol=0.0, atol=1e-9 * np.abs(one.overlaps).max())
    np.testing.assert_allclose(one.forces, other.forces, rtol=0.0, atol=1e-7 * np.abs(one.forces).max())
