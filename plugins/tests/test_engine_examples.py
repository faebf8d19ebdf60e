"""Scripts that come with the engines: unchanged they give the same files in ours, bit for bit; with our styles, the same bulk of grains."""

from pathlib import Path

import pytest
from rig.engine_examples import PACKAGES, ROOT, Example, bulk, outputs, programs, table, thermo

EXAMPLES = table()
PAGE = (ROOT / "docs/how-to/engine_examples.md").read_text(encoding="utf-8")
# Beyond what contacts that turn, or end, change in a run of some hundred grains; rows of the table with another number say why.
WITHIN = {"centre": 0.03, "height": 0.03, "kinetic": 0.1, "walls": 0.15, "grains": 0.0}


def test_table_has_scripts_of_both_engines():
    decks = {engine: {example.deck for example in EXAMPLES if example.engine == engine} for engine in PACKAGES}
    assert len(decks["liggghts"]) >= 12 and len(decks["lammps"]) >= 10


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: e.name)
def test_page_has_each_of_them(example: Example):
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| `{example.deck}`{' ' * bool(example.variant)}{example.variant} |")]
    assert example.refused in row and example.fails in row


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: e.name)
def test_example(example: Example, tmp_path: Path, request: pytest.FixtureRequest):
    request.getfixturevalue(f"{example.engine}_is_there")
    package, _ = PACKAGES[example.engine]
    if not example.source.exists():
        pytest.skip(f"its examples are not there; install the package {package}")
    stock, ours = programs(example.engine)
    first = example.run(tmp_path / "stock", *stock)
    second = example.run(tmp_path / "same", *ours)
    if example.fails:
        for done in (first, second):
            assert done.returncode != 0 and example.fails in done.stdout + done.stderr
        return
    assert first.returncode == second.returncode == 0, (first.stdout + first.stderr + second.stdout + second.stderr)[-2000:]
    assert outputs(tmp_path / "stock") == outputs(tmp_path / "same")
    assert thermo(tmp_path / "stock") == thermo(tmp_path / "same")

    if not example.ours:
        return
    third = example.run(tmp_path / "ours", *ours, ours=True)
    if example.refused:
        errors = [line for line in (third.stdout + third.stderr).splitlines() if line.startswith("ERROR")]
        assert third.returncode != 0 and len(errors) == 1 and example.refused in errors[0], errors
        return
    assert third.returncode == 0, (third.stdout + third.stderr)[-2000:]
    expected, found = bulk(example, tmp_path / "stock"), bulk(example, tmp_path / "ours")
    for quantity, within in (WITHIN | example.within).items():
        # Without walls their force is round-off.
        close = pytest.approx(expected[quantity], rel=within, abs=1e-9)
        assert found[quantity] == close, f"{quantity}: {expected} in stock, {found} in ours"
    assert found["mass"] == pytest.approx(expected["mass"], rel=1e-12 + example.within.get("grains", 0.0))
