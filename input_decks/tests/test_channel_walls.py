"""What is measured of a channel knows the grains of its walls."""

import numpy as np

from dembark.input_decks.plug_flow.channel import free_grains
from dembark.postproc.tests.scenes import contacts_of, frame_of


def test_grains_glued_to_a_wall_are_the_wall():
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    frame = frame_of(place, 0.5)
    frame.types[0] = 2
    links = contacts_of(frame, [1, 2], [2, 3], [[-3.0, 0.0, 0.0], [-2.0, 0.0, 0.0]])
    free, kept, (wall,) = free_grains(frame, links)
    assert free.ids.tolist() == [2, 3] and kept.ids.tolist() == [[2, 3]]
    np.testing.assert_allclose(wall.points, [[0.5, 0.0, 0.0]])
    np.testing.assert_allclose(wall.positions, [[1.0, 0.0, 0.0]])
    np.testing.assert_allclose(wall.forces, [[3.0, 0.0, 0.0]])
