"""Liquid that bodies carry in YADE: what bridges take and give back, nothing made or lost, saved exactly."""

import math
from pathlib import Path

import pytest

HERE = Path(__file__).parent
SCENES = ("sequence many_at_once wall erased cleared reused_id rolling_over_facets erased_facet both_fixed conserved save_load history "
          "messages").split()


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes(*SCENES, script="liquid_scenes.py")


def cap(own, other):
    """Part of the surface of a sphere that faces a touching sphere of radius `other`."""
    return 0.5 * (1.0 - math.sqrt(1.0 - (other / (own + other)) ** 2))


@pytest.mark.parametrize("name", ["cap", "fraction", "radius", "taken", "largest"])
def test_sequence_of_touches_and_ruptures(found, name):
    """Grain 0 (3 mm, 3e-10 m^3) and its neighbours 1 (2 mm, 1e-11) and 2 (2 mm, dry)."""
    apart, touch, held, one_left, all_left = found["sequence"][name]
    large, small = (0.8, 0.8) if name == "fraction" else (cap(0.003, 0.002), cap(0.002, 0.003))
    grant = 3e-10 / max(1.0, 2.0 * large)  # both ask the large grain in the same step
    bridge = [large * grant + small * 1e-11, large * grant]
    taken = [[large * grant, small * 1e-11], [large * grant, 0.0]]
    if name == "largest":
        taken = [[part * min(1.0, 1e-11 / sum(side)) for part in side] for side in taken]
        bridge = [sum(side) for side in taken]
        assert bridge[0] == pytest.approx(1e-11, rel=1e-14)
    close = lambda *numbers: pytest.approx(numbers, rel=1e-13, abs=1e-24)
    assert apart["grains"] == [3e-10, 1e-11, 0.0] and apart["count"] == 0
    carried = [3e-10 - taken[0][0] - taken[1][0], 1e-11 - taken[0][1], 0.0]
    assert touch["grains"] == close(*carried)
    assert (touch["volumes"]["0-1"], touch["volumes"]["0-2"]) == close(*bridge)
    # It pulls from the step after the one in which it forms.
    assert touch["pull"] > 0.0 > held["pull"] - touch["pull"]
    back = {"radius": (0.6, 0.4), "taken": (taken[0][0] / bridge[0], taken[0][1] / bridge[0])}.get(name, (0.5, 0.5))
    assert one_left["grains"] == close(carried[0] + back[0] * bridge[0], carried[1] + back[1] * bridge[0], 0.0)
    assert one_left["count"] == 1
    back_2 = {"radius": (0.6, 0.4), "taken": (1.0, 0.0)}.get(name, (0.5, 0.5))
    assert all_left["grains"] == close(one_left["grains"][0] + back_2[0] * bridge[1], one_left["grains"][1], back_2[1] * bridge[1])
    assert all_left["bridges"] == 0.0
    for row in (apart, touch, held, one_left, all_left):
        assert row["total"] == pytest.approx(3.1e-10, rel=1e-14)


def test_no_grain_gives_more_than_it_has(found):
    """Six neighbours that each ask for all get a sixth each."""
    row = found["many_at_once"]
    assert row["grains"][0] == pytest.approx(0.0, abs=1e-25)
    assert row["grains"][0] >= 0.0
    assert list(row["volumes"].values()) == pytest.approx([1e-11] * 6, rel=1e-14)


def test_wall_lends_and_gets_back(found):
    for apart, touch, held, left in found["wall"]["orders"]:
        assert (apart["grain"], apart["pool"], apart["bridges"]) == (0.0, 2e-10, 0.0)
        assert (touch["grain"], touch["pool"], touch["bridges"]) == pytest.approx((0.0, 1.5e-10, 5e-11), rel=1e-14)
        assert held == touch
        assert (left["grain"], left["pool"], left["bridges"]) == pytest.approx((3e-11, 1.7e-10, 0.0), rel=1e-13)
    on, off = found["wall"]["plain"]
    assert (on["grains"][1], on["bridges"]) == pytest.approx((5e-11, 5e-11), rel=1e-14)
    assert (off["grains"][1], off["walls"]) == (pytest.approx(1e-10, rel=1e-14), 0.0)


def test_erased_body_takes_its_own_and_no_more(found):
    """Its bridge is split as if it broke: the other side keeps its half."""
    before, after = found["erased"]
    bridge = before["volumes"]["0-1"]
    assert after["lost"] == pytest.approx(before["grains"][1] + 0.5 * bridge, rel=1e-13)
    assert after["grains"][0] == pytest.approx(before["grains"][0] + 0.5 * bridge, rel=1e-13)
    assert after["count"] == before["count"] - 1 == 1
    assert after["total"] == pytest.approx(3e-10, rel=1e-14)


def test_interactions_that_a_script_ends_give_their_liquid_back(found):
    before, after = found["cleared"]
    assert after["count"] == before["count"] == 2
    assert after["bridges"] == pytest.approx(sum(after["volumes"].values()), rel=1e-13)
    assert after["grains"] == pytest.approx(before["grains"], rel=1e-13) and after["total"] == pytest.approx(3e-10, rel=1e-14)


def test_body_at_the_id_of_an_erased_one_is_a_new_one(found):
    """It gets its own content, or what it is given; what was of the former is gone with it but for its partner's half."""
    before, after, again = found["reused_id"]
    bridge, volume = before["volumes"]["0-1"], 0.01 * 4.0 / 3.0 * math.pi * 0.002**3
    assert after["lost"] == pytest.approx(before["grains"][1] + 0.5 * bridge, rel=1e-13)
    assert after["grains"] == pytest.approx([before["grains"][0] + 0.5 * bridge, volume, before["grains"][2]], rel=1e-13, abs=1e-25)
    assert after["total"] == pytest.approx(before["total"] + volume, rel=1e-14)
    assert again["grains"][1] == 5e-11
    assert again["total"] == pytest.approx(after["total"] + 5e-11, rel=1e-14)
    assert after["count"] == again["count"] == 1


def test_bridge_that_goes_from_facet_to_facet_is_counted_once(found):
    case = found["rolling_over_facets"]
    touch, *_, left = case["rows"]
    assert case["handed"] == 1
    assert [row["count"] for row in case["rows"]] == [1, 1, 1, 1, 0]
    for row in case["rows"]:
        assert row["total"] == pytest.approx(2e-10, rel=1e-14)
        assert row["bridges"] == pytest.approx(5e-11 if row["count"] else 0.0, rel=1e-14, abs=1e-25)
    assert (touch["grain"], touch["pool"]) == pytest.approx((0.0, 1.5e-10), rel=1e-14, abs=1e-25)
    assert (left["grain"], left["pool"]) == pytest.approx((3e-11, 1.7e-10), rel=1e-13)


def test_bridge_to_a_wall_is_split_when_one_of_them_is_erased(found):
    before, after = found["erased_facet"]
    assert before["bridges"] == pytest.approx(1e-10, rel=1e-14) and before["count"] == 2
    assert after["grains"][2] == pytest.approx(3e-11, rel=1e-13) and after["lost"] == pytest.approx(3e-11, rel=1e-13)
    assert after["pools"] == pytest.approx([1.7e-10, 1.7e-10], rel=1e-13, abs=1e-25)
    assert after["total"] == pytest.approx(4e-10, rel=1e-14) and after["bridges"] == pytest.approx(0.0, abs=1e-25)


def test_bridge_between_fixed_bodies_keeps_its_liquid(found):
    first, second, gone = found["both_fixed"]
    assert first["count"] == second["count"] == 1 and gone["count"] == 0
    assert first["total"] == pytest.approx(gone["total"], rel=1e-14)


@pytest.mark.parametrize("threads", [1, 2])
def test_nothing_is_made_or_lost(yade, found, threads):
    one = found["conserved"] if threads == 1 else None
    case = one or yade.scenes("conserved_briefly", script="liquid_scenes.py", threads=2)["conserved_briefly"]
    counts = [row["count"] for row in case["rows"]]
    assert max(counts) > 20 and min(counts) < max(counts)
    for row in case["rows"]:
        assert row["total"] == pytest.approx(case["begin"], rel=1e-13)
        assert row["bridges"] == pytest.approx(sum(row["volumes"].values()), rel=1e-13)
        assert row["walls"] >= 0.0
    assert len({row["walls"] for row in case["rows"]}) > 1


@pytest.mark.parametrize("ending", ["xml", "yade.gz", "bin"])
def test_saved_liquid_is_the_same_to_the_bit(found, ending):
    case = found["save_load"][ending]
    assert case["before"] == case["after"]
    assert case["ends"][0] == case["ends"][1] != case["before"]


def test_history_has_the_liquid(found):
    header, row = found["history"]["text"].split()
    values = dict(zip(header.split(","), row.split(","), strict=True))
    liquid = found["history"]["tallies"]
    assert header.endswith(",liquid_grains,liquid_bridges,liquid_walls,liquid_lost,bridge_count")
    assert float(values["liquid_grains"]) == sum(liquid["grains"]) > 0.0
    assert float(values["liquid_bridges"]) == liquid["bridges"] > 0.0
    assert (float(values["liquid_walls"]), float(values["liquid_lost"]), int(values["bridge_count"])) == (0.0, 0.0, 1)


def test_wrong_words_are_told_in_one_line(found):
    said = found["messages"]
    for message, part in zip(said, ("share is 'all'; it must be cap or fraction", "(0, 2]", "(0, 1]", "equal, radius or taken",
                                    "content", "maxBridge", "volume", "no sphere", "no wall", "share and part",
                                    "belongs to a wall already"), strict=True):
        assert message.startswith("dembark: CapillaryLiquid") and "\n" not in message
        assert part in message, message


@pytest.mark.parametrize(("scene", "words"), [
    ("without_engine", "carriedLiquid=True needs the engine CapillaryLiquid right after InteractionLoop"),
    ("without_law", "with carriedLiquid=True"), ("fixed_volumes_too", "bridgeVolume")])
def test_half_a_set_up_ends_the_run(yade, scene, words):
    done = yade(HERE / "liquid_scenes.py", "none.json", scene)
    assert done.returncode == 2
    assert [line for line in done.stderr.splitlines() if line.startswith("dembark: ") and words in line]
