"""Our pair loop against the engine's, which the same laws run in when a rolling model (here one without resistance) stands beside them,
and with vectors of every width."""

import numpy as np
import pytest
from rig.cloud import DECK, cloud, deviation
from rig.liggghts_driver import read_dump, run_deck


def frames(folder, ranks=1, **words) -> np.ndarray:
    folder.mkdir()
    (folder / "cloud.data").write_text(cloud())
    done = run_deck(folder, DECK.format(**words), ranks=ranks)
    assert done.code == 0, done.error
    steps, tables = read_dump(folder / "grains.dump")
    assert steps[-1] == 1000
    return np.stack(tables)


@pytest.mark.parametrize("settings", ["", "limitForce on", "tangential_damping off", "presliding exponential", "presliding partial_slip"])
@pytest.mark.parametrize("cohesion", ["", "cohesion capillary"])
def test_same_motion_as_in_the_engines_loop(tmp_path, cohesion, settings):
    ours = frames(tmp_path / "ours", cohesion=cohesion, rolling="", settings=settings)
    engine = frames(tmp_path / "engine", cohesion=cohesion, rolling="rolling_friction cdt", settings=settings)
    moved = np.linalg.norm(ours[-1, :, 7:10], axis=1)
    assert (moved > 1.0).sum() > 100  # contacts have made many grains spin
    # Round-off grows in a cloud of collisions.
    assert deviation(ours[:2], engine[:2]) < 1e-13
    assert deviation(ours, engine) < 1e-10


def test_same_motion_on_two_ranks(tmp_path):
    words = {"cohesion": "cohesion capillary", "rolling": "", "settings": ""}
    assert deviation(frames(tmp_path / "two", ranks=2, **words), frames(tmp_path / "one", **words)) < 1e-10


@pytest.mark.parametrize(("cohesion", "settings"), [("", ""), ("cohesion capillary", ""), ("", "presliding partial_slip")])
def test_same_bits_with_narrower_vectors(tmp_path, monkeypatch, cohesion, settings):
    # A processor without the wider ones repeats the narrower ones.
    runs = []
    for lanes in (2, 4, 8):
        monkeypatch.setenv("DEMBARK_LANES", str(lanes))
        runs.append(frames(tmp_path / str(lanes), cohesion=cohesion, rolling="", settings=settings))
    assert np.array_equal(runs[0], runs[1]) and np.array_equal(runs[1], runs[2])


VIRIAL = """
compute virial all pressure NULL virial
thermo_style custom step c_virial c_virial[1] c_virial[4]
thermo_modify format float %.17g
"""


def virial(folder, every=100, **words) -> np.ndarray:
    """Rows of step, pressure and two components of the virial (Pa), every so many steps."""
    folder.mkdir()
    (folder / "cloud.data").write_text(cloud())
    done = run_deck(folder, DECK.format(**words).replace("thermo 100\n", f"{VIRIAL}thermo {every}\n"))
    assert done.code == 0, done.error
    rows = [line.split() for line in done.output.splitlines()]
    return np.array([row for row in rows if len(row) == 4 and row[0].isdigit() and row[0] != "0"], dtype=float)


@pytest.mark.parametrize(("cohesion", "settings"), [("cohesion capillary", ""), ("", "presliding partial_slip")])
def test_the_virial_is_that_of_the_engines_loop_and_does_not_change_the_run(tmp_path, cohesion, settings):
    ours = virial(tmp_path / "ours", cohesion=cohesion, rolling="", settings=settings)
    engine = virial(tmp_path / "engine", cohesion=cohesion, rolling="rolling_friction cdt", settings=settings)
    assert len(ours) >= 10 and np.ptp(ours[:, 1]) > 1.0
    np.testing.assert_allclose(ours, engine, rtol=1e-7, atol=1e-7 * np.abs(ours[:, 1]).max())
    often = virial(tmp_path / "often", every=7, cohesion=cohesion, rolling="", settings=settings)
    assert len(often) > 100
    never = frames(tmp_path / "never", cohesion=cohesion, rolling="", settings=settings)
    for folder in ("ours", "often"):
        assert np.array_equal(np.stack(read_dump(tmp_path / folder / "grains.dump")[1]), never)
