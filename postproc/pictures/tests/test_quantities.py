"""What grains are coloured by: what the dump holds, and what their contacts give them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from dumps import contacts_text, grains_text, write_times

from dembark.common.errors import DembarkError
from dembark.postproc.fields.coarse_graining import WallContacts
from dembark.postproc.pictures.quantities import grain_pressure, quantity, usual
from dembark.postproc.pictures.scenes import Album, Look
from dembark.postproc.sources import open_source
from dembark.postproc.walls import PlaneWall
from dembark.validation.verification import scenes


def test_pressure_in_a_grain_between_two_others():
    """A row of three, pressed with the force F: F d over three volumes in the middle one, half of that at the ends."""
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    frame = scenes.grains(place, np.full(3, 0.5), low=-np.ones(3), high=np.full(3, 3.0))
    pairs = np.array([[0, 1], [1, 2]])
    links = scenes.contacts(place[pairs[:, 0]], np.tile([1.0, 0.0, 0.0], (2, 1)), np.tile([-6.0, 0.0, 0.0], (2, 1)), pairs)
    middle = 6.0 * 1.0 / (3.0 * np.pi / 6.0)
    np.testing.assert_allclose(grain_pressure(frame, links), [0.5 * middle, middle, 0.5 * middle])
    wall = WallContacts(np.array([[-0.5, 0.0, 0.0]]), place[:1], np.array([[6.0, 0.0, 0.0]]))
    np.testing.assert_allclose(grain_pressure(frame, links, [wall]), [middle, middle, 0.5 * middle])


def test_the_force_of_a_wall_belongs_to_the_grain_it_touches_in_a_periodic_box():
    """The third grain lies where the first one does that has gone around once."""
    places = np.array([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5], [4.5, 0.5, 0.5]])
    frame = scenes.grains(places, np.full(3, 0.5), low=np.zeros(3), high=np.array([4.0, 4.0, 4.0]))
    frame = replace(frame, periodic=np.array([True, False, False]), wrapped=np.array([[1.5, 0.5, 0.5], [2.5, 0.5, 0.5], [0.5, 0.5, 0.5]]))
    wall = WallContacts(np.array([[0.5, 0.5, 0.0]]), frame.wrapped[2:], np.array([[0.0, 0.0, 6.0]]))
    none = scenes.contacts(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2), int))
    np.testing.assert_allclose(grain_pressure(frame, none, [wall]), [0.0, 0.0, 3.0 / (3.0 * np.pi / 6.0)])


@pytest.fixture
def frame():
    """Two grains that move, with a column of their own."""
    grains = scenes.grains(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 2.0]]), np.array([0.5, 0.25]), low=-np.ones(3), high=np.full(3, 3.0))
    return replace(grains, velocities=np.array([[3.0, 0.0, 4.0], [0.0, 0.0, -2.0]]), types=np.array([1, 2]),
                   wall_forces={"side": np.array([[0.0, 0.0, 0.0], [0.0, -7.0, 0.0]])},
                   extra={"liquid_volume": np.array([1e-9, 2e-9]), "c_wet": np.array([5.0, 6.0])})


@pytest.mark.parametrize(("name", "values", "unit"), [
    ("velocity", [5.0, 2.0], "m/s"), ("velocity:magnitude", [5.0, 2.0], "m/s"), ("velocity:z", [4.0, -2.0], "m/s"),
    ("position:z", [0.0, 2.0], "m"), ("diameter", [1.0, 0.5], "m"), ("type", [1, 2], "1"), ("id", [1, 2], "1"),
    ("force_of_side", [0.0, 7.0], "N"), ("force_of_side:y", [0.0, -7.0], "N"), ("liquid_volume", [1e-9, 2e-9], "m^3"),
    ("c_wet", [5.0, 6.0], "")])
def test_quantities_are_those_of_the_dump(frame, name, values, unit):
    found = quantity(name, frame)
    np.testing.assert_allclose(found.values, values)
    assert found.unit == unit and found.kinds == (name == "type")


def test_contacts_push_on_both_grains(frame):
    links = scenes.contacts(frame.positions[:1], np.array([[1.0, 0.0, 2.0]]), np.array([[-1.0, 5.0, -2.0]]), np.array([[0, 1]]))
    # The force (-1, 5, -2) along (1, 0, 2): 5 / sqrt 5.
    np.testing.assert_allclose(quantity("contact_force", frame, links).values, np.full(2, 5.0 / np.sqrt(5.0)))
    assert quantity("contact_count", frame, links).values.tolist() == [1.0, 1.0]


@pytest.mark.parametrize(("name", "words"), [
    ("velocty", "unknown quantity 'velocty'.*did you mean velocity"), ("velocity:w", "unknown component 'w'"),
    ("omega", "unknown quantity"), ("pressure", "needs the contacts")])
def test_other_names_are_refused_with_what_is_right(frame, name, words):
    with pytest.raises(DembarkError, match=words):
        quantity(name, frame)


def test_speed_is_usual_and_size_where_there_is_none(frame):
    assert usual(frame) == "velocity" and usual(replace(frame, velocities=None)) == "diameter"


@pytest.mark.parametrize("drawn", [True, False])
def test_a_wall_presses_where_it_is_then_drawn_or_not(tmp_path, drawn):
    """A lid that has come down by half of its height presses with 3 N on a grain of 5 mm: 3 F R / 4 pi R^3 / 3."""
    box = ((0.0, 0.1),) * 3
    places, push = np.array([[0.03, 0.05, 0.045], [0.06, 0.05, 0.02]]), np.array([[0.0, 0.0, -3.0], [0.0, 0.0, 0.0]])
    (tmp_path / "grains.dump").write_text(grains_text(100, places, np.full(2, 0.005), walls={"lid": push}, box=box))
    (tmp_path / "contacts.dump").write_text(contacts_text(100, [], [], [], [], box=box))
    lid = {"kind": "plane", "origin": [0, 0, 0.1], "normal": [0, 0, -1], "velocity": [0, 0, -1.0]}
    (tmp_path / "run.json").write_text(json.dumps({"case": "x", "time_step": 5e-4, "walls": {"lid": lid}}))
    album = Album(open_source(tmp_path), [0], Look(colour_by="pressure", walls=drawn))
    exact = 3.0 * 0.005 / (4.0 * np.pi * 0.005**3)
    assert album.sheet.colours.high * album.factor == pytest.approx(np.percentile([0.0, exact], 98.0))
    assert len(album._walls(0.05)) == drawn


LID = "solid lid" + "".join("\nfacet normal 0 0 -1\nouter loop\n" + "\n".join(f"vertex {x} {y} 0.01" for x, y in corners)
                            + "\nendloop\nendfacet" for corners in (((0, 0), (0.1, 0), (0.1, 0.1)), ((0, 0), (0.1, 0.1), (0, 0.1))))


@pytest.fixture
def pressed(tmp_path):
    """Between a floor and the mesh lid.stl that push with 3 N each, a grain of 10 mm, which rises with the lid; pressure in it, Pa."""
    def text(step, up):
        places, push = np.array([[0.05, 0.05, 0.005 + up], [0.02, 0.02, 0.08]]), np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 0.0]])
        return grains_text(step, places, np.full(2, 0.005), walls={"floor": push, "lid": -push}, box=((0.0, 0.1),) * 3)

    (tmp_path / "grains.dump").write_text(text(0, 0.0) + text(100, 0.01))
    (tmp_path / "contacts.dump").write_text("".join(contacts_text(step, [], [], [], [], box=((0.0, 0.1),) * 3) for step in (0, 100)))
    (tmp_path / "lid.stl").write_text(LID + "\nendsolid lid\n")
    motion = dict.fromkeys(("kinetic_energy", "motion_x", "motion_y", "motion_angle"), np.zeros(2)) | {"motion_z": np.array([0.0, 0.01])}
    write_times(tmp_path / "time.csv", {"step": np.array([0, 100]), "time": np.array([0.0, 0.01]), **motion})
    floor = {"kind": "plane", "velocity": [0, 0, 1.0]}
    (tmp_path / "run.json").write_text(json.dumps({"case": "x", "time_step": 1e-4, "walls": {"floor": floor}}))
    return tmp_path, 2.0 * 3.0 * 0.005 / (4.0 * np.pi * 0.005**3)


def pressures(album):
    """In the grain, in each frame."""
    return [album._quantity(*album._read(number), row).values[0] for row, number in enumerate(album.numbers)]


@pytest.mark.parametrize("drawn", [True, False])
def test_a_mesh_of_the_run_presses_where_it_is_in_each_frame(pressed, drawn):
    folder, exact = pressed
    album = Album(open_source(folder), [0, 1], Look(colour_by="pressure", walls=drawn))
    np.testing.assert_allclose(pressures(album), [exact, exact], rtol=1e-5)
    assert album.notes == [] and len(album.places) == drawn


def test_walls_without_a_known_place_are_named_and_those_of_the_user_count_once(pressed):
    folder, exact = pressed
    (folder / "lid.stl").rename(folder / "other.stl")
    source, look = open_source(folder), Look(colour_by="pressure")
    album = Album(source, [0, 1], look)
    np.testing.assert_allclose(pressures(album), [0.5 * exact] * 2, rtol=1e-5)
    assert album.notes == ["the position of the wall lid is unknown; its part of the pressure is missing, add --wall"]
    given = [PlaneWall("lid", (0.0, 0.0, 0.01), (0.0, 0.0, -1.0)), PlaneWall("floor")]
    np.testing.assert_allclose(pressures(Album(source, [0], look, given)), [exact], rtol=1e-5)
    assert Album(source, [0], Look()).notes == []


def test_one_of_several_meshes_is_not_taken_for_the_wall_of_all(pressed):
    """The forces of LIGGGHTS are those of one wall, called like its first mesh."""
    folder, exact = pressed
    (folder / "side.stl").write_text(LID.replace("0.01", "0.02") + "\nendsolid lid\n")
    album = Album(open_source(folder), [0], Look(colour_by="pressure"))
    np.testing.assert_allclose(pressures(album), [0.5 * exact], rtol=1e-5)
    assert "wall lid is unknown" in album.notes[0]
