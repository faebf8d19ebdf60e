"""Ours against the stock `tangential history`, where both laws should be the same, and where they should not."""

from dataclasses import replace

import numpy as np
import pytest
from rig import liggghts_driver
from rig.motion import deviation
from rig.scenarios import Material, Path, loaded, pressed, rotation_matrix

COULOMB = Material(static_friction=0.4, kinetic_friction=0.4)


def both(case, folder):
    return (liggghts_driver.run(case, folder / "ours"), liggghts_driver.run(case, folder / "stock", tangential="history"))


@pytest.mark.parametrize("normal_law", ["hertz", "hooke"])
@pytest.mark.parametrize("wall", [True, False])
def test_coulomb_limit_is_tangential_history(tmp_path, wall, normal_law):
    case = pressed(replace(COULOMB, normal_law=normal_law), wall)
    ours, stock = both(case, tmp_path)
    load = np.linalg.norm(ours.tangential_force, axis=1) / ours.normal_force
    assert load.max() > 0.399 and load.min() < 0.35  # sticks and slips
    assert max(deviation(stock, ours).values()) < 1e-12


def test_coulomb_limit_with_a_bridge(tmp_path):
    case = pressed(replace(COULOMB, bridge_volume=2e-10), True)
    assert max(deviation(*both(case, tmp_path)).values()) < 1e-12


def test_weakening_differs_from_tangential_history(tmp_path):
    case = pressed(replace(COULOMB, kinetic_friction=0.39), True)
    assert deviation(*both(case, tmp_path))["tangential_force"] > 1e-3


def test_turning_normal(tmp_path):
    """A pair that turns as a rigid body about an axis across the normal and its load: the force turns with it.

    Stock projects the displacement, a loss of angle^2/2 in each step: in all (turned angle) (angle of one step) / 2, which goes to
    zero with the time step. Ours keeps its length; both converge to the same.
    """
    rate, losses = 40.0, []
    for halving in (1, 2):
        time_step = 4e-5 / halving
        case = loaded(COULOMB, time_step)
        # Along x only: the load lies across the axis y.
        path = case.grains[0].path
        path = Path(displacement=(path.displacement[0], "0", path.displacement[2]), velocity=(path.velocity[0], "0", path.velocity[2]))
        case = replace(case, grains=(replace(case.grains[0], path=path), case.grains[1])).spinning((0.0, 1.0, 0.0), rate, "turning")
        ours, stock = both(case, tmp_path / str(halving))
        late = ours.time > 0.01
        size, stock_size = (np.linalg.norm(m.tangential_force, axis=1)[late] for m in (ours, stock))
        assert np.ptp(size) < 1e-8 * size[0]
        turned = rate * (ours.time[late][-1] - ours.time[late][0])
        losses.append(1.0 - stock_size[-1] / stock_size[0])
        assert losses[-1] == pytest.approx(0.5 * turned * rate * time_step, rel=0.01)
    assert losses[0] / losses[1] == pytest.approx(2.0, rel=0.01)


def test_turning_about_the_normal(tmp_path):
    """Grains that both spin about the common normal carry their load along; stock leaves it behind."""
    rate = 40.0
    ours, stock = both(loaded(COULOMB).spinning((0.0, 0.0, 1.0), rate, "twist"), tmp_path)
    still = liggghts_driver.run(loaded(COULOMB), tmp_path / "still")
    expected = np.array([rotation_matrix((0.0, 0.0, 1.0), rate * t) @ f for t, f in zip(still.time, still.tangential_force, strict=True)])
    scale = np.abs(expected).max()
    assert np.abs(ours.tangential_force - expected).max() < 1e-5 * scale
    assert np.abs(stock.tangential_force - expected).max() > 0.1 * scale
