"""A campaign's file: what is right is read as it is meant, and each mistake gets one line that says where it is and what would be right."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness import decks, stand_in  # noqa: F401

from dembark.validation.campaigns.expand import points
from dembark.validation.campaigns.spec import locate, read
from dembark.validation.cli import main

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

RIGHT = """
[campaign]
name = "boxes"
description = "Boxes of all sizes."
profile = "quick"
engines = ["liggghts"]
replicas = 2

[[sweeps]]
case = "box"
variant = "wet"
grid = { grain_diameter = ["4 mm", 0.005], grain_count = [10, 20] }
fixed = { contact_angle = "20 deg" }

[[sweeps]]
case = "box"
name = "pairs"
profile = "standard"
engines = ["yade", "liggghts"]
replicas = 3
list = [ { static_friction = 0.5, kinetic_friction = 0.4 }, { static_friction = 0.6, kinetic_friction = 0.6 } ]

[sweeps.resources.yade]
threads = 4

[resources]
memory = "500 MB"

[resources.liggghts]
ranks = 2
time = "2 h 30 min"
restart_interval = "10 min"

[resources.measure]
memory = "2 GiB"
"""


@pytest.fixture
def write(tmp_path: Path):
    """`write(text)`: a campaign file with it."""
    def put(text: str) -> Path:
        path = tmp_path / "campaign.toml"
        path.write_text(text)
        return path
    return put


def test_a_right_file_is_read_as_it_is_meant(write) -> None:
    spec = read(write(RIGHT))
    first, second = spec.sweeps
    assert (spec.name, spec.retries, spec.measure.memory) == ("boxes", 3, 2 * 2**30)
    assert first.engines == ("liggghts",) and first.axes == ("grain_diameter", "grain_count") and first.replicas == 2
    assert [dict(row) for row in first.rows] == [{"grain_diameter": d, "grain_count": n} for d in (0.004, 0.005) for n in (10, 20)]
    assert first.fixed["contact_angle"] == pytest.approx(0.3490658503988659, rel=1e-14)
    assert second.engines == ("yade", "liggghts") and second.profile == "standard" and second.replicas == 3
    assert first.resources["liggghts"].ranks == 2 and first.resources["liggghts"].time == 9000.0
    assert first.resources["liggghts"].memory == first.resources["yade"].memory == 5e8
    assert first.resources["yade"].threads == 1 and second.resources["yade"].threads == 4 and second.resources["yade"].memory == 5e8


def test_what_the_campaign_says_of_its_sweeps_counts_where_they_do_not(write) -> None:
    shared = ('case = "box"\nvariants = ["dry", "wet"]\nfixed = { grain_count = 3 }\n'
              'derived = { kinetic_friction = "0.5 * static_friction" }\n')
    own = 'variants = ["wet"]\nfixed = { grain_count = 4 }\n'
    path = write(f"{HEAD}{shared}[[sweeps]]\ngrid = {{ static_friction = [0.4, 0.6] }}\n"
                 f"[[sweeps]]\n{own}grid = {{ static_friction = [0.45] }}\n"
                 '[[sweeps]]\nvariant = "dry"\ngrid = { static_friction = [0.5] }\n')
    first, second, third = read(path).sweeps
    assert first.case.name == "box" and (first.variants, second.variants, third.variants) == (("dry", "wet"), ("wet",), ("dry",))
    assert [one.fixed["grain_count"] for one in (first, second, third)] == [3, 4, 3]
    assert [one.resolved["kinetic_friction"] for one in points(read(path)) if one.sweep.number == 1] == [0.2, 0.3, 0.2, 0.3]


HEAD = '[campaign]\nname = "boxes"\nprofile = "quick"\n'
SWEEP = HEAD + '[[sweeps]]\ncase = "box"\n'
GRID = SWEEP + "grid = { grain_count = [10, 20] }\n"

MISTAKES = {
    "invalid TOML": (SWEEP + "grid = {\n", "line 6"),
    "no text": ("\x00", "cannot be read"),
    "unknown table": (GRID + "[resuorces]\n", "unknown key 'resuorces', [top level] of"),
    "no campaign": ('[[sweeps]]\ncase = "box"\n', "campaign is missing"),
    "unknown key": (HEAD + 'replica = 2\n[[sweeps]]\ncase = "box"\n', "unknown key 'replica', [campaign] of"),
    "name with a slash": ('[campaign]\nname = "a/b"\n[[sweeps]]\ncase = "box"\n', "'a/b' is not a name of a folder"),
    "wrong type of engines": (HEAD + 'engines = "yade"\n[[sweeps]]\ncase = "box"\n', "it must be a list"),
    "no sweeps": ("sweeps = []\n" + HEAD, "there are no sweeps"),
    "sweeps missing": (HEAD, "sweeps is missing"),
    "sweeps no tables": (HEAD.replace("[campaign]", "sweeps = [3]\n[campaign]"), "3 is not a sweep"),
    "case missing": (HEAD + "[[sweeps]]\ngrid = { grain_count = [1] }\n", "case is missing, [sweeps 1]"),
    "unknown case": (HEAD + '[[sweeps]]\ncase = "bxo"\n', "did you mean box?"),
    "unknown variant": (SWEEP + 'variant = "wett"\n', "did you mean wet?"),
    "variant and variants": (SWEEP + 'variant = "dry"\nvariants = ["wet"]\n', "give one of them"),
    "a variant twice": (SWEEP + 'variants = ["dry", "dry"]\n', "names dry twice"),
    "unknown engine": (HEAD + 'engines = ["yaed"]\n[[sweeps]]\ncase = "box"\n', "did you mean yade?"),
    "unknown profile": (GRID.replace('"quick"', '"quikc"'), "did you mean quick?"),
    "no profile": (GRID.replace('profile = "quick"\n', ""), "profile is missing, [sweeps 1]"),
    "unknown parameter": (SWEEP + "grid = { grain_cuont = [10] }\n", "did you mean grain_count or"),
    "wrong unit": (SWEEP + 'grid = { grain_diameter = ["4 kg"] }\n', "[sweeps 1.grid] of"),
    "angle without its dimension": (SWEEP + 'grid = { contact_angle = ["30 mm"] }\n', "contact_angle"),
    "out of range": (SWEEP + "grid = { grain_diameter = [0.004, -0.004] }\n", "grain_diameter = -0.004 m is out of range, it must be > 0"),
    "not whole": (SWEEP + "grid = { grain_count = [10.5] }\n", "is not a whole number"),
    "no such choice": (SWEEP + 'grid = { behaviour = ["wild"] }\n', "allowed are ok | exit"),
    "a truth value": (SWEEP + "grid = { grain_count = [true] }\n", "grain_count = True has the wrong type"),
    "not a number": (SWEEP + "grid = { grain_diameter = [nan] }\n", "grain_diameter = nan: give a finite number"),
    "decimal comma": (SWEEP + 'grid = { static_friction = ["0,15", 0.3] }\n',
                      "static_friction: '0,15' has a comma; write the decimal point: 0.15, [sweeps 1.grid] of"),
    "decimal comma in a list of several lines": (SWEEP + "grid = { static_friction = [\n0,15,\n 0.3] }\n",
                                                 "'0,15' in a list: write 0.15, or 0, 15 if these are two numbers, line 7 of"),
    "decimal comma in memory": (GRID + '[resources]\nmemory = "1,5 GB"\n', "'1,5 GB' has a comma; write the decimal point: 1.5 GB"),
    "empty grid": (SWEEP + "grid = {}\n", "the grid is empty"),
    "axis without values": (SWEEP + "grid = { grain_count = [] }\n", "grain_count = [] has no values"),
    "axis that is not a list": (SWEEP + "grid = { grain_count = 10 }\n", "write grain_count = [...]"),
    "value twice": (SWEEP + 'grid = { grain_diameter = [0.004, "4 mm"] }\n', "has the value '4 mm' twice"),
    "grid and list": (GRID + "list = [{ grain_count = 5 }]\n", "grid and list are both given"),
    "empty list": (SWEEP + "list = []\n", "list = [] has no points"),
    "point that is none": (SWEEP + "list = [3]\n", "3 is not a point"),
    "point twice": (SWEEP + "list = [{ grain_count = 5 }, { grain_count = 5 }]\n", "is that of sweeps 1.list 1 again"),
    "points with different keys": (SWEEP + "list = [{ grain_count = 5 }, { grain_diameter = 0.004 }]\n",
                                   "all must have the first one's grain_count"),
    "nothing varies": (SWEEP, "nothing varies"),
    "fixed and varied": (GRID + "fixed = { grain_count = 5 }\n", "grain_count is fixed and varies"),
    "replicas as an axis": (SWEEP + "grid = { replicas = [1, 2] }\n", "replicas is not a parameter of a sweep"),
    "negative ranks": (GRID + "[resources.liggghts]\nranks = -2\n", "ranks = -2 is out of range, [resources.liggghts] of"),
    "ranks for YADE": (GRID + "[resources.yade]\nranks = 2\n", "use threads: YADE runs in one process"),
    "memory without unit": (GRID + '[resources]\nmemory = "500"\n', "'500' is not an amount of memory"),
    "unreadable time": (GRID + '[resources]\ntime = "two hours"\n', "'two hours' is not a duration, give a positive one"),
    "restart later than the end": (GRID + '[resources]\ntime = "1 h"\nrestart_interval = "2 h"\n',
                                   "restart_interval is not shorter than time"),
    "unknown resource": (GRID + '[resources]\nmemry = "1 GB"\n', "did you mean memory?"),
    "condition broken": (SWEEP + "fixed = { static_friction = 0.5 }\ngrid = { kinetic_friction = [0.4, 0.6] }\n",
                         "point dry_kinetic_friction=0.6 of [sweeps 1] of"),
    "same run twice": (SWEEP + 'variants = ["dry", "wet"]\ngrid = { contact_angle = [0.1, 0.2] }\n',
                       "points dry_contact_angle=0.1 and wet_contact_angle=0.1 are the same run"),
    "one folder for two": (GRID + '[[sweeps]]\ncase = "box"\nfixed = { contact_angle = 0.2 }\ngrid = { grain_count = [10] }\n',
                           "[sweeps 1] and [sweeps 2]"),
    "too many": (SWEEP + f"replicas = 10001\ngrid = {{ grain_count = {list(range(1, 3))} }}\n", "a campaign may have 20000"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_gets_one_line_before_anything_starts(name: str, write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, expected = MISTAKES[name]
    assert main(["submit", str(write(text)), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and error.startswith("dembark: ")
    assert expected in error and "campaign.toml" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("words", "expected"), [
    (["nowhere.toml"], "there is no campaign 'nowhere.toml'"),
    (["sub/nowhere.toml"], "there is no file sub/nowhere.toml"),
    (["."], "is a folder"),
    (["small", "--executor", "slrum"], "--executor slrum is neither local, nor slurm, nor the file of a site"),
    (["small", "--jobs", "3"], "--jobs is for a cluster"),
    (["wide", "--cores", "2"], "needs 3 cores, there are 2"),
    (["large", "--cores", "2"], "needs 1 TB of memory"),
    (["smal"], "did you mean small?"),
])
def test_a_wrong_command_gets_one_line(words: list[str], expected: str, decks: Path, tmp_path: Path,
                                       monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (decks / "box/campaigns").mkdir()
    (decks / "box/campaigns/small.toml").write_text(GRID)
    (decks / "box/campaigns/wide.toml").write_text(GRID + "[resources]\nthreads = 3\n")
    (decks / "box/campaigns/large.toml").write_text(GRID + '[resources]\nmemory = "1000 GB"\n')
    assert main(["submit", *words, "--dry-run"]) == 2
    error = capsys.readouterr().err
    assert expected in error and error.count("\n") == 1


def test_shipped_campaigns_are_right(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DEMBARK_DECKS")
    from dembark.validation.campaigns.spec import shipped_campaigns

    assert len(shipped_campaigns()) >= 10
    for name, path in shipped_campaigns().items():
        spec = read(path)
        assert spec.name == name and spec.description and points(spec)
        assert locate(name) == path.resolve()


def test_a_name_gives_case_and_profile(write) -> None:
    named = write('[campaign]\nname = "box-quick"\n\n[[sweeps]]\nvariant = "wet"\ngrid = { grain_count = [10, 20] }\n')
    (sweep,) = read(named).sweeps
    assert (sweep.case.name, sweep.profile) == ("box", "quick")
    other = write('[campaign]\nname = "box-quick"\nprofile = "standard"\n\n[[sweeps]]\ngrid = { grain_count = [10, 20] }\n')
    assert read(other).sweeps[0].profile == "standard"
