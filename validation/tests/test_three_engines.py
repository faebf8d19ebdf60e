"""Any number of engines: pairs of them are compared, and one that lacks something or is not installed is left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from third_engine import Third

from dembark.common.errors import DembarkError, RunError
from dembark.common.files import read_json
from dembark.validation import doctor, engines
from dembark.validation.campaigns import expand
from dembark.validation.campaigns.plan import of_profile, series
from dembark.validation.campaigns.spec import read
from dembark.validation.case import deck, folders
from dembark.validation.cli import main
from dembark.validation.judge import result
from dembark.validation.judge.comparison import compare
from dembark.validation.judge.result import QuantityRecord, Result
from dembark.validation.runs.steps import compare_engines

NEEDS = '[needs]\ncarried_liquid = "contact_angle < 0.2"\n[runs]\n'


@pytest.fixture
def third(decks: Path, stand_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bool], Path]]:
    """`third(installed)`: the third engine, registered, with a deck in the case `box`, whose variant `wet` needs what it lacks."""
    monkeypatch.setattr(engines, "ENGINES", (*engines.ENGINES, Third))
    case = decks / "box/case.toml"
    case.write_text(case.read_text().replace('engines = ["liggghts", "yade"]\n', "").replace("[runs]\n", NEEDS).replace(
        '{variant = "wet", engines = ["liggghts"]}', '{variant = "wet"}'))
    (decks / "box/third.txt").write_text("deck\n")

    def make(installed: bool) -> Path:
        program = tmp_path / "third"
        if installed:
            program.write_text("#!/bin/sh\necho third 3.3\n")
            program.chmod(0o755)
            monkeypatch.setenv("THIRD", str(program))
        else:
            monkeypatch.delenv("THIRD", raising=False)
        engines.find.cache_clear()
        folders.load.cache_clear()
        return case

    yield make
    engines.find.cache_clear()


def test_a_variant_runs_in_the_engines_that_can_do_it(third: Callable[[bool], Path]) -> None:
    third(True)
    assert {str(one.place) for one in of_profile("quick")} == {
        "box/dry/liggghts", "box/dry/yade", "box/dry/third", "box/wet/liggghts", "box/wet/yade"}
    plan = expand.profile("quick")
    assert "left_out" not in plan.facts


def test_an_engine_is_not_asked_for_what_it_cannot_do(third: Callable[[bool], Path], tmp_path: Path,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    case = third(True)
    told = "The Third has no liquid carried by grains, which these parameters of case box need, take liggghts or yade"
    for action in (lambda: series(folders.find("box"), "wet", None, engines.find("third")),
                   lambda: deck.write(folders.find("box"), "third", {"contact_angle": 0.1}, tmp_path)):
        with pytest.raises(DembarkError) as caught:
            action()
        assert str(caught.value) == told
    assert main(["deck", "box", "--engine", "third", "--set", "contact_angle=0.1", "--out", str(tmp_path / "deck")]) == 2
    assert told in capsys.readouterr().err
    # A case that runs in it is wrong, and so is one with an unknown need.
    text = case.read_text()
    for old, new, line in (('{variant = "wet"}', '{variant = "wet", engines = ["third"]}', "wet in third, which has no liquid carried"),
                           ("carried_liquid =", "caried_liquid =", "did you mean carried_liquid")):
        case.write_text(text.replace(old, new))
        folders.load.cache_clear()
        with pytest.raises(DembarkError, match=line):
            folders.find("box")


def test_an_optional_engine_that_is_not_there_is_left_out_and_named(third: Callable[[bool], Path], tmp_path: Path) -> None:
    third(False)
    assert {one.place.name for one in of_profile("quick")} == {"liggghts", "yade"}
    plan = expand.profile("quick")
    assert "make third" in plan.facts["left_out"]["third"]
    with pytest.raises(DembarkError, match="the third engine not found"):
        of_profile("quick", only_engines=["third"])
    (finding,) = [one for one in doctor.examine() if one.what == "the third engine"]
    assert finding.found is None and not finding.required and "make third" in finding.advice
    campaign = tmp_path / "sizes.toml"
    campaign.write_text('[campaign]\nname = "sizes"\n[[sweeps]]\ncase = "box"\nprofile = "quick"\ngrid = { grain_count = [10, 20] }\n')
    # A campaign is the same on every machine: it has the engine only if it names it.
    found = expand.campaign(read(campaign))
    assert {one.place.name for one in found.series} == {"liggghts", "yade"}
    campaign.write_text(campaign.read_text().replace('name = "sizes"', 'name = "sizes"\nengines = ["yade", "third"]'))
    with pytest.raises(DembarkError, match="the third engine not found"):
        expand.campaign(read(campaign))


def test_a_sweep_that_names_no_engines_has_those_that_can_do_all_of_it(third: Callable[[bool], Path], tmp_path: Path,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    third(True)
    monkeypatch.setattr(Third, "facts", replace(Third.facts, optional=False))
    campaign = tmp_path / "angles.toml"
    for angles, expected in (("0.3, 0.4", {"liggghts", "yade", "third"}), ("0.1, 0.4", {"liggghts", "yade"})):
        campaign.write_text('[campaign]\nname = "angles"\n[[sweeps]]\ncase = "box"\nprofile = "quick"\n'
                            f"grid = {{ contact_angle = [{angles}] }}\n")
        assert {one.place.name for one in expand.campaign(read(campaign)).series} == expected


def written(folder: Path, engine: str, value: float, half: float = 0.02) -> None:
    (folder / engine).mkdir(parents=True)
    quantities = tuple(QuantityRecord(f"q{number}", value, "info", interval=(value - half, value + half), basis="5 replicas")
                       for number in range(4))
    result.write(folder / engine / result.METRICS, Result("box", "dry", engine, quantities, "quick"))


def test_every_pair_is_compared_and_all_of_them_share_what_chance_may_do(tmp_path: Path) -> None:
    for engine, value in (("yade", 1.0), ("liggghts", 1.01), ("third", 1.3)):
        written(tmp_path, engine, value)
    found = compare(tmp_path)
    assert found.engines == ("liggghts", "third", "yade")
    pairs = {(one.reference_engine, one.engine): one.verdict for one in found.quantities}
    assert pairs == {pair: "fail" if "third" in pair else "pass" for pair in combinations(found.engines, 2)}
    # Four quantities of three pairs: the page fails by chance once in a hundred times.
    assert sum(one.chance or 0.0 for one in found.quantities) == pytest.approx(0.01)


def test_two_engines_are_compared_although_a_third_one_failed(tmp_path: Path) -> None:
    wanted = [tmp_path / engine / result.METRICS for engine in ("liggghts", "yade", "third")]
    written(tmp_path, "liggghts", 1.0)
    compare_engines(tmp_path, wanted)
    assert not (tmp_path / result.COMPARISON).exists()
    with pytest.raises(RunError, match="a measurement of liggghts only"):
        compare(tmp_path)
    written(tmp_path, "yade", 1.0)
    compare_engines(tmp_path, wanted)
    assert read_json(tmp_path / result.COMPARISON)["engines"] == ["liggghts", "yade"]
