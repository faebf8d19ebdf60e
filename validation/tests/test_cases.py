"""Case files: what is read, what is refused, and how the numbers of a run come about."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dembark.common.errors import DembarkError
from dembark.common.units import to_si
from dembark.postproc.measurement import Measurement, Value
from dembark.postproc.statistics import exact
from dembark.validation.case import folders
from dembark.validation.case.expressions import Expression
from dembark.validation.case.folders import discover, find, load
from dembark.validation.case.resolve import for_replica, portable, resolve, settings
from dembark.validation.judge.verdict import quantities


def edited(decks: Path, old: str, new: str) -> Path:
    path = decks / "box" / "case.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    folders.load.cache_clear()
    return path


def test_case_is_read(decks: Path) -> None:
    case = discover()["box"]
    assert case.parameters["grain_diameter"].value == 0.005
    assert case.parameters["grain_diameter"].range == "> 0"
    assert [(run.variant, run.engines) for run in case.runs["quick"]] == [("dry", ("liggghts", "yade")), ("wet", ("liggghts",))]


def test_what_the_folder_says_need_not_be_written(decks: Path) -> None:
    (decks / "box" / "yade.py").unlink()
    case = load(path := edited(decks, 'engines = ["liggghts", "yade"]\n', ""))
    assert (case.name, case.engines) == ("box", ("liggghts",))
    assert resolve(case, "full") == resolve(case, "quick") == resolve(case)
    (decks / "box" / "liggghts.in").unlink()
    folders.load.cache_clear()
    with pytest.raises(DembarkError, match=r"there is no deck, \[case\] of .*, one of liggghts.in, yade.py, lammps.in"):
        load(path)


def test_a_failure_has_the_cause_that_is_known_of_its_quantity_and_variant(decks: Path) -> None:
    case = load(edited(decks, "[runs]", """
[quantities]
angle = { label = "a", evidence = "experiment", tolerance = 0.1, why = "w", source = "s" }
"part_*" = { label = "part *", evidence = "theory", tolerance = 0.1, why = "w", family = "parts" }
[[findings]]
quantities = ["angle", "part_1"]
variants = ["wet"]
cause = "The plate is too small."
[runs]"""))
    wrong = Value(exact(2.0), exact(1.0))
    found = Measurement({"angle": wrong, "part_1": wrong, "part_2": wrong})
    causes = {variant: [one.cause for one in quantities(case, found, variant)] for variant in ("wet", "dry")}
    assert causes == {"wet": ["The plate is too small.", "The plate is too small.", ""], "dry": ["", "", ""]}
    assert [one.family for one in quantities(case, found, "wet")] == ["box, wet: angle", "box: parts", "box: parts"]
    # A cause is shown with failures alone.
    assert not any(one.cause for one in quantities(case, Measurement({"angle": Value(exact(1.0), exact(1.0))}), "wet"))


def test_runs_are_named_or_tables(decks: Path) -> None:
    case = load(edited(decks, '[{variant = "dry"}]', '[{variants = ["wet", "dry"], replicas = {yade = 2}}]'))
    assert [(run.variant, run.engines, run.replicas) for run in case.runs["standard"]] == [
        (name, ("liggghts", "yade"), {"yade": 2}) for name in ("wet", "dry")]
    case = load(edited(decks, '[{variant = "dry"}, ', '["dry", '))
    assert [(run.variant, run.engines) for run in case.runs["quick"]] == [("dry", ("liggghts", "yade")), ("wet", ("liggghts",))]


def test_a_profile_may_run_the_same_as_another(decks: Path) -> None:
    case = load(edited(decks, 'standard = [{variant = "dry"}]', 'standard = "quick"'))
    assert case.runs["standard"] == case.runs["quick"]
    with pytest.raises(DembarkError, match="did you mean quick"):
        load(edited(decks, 'standard = "quick"', 'standard = "quik"'))


def test_bodies_are_counted_with_derived_numbers(decks: Path) -> None:
    case = load(edited(decks, 'steps = "100"', 'steps = "100"\ntwice = "2 * grain_count"'))
    case = load(edited(decks, '[case]', '[case]\nparticles = "twice"'))
    assert case.particle_count(resolve(case)) == 20
    case = load(edited(decks, 'twice = ', 'half = "1 / 0"\ntwice = '))
    with pytest.raises(DembarkError, match=r"half = '1 / 0' cannot be evaluated, \[derived\] of case box"):
        case.particle_count(resolve(case))


def test_order_of_overrides(decks: Path) -> None:
    case = find("box")
    assert resolve(case)["grain_count"] == 10
    assert resolve(case, "standard")["grain_count"] == 20
    assert resolve(case, "standard", "wet")["contact_angle"] == 0.1
    assert resolve(case, "standard", "wet", settings(["grain_count=30", "contact_angle=9 deg"])) | {} == {
        **resolve(case), "grain_count": 30, "contact_angle": pytest.approx(math.pi / 20), "replicas": 3}


@pytest.mark.parametrize(("pair", "words"), [
    ("grain_diametre=1", ["unknown parameter 'grain_diametre'", "did you mean grain_diameter"]),
    ("grain_diameter=3 s", ["grain_diameter", "'3 s'", "m"]),
    ("grain_diameter=3 furlongz", ["furlongz"]),
    ("grain_diameter=0", ["out of range", "> 0"]),
    ("grain_diameter=-1 mm", ["out of range", "> 0"]),
    ("grain_diameter=nan", ["grain_diameter = nan: give a finite number"]),
    ("grain_diameter=1e400", ["grain_diameter = 1e400: give a finite number"]),
    ("grain_diameter=4,5 mm", ["grain_diameter: '4,5 mm' has a comma; write the decimal point: 4.5 mm"]),
    ("grain_diameter=1,234.5", ["has a comma"]),
    ("grain_diameter=1'000", ["grain_diameter: \"1'000\" is not a number"]),
    ("grain_diameter=4.5.6", ["'4.5.6' is not a number"]),
    ("grain_diameter=4 5 mm", ["'4 5 mm' is not a number"]),
    ("grain_diameter=mm", ["grain_diameter = mm: give a number with it, e.g. '4 mm'"]),
    ("grain_diameter=4 kg", ["cannot convert '4 kg' to m; give e.g. '4 mm'"]),
    ("grain_count=1,000", ["grain_count: '1,000' has a comma"]),
    ("strength=-inf", ["strength = -inf: give a finite number"]),
    ("grain_diameter=auto", ["must have a value"]),
    ("grain_count=2.5", ["whole number"]),
    ("grain_count=inf", ["grain_count = inf: give a finite number"]),
    ("contact_angle=95 deg", ["out of range"]),
    ("static_friction=30 deg", ["angles"]),
    ("behaviour=explode", ["allowed are", "truncate"]),
    ("grain_diameter", ["key=value"]),
    ("grain_diameter=", ["key=value"]),
])
def test_wrong_settings_are_refused_in_one_line(decks: Path, pair: str, words: list[str]) -> None:
    with pytest.raises(DembarkError) as caught:
        resolve(find("box"), None, None, settings([pair]))
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_a_key_twice_is_refused() -> None:
    with pytest.raises(DembarkError, match="twice"):
        settings(["a=1", "a=2"])


def test_unknown_names_get_near_matches(decks: Path) -> None:
    for call, word in ((lambda: find("bux"), "did you mean box"), (lambda: resolve(find("box"), "quik"), "did you mean quick"),
                       (lambda: resolve(find("box"), None, "wett"), "did you mean wet")):
        with pytest.raises(DembarkError, match=word):
            call()


def test_constraint_holds_between_parameters(decks: Path) -> None:
    case = find("box")
    assert resolve(case, changes={"static_friction": 0.5, "kinetic_friction": 0.5})["kinetic_friction"] == 0.5
    assert resolve(case, changes={"kinetic_friction": 0.9})["static_friction"] is None
    with pytest.raises(DembarkError, match="exceeds the static one"):
        resolve(case, changes={"static_friction": 0.5, "kinetic_friction": 0.6})
    assert resolve(case, changes={"static_friction": "auto", "kinetic_friction": 0.6})["static_friction"] is None


STUDY = """
[variants.large]
grain_count = 30

[studies.size]
title = "Sizes"
along = "grain_count"
variants = ["dry", "wet", "large"]

"""


@pytest.mark.parametrize(("old", "new", "words"), [
    ('unit = "m"', 'unit = "metrez"', ["metrez", "parameters.grain_diameter"]),
    ('unit = "m"', 'unit = "d"', ["'d' is not a base SI unit", "parameters.grain_diameter"]),
    ("value = 0.005", "value = -0.005", ["out of range", "parameters.grain_diameter"]),
    ("value = 0.005\n", "", ["value is missing"]),
    ('doc = "diameter"', "", ["doc is missing"]),
    ("above = 0.0", "abov = 0.0", ["abov", "did you mean above"]),
    ("value = 0.005", 'value = "small"', ["'small' is not a number", "parameters.grain_diameter"]),
    ("contact_angle = 0.1", "contact_angel = 0.1", ["contact_angel", "did you mean contact_angle"]),
    ("contact_angle = 0.1", "contact_angle = 3", ["out of range", "variants.wet"]),
    ('quick = [{variant = "dry"}', 'quick = [{variant = "dri"}', ["dri", "did you mean dry"]),
    ('quick = [{variant = "dry"}', 'quick = [{variant = "wet"}', ["twice"]),
    ('quick = [{variant = "dry"}', 'quick = [{variant = "dry", replicas = {yad = 1}}', ["replicas", "did you mean yade"]),
    ('quick = [{variant = "dry"}', 'quick = [{variant = "dry", replicas = {yade = 0}}', ["replicas", "out of range"]),
    ('quick = [{variant = "dry"}', 'quick = [{variant = "dry", replicas = 2}', ["replicas", "wrong type"]),
    ('quick = [{variant = "dry"}', 'quick = ["dri"', ["dri", "did you mean dry"]),
    ('quick = [{variant = "dry"}', 'quick = [{variants = ["dri"]}', ["dri", "did you mean dry"]),
    ('quick = [{variant = "dry"}', 'quick = [{variants = []}', ["in quick", "give variant or variants"]),
    ('quick = [{variant = "dry"}', 'quick = [{variant = "dry", variants = ["wet"]}', ["in quick", "give variant or variants"]),
    ('"the kinetic friction exceeds the static one"', "3", ["3 is not a sentence", "[constraints]"]),
    ("[runs]", '[studies]\nsize = "dry"\n[runs]', ["'dry' is not a table", "studies.size"]),
    ('engines = ["liggghts", "yade"]', 'engines = ["ligghts"]', ["did you mean liggghts"]),
    ("kinetic_friction <= static", "kinetic_frictio <= static", ["kinetic_frictio"]),
    ("kinetic_friction <= static_friction", "__import__('os')", ["unknown call of __import__()"]),
    ("[case]", "[case", ["cannot be read"]),
    ('title = "A box"', "title = 3", ["title", "wrong type"]),
    ("[runs]", STUDY.replace('along = "grain_count"', 'along = "grain_cont"') + "[runs]", ["studies.size", "did you mean grain_count"]),
    ("[runs]", STUDY.replace('"wet"', '"wett"') + "[runs]", ["studies.size", "did you mean wet"]),
    ("[runs]", STUDY.replace(', "wet"', "") + "[runs]", ["studies.size", "at least three variants"]),
    ("[runs]", '[controls]\n"gravity doubled" = ["weight"]\n[runs]', ["weight", "quantity", "[controls]"]),
    ("[runs]", '[controls]\n"gravity doubled" = "weight"\n[runs]', ["gravity doubled", "a list of the quantities", "[controls]"]),
    ("[runs]", '[[findings]]\nquantities = ["weight"]\ncause = "c"\n[runs]', ["weight", "quantity", "[findings]"]),
    ("[runs]", '[quantities.k]\nlabel = "K"\n[[findings]]\nquantities = ["k"]\nvariants = ["wett"]\ncause = "c"\n[runs]',
     ["did you mean wet"]),
    ("[runs]", '[quantities.k]\nlabel = "K"\n[[findings]]\nquantities = ["k"]\n[runs]', ["cause is missing", "[findings]"]),
    ("[runs]", '[quantities]\na = { label = "A", family = "f" }\nb = { label = "B", family = "f", evidence = "code" }\n[runs]',
     ["quantities.b", "family 'f'", "a of the same family"]),
    ("[runs]", STUDY.replace("along", "alone") + "[runs]", ["studies.size", "alone"]),
    ("[runs]", '[quantities.k]\nlabel = "K"\nevidence = "theory"\ntolerance = 0.1\n[runs]', ["quantities.k", "a tolerance without why"]),
    *(("[runs]", f'[quantities.k]\nlabel = "K"\nevidence = "theory"\nwhy = "x"\n{key} = {value}\n[runs]',
       [f"{key} = {said} is not possible", "[quantities.k]", "give a finite number >= 0"])
      for key, value, said in (("tolerance", "inf", "inf"), ("tolerance", "nan", "nan"), ("tolerance", "-0.1", "-0.1"),
                               ("tolerance", '"2 %"', "'2 %'"), ("input_uncertainty", "-0.1", "-0.1"), ("input_uncertainty", "inf", "inf"),
                               ("agreement", "inf", "inf"))),
    ("[runs]", '[quantities.k]\nlabel = "K"\nevidence = "theory"\ntolerance = 0.1\nwhy = "x"\ninput_uncertainty = 0.1\n[runs]',
     ["quantities.k", "input_uncertainty needs inputs"]),
    ("[runs]", '[quantities.k]\nlabel = "K"\nevidence = "theory"\ntolerance = 0.1\nwhy = "x"\ninput_uncertainty = 0.1\ninputs="y"\n[runs]',
     ["quantities.k", "input_uncertainty is not below the tolerance"]),
    ("[runs]", '[quantities.k]\nlabel = "K"\nevidence = "experiment"\n[runs]', ["quantities.k", "without source", "line "]),
    ("[derived]\n", '[derived]\nrows = "cel(grain_count / 2)"\n', ["cel()", "did you mean ceil?"]),
    ("[runs]", '[picture]\ncolour_by = "velocity"\nscael = 1.0\n[runs]', ["did you mean scale", "[picture]"]),
    ("[runs]", '[picture]\ncut = true\n[runs]', ["colour_by is missing", "[picture]"]),
    ("[runs]", '[picture]\ncolour_by = "velocity"\nview = "fornt"\n[runs]', ["unknown view 'fornt'", "did you mean front"]),
    ("[runs]", '[walls]\nbody = { kind = "box" }\n[runs]', ["size is missing", "walls.body"]),
    ("[runs]", '[picture]\ncolour_by = "speed"\nscale = 1\n[runs]', ["unknown colour_by 'speed'"]),
    ("[runs]", '[picture]\ncross_section = "xz"\nspeed = "sqrt(9.81"\n[runs]', ["is not an expression", "[picture]"]),
    ('source = ["nobody"]', 'source = ["nobody"]\nreferences = ["janssen_1985"]', ["unknown reference 'janssen_1985'", "[case]"]),
    ('source = ["nobody"]', "source = [1]", ["source = [1]", "a list of texts"]),
])
def test_mistakes_in_a_case_file_are_told(decks: Path, old: str, new: str, words: list[str]) -> None:
    path = edited(decks, old, new)
    with pytest.raises(DembarkError) as caught:
        load(path)
    for word in [*words, "case.toml"]:
        assert word in str(caught.value)


@pytest.mark.parametrize(("old", "new", "key"), [
    ("above = 0.0", "abov = 0.0", "abov ="), ('title = "A box"', 'titel = "A box"', "titel"),
    ("[runs]", "[rnus]", "[rnus]"), ("[runs]", '[quantities]\nk = { label = "K", evidense = "theory" }\n[runs]', "evidense"),
    ("[runs]", "[quantities.k]\nlabel = 3\n[runs]", "label = 3"),
    ("[runs]", '[quantities]\nother = { label = "theori" }\nk = { label = """K\n  L""", evidence = "theori" }\n[runs]',
     'evidence = "theori"'),
    ("[runs]", '[quantities.k]\nlabel = "K"\n[controls]\n"gravity doubled" = ["kk"]\n[runs]', '["kk"]'),
    ('variant = "dry"}, {', 'variant = "dri"}, {', '"dri"'), ("[runs]", '[quantities.k]\n"labl" = "K"\n[runs]', "labl"),
])
def test_a_wrong_key_is_told_with_its_line(decks: Path, old: str, new: str, key: str) -> None:
    path = edited(decks, old, new)
    (line,) = (number for number, text in enumerate(path.read_text().splitlines(), start=1) if key in text)
    with pytest.raises(DembarkError, match=f"{path}, line {line}(,|$)"):
        load(path)


def test_a_folder_of_cases_is_not_a_case(decks: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DEMBARK_CASES", str(decks / "box"))
    with pytest.raises(DembarkError, match=f"is a case itself.*name the folder above it, {decks}"):
        find("box")


def test_seeds_of_replicas_differ_and_the_first_is_the_decks_own(decks: Path) -> None:
    values = resolve(find("box"))
    assert [for_replica(values, k)["seed"] for k in (1, 2, 3)] == [7, 8, 9]


def test_infinity_becomes_a_number_that_json_and_the_engines_can_carry(decks: Path) -> None:
    assert portable(resolve(find("box")))["strength"] == 1e300
    # Where the case itself has no limit, its word for that may be written.
    assert portable(resolve(find("box"), changes=settings(["strength=inf"])))["strength"] == 1e300


@pytest.mark.parametrize(("text", "unit", "value"), [
    ("20 mm", "m", 0.02), ("72 mN/m", "N/m", 0.072), ("5 MPa", "Pa", 5e6), ("30 deg", "rad", math.pi / 6), ("5 %", "1", 0.05),
    ("1/2", "1", 0.5), ("2.5 g/cm^3", "kg/m^3", 2500.0), ("9.81 m s^-2", "m/s^2", 9.81), ("-4*mm", "m", -0.004),
    ("20°", "rad", math.pi / 9), ("20 degC", "K", 293.15), ("0.3", "m", 0.3)])
def test_units(text: str, unit: str, value: float) -> None:
    assert to_si(text, unit) == pytest.approx(value, rel=1e-15)


@given(st.floats(min_value=1e-9, max_value=1e9))
def test_a_length_in_millimetres_is_a_thousandth(value: float) -> None:
    assert to_si(f"{value!r} mm", "m") == pytest.approx(value / 1000, rel=1e-14)
    assert to_si(repr(value), "m") == value


def test_the_first_value_that_is_set_counts() -> None:
    condition = Expression("kinetic <= min(first(static, grain), first(static, wall))")
    assert condition.names == {"kinetic", "static", "grain", "wall"}
    assert condition({"kinetic": 0.4, "static": None, "grain": 0.5, "wall": 0.3}) is False
    assert condition({"kinetic": 0.4, "static": 0.5, "grain": 0.5, "wall": 0.3}) is True
    assert condition({"kinetic": None, "static": 0.5, "grain": 0.5, "wall": 0.3}) is None
    assert condition({"kinetic": 0.4}) is None
    assert Expression("kinetic > 1 and static > 1")({"kinetic": 0.5}) is None


@pytest.mark.parametrize("case", ["silo", "column_collapse", "gravity_channel", "plane_silo", "plug_flow"])
def test_a_kinetic_friction_above_the_static_one_is_refused_with_defaults_and_variants(case: str) -> None:
    """The static friction may be that of grains and walls: given, by default or by a variant."""
    one = find(case)
    for name in one.variants:
        values = resolve(one, "quick", name)
        least = values["static_friction"] or min(values["grain_friction"], values["wall_friction"])
        assert resolve(one, "quick", name, {"kinetic_friction": least})["kinetic_friction"] == least
        with pytest.raises(DembarkError, match="kinetic friction exceeds the static one"):
            resolve(one, "quick", name, {"kinetic_friction": 1.01 * least})
    with pytest.raises(DembarkError, match="youngs_modulus = 5e\\+09 Pa is out of range, it must be >= 5e\\+06 and <= 1e\\+09"):
        resolve(one, "quick", None, settings(["youngs_modulus=5 GPa"]))


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_expressions_agree_with_python(a: float, b: float) -> None:
    values = {"a": a, "b": b}
    assert Expression("a <= b or -a > 2*b")(values) == (a <= b or -a > 2 * b)
    assert Expression("min(a, b) + abs(a) < max(a, b)/2 and not a == b")(values) == (min(a, b) + abs(a) < max(a, b) / 2 and a != b)
    assert Expression("0 < a < b")(values) == (0 < a < b)


@given(st.floats(1e-3, 1e3) | st.floats(-1e3, -1e-3), st.integers(-20, 20), st.integers(-20, 20))
def test_powers_are_those_of_python(a: float, m: int, n: int) -> None:
    for base, exponent in ((a, n), (m, n)):
        if base == 0 and exponent < 0:
            continue
        found, expected = Expression("-x ** n * 2")({"x": base, "n": exponent}), -(base**exponent) * 2
        assert found == expected and type(found) is type(expected)


@pytest.mark.parametrize("text", ["9 ** 9 ** 9 ** 9", "10.0 ** 999", "(-8) ** (1 / 3)", "0 ** -1", "1 / 0", "sqrt(-1)"])
def test_an_expression_without_a_real_value_says_so_at_once(text: str) -> None:
    with pytest.raises(DembarkError, match="cannot be evaluated"):
        Expression(text).evaluated({})


def test_expressions_go_to_other_processes() -> None:
    again = pickle.loads(pickle.dumps(Expression("first(a, b) > 1 and c > 0")))
    assert again.names == {"a", "b", "c"} and again({"b": 2, "c": 1}) is True and again({"b": 2}) is None


@pytest.mark.parametrize("text", ["a.b", "a[0]", "lambda: 1", "open('x')", "a := 1", "[1]", "a if b else 1", "f'{a}'", "a if", "min(*a)"])
def test_expressions_refuse_everything_else(text: str) -> None:
    with pytest.raises(DembarkError):
        Expression(text)
