"""Walls: where contacts fall, stresses from known loads, peaks; and the engines' own wall forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from packings import contacts_of, frame_of

from dembark.common.errors import DembarkError
from dembark.postproc import DumpError
from dembark.postproc.statistics import block_mean
from dembark.postproc.walls import CylinderWall, Inclusion, MeshWall, Motion, PlaneWall, into_box, wall_contacts
from dembark.postproc.walls.mesh import nearest, read_stl, surface_of
from dembark.postproc.walls.patches import box_patches, cylinder_patches, inclusion_patches, mesh_patches, plane_patches
from dembark.postproc.walls.peaks import Blocks, Histogram, PeakFinder
from dembark.postproc.walls.stress import wall_stress

RANDOM = np.random.default_rng(7)


def rotation(seed):
    """A random proper rotation (3, 3)."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.linalg.det(q)


def sphere_mesh(radius=1.0, rings=12):
    """Triangles of a sphere."""
    polar, angle = np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings + 1)
    grid = radius * np.stack([np.outer(np.sin(polar), np.cos(angle)), np.outer(np.sin(polar), np.sin(angle)),
                              np.outer(np.cos(polar), np.ones_like(angle))], axis=-1)
    corners = [grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]]
    triangles = np.concatenate([np.stack([corners[i] for i in pick], axis=-2).reshape(-1, 3, 3) for pick in ((0, 1, 2), (0, 2, 3))])
    sides = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    return triangles[sides > 1e-12]


def write_stl(path, triangles, binary):
    """An STL file of one solid."""
    if binary:
        rows = np.zeros(len(triangles), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
        rows["v"] = triangles
        path.write_bytes(b"solid in name only".ljust(80, b" ") + np.uint32(len(triangles)).tobytes() + rows.tobytes())
    else:
        facets = "".join("facet normal 0 0 0\n outer loop\n" + "".join(f"  vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in one) +
                         " endloop\nendfacet\n" for one in triangles)
        path.write_text(f"solid part one\n{facets}endsolid part one\n")


# --- triangles -----------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("axis", [0, 1, 2])
def test_tree_of_a_flat_mesh_and_points_far_from_it(axis):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    triangles = np.roll(corners[[[0, 1, 2], [0, 2, 3]]], axis + 1, axis=2)
    points = 50.0 * np.random.default_rng(3).normal(size=(200, 3))
    expected = np.clip(points, 0.0, 1.0)
    expected[:, axis] = 0.0
    found, _ = nearest(surface_of(triangles), points)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert nearest(surface_of(triangles), np.empty((0, 3)))[0].shape == (0, 3)


@pytest.mark.parametrize("binary", [False, True])
def test_stl_comes_back_as_it_was_written(tmp_path, binary):
    triangles = np.round(RANDOM.normal(size=(7, 3, 3)), 3)
    flat = np.zeros((1, 3, 3))
    write_stl(tmp_path / "part.stl", np.concatenate([triangles, flat]), binary)
    surface = read_stl(tmp_path / "part.stl")
    np.testing.assert_allclose(surface.triangles, triangles, atol=1e-6)
    wall = MeshWall.from_stl("side", tmp_path / "part.stl", scale=1e-3)
    np.testing.assert_allclose(wall.triangles, 1e-3 * triangles, atol=1e-9)


def test_solids_of_a_text_file_are_groups(tmp_path):
    for name, shift in (("one", 0.0), ("two", 4.0)):
        write_stl(tmp_path / name, sphere_mesh(rings=3) + shift, binary=False)
    (tmp_path / "both.stl").write_text((tmp_path / "one").read_text() + (tmp_path / "two").read_text().replace("part one", "part two"))
    patches = mesh_patches(MeshWall.from_stl("side", tmp_path / "both.stl"), "group")
    assert patches.labels == ("part one", "part two")
    np.testing.assert_allclose(patches.areas[0], patches.areas[1])
    np.testing.assert_allclose(patches.centres, [[0.0] * 3, [4.0] * 3], atol=1e-7)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("cut", [1, 20, 500])
def test_cut_off_stl_is_refused_in_one_line(tmp_path, binary, cut):
    path = tmp_path / "part.stl"
    write_stl(path, sphere_mesh(rings=4), binary)
    path.write_bytes(path.read_bytes()[:-cut] if binary or cut > 1 else path.read_bytes()[:-12])
    with pytest.raises(DumpError, match=r"part\.stl") as caught:
        read_stl(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"hello", b"solid x\nendsolid x\n"])
def test_other_files_are_no_stl(tmp_path, content):
    (tmp_path / "part.stl").write_bytes(content)
    with pytest.raises(DumpError, match="STL"):
        read_stl(tmp_path / "part.stl")
    with pytest.raises(DumpError, match="does not exist"):
        read_stl(tmp_path / "nowhere.stl")


# --- walls ---------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("seed", [0, 1, 2])
def test_uniform_stress_on_a_plane_of_any_orientation(seed):
    turn, origin = rotation(seed), RANDOM.normal(size=3)
    wall = PlaneWall("floor", tuple(origin), tuple(turn[2]))
    patches = plane_patches(wall, np.linspace(-2.0, 2.0, 5), np.linspace(-1.0, 1.0, 3))
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(-2.0, 2.0, 0.1) + 0.05, np.arange(-1.0, 1.0, 0.1) + 0.05, indexing="ij"))
    foot = wall.points(u, v)
    normal, along, across = wall.axes
    np.testing.assert_allclose(wall.axes @ wall.axes.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(across, along), normal, atol=1e-12)
    forces = np.tile(0.01 * (7.0 * normal - 2.0 * along + 3.0 * across), (len(u), 1))
    frame = frame_of(foot + 0.08 * normal, walls={"floor": forces}, low=(-9,) * 3, high=(9,) * 3)
    np.testing.assert_allclose(wall_contacts(frame, wall).points, foot, atol=1e-12)
    found = wall_stress([frame], wall, patches)
    np.testing.assert_allclose(found.mean, np.tile([7.0, -2.0, 3.0], (8, 1)), rtol=1e-9)
    np.testing.assert_allclose(found.shear, np.hypot(2.0, 3.0))
    assert found.reach == pytest.approx((0.8, 0.8))
    assert found.contacts.tolist() == [100] * 8
    assert len(box_patches(wall, frame, 1.0)) > 8


@pytest.mark.parametrize("inward", [True, False])
@pytest.mark.parametrize("seed", [3, 4])
def test_pressure_on_a_cylinder_of_any_orientation(seed, inward):
    turn, origin = rotation(seed), RANDOM.normal(size=3)
    wall = CylinderWall("side", 2.0, tuple(turn[0]), tuple(origin), inward)
    angle, height = (grid.ravel() for grid in np.meshgrid((np.arange(48) + 0.5) * np.pi / 24.0, np.arange(-2.9, 3.0, 0.2)))
    axis, outward = wall.axes[0], wall.outward(angle)
    each = 2.0 * np.pi / 24.0 * 0.2 / 1.0
    sign = -1.0 if inward else 1.0
    forces = each * (sign * 5.0 * outward + 2.0 * axis - 1.0 * np.cross(axis, outward))
    centres = wall.points(angle, height) + sign * 0.1 * outward
    found = wall_stress([frame_of(centres, walls={"side": forces})], wall, cylinder_patches(wall, 8, np.linspace(-3.0, 3.0, 4)))
    np.testing.assert_allclose(found.mean, np.tile([5.0, 2.0, -1.0], (24, 1)), rtol=1e-9)
    assert found.imbalance() < 1e-12
    np.testing.assert_allclose(found.patches.areas.sum(), 2.0 * np.pi * 2.0 * 6.0)
    np.testing.assert_allclose(wall_contacts(frame_of(centres, walls={"side": forces}), wall).points, wall.points(angle, height), atol=1e-9)


def test_pressure_on_a_mesh_is_that_of_each_triangle_and_of_the_whole():
    triangles = sphere_mesh(2.0, 8)
    wall = MeshWall("drop", triangles, np.arange(len(triangles)) % 2, ("even", "odd"))
    middle, normal = triangles.mean(axis=1), wall.axes[:, 0]
    area = mesh_patches(wall).areas
    for side in (1.0, -1.0):
        frame = frame_of(middle + side * 0.05 * normal, walls={"drop": 4.0 * side * area[:, None] * normal})
        found = wall_stress([frame], wall, mesh_patches(wall))
        np.testing.assert_allclose(found.mean, np.tile([4.0, 0.0, 0.0], (len(area), 1)), atol=1e-9)
        assert found.patches.locate(np.array([[3.0, 0.0]])).tolist() == [3]
        groups = wall_stress([frame], wall, mesh_patches(wall, "group"))
        np.testing.assert_allclose(groups.mean[:, 0], 4.0)


def test_forces_outside_the_patches_are_kept_and_told():
    wall = PlaneWall("floor")
    frame = frame_of([[0.5, 0.5, 0.1], [3.0, 0.5, 0.1]], walls={"floor": [[0.0, 0.0, 2.0], [0.0, 1.0, 5.0]]})
    found = wall_stress([frame], wall, plane_patches(wall, np.array([0.0, 1.0]), np.array([0.0, 1.0])))
    assert found.outside.tolist() == [[0.0, 1.0, 5.0]] and found.force.tolist() == [[0.0, 1.0, 7.0]]
    assert found.mean[0, 0] == pytest.approx(2.0) and found.imbalance() == 0.0


def test_moving_wall_takes_its_patches_along():
    edges, force = np.array([0.0, 1.0, 2.0]), {"floor": [[0.0, 0.0, 1.0]]}
    wall = PlaneWall("floor", (0.0, 0.0, 1.0), motion=Motion((1.0, 0.0, -0.5), since=2.0))
    frames = [frame_of([[0.5, 0.5, 1.1]], walls=force, step=0), frame_of([[3.5, 0.5, 0.1]], walls=force, step=4)]
    found = wall_stress(frames, wall, plane_patches(wall, edges, edges), time_step=1.0)
    assert found.displacements.tolist() == [[0.0, 0.0, 0.0], [2.0, 0.0, -1.0]]
    np.testing.assert_allclose(wall_contacts(frames[1], wall, 4.0).points, [[3.5, 0.5, 0.0]])
    assert found.reach == pytest.approx((1.0, 1.0))
    mesh = MeshWall("floor", np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]]), motion=Motion((0.0, 0.0, 3.0)))
    np.testing.assert_allclose(wall_contacts(frame_of([[0.5, 0.5, 6.1]], walls=force), mesh, 2.0).points, [[0.5, 0.5, 6.0]])


def test_grain_beyond_a_periodic_border_counts_on_the_other_side():
    wall = PlaneWall("floor")
    frame = frame_of([[5.5, 0.5, 0.1]], walls={"floor": [[0.0, 0.0, 1.0]]}, periodic=(True, False, False))
    np.testing.assert_allclose(into_box(frame), [[-4.5, 0.5, 0.1]])
    found = wall_stress([frame], wall, box_patches(wall, frame, 10.0))
    assert not found.outside.any()


def test_wall_that_nothing_touches_and_frames_without_grains():
    wall = CylinderWall("side", 1.0)
    frames = [frame_of(np.zeros((0, 3)), walls={"side": np.zeros((0, 3))}, step=k) for k in range(9)]
    found = wall_stress(frames, wall, cylinder_patches(wall, 4, np.array([0.0, 1.0])))
    assert not found.mean.any() and not found.half.any() and found.peak_stress.number == 0 and len(found.peak_forces) == 0
    assert np.isnan(found.contact_force.mean)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: PlaneWall("w", normal=(0.0, 0.0, 0.0)).axes, "not a direction"),
    (lambda: CylinderWall("w", -1.0), "radius"),
    (lambda: CylinderWall("w", float("nan")), "radius"),
    (lambda: MeshWall("w", np.zeros((0, 3, 3))), "triangles"),
    (lambda: Inclusion("w", ()), "at least one"),
    (lambda: Inclusion("w", (1,), "cube"), "cube"),
    (lambda: plane_patches(PlaneWall("w"), np.array([1.0, 0.0]), np.array([0.0, 1.0])), "rising"),
    (lambda: cylinder_patches(CylinderWall("w", 1.0), 0, np.array([0.0, 1.0])), "at least one"),
    (lambda: wall_stress([], PlaneWall("w"), plane_patches(PlaneWall("w"), np.arange(2), np.arange(2))), "no frame"),
])
def test_mistakes_get_one_line(make, words):
    with pytest.raises(DembarkError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_unknown_wall_names_those_that_are_there():
    with pytest.raises(DumpError, match="side"):
        wall_contacts(frame_of([[0.0, 0.0, 0.0]], walls={"side": np.zeros((1, 3))}), PlaneWall("base"))


# --- inclusions ----------------------------------------------------------------------------------------------------------

def loaded_sphere(count=4000, radius=1.0, small=0.02):
    """A large grain (id 1) with `count` small ones around it, and the directions to those."""
    k = np.arange(count) + 0.5
    polar, angle = np.arccos(1.0 - 2.0 * k / count), np.pi * (1.0 + np.sqrt(5.0)) * k
    away = np.column_stack([np.cos(angle) * np.sin(polar), np.sin(angle) * np.sin(polar), np.cos(polar)])
    positions = np.concatenate([np.zeros((1, 3)), (radius + small) * away])
    return frame_of(positions, np.r_[radius, np.full(count, small)]), away


@pytest.mark.parametrize("swap", [False, True])
def test_hydrostatic_pressure_on_a_grain(swap):
    frame, away = loaded_sphere()
    count = len(away)
    on_inclusion = -3.0 * 4.0 * np.pi / count * away
    big, others = np.ones(count, int), np.arange(2, count + 2)
    contacts = contacts_of(frame, others, big, -on_inclusion) if swap else contacts_of(frame, big, others, on_inclusion)
    inclusion = Inclusion("stone", (1,))
    patches = inclusion_patches(inclusion, inclusion.size(frame), 4, 4)
    np.testing.assert_allclose(patches.areas, 4.0 * np.pi / 16.0)
    found = wall_stress([frame], inclusion, patches, contacts=[contacts])
    np.testing.assert_allclose(found.mean[:, 0], 3.0, rtol=0.01)
    np.testing.assert_allclose(found.mean[:, 1:], 0.0, atol=1e-9)
    assert found.normal_force[0] == pytest.approx(12.0 * np.pi)


def test_force_on_an_inclusion_by_height_and_its_sign():
    # Two glued grains; one neighbour next to the upper one pushes it along -x, one below pushes it up.
    positions = [[0.0, 0.0, 0.5], [0.0, 0.0, -0.5], [1.0, 0.0, 0.5], [0.0, 0.0, -1.5]]
    frame = frame_of(positions, 0.5, ids=[3, 5, 8, 9])
    contacts = contacts_of(frame, [3, 9, 3], [8, 5, 5], np.array([[-4.0, 0.0, 1.0], [0.0, 0.0, -2.0], [9.0, 9.0, 9.0]]))
    body = Inclusion("body", (3, 5), "cylinder")
    assert body.size(frame) == pytest.approx(0.5)
    places, forces = body.loads(frame, contacts)
    np.testing.assert_allclose(places.points, [[0.5, 0.0, 0.5], [0.0, 0.0, -1.0]], atol=1e-12)
    np.testing.assert_allclose(forces, [[4.0, 0.0, -1.0], [0.0, 0.0, -2.0]])
    found = wall_stress([frame], body, inclusion_patches(body, 0.5, 1, np.array([-1.0, 0.0, 1.0])), contacts=[contacts])
    np.testing.assert_allclose(found.mean[1] * np.pi, [4.0, -1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found.force, [[4.0, 0.0, -3.0]])


@pytest.mark.parametrize("shift", [0.0, 1.4, 2.5])
def test_an_inclusion_across_a_periodic_face_is_one_body(shift):
    """Two glued grains that others push from both sides, in a dump without image flags."""
    places = np.array([[1.0, 0.0, 0.5], [2.0, 0.0, 0.5], [0.0, 0.0, 0.5], [3.0, 0.0, 0.5]]) + np.array([shift, 0.0, 0.0])
    places[:, 0] %= 4.0
    frame = replace(frame_of(places, 0.5, ids=[1, 2, 3, 4]), low=np.array([0.0, -1.0, 0.0]), high=np.array([4.0, 1.0, 1.0]),
                    periodic=np.array([True, False, False]), unwrapped=False)
    contacts = contacts_of(frame, [1, 2], [3, 4], np.array([[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]))
    contacts = replace(contacts, branch=np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    body = Inclusion("body", (1, 2))
    assert body.size(frame) == pytest.approx(1.0)
    points, forces = body.loads(frame, contacts)
    np.testing.assert_allclose(points.points, [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], atol=1e-12)
    assert (np.sum(forces * points.points, axis=1) > 0.0).all()
    # A body as long as the period stays as it is.
    row = replace(frame, positions=np.array([[0.5, 0.0, 0.5], [1.5, 0.0, 0.5], [2.5, 0.0, 0.5], [3.5, 0.0, 0.5]]))
    np.testing.assert_allclose(Inclusion("row", (1, 2, 3, 4)).members(row)[1][:, 0], [-1.5, -0.5, 0.5, 1.5])


def test_inclusion_without_its_contacts_or_grains_is_refused():
    frame, _ = loaded_sphere(5)
    inclusion = Inclusion("stone", (1,))
    patches = box_patches(inclusion, frame, 0.5)
    with pytest.raises(DumpError, match="contacts"):
        wall_stress([frame], inclusion, patches)
    with pytest.raises(DumpError, match="grain 77"):
        Inclusion("stone", (1, 77)).members(frame)


# --- statistics ----------------------------------------------------------------------------------------------------------

@given(st.lists(st.integers(0, 4), min_size=1, max_size=40))
def test_peaks_are_the_local_maxima(values):
    finder, found = PeakFinder((1,)), []
    for value in values:
        before, peak = finder.feed(np.array([float(value)]))
        found += before[peak].tolist()
    runs = [value for number, value in enumerate(values) if number == 0 or value != values[number - 1]]
    assert found == [float(b) for a, b, c in zip(runs, runs[1:], runs[2:], strict=False) if a < b > c]


@settings(max_examples=40)
@example([[5e-324], [1e6]])
@given(st.lists(st.lists(st.floats(-1e3, 1e6), max_size=20), max_size=6))
def test_histogram_counts_like_one_that_knows_the_range(parts):
    histogram = Histogram(8)
    for part in parts:
        histogram.add(np.array(part))
    values = np.array([value for part in parts for value in part])
    assert histogram.number == len(values) and histogram.below == (values <= 0.0).sum()
    if (values > 0.0).any():
        np.testing.assert_array_equal(histogram.counts, np.histogram(values[values > 0.0], histogram.edges)[0])
        assert (histogram.density() * histogram.width).sum() == pytest.approx(1.0)
        assert histogram.quantile(1.0) == pytest.approx(values.max())
        assert histogram.mean == pytest.approx(values.mean(), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("count", [1, 7, 8, 100, 128, 1000])
def test_blocks_have_the_interval_of_their_means(count):
    values = np.random.default_rng(count).normal(size=(count, 3, 2))
    blocks = Blocks()
    for value in values:
        blocks.add(value)
    length = max(1, 2 ** int(np.log2(max(1, count // 64))))
    assert blocks.count == count // length
    means = values[: blocks.count * length].reshape(blocks.count, length, 3, 2).mean(axis=1)
    due = [[block_mean(means[:, one, other]).half for other in range(2)] for one in range(3)]
    np.testing.assert_allclose(blocks.half((3, 2)), due)


def test_series_gives_the_mean_the_deviation_and_the_peaks():
    load = np.abs(np.random.default_rng(5).normal(size=(40, 6)))
    wall, place = PlaneWall("floor"), np.column_stack([np.arange(6) + 0.5, np.full(6, 0.5), np.full(6, 0.1)])
    frames = [frame_of(place, walls={"floor": row[:, None] * [0.0, 0.5, 2.0]}, step=10 * k) for k, row in enumerate(load)]
    found = wall_stress(frames, wall, plane_patches(wall, np.arange(7.0), np.array([0.0, 1.0])), time_step=0.1)
    np.testing.assert_allclose(found.series[:, :, 0], 2.0 * load)
    np.testing.assert_allclose(found.mean[:, 0], 2.0 * load.mean(axis=0))
    np.testing.assert_allclose(found.deviation[:, 1], 0.5 * load.std(axis=0))
    total = 2.0 * load.sum(axis=1)
    tops = [k for k in range(1, 39) if total[k - 1] < total[k] > total[k + 1]]
    np.testing.assert_allclose(found.peak_forces, total[tops])
    np.testing.assert_allclose(found.peak_times, np.array(tops))
    assert found.peak_stress.number == sum(
        load[k - 1, p] < load[k, p] > load[k + 1, p] for k in range(1, 39) for p in range(6))
    bare = wall_stress(iter(frames), wall, found.patches, keep_series=False)
    assert bare.series is None
    np.testing.assert_array_equal(bare.mean, found.mean)
