"""Scripts from YADE's own source tree: unchanged they do in the overlay what they do in stock YADE, and with dembark's law they run.

The replacements are those of docs/how-to/migration.md; `LAW` stands for Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz, `IP2` for
Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys.
"""

import json
import math
import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from dembark.validation import engines

RUNNER = Path(__file__).with_name("stock_example_scenes.py")
ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.slow

LINEAR = ("Ip2_FrictMat_FrictMat_FrictPhys()", "Law2_ScGeom_FrictPhys_CundallStrack()")
MINDLIN = ("Ip2_FrictMat_FrictMat_MindlinPhys()", "Law2_ScGeom_MindlinPhys_Mindlin()")


def pair(restitution, friction):
    """The Ip2 with one coefficient of friction and no slip weakening."""
    return f"IP2(restitution={restitution}, staticFriction={friction}, kineticFriction={friction}, criticalSlipDistance=0)"


def swapped(stock, restitution, friction):
    """Replacements of a pair of stock functors without arguments."""
    return (stock[0], pair(restitution, friction)), (stock[1], "LAW()")


@dataclass(frozen=True)
class Example:
    """path : below the source tree of YADE; steps : at most; words : behind the script; ours : (what stands there, what a user writes);
    same : whether two runs of stock YADE give the same."""

    path: str
    steps: int
    ours: tuple[tuple[str, str], ...]
    words: tuple[str, ...] = ()
    same: bool = True


# The walls of the triaxial tests have no friction, and are the material 1.
_WALLED = "MatchMaker(matches=((0, 0, {0}), (0, 1, 0), (1, 1, 0)))"

EXAMPLES = {
    # No material has a Poisson's ratio of 0.6.
    "mindlin": Example("examples/test/mindlin.py", 100, (*swapped(MINDLIN, 1, "tan(radians(26))"), ("poisson=0.6", "poisson=0.3"))),
    "Damping_HM": Example("examples/test/Damping_HM.py", 2000, (
        ("Ip2_FrictMat_FrictMat_MindlinPhys(label='damping')", pair(0.128, "tan(radians(26))")),
        ("Law2_ScGeom_MindlinPhys_Mindlin(label='contactLaw')", "LAW()"), ("poisson = 0.6", "poisson = 0.3"),
        *((line, "pass") for line in ("damping.betan = 0.5", "damping.betas = 0.0", "damping.useDamping = True", "damping.betas = 0.5")))),
    "Test1": Example("examples/Benchmarks_Chung_and_Ooi/Test1.py", 20000, swapped(MINDLIN, 1, 0.35)),
    "Test3": Example("examples/Benchmarks_Chung_and_Ooi/Test3.py", 20000, (
        ("[ip2]", "[" + pair("en", 0) + "]"), ("Law2_ScGeom_MindlinPhys_Mindlin(preventGranularRatcheting=False)", "LAW()"),
        ("\t\tii.phys.kno = Kno\n", ""), ("\t\tii.phys.kso = Kso\n", "")), ("aluminium_oxide", "0.6")),
    "Test4": Example("examples/Benchmarks_Chung_and_Ooi/Test4.py", 20000, (
        ("[ip2]", "[" + pair("en", 0.092) + "]"), ("Law2_ScGeom_MindlinPhys_Mindlin(preventGranularRatcheting=False)", "LAW()"),
        ("\t\tii.phys.kno = Kno\n", ""), ("\t\tii.phys.kso = Kso\n", "")), ("aluminium_oxide", "30")),
    "triaxial tutorial": Example("examples/triax-tutorial/script-session1.py", 2000,
                                 swapped(LINEAR, 1, _WALLED.format("tan(radians(compFricDegree))"))),
    "triax-basic": Example("examples/test/triax-basic.py", 1000, swapped(LINEAR, 1, _WALLED.format("tan(radians(30))"))),
    "periodic-triax": Example("examples/PeriodicBoundaries/periodic-triax.py", 3000, swapped(LINEAR, 1, "tan(0.5)")),
    "timeStepperUsage": Example("examples/timeStepperUsage.py", 1000, swapped(LINEAR, 1, "tan(0.5)")),
    "addToClump": Example("examples/clumps/addToClump-example.py", 20000, swapped(LINEAR, 1, "tan(1)")),
    "spheresFactory": Example("examples/spheresFactory.py", 4000, (
        ("Ip2_FrictMat_FrictMat_MindlinPhys(", "IP2(staticFriction=tan(0.5), kineticFriction=tan(0.5), criticalSlipDistance=0,"),
        ("en=MatchMaker(matches", "restitution=MatchMaker(matches"),
        ("Law2_ScGeom_MindlinPhys_Mindlin(label='contactLaw')", "LAW()")), same=False),
    "capillary": Example("examples/capillaryLaplaceYoung/CapillaryPhys-example.py", 2000, (
        ("Ip2_FrictMat_FrictMat_MindlinCapillaryPhys(label='ContactModel')",
         pair(0.93, "friction")[:-1] + ", bridgeVolume=1e-14, surfaceTension=0.073, contactAngle=0)"),
        ("Law2_ScGeom_MindlinPhys_Mindlin()", "LAW(capillaryModel='exact')"),
        ("Law2_ScGeom_CapillaryPhys_Capillarity(capillaryPressure=10000),  #for hertz model only", ""),
        ("ContactModel.betan = viscous_normal", "pass"), ("ContactModel.betas = viscous_shear", "pass"),
        ("ContactModel.useDamping = True", "pass"))),
    "energy": Example("examples/test/energy.py", 3000, ()),
}


def translated(example, text):
    """The script with dembark's law; ValueError where it has not what is to be replaced."""
    for old, new in example.ours:
        if old not in text:
            raise ValueError(f"{example.path} has no '{old}'")
        text = text.replace(old, new)
    names = {"IP2(": "Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(", "LAW(": "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz("}
    for short, name in names.items():
        text = text.replace(short, name)
    return text


@pytest.fixture(scope="module")
def stock():
    """The prefix of the YADE below the overlay, and its source tree."""
    found = subprocess.run([ROOT / "packaging/yade.sh", "--where"], capture_output=True, text=True, check=False)
    if found.returncode:
        pytest.skip(found.stderr.strip())
    where = dict(re.findall(r"(\w+)=(.*)", found.stdout))
    source = Path(where["YADE_SOURCE_DIR"])
    if not (source / "examples").is_dir():
        pytest.skip(f"{source} has no examples")
    return Path(where["YADE_PREFIX"]) / "bin/yade", source


def ran(program, example, script, folder, prefix=None):
    """Numbers of a run in a new folder, and its last line of stderr."""
    folder.mkdir()
    engine = engines.find("yade")
    environment = engine.environment()
    if prefix is None:
        environment.pop("YADE_PREFIX")
    done = engines.call([program, "-j1", "-n", "-x", RUNNER, folder / "out.json", str(example.steps), script, *example.words], folder,
                        environment | {"PYTHONPATH": os.pathsep.join(filter(None, [str(RUNNER.parent)]))}, timeout=600)
    assert (folder / "out.json").exists(), (done.stdout + done.stderr)[-2000:]
    return json.loads((folder / "out.json").read_text()), done.stderr


@pytest.mark.parametrize("name", EXAMPLES)
def test_unchanged_it_is_what_stock_yade_does(name, stock, tmp_path):
    """To the last bit of all bodies, where stock YADE itself does the same twice."""
    program, source = stock
    example = EXAMPLES[name]
    script = source / example.path
    own, _ = ran(program, example, script, tmp_path / "stock")
    overlay, said = ran(engines.find("yade").executable, example, script, tmp_path / "overlay", prefix=True)
    print(name, "stock", own, "overlay", overlay)
    assert own["made"] > 0 and "dembark" not in said
    if example.same:
        assert overlay == own


@pytest.mark.parametrize("name", [name for name, example in EXAMPLES.items() if example.ours])
def test_with_the_law_of_dembark_it_runs(name, stock, tmp_path):
    _, source = stock
    example = EXAMPLES[name]
    script = tmp_path / Path(example.path).name
    script.write_text(translated(example, (source / example.path).read_text(encoding="utf-8")), encoding="utf-8")
    ours, said = ran(engines.find("yade").executable, example, script, tmp_path / "ours", prefix=True)
    print(name, "ours", ours, said)
    assert ours["made"] > 0 and math.isfinite(ours["kinetic"])
