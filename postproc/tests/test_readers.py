"""Dumps come back as they were written, and broken ones are refused in one line."""

import numpy as np
import pytest
from dumps import contacts_text, grains_text, write_times

from dembark.postproc import ContactsDump, DumpError, DumpWarning, GrainsDump, read_times

PLACES = np.array([[0.01, 0.02, 0.03], [-0.04, 0.05, 0.123456789012], [0.07, -0.08, 0.09]])
RADII = np.array([0.0025, 0.002, 0.003])


@pytest.fixture
def two_frames(tmp_path):
    path = tmp_path / "grains.dump"
    wall = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [-4.0, 0.0, 0.5]])
    box = ((0.0, 0.1), (-0.1, 0.1), (0.0, 1.0))
    text = grains_text(100, PLACES, RADII, velocities=2.0 * PLACES, walls={"side": wall, "base": 0.0 * wall}, box=box, flags="ff pp ff",
                       order=[2, 0, 1])
    path.write_text(
        text
        + grains_text(200, PLACES + 0.01, RADII, walls={"side": wall, "base": 0.0 * wall}, images=[[0, 1, 0], [0, 0, 0], [1, 0, 0]],
                      box=box, flags="ff pp ff")
    )
    return path


def test_frame_is_sorted_by_id_in_double_precision(two_frames):
    frame = GrainsDump(two_frames)[0]
    assert frame.step == 100
    assert frame.ids.tolist() == [1, 2, 3]
    np.testing.assert_allclose(frame.positions, PLACES, rtol=0, atol=1e-13)
    np.testing.assert_allclose(frame.velocities, 2.0 * PLACES, rtol=1e-11)
    assert frame.wall_forces.keys() == {"side", "base"}
    assert frame.wall_forces["side"][2].tolist() == [-4.0, 0.0, 0.5]


def test_image_flags_unwrap_periodic_axes_only(two_frames):
    frame = GrainsDump(two_frames)[1]
    np.testing.assert_allclose(frame.positions[0] - frame.wrapped[0], [0.0, 0.2, 0.0])
    np.testing.assert_allclose(frame.positions[2], frame.wrapped[2])


def test_select_keeps_wall_forces_beside_their_grains(two_frames):
    part = GrainsDump(two_frames)[0].select(np.array([False, False, True]))
    assert part.ids.tolist() == [3]
    assert part.wall_forces["side"].tolist() == [[-4.0, 0.0, 0.5]]


@pytest.mark.parametrize(("text", "message"), [("", "empty"), ("hello\n", "neither a text dump"), (None, "does not exist")])
def test_foreign_files_are_refused(tmp_path, text, message):
    path = tmp_path / "grains.dump"
    if text is not None:
        path.write_text(text)
    with pytest.raises(DumpError, match=message):
        GrainsDump(path)


def test_contacts_take_the_nearest_image(tmp_path):
    path = tmp_path / "contacts.dump"
    box = ((-1.0, 1.0), (0.0, 0.025), (-1.0, 1.0))
    path.write_text(contacts_text(5, [[0.0, 0.001, 0.0]], [[0.0, 0.024, 0.003]], [[3, 7]], [[0.0, 1.0, -2.0]], box=box, flags="ff pp ff"))
    frame = ContactsDump(path)[0]
    np.testing.assert_allclose(frame.branch, [[0.0, -0.002, 0.003]], atol=1e-15)
    assert frame.ids.tolist() == [[3, 7]]
    assert frame.forces.tolist() == [[0.0, 1.0, -2.0]]


def test_frame_without_contacts(tmp_path):
    path = tmp_path / "contacts.dump"
    path.write_text(contacts_text(5, [], [], [], []))
    assert len(ContactsDump(path)[0].forces) == 0


def test_times(tmp_path):
    write_times(tmp_path / "time.csv", {"step": [1, 2], "time": [0.1, 0.2], "kinetic_energy": [1.0, 0.5], "base_fz": [0.0, 3.0]})
    assert read_times(tmp_path / "time.csv")["base_fz"].tolist() == [0.0, 3.0]
    (tmp_path / "time.csv").write_text("step,time\n1,2\n")
    with pytest.raises(DumpError, match="header"):
        read_times(tmp_path / "time.csv")


@pytest.mark.parametrize("bounds", ["0 0", "1 0"])
@pytest.mark.parametrize(("kind", "row", "reader"), [
    ("ATOMS", "ATOMS id x y z radius mass\n1 0.1 0.2 0.3 0.01 1", GrainsDump),
    ("ENTRIES", f"ENTRIES {' '.join(f'c_contacts[{n}]' for n in range(1, 13))}\n0.9 0 0 0.1 0 0 1 2 1 0 0 1", ContactsDump)])
def test_a_periodic_box_without_a_length_is_refused(tmp_path, bounds, kind, row, reader):
    head = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF {}\n1\nITEM: BOX BOUNDS pp {} ff\n0 1\n{}\n0 1\nITEM: {}\n"
    (tmp_path / "a.dump").write_text(head.format(kind, "pp", bounds, row))
    low, high = bounds.split()
    with pytest.raises(DumpError, match=f"step 0: the box is periodic along y, but reaches from {low} to {high}"):
        reader(tmp_path / "a.dump")[0]
    # Around a plane layer, a box that is not periodic may be flat.
    (tmp_path / "a.dump").write_text(head.format(kind, "ff", bounds, row))
    assert len(reader(tmp_path / "a.dump")[0].ids) == 1


def test_contacts_that_are_listed_twice_are_reported(tmp_path):
    """Each row counts, and the stress would be twice too large."""
    path, box = tmp_path / "contacts.dump", {"box": ((0.0, 0.025), (0.0, 1.0), (0.0, 1.0)), "flags": "pp ff ff"}
    first, second = np.array([[0.001, 0, 0], [0.01, 0, 0]]), np.array([[0.003, 0, 0], [0.012, 0, 0]])
    ids, forces = [[3, 7], [3, 8]], np.eye(3)[:2]

    def read(*parts):
        path.write_text(contacts_text(5, *parts, **box))
        dump = ContactsDump(path)
        assert len(dump[0].ids) == len(parts[2])
        return dump.remarks

    assert read(first, second, ids, forces) == ()
    with pytest.warns(DumpWarning, match="the contact of grains 3 and 8 is listed twice, and counts twice"):
        assert read(np.vstack([first, second[1:]]), np.vstack([second, first[1:]]), [*ids, [8, 3]], np.vstack([forces, -forces[1:]]))
    # In a box of few grains, a pair may touch through a face, too.
    assert read([[0.001, 0, 0]] * 2, [[0.012, 0, 0], [0.015, 0, 0]], [[3, 7]] * 2, forces) == ()


def test_forces_that_seem_to_be_those_on_the_other_grain_are_reported(tmp_path):
    """Forces on grain 2, as other programs may write them, give stresses of the wrong sign."""
    path, count = tmp_path / "contacts.dump", 20
    rng = np.random.default_rng(3)
    first, branch = rng.uniform(size=(count, 3)), rng.normal(size=(count, 3))
    second, ids = first + branch, [[k, k + 100] for k in range(1, count + 1)]
    box = {"box": ((-9.0, 9.0),) * 3, "flags": "ff ff ff"}

    def read(forces, rows=count):
        path.write_text(contacts_text(5, first[:rows], second[:rows], ids[:rows], forces[:rows], **box))
        dump = ContactsDump(path)
        assert len(dump[0].ids) == rows
        return dump.remarks

    push = -rng.uniform(1.0, 2.0, (count, 1)) * branch + 0.1 * np.cross(branch, (1.0, 0.0, 0.0))  # with friction
    assert read(push) == ()
    # A filling begins with few contacts.
    text = contacts_text(4, first[:1], second[:1], ids[:1], -push[:1], **box) + contacts_text(5, first, second, ids, -push, **box)
    path.write_text(text)
    dump = ContactsDump(path)
    assert len(dump[0].ids) == 1 and dump.remarks == ()
    with pytest.warns(DumpWarning, match="from step 5 on: nearly all forces point"):
        assert len(dump[1].ids) == count
    with pytest.warns(DumpWarning, match="nearly all forces point from grain 1 to grain 2: if they are those on grain 2"):
        assert read(-push)
    # Grains that bridges pull together push as much; two may hang on one.
    assert read(np.where(np.arange(count)[:, None] % 2, push, -push)) == ()
    assert read(-push, rows=2) == ()
