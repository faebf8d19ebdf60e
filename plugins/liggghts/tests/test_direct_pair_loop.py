"""Our pair loop against the engine's, which the same laws run in when a rolling model (here one without resistance) stands beside them,
and with vectors of every width."""

import numpy as np
import pytest
from rig.cloud import DECK, cloud, deviation
from rig.energy_account import FIX
from rig.liggghts_driver import read_dump, run_deck


def frames(folder, ranks=1, deck=DECK, **words) -> np.ndarray:
    folder.mkdir()
    (folder / "cloud.data").write_text(cloud())
    done = run_deck(folder, deck.format(**words), ranks=ranks)
    assert done.code == 0, done.error
    steps, tables = read_dump(folder / "grains.dump")
    assert steps[-1] == 1000
    return np.stack(tables)


SETTINGS = ("", "limitForce on", "tangential_damping off", "presliding exponential", "presliding partial_slip", "friction_limit elastic",
            "friction_limit elastic presliding partial_slip")


# Bridges do not touch friction: with them one setting stands for all.
@pytest.mark.parametrize(("cohesion", "settings"), [
    pytest.param(cohesion, settings, marks=pytest.mark.full if cohesion and settings else ())
    for cohesion in ("", "cohesion capillary") for settings in SETTINGS])
def test_same_motion_as_in_the_engines_loop(tmp_path, cohesion, settings):
    ours = frames(tmp_path / "ours", cohesion=cohesion, rolling="", settings=settings)
    engine = frames(tmp_path / "engine", cohesion=cohesion, rolling="rolling_friction cdt", settings=settings)
    moved = np.linalg.norm(ours[-1, :, 7:10], axis=1)
    assert (moved > 1.0).sum() > 100  # contacts have made many grains spin
    # Round-off grows in a cloud of collisions.
    assert deviation(ours[:2], engine[:2]) < 1e-13
    assert deviation(ours, engine) < 1e-10


BRIDGES = "fix m11 all property/global bridgeVolume peratomtypepair 2 1e-12 5e-12 5e-12 0\n"
LIQUID = DECK.replace(BRIDGES, "fix liquid all capillary/liquid content 0.01\n") + (
    'variable held equal f_liquid[2]\nprint "bridges hold ${{held}}" append liquid.txt\n')


def test_same_liquid_and_motion_as_in_the_engines_loop(tmp_path):
    """Liquid that the grains carry, which bridges take and give back."""
    words = {"deck": LIQUID, "cohesion": "cohesion capillary", "settings": "carried_liquid on"}
    ours = frames(tmp_path / "ours", rolling="", **words)
    engine = frames(tmp_path / "engine", rolling="rolling_friction cdt", **words)
    assert deviation(ours[:2], engine[:2]) < 1e-13
    assert deviation(ours, engine) < 1e-10
    held, other = (float((tmp_path / loop / "liquid.txt").read_text().split()[-1]) for loop in ("ours", "engine"))
    assert held > 1e-10
    assert held == pytest.approx(other, rel=1e-10)


PULLED = LIQUID.replace("run 1000\n", "run 998\ngroup two type 2\ndisplace_atoms two move 1e-4 0 1e-4\nrun 2\n")


@pytest.mark.parametrize(("ranks", "lanes", "account"), [
    *(pytest.param(*each, "", marks=pytest.mark.full) for each in ((1, 2), (2, 4), (2, 8))), (1, 8, f"{FIX}\n")])
def test_liquid_of_bridges_that_a_displacement_breaks_is_given_back(tmp_path, monkeypatch, ranks, lanes, account):
    """They are longer than they may be in a set-up, which changes nothing, and break in the step after it."""
    words = {"deck": PULLED.replace("run 998", f"{account}run 998"), "cohesion": "cohesion capillary", "settings": "carried_liquid on"}
    monkeypatch.setenv("DEMBARK_LANES", str(lanes))
    ours = frames(tmp_path / "ours", rolling="", ranks=ranks, **words)
    engine = frames(tmp_path / "engine", rolling="rolling_friction cdt", **words)
    assert deviation(ours, engine) < 1e-9
    held, other = (float((tmp_path / loop / "liquid.txt").read_text().split()[-1]) for loop in ("ours", "engine"))
    assert held == pytest.approx(other, rel=1e-9)


@pytest.mark.full
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
compute virial all pressure thermo_temp virial
thermo_style custom step c_virial c_virial[1] c_virial[4]
thermo_modify format float %.17g
thermo """


def asked(folder, every, **words) -> tuple[np.ndarray, np.ndarray]:
    """Step, pressure and two components of the virial (Pa), told every so many steps (0: never), and the frames. Held grains touch."""
    folder.mkdir()
    (folder / "cloud.data").write_text(cloud())
    text = DECK.format(**words).replace("stuck id 1:64", "stuck id 1:128")
    done = run_deck(folder, text.replace("thermo 100\n", f"{VIRIAL}{every}\n") if every else text)
    assert done.code == 0, done.error
    rows = [line.split() for line in done.output.splitlines()]
    told = [row for row in rows if len(row) == 4 and row[0].isdigit() and row[0] != "0"]
    return np.array(told, dtype=float), np.stack(read_dump(folder / "grains.dump")[1])


@pytest.mark.parametrize(("cohesion", "settings"), [
    pytest.param("cohesion capillary", "", marks=pytest.mark.full), ("", ""), ("", "presliding partial_slip")])
def test_the_virial_is_that_of_the_engines_loop_and_does_not_change_the_run(tmp_path, cohesion, settings):
    words = {"cohesion": cohesion, "settings": settings}
    ours, frames = asked(tmp_path / "ours", 100, rolling="", **words)
    engine, _ = asked(tmp_path / "engine", 100, rolling="rolling_friction cdt", **words)
    assert len(ours) >= 10 and np.ptp(ours[:, 1]) > 1.0
    np.testing.assert_allclose(ours, engine, rtol=1e-7, atol=1e-7 * np.abs(ours[:, 1]).max())
    often, others = asked(tmp_path / "often", 7, rolling="", **words)
    assert len(often) > 100
    for found in (others, asked(tmp_path / "never", 0, rolling="", **words)[1]):
        assert np.array_equal(found, frames)
