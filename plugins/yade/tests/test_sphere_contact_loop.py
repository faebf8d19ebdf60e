"""SphereContactLoop leaves what InteractionLoop leaves."""

import pytest

SCENES = ("dry", "wet", "partial_slip", "elastic_limit", "carried", "periodic", "odd_bodies", "changed_on_the_way", "many_laws",
          "saved")


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes(*SCENES, "coincident", "crowd", "cell", "callback", "said", "no_number", "interpreter", script="loop_scenes.py")


@pytest.mark.parametrize("scene", SCENES)
def test_every_bit_of_bodies_and_contacts_is_that_of_the_stock_loop(found, scene):
    stock, short = found[scene]["stock"], found[scene]["short"]
    assert stock["count"] > 20
    for what in ("bodies", "contacts", "count", "listed", "lost", "bridges"):
        assert short[what] == stock[what], what


@pytest.mark.parametrize("scene", SCENES)
def test_geometry_of_contacts_is_kept_up(found, scene):
    assert found[scene]["short"]["geometry"] == found[scene]["stock"]["geometry"]


@pytest.mark.parametrize("scene", SCENES)
def test_pairs_of_spheres_do_take_the_short_way(found, scene):
    short = found[scene]["short"]
    # Contacts that know a functor of before keep it, and are dispatched to it.
    least = 0 if scene == "changed_on_the_way" else 0.3 * short["count"]
    ended_in_the_step = 2
    assert least < short["short"] <= short["count"] + ended_in_the_step


def test_packs_take_what_touches_under_a_law_that_they_know(found):
    packed = {scene: found[scene]["short"]["packed"] for scene in SCENES}
    for scene in ("dry", "periodic", "odd_bodies"):
        assert packed[scene] == found[scene]["short"]["short"] > 20, scene
    assert 20 < packed["wet"] < found["wet"]["short"]["short"]  # the others are held by their bridges
    assert 5 < packed["many_laws"] < found["many_laws"]["short"]["short"]
    assert packed["partial_slip"] == packed["carried"] == packed["changed_on_the_way"] == 0


def test_callbacks_are_called_by_the_stock_loop(found):
    stock, short = found["callback"]["stock"], found["callback"]["short"]
    assert short["short"] == 0
    assert (short["bodies"], short["contacts"]) == (stock["bodies"], stock["contacts"])


@pytest.mark.parametrize("lanes", ["2", *(pytest.param(lanes, marks=pytest.mark.full) for lanes in "48")])
def test_packs_of_any_width_give_the_same_bits(yade, found, monkeypatch, lanes):
    monkeypatch.setenv("DEMBARK_LANES", lanes)
    narrower = yade.scenes("crowd", "many_laws", script="loop_scenes.py")
    for scene, both in narrower.items():
        assert both["short"]["short"] > 50
        assert both["short"] == found[scene]["short"], scene


def test_coincident_centres_end_the_run(found):
    """They have no normal. Both loops say so in the same line."""
    stock, short = found["coincident"]["stock"], found["coincident"]["short"]
    assert stock["touching"] == short["touching"] == short["short"] == 1
    assert short["said"] == stock["said"]
    assert stock["said"].startswith("dembark: the contact of bodies 0 and 1 has no finite force in step 3;") and "\n" not in stock["said"]


def test_two_threads_sum_forces_in_another_order_only(yade, found):
    assert found["crowd"]["short"]["count"] > 1000  # several blocks a thread
    for scene, two in yade.scenes("crowd", "cell", script="loop_scenes.py", threads=2).items():
        one = found[scene]
        for loop in ("stock", "short"):
            assert two[loop]["count"] == one["stock"]["count"] > 20
            assert two[loop]["bridges"] == one["stock"]["bridges"]
            assert two[loop]["lost"] == pytest.approx(one["stock"]["lost"], rel=1e-9)
            assert two[loop]["fall"] == pytest.approx(one["stock"]["fall"], rel=1e-12)
    assert found["cell"]["stock"]["bridges"] > 20


def test_python_keeps_what_it_knows_of_the_thread(found):
    assert found["interpreter"] == {"stock": [1] * 3, "short": [1, 2, 3]}


def test_mistakes_are_told_in_one_line(found):
    said = found["said"]
    assert said["restitution"].startswith("dembark: restitution must be > 0 and <= 1, not 2")
    assert said["no law"].startswith("dembark: SphereContactLoop: no Law2 functor for ScGeom and FinnieRabinowiczPhys of bodies")
    assert said["no physics"].startswith("dembark: SphereContactLoop: no Ip2 functor for the materials of bodies")
    assert said["no geometry"] == "nothing"
    assert not any("\n" in line for line in said.values())


def test_a_force_that_is_no_number_ends_the_run(found):
    for loop in ("stock", "short"):
        assert "has no finite force in step" in found["no_number"][loop]
