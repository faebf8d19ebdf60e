"""What users get wrong: one line that says what would be right, before any engine starts, and nothing left behind."""

from __future__ import annotations

import shlex
from importlib.metadata import version
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation import engines
from dembark.validation.case import deck, folders
from dembark.validation.cli import main

HEAD = '[campaign]\nname = "mine"\nprofile = "quick"\n[[sweeps]]\ncase = "silo"\n'
RUN = ("run", "silo", "--engine", "liggghts", "--out", "out")

SETTINGS = {
    "wall_friction=0,3": "wall_friction: '0,3' has a comma; write the decimal point: 0.3",
    "gravity=9,81 m/s^2": "write the decimal point: 9.81 m/s^2",
    "grain_diameter=4,5mm": "write the decimal point: 4.5mm",
    "grain_density=2.500,0": "write a decimal point and nothing between thousands",
    "grain_count=2,200": "grain_count: '2,200' has a comma",
    "grain_density=2'500": "give e.g. '2.5 g/cm^3'",
    "grain_density=2 500 kg/m^3": "give e.g. '2.5 g/cm^3'",
    "wall_friction=0.3.1": "give e.g. 0.3",
    "wall_friction=0.3 0.4": "give e.g. 0.3",
    "restitution=nan": "restitution = nan: give a finite number",
    "cylinder_radius=inf": "cylinder_radius = inf: give a finite number",
    "cylinder_radius=1e400": "cylinder_radius = 1e400: give a finite number",
    "cylinder_radius=1e400 mm": "cylinder_radius = 1e400 mm: give a finite number",
    "grain_count=1e400": "give a finite number",
    "grain_diameter=mm": "grain_diameter = mm: give a number with it, e.g. '4 mm'",
    "grain_diameter=4 kg": "cannot convert '4 kg' to m; give e.g. '4 mm'",
    "grain_diameter=4 mn": "unknown unit 'mn' in '4 mn'; give e.g. '4 mm'",
    "bridge_volume=1 mm3": "write the power with ^: '1 mm^3'",
    "wall_friction=20 deg": "mixes up angles and plain ratios; give e.g. 0.3",
    "grain_diameter=small": "give e.g. '4 mm'",
    "grain_count=10.5": "is not a whole number, >= 1",
    "grain_count=0": "it must be >= 1",
    "restitution=1.2": "it must be >= 0.05 and <= 1",
    "youngs_modulus=5 GPa": "it must be >= 5e+06 and <= 1e+09",
    "youngs_modulus=1 kPa": "it must be >= 5e+06 and <= 1e+09",
    "kinetic_friction=0.9": "wall_friction = 0.3 in case silo, it must hold that kinetic_friction <= min(",
    "cylinder_radius=1 cm": "it must hold that cylinder_radius >= 3 * grain_diameter",
    "capillary_model=exakt": "allowed are exact | willett",
    "grain_diametre=4 mm": "did you mean grain_diameter",
    "grain_diameter": "write --set key=value",
    "grain_diameter=": "write --set key=value",
    "frames=1": "it must be >= 2",
}

COMMANDS = {
    "misspelt command": (("runn", "silo"), "Did you mean 'run'"),
    "misspelt case": (("run", "slio", "--engine", "liggghts"), "did you mean silo?"),
    "own case without its folder": (("deck", "mine", "--engine", "liggghts", "--out", "out"), "dembark --cases FOLDER"),
    "own case of validate": (("validate", "--case", "mine"), "dembark --cases FOLDER"),
    "misspelt engine": (("run", "silo", "--engine", "ligghts"), "did you mean liggghts?"),
    "misspelt profile": ((*RUN, "--profile", "quikc"), "did you mean quick?"),
    "misspelt variant": ((*RUN, "--variant", "wett"), "did you mean wet"),
    "misspelt option": ((*RUN, "--threds", "2"), "--threads"),
    "no engine": (("run", "silo"), "--engine"),
    "no folder for changes": (("run", "silo", "--engine", "liggghts", "--set", "frames=9"), "name a folder for its results"),
    "a key twice": ((*RUN, "--set", "frames=9", "--set", "frames=8"), "give each key once"),
    "no threads": ((*RUN, "--threads", "0"), "greater than or equal to 1"),
    "threads with a comma": ((*RUN, "--threads", "1,5"), "--threads': Input should be a valid integer"),
    "ranks of YADE": (("run", "silo", "--engine", "yade", "--out", "out", "--ranks", "2"), "use --threads"),
    "interval without unit": ((*RUN, "--restart-interval", "10"), '"10 min"'),
    "interval with a comma": ((*RUN, "--restart-interval", "1,5 h"), "write the decimal point: 1.5 h"),
    "case of validate": (("validate", "--case", "siol"), "did you mean silo?"),
    "engine of validate": (("validate", "--engine", "yad"), "did you mean yade?"),
    "report of nothing": (("report", "--results", "out"), "first, or give --results"),
    "status of nothing": (("status", "out"), "out"),
    "unknown campaign": (("submit", "silo-smal", "--out", "out"), "did you mean silo-small"),
    "fields of nothing": (("fields", "out.dump", "--out", "f.nc"), "out.dump"),
    "fields nowhere": (("fields", "silo"), "name a file with --out"),
}

CAMPAIGNS = {
    "decimal comma": ('grid = { wall_friction = ["0,15", 0.3] }\n', "write the decimal point: 0.15"),
    "decimal comma in fixed": ('fixed = { gravity = "9,81 m/s^2" }\ngrid = { frames = [9] }\n', "write the decimal point: 9.81 m/s^2"),
    "decimal comma in a list": ('list = [{ wall_friction = "0,2" }]\n', "write the decimal point: 0.2"),
    "decimal comma without quotes": ("grid = { wall_friction = [0,15, 0.3] }\n", "'0,15' in a list: write 0.15, or 0, 15"),
    "decimal comma outside a list": ("fixed = { wall_friction = 0,3 }\n", "cannot be read"),
    "nan": ("grid = { restitution = [0.5, nan] }\n", "restitution = nan: give a finite number"),
    "infinite": ("grid = { cylinder_radius = [inf] }\n", "cylinder_radius = inf: give a finite number"),
    "bare unit": ('grid = { grain_diameter = ["mm"] }\n', "give a number with it, e.g. '4 mm'"),
    "kinetic above static": ("grid = { kinetic_friction = [0.2, 0.9] }\n", "it must hold that kinetic_friction <= min("),
}


@pytest.fixture(autouse=True)
def nothing_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder, and engines that must not be asked for."""
    monkeypatch.chdir(tmp_path)

    def never(name: str) -> engines.Engine:
        pytest.fail(f"{name} was looked for")
    monkeypatch.setattr(engines, "find", never)


def refused(words: tuple[str, ...], expected: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The command ends with exit code 2 and one line that holds `expected`."""
    assert main(list(words)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("dembark: ") and said.err.count("\n") == 1 and "Traceback" not in said.err
    assert expected in said.err


@pytest.mark.parametrize("setting", SETTINGS)
def test_a_wrong_setting_is_refused(setting: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    refused((*RUN, "--set", setting), SETTINGS[setting], capsys)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", COMMANDS)
def test_a_wrong_command_is_refused(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    refused(*COMMANDS[name], capsys)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_wrong_campaign_is_refused(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, expected = CAMPAIGNS[name]
    (tmp_path / "mine.toml").write_text(HEAD + text)
    refused(("submit", "mine.toml", "--out", "out"), expected, capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.parametrize(("text", "expected"), [
    (None, "add one with measure(replicas)"),
    ("def measure(:\n", "measure.py, line 1, SyntaxError"),
    ("\nimport no_such_module\n", "measure.py, line 2, ModuleNotFoundError: No module named 'no_such_module'"),
    ("def quantities(replicas): ...\n", "has no function measure"),
])
def test_missing_or_broken_checks_are_told_before_a_run(text: str | None, expected: str, decks: Path, tmp_path: Path,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    file = decks / "box/measure.py"
    file.unlink()
    if text is not None:
        file.write_text(text)
    refused(("run", "box", "--engine", "liggghts", "--out", "out"), expected, capsys)
    assert not (tmp_path / "out").exists()


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A case of one's own from the template of packings."""
    monkeypatch.setenv("DEMBARK_CASES", str(tmp_path / "cases"))
    assert main(["new-case", "mine", "--template", "packing", "--in", str(tmp_path / "cases")]) == 0
    return tmp_path / "cases/mine"


def test_the_command_that_runs_a_new_case_can_be_pasted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "my cases (ü)"
    assert main(["new-case", "mine", "--in", str(folder)]) == 0
    words = shlex.split(capsys.readouterr().out.partition("Run it: ")[2])
    assert words[:5] == ["dembark", "--cases", str(folder), "run", "mine"]


@pytest.mark.parametrize(("file", "old", "new", "expected"), [
    ("setup.py", "p.box_width", "p.box_widht", "there is no parameter box_widht, did you mean box_width"),
    ("deck.in", "${gravity}", "${gravty}", "uses ${gravty}, which nothing defines, did you mean gravity"),
    ("deck.in", '{% include "start.in" %}', '{% include "start.in" %}\n# << mobil >>', ", 'mobil' is undefined, did you mean mobile"),
    ("case.toml", "[parameters]", "[parameters]\nwall_frction = { value = 0.5 }",
     "no group has a parameter wall_frction, and doc is missing, [parameters.wall_frction]"),
])
def test_misspelt_names_of_an_own_case(file: str, old: str, new: str, expected: str, own: Path, tmp_path: Path,
                                       capsys: pytest.CaptureFixture[str]) -> None:
    text = (own / file).read_text()
    assert old in text
    (own / file).write_text(text.replace(old, new, 1))
    capsys.readouterr()
    refused(("deck", "mine", "--engine", "liggghts", "--out", "out"), expected, capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("key", "value", "words"), [
    ("steps", "0", "steps = 0 of a run of case mine, from [derived], it must be an integer of at least 1"),
    ("steps", "0.4", "steps = 0 of"), ("steps", "-5", "steps = -5 of"), ("time_step", "-1e-5", "time_step = -1e-05 of a run of case mine"),
    ("time_step", "0 * height", "time_step = 0.0 of a run of case mine, from [derived], it must be a positive number of seconds"),
])
def test_a_run_without_a_step_is_refused(key: str, value: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("DEMBARK_CASES", str(tmp_path / "cases"))
    assert main(["new-case", "mine", "--in", str(tmp_path / "cases")]) == 0
    file = tmp_path / "cases/mine/case.toml"
    before, _, after = file.read_text().partition("[derived]")
    numbers = {"time_step": "1e-5", "stride": "10", "steps": "500", key: value}
    lines = "".join(f'{name} = "{one}"\n' for name, one in numbers.items())
    file.write_text(f"{before}[derived]\n{lines}\n{after[after.index('[quantities]'):]}")
    capsys.readouterr()
    refused(("deck", "mine", "--engine", "liggghts", "--out", "out"), words, capsys)


@pytest.mark.parametrize(("steps", "words"), [("0", "steps = 0 of a run of case mine, from"), ("100.5", "steps = 100.5 of"),
                                              ("'100'", "steps = '100' of"), ("float('nan')", "steps = nan of")])
def test_a_set_up_without_a_step_is_refused(steps: str, words: str, own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (own / "setup.py").write_text("from dembark.input_decks.common.setup import Setup\n\n\n"
                                  f"def setup(p):\n    return Setup(steps={steps}, time_step=1e-5)\n")
    capsys.readouterr()
    refused(("deck", "mine", "--engine", "liggghts", "--out", "out"), words, capsys)


@pytest.mark.parametrize("place", ['Path(__file__).with_name("reference") / "film.csv"',
                                   'HERE / "reference/film.csv"', 'HERE.joinpath("film.csv")'])
@pytest.mark.parametrize("content", [
    pytest.param(None, id="missing"), pytest.param(b"", id="empty"), pytest.param(b"time,x\n0,5,1\n", id="comma"),
    pytest.param(b"time,\xff\n", id="binary"), pytest.param(b"# of 12 March, evening\ntime,x\n0,1\n1\n", id="there")])
def test_a_table_that_cannot_be_read_is_reported_before_a_run(place: str, content: bytes | None, decks: Path) -> None:
    (decks / "box/measure.py").write_text("from . import curves\n")
    module, table = decks / "box/curves.py", decks / "box/reference/film.csv"
    module.write_text(f"HERE = Path(__file__).parent\nOUTPUT = run.folder / 'own.csv'\nFILM = {place}\n")
    table.parent.mkdir()
    if content is not None:
        table.write_bytes(content)
    box = folders.find("box")
    if content and content.startswith(b"#"):
        deck.require_measure(box)
        return
    with pytest.raises(DembarkError) as caught:
        deck.require_measure(box)
    assert content != b"time,x\n0,5,1\n" or "line 2, has 3 fields, the header 2" in str(caught.value)
    assert all(word in str(caught.value) for word in ("film.csv", f"{module}, line 3"))


@pytest.mark.parametrize(("table", "words"), [
    ('[variants]\n"../x" = {}', "'../x' is not a name of a folder, [variants.../x]"), ('[variants]\n"a/b" = {}', "'a/b' is not a name"),
    ('[variants]\n".hidden" = {}', "'.hidden' is not a name"), ('[variants]\n"a b" = {}', "'a b' is not a name"),
    ('[profiles]\n"../x" = {}', "'../x' is not a name of a folder, [profiles.../x]"),
    ('[studies]\n"a/b" = { title = "t", along = "restitution", variants = ["a", "b", "c"] }', "'a/b' is not a name of a folder"),
])
def test_what_cannot_be_a_folder_of_results_is_refused(table: str, words: str, own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its results would lie elsewhere, where no report looks for them."""
    with (own / "case.toml").open("a") as file:
        file.write(f"\n{table}\n")
    capsys.readouterr()
    refused(("cases", "mine"), words, capsys)


def test_a_file_with_the_mark_that_some_editors_put_first(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = own / "case.toml"
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    assert main(["cases", "mine"]) == 0 and "mine: grains settle on a floor" in capsys.readouterr().out


def test_own_decks_that_are_not_there_are_told(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("DEMBARK_DECKS", "nowhere")
    folders.load.cache_clear()
    refused(("cases",), "set it to the folder that holds the case folders", capsys)


def test_version_and_help_tell_what_a_first_user_needs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith(f"dembark {version('dembark')}")
    assert main(["--help"]) == 0
    assert "DEMBARK_CASES" in capsys.readouterr().out


@pytest.mark.parametrize(("case", "setting", "words"), [
    ("silo", "grain_diameter=1 um", "a packing may have 1e+07, take larger bodies, a smaller vessel or fewer bodies"),
    ("silo", "grain_diameter=10 nm", "fill a lattice of about"),
    ("silo", "cylinder_radius=100 m", "fill a lattice of about"),
    ("silo", "grain_count=100000000", "case silo would have 1e+08 bodies"),
    ("gravity_channel", "channel_width=1 km", "case gravity_channel would have 1.1e+07 bodies"),
    ("debarking_drum", "log_count=1000000000", "case debarking_drum would have 1e+09 bodies"),
    ("rotating_drum", "grain_diameter=0.3 um", "would have"),
])
def test_a_packing_without_end_is_refused_at_once(case: str, setting: str, words: str, tmp_path: Path,
                                                  capsys: pytest.CaptureFixture[str]) -> None:
    refused(("deck", case, "--engine", "liggghts", "--set", setting, "--out", str(tmp_path / "deck")), words, capsys)
    assert not (tmp_path / "deck").exists()
