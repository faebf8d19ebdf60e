"""fix mesh/surface under our contact models: whatever a file has twice or leaves open, the floor is the same."""

import numpy as np
import pytest
from rig import floors, input_script
from rig.liggghts_driver import read_dump, run_deck


def properties() -> str:
    pair = {"coefficientRestitution": 1.0, "staticFriction": 0.5, "kineticFriction": 0.4, "criticalSlipDistance": 1e-5}
    lines = ["youngsModulus peratomtype 5e6 5e6", "poissonsRatio peratomtype 0.3 0.3"]
    lines += [f"{name} peratomtypepair 2 {value} {value} {value} {value}" for name, value in pair.items()]
    return "\n".join(f"fix p{n} all property/global {line}" for n, line in enumerate(lines))


def deck(wall: str, number: int = 0) -> str:
    lines = []
    for n, (start, velocity) in enumerate(floors.PATHS, start=1):
        lines.append(f"create_atoms 1 single {start[0]} {start[1]} {floors.HEIGHT} units box\ngroup g{n} id {n}\n"
                     f"fix m{n} g{n} move linear {velocity[0]} {velocity[1]} 0 units box")
    return f"""\
{input_script.head("granular", "communicate single vel yes", "off", "f f f")}
region domain block -0.03 0.03 -0.03 0.03 -0.03 0.03 units box
create_box 2 domain
neighbor 0.002 bin
neigh_modify delay 0
{chr(10).join(lines)}
set group all density 2500 diameter {2 * floors.RADIUS}
{properties()}
pair_style gran model hertz tangential finnie_rabinowicz
pair_coeff * *
timestep {floors.STEP}
{wall}
dump grains all custom 5 {number}.dump id fx fy fz
dump_modify grains sort id format "%d %.17g %.17g %.17g"
thermo 1000
run {floors.STEPS}
"""


def on_mesh(file: str, more: str = "") -> str:
    return (f"fix stl all mesh/surface file {file} type 2 {more}\n"
            "fix wall all wall/gran model hertz tangential finnie_rabinowicz mesh n_meshes 1 meshes stl")


PLANE = "fix wall all wall/gran model hertz tangential finnie_rabinowicz primitive type 2 zplane 0"


def test_every_file_of_a_floor_is_the_floor(tmp_path):
    files = {**floors.files(), "plane": b""}
    decks = []
    for number, (name, content) in enumerate(files.items()):
        (tmp_path / f"{number}.stl").write_bytes(content)
        decks.append(deck(PLANE if name == "plane" else on_mesh(f"{number}.stl"), number))
    done = run_deck(tmp_path, "clear\n".join(decks))
    assert done.code == 0 and not done.error, done.error or done.output[-2000:]
    forces = {name: np.array(read_dump(tmp_path / f"{number}.dump")[1])[..., 1:] for number, name in enumerate(files)}
    assert forces["plane"][..., 2] == pytest.approx(5.7917e-3, rel=1e-4)
    for name, force in forces.items():
        assert np.abs(force - forces["plane"]).max() < 2e-3 * forces["plane"].max(), name
        if "um" not in name:
            assert np.abs(force - forces["plane"]).max() < 3e-5 * forces["plane"].max(), name
    assert "left out 2 triangles without area and 0 given again" in done.output


@pytest.mark.parametrize("line", floors.refused())
def test_other_files_are_refused_in_one_line(tmp_path, line):
    (tmp_path / "0.stl").write_bytes(floors.refused()[line])
    done = run_deck(tmp_path, deck(on_mesh("0.stl")))
    assert done.code != 0 and "file '0.stl'" in done.error and line in done.error, done.output[-500:]


def test_an_exclusion_list_names_the_lines_of_the_file(tmp_path):
    """As the stock reader: by the lines on which facets begin."""
    (tmp_path / "0.stl").write_bytes(floors.files()["plain"])
    (tmp_path / "out.txt").write_text("2\n9\n")
    done = run_deck(tmp_path, deck(on_mesh("0.stl", "element_exclusion_list read out.txt")))
    assert done.code == 0 and "containing 2 triangle(s)" in done.output, done.error or done.output[-1500:]
