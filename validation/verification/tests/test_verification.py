"""Every item of the verification chapter passes, and each of its checks has wrong physics that fails it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dembark.validation import verification
from dembark.validation.judge.tally import of_folder
from dembark.validation.verification import fields_balance, fields_exact, fields_rings, scenes, sph_flows
from dembark.validation.verification.item import Curve, Item, Panel, order


@cache
def computed(compute):
    return compute()


@pytest.mark.parametrize("compute", verification.ITEMS, ids=lambda compute: compute.__name__)
def test_item_passes(compute):
    item = computed(compute)
    assert item.title and item.text and item.quantities
    assert {one.name: one.verdict for one in item.quantities} == {one.name: "pass" for one in item.quantities}
    for panel in item.panels:
        for curve in panel.curves:
            assert len(curve.place) == len(curve.value) and (np.asarray(curve.value) > 0.0).all()


def massless(frame, links, **_):
    return replace(frame, masses=np.where(frame.ids == 1, 0.0, frame.masses)), links


def faster(frame, links, **_):
    return replace(frame, velocities=1.01 * frame.velocities), links


def jittering(frame, links, **_):
    return replace(frame, velocities=frame.velocities + 1e-3 * np.random.default_rng(1).normal(size=frame.velocities.shape)), links


def without_contact(frame, links, **_):
    strongest = np.argmax(np.linalg.norm(links.forces, axis=1))
    return frame, replace(links, forces=np.where(np.arange(len(links.forces))[:, None] == strongest, 0.0, links.forces))


def only(wrong, when):
    """`wrong` where the options of coarse graining are such, and nothing elsewhere."""
    return lambda frame, links, **options: wrong(frame, links) if when(options) else (frame, links)


# What is given to coarse graining instead of the system, by the control's name.
SPOILT = {
    "a grain without its mass": massless, "a lost contact": without_contact, "velocities a hundredth too large": faster,
    "grains that jitter": jittering, "threads that skip a grain": only(massless, lambda options: options.get("threads", 1) > 1)}


# What another fluid is made with.
OTHER_FLUID = {"gravity a fiftieth too strong": {"gravity": [0, -1.02 * sph_flows.GRAVITY]}, "water a tenth too light": {"density": 900.0}}


def given(wrong, graining):
    """`graining` of what `wrong` makes of a system."""
    return lambda frame, links, *more, **options: graining(*wrong(frame, links, **options), *more, **options)


def spoil(monkeypatch, control):
    """Have all items computed with wrong physics."""
    if control == "gravity doubled":
        for module in (fields_balance, fields_rings):
            monkeypatch.setattr(module, "GRAVITY", 2.0 * scenes.GRAVITY)
    elif control == "a base with a hundredth too much force":
        with_wall, graining = scenes.with_wall, fields_balance.coarse_grain

        def stronger(base):
            return type(base)(base.points, base.positions, 1.01 * base.forces)

        monkeypatch.setattr(scenes, "with_wall", lambda network: with_wall(replace(network, base=stronger(network.base))))
        monkeypatch.setattr(fields_balance, "coarse_grain",
                            lambda *given, walls, **more: graining(*given, walls=[stronger(one) for one in walls], **more))
    elif control in OTHER_FLUID:
        fluid = sph_flows.SphFluid
        monkeypatch.setattr(sph_flows, "SphFluid", lambda points, **more: fluid(points, **more | OTHER_FLUID[control]))
    else:
        for module, name in ((fields_exact, "coarse_grain"), (fields_balance, "coarse_grain"), (fields_rings, "ring_fields")):
            monkeypatch.setattr(module, name, given(SPOILT[control], getattr(module, name)))


# Those that are slow and have a quick one of their kind among the others.
SLOW = ("gravity doubled", "a lost contact", "water a tenth too light")
CONTROLS = [*SPOILT, *OTHER_FLUID, "gravity doubled", "a base with a hundredth too much force"]


@pytest.mark.parametrize("compute", verification.ITEMS, ids=lambda compute: compute.__name__)
def test_every_check_names_what_fails_it(compute):
    assert all(one.control in CONTROLS for one in computed(compute).quantities)


@pytest.mark.parametrize("control", [pytest.param(one, marks=pytest.mark.full if one in SLOW else ()) for one in CONTROLS])
def test_wrong_physics_fails(control, monkeypatch):
    named = {compute: names for compute in verification.ITEMS
             if (names := {one.name for one in computed(compute).quantities if one.control == control})}
    assert named
    spoil(monkeypatch, control)
    for compute, names in named.items():
        assert names <= {one.name for one in compute().quantities if one.verdict == "fail"}


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
    assert order("order", "o", steps, 3.0 * steps**2, due, "theory", "another order").verdict == verdict


def test_items_come_back_as_they_were_written(tmp_path):
    steps = np.array([0.1, 0.05])
    curve = Curve("error", steps, steps**2)
    item = Item("wave", "Wave", "A wave.", [order("order", "order", steps, steps**2, 2.0, "theory", "another order")],
                [Panel("Wave", "h", "error", [curve])])
    verification.write(tmp_path, [item])
    (found,) = verification.read(tmp_path)
    assert found.quantities == item.quantities and found.panels[0].curves[0].value == [*curve.value]
    assert of_folder(tmp_path).passed == 1 and verification.read(tmp_path / "none") == []
