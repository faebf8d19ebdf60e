"""Every item of the verification chapter passes, and can fail."""

import numpy as np
import pytest

from dembark.validation import verification
from dembark.validation.judge.tally import of_folder
from dembark.validation.verification import fields_balance, scenes
from dembark.validation.verification.item import Curve, Item, Panel, order


@pytest.mark.parametrize("compute", verification.ITEMS, ids=lambda compute: compute.__name__)
def test_item_passes(compute):
    item = compute()
    assert item.title and item.text and item.quantities
    assert {one.name: one.verdict for one in item.quantities} == {one.name: "pass" for one in item.quantities}
    for panel in item.panels:
        for curve in panel.curves:
            assert len(curve.place) == len(curve.value) and (np.asarray(curve.value) > 0.0).all()


def test_names_are_their_own():
    names = [compute.__name__ for compute in verification.ITEMS]
    assert len(set(names)) == len(names)


def test_heap_stands_still():
    network = scenes.heap()
    frame, links = network.frame, network.links
    force = np.zeros_like(frame.positions)
    np.add.at(force, links.ids[:, 0] - 1, links.forces)
    np.add.at(force, links.ids[:, 1] - 1, -links.forces)
    force += scenes.with_wall(network).wall_forces["base"]
    force[:, 2] -= frame.masses * scenes.GRAVITY
    assert np.abs(force).max() < 1e-10 * scenes.GRAVITY * frame.masses.sum()


def test_a_contact_that_is_missing_shows_in_the_balance():
    network = scenes.heap()
    _, whole = fields_balance.residual(network, "gaussian", 0.15, 0.05)
    links = network.links
    kept = np.arange(len(links.ids)) != np.argmax(np.linalg.norm(links.forces, axis=1))
    cut = scenes.contacts(links.first[kept], links.branch[kept], links.forces[kept], links.ids[kept] - 1)
    _, broken = fields_balance.residual(scenes.Network(network.frame, cut, network.base), "gaussian", 0.15, 0.05)
    assert broken > 3.0 * whole


@pytest.mark.parametrize(("due", "verdict"), [(2.0, "pass"), (1.0, "fail")])
def test_order_of_convergence(due, verdict):
    steps = np.array([0.1, 0.05, 0.025])
    assert order("order", "o", steps, 3.0 * steps**2, due, "theory").verdict == verdict


def test_items_come_back_as_they_were_written(tmp_path):
    steps = np.array([0.1, 0.05])
    curve = Curve("error", steps, steps**2)
    item = Item("wave", "Wave", "A wave.", [order("order", "order", steps, steps**2, 2.0, "theory")],
                [Panel("Wave", "h", "error", [curve])])
    verification.write(tmp_path, [item])
    (found,) = verification.read(tmp_path)
    assert found.quantities == item.quantities and found.panels[0].curves[0].value == [*curve.value]
    assert of_folder(tmp_path).passed == 1 and verification.read(tmp_path / "none") == []
