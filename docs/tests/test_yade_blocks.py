"""YADE blocks of the documentation, all run in one process; and whether classes have the attributes that their pages name."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from blocks import PAGES, ROOT, Block, blocks, built, parameter_names

from dembark.validation import engines

# Runs each block of blocks.json in a scene of its own, in a folder of its own, and looks the attributes of classes.json up.
DRIVER = r"""
import contextlib, io, json, os, sys, traceback
from pathlib import Path
home, found = Path.cwd(), {}
for place, text in json.loads(Path("blocks.json").read_text()).items():
    O.reset()
    folder = home / place.replace("/", "_").replace(":", "_")
    folder.mkdir()
    os.chdir(folder)
    (folder / "case.toml").write_text((home / "case.toml").read_text())
    sys.argv = [str(folder / "script.py")]
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):
            exec(compile(text, place, "exec"), dict(globals()))
        found[place] = {"said": said.getvalue(), "error": ""}
    except BaseException:
        found[place] = {"said": said.getvalue(), "error": traceback.format_exc()}
os.chdir(home)
known = {}
for name, attributes in json.loads(Path("classes.json").read_text()).items():
    one = globals()[name]()
    energies = list(one.keys()) if hasattr(one, "keys") else []
    known[name] = {"missing": [attribute for attribute in attributes if not hasattr(one, attribute) and attribute not in energies],
                   "own": energies + sorted(set(one.dict()) - set(type(one).__mro__[1]().dict()))}
Path("found.json").write_text(json.dumps({"blocks": found, "classes": known}))
print("blocks: finished")
"""
# What fragments take for granted: two materials and, for the surface, a plate of facets with a sphere on it.
BEFORE = """
grain = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
wall = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
steps = 10
"""
SPHERES = """
O.bodies.append([sphere((0, 0, 0), 0.0025, material=grain), sphere((0.00499, 0, 0), 0.0025, material=grain)])
"""
PLATE = """
for corners in (((-1, -1, 0), (1, -1, 0), (1, 1, 0)), ((-1, -1, 0), (1, 1, 0), (-1, 1, 0))):
    O.bodies.append(utils.facet([(0.01 * x, 0.01 * y, 0) for x, y, _ in corners], material=grain))
O.bodies.append(sphere((0, 0, 0.00249), 0.0025, material=grain))
"""
LAW = "[Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]"
IP2 = "[Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=0.5, staticFriction=0.5, kineticFriction=0.4, criticalSlipDistance=1e-5)]"
LOOP = """
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(){bounds}]), {loop}, NewtonIntegrator(damping=0)]
O.dt = 1e-6
O.run(10, True)
"""
CASE = '[parameters.grain_count]\nvalue = 10\n'
# What complete scripts print, by the class that they show.
SAID = {"LcpImpact": "impacts: ", "EnergyAccount": "balance: True",
        "IntegrationMonitor": "velocity 0.", "SphFluid": "front: 0.",
        "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz": "bridges: 1"}
# Headings of the pages of YADE below which a table of attributes or methods stands, and pages about one class.
CLASSES = {"docs/reference/yade_lcp_impact.md": "LcpImpact", "docs/reference/yade_energy_account.md": "EnergyAccount",
           "docs/reference/yade_sph_fluid.md": "SphFluid"}
PARAMETERS = ROOT / "docs/reference/parameters.md"
PAIRS, CONTACTS = "Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys", "Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz"
# The class whose attributes a section of that page names.
SECTIONS = {"Contact": PAIRS, "Options": CONTACTS, "Liquid": PAIRS, "Carried liquid": "CapillaryLiquid", "Impacts of logs": "LcpImpact",
            "Energies": "EnergyAccount", "Fluid": "SphFluid"}
# Words in the first column of other tables: of the dict for friction, and of a body's blocked degrees of freedom.
NO_ATTRIBUTES = {"static", "kinetic", "slip", "strength", "area", "healing", "xyzXYZ", "XYZ", "zXY", "zXYZ"}


def fragment(text: str) -> str:
    """A script that uses the fragment as its page says."""
    if text.startswith(("InteractionLoop(", "SphereContactLoop(")):
        met = "O.interactions[0, 1].phys.ruptureDistance > 0" if text.startswith("I") else "O.engines[2].shortWay == 1"
        return BEFORE + SPHERES + LOOP.format(bounds=", Bo1_Wall_Aabb()", loop=text.strip()) + f"assert {met}"
    if "MatchMaker" in text:
        functor = text[text.index("Ip2_"):].strip()
        loop = f"InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [{functor}], {LAW})"
        return text + SPHERES + LOOP.format(bounds="", loop=loop) + "assert O.interactions[0, 1].phys.staticFriction == 0.5"
    if "CylinderWall" in text:
        loop = f"InteractionLoop([Ig2_CylinderWall_Sphere_ScGeom()], {IP2}, {LAW})"
        sphere = "O.bodies.append(sphere((0.02251, 0, 0), 0.0025, material=grain))\n"
        return BEFORE + text + sphere + LOOP.format(bounds=", Bo1_CylinderWall_Aabb()", loop=loop) + "assert O.interactions[0, 1].isReal"
    if "FacetSurface" in text:
        touching = "assert sum(one.isReal for one in O.interactions) == 1  # on the border of two facets"
        return BEFORE + PLATE + text + f"O.dt = 1e-6\nO.run(10, True)\n{touching}"
    if "LcpImpact(" in text and "O.engines" in text:
        log = "O.bodies.append(sphere((0, 0, 0), 0.1, material=grain))\n"
        return BEFORE + text + log + "O.dt = 1e-6\nO.run(10, True)\nassert hits.steps == 10"
    before, after = (SPHERES, "assert liquid.volume(0) == 1e-9") if "CapillaryLiquid(" in text else ("", "")
    return BEFORE + before + text + after


def classes() -> dict[str, list[str]]:
    """Of each class with a table on a page of YADE the names in the first column of its tables."""
    found: dict[str, list[str]] = {}
    for page in (page for page in PAGES if page.name.startswith("yade_")):
        name = CLASSES.get(str(page.relative_to(ROOT)), "")
        for line in page.read_text(encoding="utf-8").splitlines():
            if line.startswith("## "):
                titled = re.match(r"## (?:.*: )?`(\w+)`$", line)
                name = titled.group(1) if titled else "LogWall" if line == "## Walls" else CLASSES.get(str(page.relative_to(ROOT)), "")
            elif line.startswith("| `") and name:
                words = [word for word in re.findall(r"`(\w+)(?:\([^`]*\))?`", line.split("|")[1]) if word not in NO_ATTRIBUTES]
                found.setdefault(name, []).extend(words)
    for section, attributes in parameter_names(PARAMETERS, "YADE").items():
        found.setdefault(SECTIONS[section], []).extend(name for name in attributes if name != "none")
    return found


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What YADE said to each block and of each class, from one start."""
    yade = built("yade")
    folder = tmp_path_factory.mktemp("yade")
    scripts = {block.place: block.text for block in blocks("python yade")}
    scripts |= {block.place: fragment(block.text) for block in blocks("YADE fragment")}
    (folder / "blocks.json").write_text(json.dumps(scripts))
    (folder / "classes.json").write_text(json.dumps(classes()))
    (folder / "case.toml").write_text(CASE)
    (folder / "driver.py").write_text(DRIVER)
    done = engines.call(yade.command(Path("driver.py"), {}), folder, yade.environment(), timeout=300)
    assert "blocks: finished" in done.stdout, (done.stdout + done.stderr)[-3000:]
    return json.loads((folder / "found.json").read_text())


@pytest.mark.parametrize("block", blocks("python yade"), ids=lambda block: block.place)
def test_script(block: Block, results: dict[str, Any]) -> None:
    found = results["blocks"][block.place]
    assert not found["error"]
    assert next(line for name, line in SAID.items() if f"{name}(" in block.text) in found["said"]


@pytest.mark.parametrize("block", blocks("YADE fragment"), ids=lambda block: block.place)
def test_fragment(block: Block, results: dict[str, Any]) -> None:
    assert not results["blocks"][block.place]["error"]


def test_classes_have_the_attributes_that_their_pages_name(results: dict[str, Any]) -> None:
    assert len(results["classes"]) >= 8 and sum(map(len, classes().values())) > 70
    assert {name: one["missing"] for name, one in results["classes"].items() if one["missing"]} == {}


def test_pages_name_all_attributes_of_their_classes(results: dict[str, Any]) -> None:
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES if page == PARAMETERS or page.name.startswith("yade_"))
    untold = {name: [attribute for attribute in one["own"] if f"`{attribute}" not in text] for name, one in results["classes"].items()}
    assert {name: attributes for name, attributes in untold.items() if attributes} == {}
