"""Verdicts that depend on a packing rest on five packings or more in the profile `standard`, in each engine that runs them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dembark.input_decks.common.packing import rank
from dembark.validation.case.deck import prepare
from dembark.validation.case.folders import discover, load
from dembark.validation.case.model import Case
from dembark.validation.case.resolve import for_replica, resolve

LEAST = 5
# Cases whose bodies begin at random places, or with random sizes, so that their numbers are those of one packing.
RANDOM = ("column_collapse", "debarking_drum", "gravity_channel", "log_pile", "plane_silo", "plug_flow", "silo")
# Cases, or variants of one, that may have fewer, with the reason.
FEWER = {
    "triaxial": "a lattice has no packing; the disordered grains have five",
    "rotating_drum": "a drum that turns steadily forgets its packing: intervals come from blocks of its time; `full` has three packings",
    "hopper_discharge": "the rate is a mean over thousands of grains of one long run; `full` has three packings",
    "conical_silo": "the rate is a mean over tens of thousands of grains of one long run; the narrow silo has three packings",
    "mixing_drum": "the drum drives 38 000 grains, and the tolerances are for a packing other than the published one",
    "penetration": "a bed costs minutes to settle, and the published packings scatter by less than half of the tolerances",
    "avalanche": "single grains have no packing, and chutes flow steadily; the avalanches themselves have five",
    "dam_break_cubes": "its single runs have nothing random; those that have, stacks in both engines, are five",
    "plug_flow/glass_slippery": "one input of `glass` is changed, for U_input; intervals come from blocks of time",
    "plug_flow/glass_gripping": "the same",
    "plug_flow/glass_thin": "the same",
    "vibrated_layer": "waves forget the packing within tens of periods: intervals come from windows of time",
}


@given(count=st.integers(1, 3000), seed=st.integers(1, 10000))
@example(count=328, seed=1)
@example(count=1271, seed=7)
def test_an_order_by_the_seed_has_no_trend(count: int, seed: int) -> None:
    order = rank(count, seed)
    assert sorted(order) == list(range(count))
    if count > 40:
        assert abs(np.corrcoef(np.arange(count), order)[0, 1]) < 0.3


def too_few(case: Case, least: int = LEAST) -> list[tuple[str, str, str]]:
    """Runs of `standard` (case, variant, engine) with fewer packings than `least`."""
    return [(case.name, run.variant, engine) for run in case.runs.get("standard", ()) for engine in run.engines
            if resolve(case, "standard", run.variant, run.changes(engine))["replicas"] < least]


def test_cases_with_a_seed_are_the_random_ones_and_have_replicas() -> None:
    cases = discover()
    seeded = {name for name, case in cases.items() if "seed" in case.parameters}
    assert seeded >= set(RANDOM)
    assert seeded == {name for name, case in cases.items() if "replicas" in case.parameters}


@pytest.mark.parametrize("name", sorted(name for name, case in discover().items() if "replicas" in case.parameters))
def test_standard_has_five_packings_in_each_engine(name: str) -> None:
    assert [run for run in too_few(discover()[name]) if not {name, f"{name}/{run[1]}"} & FEWER.keys()] == []


def test_fewer_are_found(tmp_path) -> None:
    """The negative control."""
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "liggghts.in").write_text("# A deck.\n")
    (folder / "yade.py").write_text("p = dembark.parameters()\n")
    (folder / "case.toml").write_text("""
[case]
title = "Mine"
groups = ["packings"]
[variants]
many = {}
few = { replicas = 4 }
[profiles]
standard = { replicas = 5 }
[runs]
standard = [{variant = "many", replicas = {yade = 1}}, "few"]
""")
    assert too_few(load(folder / "case.toml")) == [("mine", "many", "yade"), ("mine", "few", "liggghts"), ("mine", "few", "yade")]


@pytest.mark.parametrize("name", sorted(name for name, case in discover().items() if "motion" in case.parameters))
def test_runs_of_every_profile_have_grains_and_steps(name: str) -> None:
    """Grains that are too soft for the fastest level of a drive are refused when the run begins, which may be hours from now."""
    case = discover()[name]
    for profile, runs in case.runs.items():
        for run in runs:
            for engine in run.engines:
                made = prepare(case, for_replica(resolve(case, profile, run.variant, run.changes(engine)), 0))
                assert made.steps > 0, (profile, run.variant)
