"""rolling_resistance in LIGGGHTS: motion on walls as theory has it, the stock models beside it, both pair loops, meshes that turn."""

from dataclasses import replace

import numpy as np
import pytest
from rig.cloud import DECK, cloud, deviation
from rig.liggghts_driver import deck, head, motion, properties, read_dump, run_deck
from rig.scenarios import DRY, SPRING, Grain, Material, Scenario
from rig.walls import FLOOR, on_mesh

G, FRICTION = 9.81, 0.05
PROPERTY = "fix p_roll{0} all property/global coefficientRolling{0} peratomtypepair 2 {1}\n"
ROUGH = replace(DRY, youngs_modulus=5e6, static_friction=0.8, kinetic_friction=0.8, restitution=0.3)


def roll(folder, model, *, stock="", slope=0.0, speed=0.1, spin=0.0, steps=60000, mesh=False):
    """A sphere on a plane that is tilted by `slope` (rad): set down slowly, rolling at `speed` (m/s), spinning about the normal."""
    material = ROUGH if stock else replace(ROUGH, rolling_resistance=model, rolling_friction=FRICTION, rolling_damping_ratio=0.3)
    radius, overlap = 2.5e-3, 3.4e-6
    grain = Grain(radius=radius, position=(-0.02, 0.0, radius - overlap), velocity=(speed, 0.0, 0.0),
                  angular_velocity=(0.0, speed / radius, spin))
    case = Scenario(name="roll", material=material, grains=(grain,), wall=True, time_step=5e-6, steps=steps, stride=steps // 100,
                    gravity=(G * float(np.sin(slope)), 0.0, -G * float(np.cos(slope))))
    text = deck(case)
    if stock:
        text = text.replace("tangential finnie_rabinowicz", f"tangential finnie_rabinowicz rolling_friction {stock}")
        text = text.replace("pair_style", f"{PROPERTY.format('Friction', f'{FRICTION} ' * 4)}pair_style")
    if mesh:
        text = on_mesh(text, folder, FLOOR)
    done = run_deck(folder, text)
    assert done.code == 0 and not done.error, done.error
    return motion(case, folder)


@pytest.mark.parametrize("mesh", [False, True], ids=["plane", "mesh"])
@pytest.mark.parametrize("model", ["constant_torque", "elastic_plastic"])
def test_rolling_sphere_stops_after_the_distance_of_theory(tmp_path, model, mesh):
    """7/5 m dv/dt = -mu_r m g, over 7 v^2 / (10 mu_r g) = 14 mm and over edges between triangles."""
    out = roll(tmp_path, model, mesh=mesh)
    x, v = out.position[:, 0, 0] + 0.02, out.velocity[:, 0, 0]
    assert x[-1] == pytest.approx(0.7 * 0.1**2 / (FRICTION * G), rel=0.01)
    assert np.interp(0.14, out.time, v) == pytest.approx(0.1 - 5.0 / 7.0 * FRICTION * G * 0.14, rel=0.01)
    assert np.abs(v[-5:]).max() < 1e-4


def test_without_resistance_it_rolls_on(tmp_path):
    assert roll(tmp_path, "off").velocity[-1, 0, 0] == pytest.approx(0.1, rel=0.01)


@pytest.mark.parametrize(("over_limit", "rests"), [(0.9, True), (1.1, False)])
def test_sphere_rests_on_a_slope_below_the_limit(tmp_path, over_limit, rests):
    slope = float(np.arctan(over_limit * FRICTION))
    v = roll(tmp_path, "elastic_plastic", slope=slope, speed=0.0).velocity[-1, 0, 0]
    acceleration = 5.0 / 7.0 * G * (np.sin(slope) - FRICTION * np.cos(slope))
    assert abs(v) < 1e-9 if rests else v == pytest.approx(0.3 * acceleration, rel=0.05)


@pytest.mark.parametrize(("ours", "stock"), [("constant_torque", "cdt"), ("elastic_plastic", "epsd2")])
def test_as_the_stock_model_where_that_is_right(tmp_path, ours, stock):
    """A sphere that rolls without twisting at a steady load; it stops before the end, where `cdt` trembles."""
    one, other = roll(tmp_path / "ours", ours, steps=40000), roll(tmp_path / "stock", "off", stock=stock, steps=40000)
    assert np.abs(one.velocity[:, 0, 0] - other.velocity[:, 0, 0]).max() < 2e-4
    # Twisting makes `cdt` resist less; ours does not ask.
    if stock == "cdt":
        calm = one.position[-1, 0, 0]
        for model, words, share in ((ours, "", 1.0), ("off", stock, 1.1)):
            far = roll(tmp_path / f"twisting {words}", model, stock=words, spin=100.0, steps=40000).position[-1, 0, 0]
            assert (far + 0.02) / (calm + 0.02) == pytest.approx(1.0, abs=0.01) if share == 1.0 else (far + 0.02) / (calm + 0.02) > share


@pytest.mark.parametrize("settings", ["rolling_resistance constant_torque", "rolling_resistance elastic_plastic",
                                      "rolling_resistance elastic_plastic presliding partial_slip"])
@pytest.mark.parametrize("cohesion", ["", pytest.param("cohesion capillary", marks=pytest.mark.full)])
def test_same_motion_in_both_pair_loops(tmp_path, monkeypatch, settings, cohesion):
    """Grains are stuck, collide, part and come back."""
    def frames(name, edit=lambda text: text):
        (tmp_path / name).mkdir()
        (tmp_path / name / "cloud.data").write_text(cloud())
        text = DECK.format(cohesion=cohesion, rolling="", settings=settings)
        text = text.replace("Friction peratomtypepair 2 0 0 0 0", "Friction peratomtypepair 2 0.1 0 0 0.3")
        text = text.replace("pair_style", PROPERTY.format("ViscousDamping", "0.3 0 0 0.1") + "pair_style")
        done = run_deck(tmp_path / name, edit(text))
        assert done.code == 0, done.error
        return np.stack(read_dump(tmp_path / name / "grains.dump")[1])

    ours = frames("ours")
    free = frames("free", lambda text: text.replace(f"{settings.split(' presliding')[0]}", ""))
    monkeypatch.setenv("DEMBARK_LANES", "1")
    engine = frames("engine")
    assert deviation(ours[:2], engine[:2]) < 1e-13
    # Round-off tells that these were two loops.
    assert 0.0 < deviation(ours, engine) < 1e-10
    assert deviation(ours, free) > 1e-4


@pytest.mark.parametrize(("spin", "rolls"), [((20.0, 0.0, 0.0), False), ((0.0, 0.0, 0.0), True)])
def test_grain_that_turns_with_a_mesh_does_not_roll(tmp_path, spin, rolls):
    """A plane of triangles turns about x through the point of contact, beneath a grain with that spin, or without."""
    material = replace(DRY, static_friction=0.0, kinetic_friction=0.0, restitution=1.0, **SPRING | {"rolling_damping_ratio": 0.0})
    grain = Grain(position=(0.0, 0.0, 4.99e-3), angular_velocity=spin)
    case = Scenario(name="turning", material=material, grains=(grain,), wall=True, time_step=1e-6, steps=20, stride=1)
    text = on_mesh(deck(case), tmp_path, FLOOR, f"rotate origin 0 0 0 axis 1 0 0 period {2.0 * np.pi / 20.0!r}")
    done = run_deck(tmp_path, text)
    assert done.code == 0 and not done.error, done.error
    torque = motion(case, tmp_path).torque[:, 0, 0]
    assert (torque > 0.0).all() if rolls else np.abs(torque).max() < 1e-12
    assert rolls or run_deck(tmp_path / "still", on_mesh(deck(case), tmp_path / "still", FLOOR)).code == 0
    assert rolls or np.abs(motion(case, tmp_path / "still").torque[:, 0, 0]).min() > 1e-8


def test_both_kinds_at_once_are_refused(tmp_path):
    case = Scenario(name="both", material=replace(DRY, **SPRING), grains=(Grain(),), wall=True, steps=10)
    done = run_deck(tmp_path, deck(case).replace("tangential finnie_rabinowicz", "tangential finnie_rabinowicz rolling_friction cdt"))
    assert done.code != 0 and "rolling_resistance and the model rolling_friction are both on" in done.error


@pytest.mark.parametrize(("word", "faster"), [("cdt", "constant_torque"), ("epsd2", "elastic_plastic"), ("off", "")])
def test_a_stock_model_that_leaves_the_packed_loop_says_so_once(tmp_path, word, faster):
    done = run_deck(tmp_path, f"""\
{head()}
region domain block -0.03 0.03 -0.03 0.03 -0.03 0.03 units box
create_box 2 domain
create_atoms 1 single 0 0 0 units box
set group all diameter 0.008 density 2500
neighbor 0.0005 bin
timestep 5e-6
{properties(Material())}
fix r1 all property/global coefficientRollingFriction peratomtypepair 2 0.1 0.1 0.1 0.1
fix r2 all property/global coefficientRollingViscousDamping peratomtypepair 2 0.1 0.1 0.1 0.1
pair_style gran model hertz tangential finnie_rabinowicz rolling_friction {word}
pair_coeff * *
fix motion all nve/sphere
run 1
run 1
""")
    assert done.code == 0, done.error or done.output[-1000:]
    warnings = [line for line in done.output.splitlines() if "WARNING" in line and "rolling_friction" in line]
    assert len(warnings) == (1 if faster else 0)
    assert all(f"rolling_friction {word}" in line and f"'rolling_resistance {faster}'" in line for line in warnings)
