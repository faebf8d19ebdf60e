"""The examples in the docstrings of dembark.physics give what they say."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

import dembark.physics

MODULES = ["dembark.physics", *(module.name for module in pkgutil.walk_packages(dembark.physics.__path__, "dembark.physics.")
                                if ".tests" not in module.name)]


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_say(name: str) -> None:
    told: list[str] = []
    runner = doctest.DocTestRunner(verbose=False)
    for example in doctest.DocTestFinder().find(importlib.import_module(name)):
        runner.run(example, out=told.append)
    assert not told, "".join(told)


def test_there_are_examples() -> None:
    """Of a bare solver, a law and the fluid: an empty search would pass all others."""
    finder = doctest.DocTestFinder()
    count = {name: sum(len(test.examples) for test in finder.find(importlib.import_module(f"dembark.physics.{name}")))
             for name in ("lcp", "capillary", "sph")}
    assert min(count.values()) > 0, count
