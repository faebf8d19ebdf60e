"""Closed surfaces as rigid bodies of spheres, against closed forms."""

import math
import re
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dembark.common.errors import DembarkError
from dembark.input_decks.common import bodies
from dembark.validation import cli, engines


def cells(*places, edge=1.0):
    """Triangles of unit cells at `places`, without the faces between them."""
    found = []
    for place in places:
        for axis in range(3):
            for side in (0, 1):
                neighbour = tuple(x + (2 * side - 1) * (k == axis) for k, x in enumerate(place))
                if neighbour in places:
                    continue
                corners = []
                for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))[:: 2 * side - 1]:
                    corner = np.array(place, float)
                    corner[[axis, (axis + 1) % 3, (axis + 2) % 3]] += side, a, b
                    corners.append(corner)
                found += [corners[:3], [corners[0], *corners[2:]]]
    return edge * np.array(found)


CUBE = cells((0, 0, 0))
# Three arms: no plane of symmetry along the axes alone, and not convex.
CORNER = cells((0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 1))
TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]


def sphere(levels):
    """An icosahedron whose triangles are cut into four `levels` times, on the unit sphere."""
    golden = (1 + math.sqrt(5)) / 2
    points = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0]])
    points = np.concatenate([points, np.roll(points, 1, 1), np.roll(points, 2, 1)]) / math.hypot(1, golden)
    near = np.linalg.norm(points[:, None] - points, axis=2) < 1.2
    faces = [(a, b, c) for a in range(12) for b in range(a) for c in range(b) if near[a, b] and near[b, c] and near[a, c]]
    triangles = points[np.array(faces)]
    inward = np.linalg.det(triangles) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    for _ in range(levels):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = ((u + v) / np.linalg.norm(u + v, axis=1)[:, None] for u, v in ((a, b), (b, c), (c, a)))
        triangles = np.concatenate([np.stack(one, 1) for one in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return triangles


def of_cells(places):
    """Volume, centre and inertia of unit cells, summed up."""
    middles = np.array(places) + 0.5
    centre = middles.mean(0)
    arms = middles - centre
    return len(places), centre, len(places) / 6 * np.eye(3) + sum(a @ a * np.eye(3) - np.outer(a, a) for a in arms)


CLOSED_FORMS = {
    "cube": (CUBE, (1.0, [0.5] * 3, np.eye(3) / 6)),
    "tetrahedron": (TETRAHEDRON, (1 / 6, [0.25] * 3, np.full((3, 3), 1 / 480) + np.eye(3) * (1 / 80 - 1 / 480))),
    "corner": (CORNER, of_cells([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 1)])),
    "cavity": (np.concatenate([cells((0, 0, 0), edge=3), cells((1, 1, 1))[:, ::-1]]), (26.0, [1.5] * 3, (3**5 - 1) / 6 * np.eye(3))),
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_mass_properties_are_those_of_closed_forms(name):
    triangles, (volume, centre, inertia) = CLOSED_FORMS[name]
    found = bodies.closed(triangles, name).mass
    assert found.volume == pytest.approx(volume, rel=1e-14)
    np.testing.assert_allclose(found.centre, centre, atol=1e-14)
    np.testing.assert_allclose(found.inertia, inertia, atol=1e-13 * np.max(inertia))


def test_those_of_a_sphere_converge_with_the_square_of_the_edges():
    def errors(levels):
        found = bodies.mass_properties(sphere(levels))
        np.testing.assert_allclose(found.inertia, found.inertia[0, 0] * np.eye(3), atol=1e-12)
        return found.volume / (4 / 3 * math.pi) - 1, found.inertia[0, 0] / (8 / 15 * math.pi) - 1

    coarse, fine = errors(3), errors(4)
    assert abs(fine[0]) < 5e-3 and abs(fine[1]) < 8e-3
    np.testing.assert_allclose(np.array(coarse) / fine, 4.0, rtol=0.02)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1), st.tuples(*[st.floats(-50, 50)] * 3),
       st.floats(0.01, 100))
def test_they_turn_move_and_grow_with_the_body(turn, shift, scale):
    rotation = Rotation.from_quat(turn)
    matrix = rotation.as_matrix()
    before = bodies.mass_properties(CORNER)
    after = bodies.mass_properties(scale * (rotation.apply(CORNER.reshape(-1, 3)).reshape(-1, 3, 3) + shift))
    assert after.volume == pytest.approx(before.volume * scale**3, rel=1e-9)
    np.testing.assert_allclose(after.centre, scale * (rotation.apply(before.centre) + shift), atol=1e-10 * scale)
    np.testing.assert_allclose(after.inertia, scale**5 * matrix @ before.inertia @ matrix.T, atol=1e-9 * scale**5 * 10)


def test_principal_axes_are_turned_to_x_y_and_z():
    tilted = Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).apply(CORNER.reshape(-1, 3)).reshape(-1, 3, 3)
    found = bodies.closed(tilted, "tilted").turned().mass
    assert bodies.is_principal(found.inertia) and not bodies.is_principal(bodies.mass_properties(tilted).inertia)
    np.testing.assert_allclose(found.centre, 0, atol=1e-14)
    np.testing.assert_allclose(np.diag(found.inertia), np.linalg.eigvalsh(bodies.mass_properties(CORNER).inertia), rtol=1e-12)
    assert found.volume == pytest.approx(5.0)
    # One that is along the axes keeps its edges there, the longest along x.
    assert np.ptp(bodies.closed(CUBE, "cube").turned().points, axis=0).tolist() == [1, 1, 1]
    bar = bodies.closed(CUBE * [1, 2, 5], "bar")
    assert np.ptp(bar.turned().points, axis=0).tolist() == [5, 2, 1]
    assert bar.turned().mass.volume == pytest.approx(10.0)


def test_a_slender_body_askew_is_refused_before_it_fills_the_memory():
    corners = (CUBE * [1, 0.004, 0.004]).reshape(-1, 3)
    thin = bodies.closed(Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).apply(corners).reshape(-1, 3, 3), "thin")
    with pytest.raises(DembarkError, match="too slender for the box around it"):
        bodies.covering(thin, 10)
    assert len(bodies.covering(thin.turned(), 10).radii) == 10


def pushed(triangles, corner, by):
    """With the corner (3,) of all its triangles moved."""
    found = triangles.copy()
    found[(triangles == corner).all(-1)] += by
    return found


TURNED = CUBE.copy()
TURNED[3] = TURNED[3][::-1]
WRONG = {
    "open": (CUBE[1:], "open: 3 edges belong to one triangle"),
    "third triangle": (np.concatenate([CUBE, cells((1, 1, 0))]), "1 edges belong to more than two"),
    "one turned": (TURNED, "triangles at 3 edges are turned against their neighbours"),
    "inside out": (CUBE[:, ::-1], "inside out"),
    "part inside out": (np.concatenate([CUBE, cells((3, 0, 0))[:, ::-1]]), "inside out"),
    "full cavity": (np.concatenate([cells((0, 0, 0), edge=3), cells((1, 1, 1))]), "both normals outwards"),
    "crossing parts": (np.concatenate([CUBE, CUBE + np.array([0.5, 0.3, 0.4])]), "cuts or touches itself"),
    "through itself": (pushed(CORNER, [3, 1, 1], [-4.5, 0.4, 1.2]), "cuts or touches itself"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_encloses_nothing_is_refused_in_one_line(name):
    triangles, reason = WRONG[name]
    with pytest.raises(DembarkError) as raised:
        bodies.closed(triangles, "part.stl")
    assert reason in str(raised.value) and str(raised.value).startswith("part.stl is no closed body") and "\n" not in str(raised.value)


def write(path, triangles):
    """A binary file: corners in single precision."""
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *one.ravel(), 0) for one in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + rows)


def test_corners_of_single_precision_are_joined(tmp_path):
    tilted = Rotation.from_euler("xyz", [0.3, 0.5, 0.7]).apply(CORNER.reshape(-1, 3)).reshape(-1, 3, 3) + np.array([100, 0, 0])
    write(tmp_path / "part.stl", tilted + 1e-5 * np.random.default_rng(1).uniform(-0.5, 0.5, tilted.shape))
    found = bodies.read_body(tmp_path / "part.stl", 0.001)
    assert found.points.shape == (24, 3)
    assert found.mass.volume == pytest.approx(5e-9, rel=1e-4)


def test_voxels_of_a_cube_fill_it():
    body = bodies.closed(CUBE, "cube")
    found = bodies.voxels(body, 0.25)
    assert found.centres.shape == (64, 3) and set(found.radii) == {0.125}
    assert sorted(set(np.round(found.centres[:, 0], 12))) == [0.125, 0.375, 0.625, 0.875]
    seen = bodies.fit(body, found)
    assert seen.volume_ratio == pytest.approx(math.pi / 6, rel=5e-3) and seen.beyond < 1e-12
    # The corner of a cell is the farthest from its sphere.
    assert seen.short == pytest.approx((math.sqrt(3) - 1) * 0.125, rel=1e-9)
    # Spheres of the corner's arms only where there is a body.
    assert len(bodies.voxels(bodies.closed(CORNER, "corner"), 1.0).radii) == 5


def test_spheres_of_different_sizes_are_inscribed_and_cover_more_and_more():
    body = bodies.closed(CORNER, "corner")
    few, more = bodies.covering(body, 5), bodies.covering(body, 40)
    np.testing.assert_array_equal(more.centres[:5], few.centres)
    assert (body.distance(more.centres) + more.radii).max() < 1e-9
    seen = [bodies.fit(body, one) for one in (few, more)]
    assert seen[0].volume_ratio < seen[1].volume_ratio < 1 and seen[1].rms < 0.5 * seen[0].rms and seen[1].beyond == 0
    assert seen[1].volume_ratio > 0.75
    # The first sphere of a cube is the inscribed one, of a sphere itself.
    assert bodies.covering(bodies.closed(CUBE, "cube"), 1).radii == pytest.approx(0.5, abs=1e-12)
    assert bodies.covering(bodies.closed(sphere(3), "sphere"), 1).radii == pytest.approx(0.99, abs=0.01)


def test_the_fit_of_known_spheres():
    """One sphere of radius 0.6 in the middle of a unit cube: caps reach out of its faces."""
    cap = math.pi * 0.1**2 * (3 * 0.6 - 0.1) / 3
    seen = bodies.fit(bodies.closed(CUBE, "cube"), bodies.Spheres(np.array([[0.5, 0.5, 0.5]]), np.array([0.6])))
    assert seen.volume_ratio == pytest.approx(4 / 3 * math.pi * 0.6**3, rel=5e-3) and 6 * cap > 0.05
    assert seen.beyond == pytest.approx(0.1) and seen.short == pytest.approx(math.sqrt(0.75) - 0.6)


def test_the_command_writes_what_each_engine_takes(tmp_path, capsys):
    write(tmp_path / "my part.stl", CORNER)
    out = tmp_path / "out"
    common = ["body", str(tmp_path / "my part.stl"), "--density", "2500 kg/m^3", "--out", str(out), "--unit", "cm"]
    files = {}
    for name in engines.names():
        assert cli.main([*common, "--engine", name, "--spheres", "6", "--at", "0,0,0.5"]) == 0
        said = capsys.readouterr().out
        files[name] = {line.removeprefix("written: ") for line in said.splitlines() if line.startswith("written")}
    assert "44 triangles, closed; volume 5e-06 m3" in said and "mass 0.0125 kg" in said
    assert {name: len(found) for name, found in files.items()} == {"liggghts": 2, "yade": 1, "lammps": 3}
    rows = np.loadtxt(out / "my_part.spheres")
    assert rows.shape == (6, 4)
    template = (out / "my_part-liggghts.in").read_text()
    assert "mass 0.012" in template and "use_density" in template and f"nspheres {len(rows)}" in template
    words = (out / "my_part.infile").read_text().splitlines()[2].split()
    assert len(words) == 20 and float(words[1]) == pytest.approx(0.0125) and [float(x) for x in words[2:5]] == [0, 0, 0.5]
    tensor = 2500 * 1e-10 * of_cells([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (0, 0, 1)])[2]
    np.testing.assert_allclose(np.array(words[5:11], float), [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2],
                                                              tensor[1, 2]], rtol=1e-6)
    # The spheres' own masses add up to the body's.
    masses = (out / "my_part.mol").read_text().split("Masses\n\n")[1].split("\n\n")[0]
    assert sum(float(line.split()[1]) for line in masses.splitlines()) == pytest.approx(0.0125)
    # Without --at the centre of mass is where the file has it; numbers are plain.
    common[5] = str(out := tmp_path / "other")
    for name in engines.names():
        assert cli.main([*common, "--engine", name, "--spheres", "6"]) == 0
    centre = re.search(r"CENTRE = Vector3\((.*)\)", (out / "my_part_body.py").read_text())
    np.testing.assert_allclose(list(map(float, centre[1].split(","))), [0.011, 0.007, 0.007], rtol=1e-6)
    assert not any("np." in one.read_text() for one in out.iterdir())
    # Particles of fix sph/body need principal axes and a lattice.
    common[5] = str(out := tmp_path / "lattice")
    assert cli.main([*common, "--engine", "liggghts", "--spacing", "5 mm", "--principal"]) == 0
    assert "inertia" in (out / "my_part-sph.in").read_text()


def test_the_command_says_how_well_the_spheres_fit_and_overwrites_nothing(tmp_path, capsys):
    """Spheres on a lattice fill pi/6 of a cube."""
    write(tmp_path / "cube.stl", CUBE)
    words = ["body", str(tmp_path / "cube.stl"), "--density", "1000", "--engine", "yade", "--along", "4", "--out", str(tmp_path / "out")]
    assert cli.main(words) == 0
    said = capsys.readouterr().out
    assert 100 * math.pi / 6 == pytest.approx(float(re.search(r"volume of their union (\S+) % of the body's", said)[1]), abs=0.5)
    assert "pieces" not in said
    module = (tmp_path / "out/cube_body.py").read_text()
    assert "import cube_body\n" in module and "cube_body.add()" in module and "{" not in module.partition("MASS")[0]
    (tmp_path / "out/cube_body.py").write_text("mine")
    assert cli.main(words) == 2
    assert "cube_body.py is there already, name another folder, or another --name" in capsys.readouterr().err
    assert (tmp_path / "out/cube_body.py").read_text() == "mine"


def test_pieces_apart_from_each_other_are_noted(tmp_path, capsys):
    write(tmp_path / "two.stl", np.concatenate([cells((0, 0, 0)), cells((3, 0, 0))]))
    words = ["--density", "1000", "--engine", "yade", "--along", "8", "--out", str(tmp_path / "out")]
    assert cli.main(["body", str(tmp_path / "two.stl"), *words]) == 0
    assert "note: the surface encloses 2 pieces apart from each other, which move as one rigid body" in capsys.readouterr().out
    assert bodies.closed(CLOSED_FORMS["cavity"][0], "cavity").pieces == 1


def test_a_surface_that_is_not_there_does_not_exist(tmp_path, capsys):
    assert cli.main(["body", "absent.stl", "--density", "1", "--engine", "yade", "--along", "8", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "dembark: absent.stl does not exist\n"


@pytest.mark.parametrize(("words", "said"), [
    ([], "give one of --spheres, --along and --spacing"), (["--along", "3", "--spacing", "1mm"], "give one of"),
    (["--along", "3", "--at", "1,2"], "it is no place"), (["--along", "3", "--name", "3d"], "no name for scripts"),
    (["--along", "3", "--unit", "yd"], "unit"), (["--spacing", "5 m"], "one sphere in the body"),
    (["--spacing", "1e-4"], "take a larger one"),
])
def test_wrong_words_get_one_line(tmp_path, capsys, words, said):
    write(tmp_path / "cube.stl", CUBE)
    code = cli.main(["body", str(tmp_path / "cube.stl"), "--engine", "yade", "--density", "1000", "--out", str(tmp_path), *words])
    error = capsys.readouterr().err
    assert code == 2 and said in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "cube.stl"]
