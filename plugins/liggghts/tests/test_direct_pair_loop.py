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
