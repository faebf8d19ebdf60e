"""Every combination of models that the documentation promises runs at compiled speed; all others are refused with the list of these."""

import re
from pathlib import Path

import pytest
from rig import liggghts_driver, walls
from rig.combinations import LIST
from rig.scenarios import Grain, Material, Scenario

ROOT = Path(__file__).resolve().parents[3]
COMBINATIONS = set(LIST)
ROLLING = "\n".join(f"fix p_{name} all property/global {name} peratomtypepair 2 0.1 0.1 0.1 0.1"
                    for name in ("coefficientRollingFriction", "coefficientRollingViscousDamping", "workOfAdhesion"))
CASE = Scenario(name="two grains", material=Material(bridge_volume=2e-10), wall=True, steps=3, stride=1, time_step=1e-5, grains=(
    Grain(position=(0.0, 0.0, 4.99e-3), velocity=(0.1, 0.0, 0.0)),
    Grain(position=(9.99e-3, 0.0, 4.99e-3), angular_velocity=(0.0, 50.0, 1.0))))


def words(normal, tangential, cohesion, rolling, surface, settings=""):
    friction = " presliding exponential" if tangential == "finnie_rabinowicz" else ""
    bridges = {"capillary": " capillary_model willett", "adhesion": " adhesion_law dmt"}.get(cohesion, "")
    return (f"model {normal} tangential {tangential} cohesion {cohesion} rolling_friction {rolling} surface {surface} {{}}"
            f"{friction}{bridges}{settings}")


def deck(combination, settings="") -> str:
    text = liggghts_driver.deck(CASE)
    chosen = words(*combination, settings)
    text = re.sub(r"^pair_style gran .*$", f"{ROLLING}\npair_style gran {chosen.format('')}", text, flags=re.MULTILINE)
    return re.sub(r"^fix floor all wall/gran .*$", f"fix floor all wall/gran {chosen.format('primitive type 2 zplane 0')}", text,
                  flags=re.MULTILINE)


def test_documentation_promises_what_is_compiled():
    assert len(COMBINATIONS) == len(LIST) == 20
    normals, rollings = "hertz|hooke", "off|cdt|epsd2"
    laws = {("finnie_rabinowicz", "off"), ("finnie_rabinowicz", "capillary"), ("history", "capillary")}
    adhesive = {(n, "finnie_rabinowicz", "adhesion", "off", "default") for n in normals.split("|")}
    assert {(n, t, c, r, "default") for n in normals.split("|") for r in rollings.split("|") for t, c in laws} | adhesive == COMBINATIONS
    for page in ("tangential_finnie_rabinowicz", "cohesion_capillary"):
        text = (ROOT / f"docs/reference/liggghts_{page}.md").read_text(encoding="utf-8")
        assert f"`model {normals}`" in text and f"`rolling_friction {rollings}`" in text and "`surface default`" in text


@pytest.mark.parametrize("settings", ["", " tangential_damping off limitForce on"])
def test_all_combinations_run(tmp_path, settings):
    """One start of the engine; an uncompiled one would be refused. Grains and wall feel each other in all of them."""
    walls.batch(tmp_path, {combination: deck(combination, settings) for combination in sorted(COMBINATIONS)})
    for number in range(len(COMBINATIONS)):
        frame = liggghts_driver.read_dump(tmp_path / f"{number}.dump")[1][-1]
        assert (abs(frame[:, [10, 12]]) > 1e-6).all(), sorted(COMBINATIONS)[number]


@pytest.mark.parametrize("other", [("hertz/stiffness", "finnie_rabinowicz", "off", "off", "default"),
                                   ("hertz", "no_history", "capillary", "off", "default"),
                                   ("hooke", "finnie_rabinowicz", "sjkr", "off", "default"),
                                   ("hertz", "finnie_rabinowicz", "capillary", "epsd", "default"),
                                   ("hertz", "history", "capillary", "luding", "default")])
def test_others_are_refused_with_exactly_this_list(tmp_path, other):
    done = liggghts_driver.run_deck(tmp_path, deck(other))
    assert done.code != 0
    errors = [line for line in done.output.splitlines() if line.startswith("ERROR")]
    assert len(errors) == 1 and "not compiled" in errors[0]
    told = re.findall(r"model (\S+) tangential (\S+) cohesion (\S+) surface (\S+) rolling_friction ([\w|]+)", errors[0])
    assert {(n, t, c, r, s) for ns, t, c, s, rs in told for n in ns.split("|") for r in rs.split("|")} == COMBINATIONS


HISTORY, FRICTION = ("hertz", "history"), ("hertz", "finnie_rabinowicz")


@pytest.mark.parametrize(("written", "settings", "read", "then", "words"), [
    # As many numbers: 5, 5, 8, and of another kind.
    ((*HISTORY, "capillary", "off"), "", (*FRICTION, "off", "off"), "", ("tangential history, cohesion capillary, which",)),
    ((*FRICTION, "off", "off"), "", (*HISTORY, "capillary", "off"), "", ("tangential finnie_rabinowicz, cohesion off, which",)),
    ((*FRICTION, "off", "epsd2"), "", (*FRICTION, "off", "off"), " rolling_resistance elastic_plastic", ("rolling_friction epsd2, which",)),
    ((*HISTORY, "off", "off"), "", (*FRICTION, "off", "off"), "", ("tangential history, which",)),
    # The same models, and a law of the engine that keeps nothing.
    ((*FRICTION, "capillary", "epsd2"), "", (*FRICTION, "capillary", "epsd2"), "", ()),
    (("hertz", "no_history", "off", "off"), "", (*FRICTION, "off", "off"), "", ()),
    ((*HISTORY, "off", "off"), "", (*HISTORY, "off", "off"), "", ()),
])
def test_histories_of_a_restart_file_are_read_by_its_models_alone(tmp_path, written, settings, read, then, words):
    """The engine compares their lengths: bridge volumes were read as displacements, and displacements as volumes."""
    first = deck((*written, "default"), settings).replace(" presliding exponential", "")
    again = deck((*read, "default"), then).replace(" presliding exponential", "")
    again = re.sub(r"^region domain.*\ncreate_box.*$", "read_restart state", again, flags=re.MULTILINE)
    again = re.sub(r"^(create_atoms|group|set|dump\S*) .*\n", "", again, flags=re.MULTILINE)
    done = liggghts_driver.run_deck(tmp_path, f"{first}\nwrite_restart state\n")
    assert done.code == 0, done.error
    # A wall of the same models keeps its own.
    wall = re.search(r"^fix floor.*$", first, re.MULTILINE)
    again = re.sub(r"^fix floor.*$", lambda _: wall[0], again, flags=re.MULTILINE)
    done = liggghts_driver.run_deck(tmp_path, again, name="again.in")
    if not words:
        assert done.code == 0, done.error
        return
    assert done.code != 0 and "the restart file has contact histories of" in done.error
    for word in words:
        assert word in done.error
