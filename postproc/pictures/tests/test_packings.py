"""Grains of a picture have the pressure that their contacts give them."""

import numpy as np

from dembark.postproc.fields.coarse_graining import WallContacts
from dembark.postproc.pictures import packings
from dembark.validation.verification import scenes


def test_pressure_in_a_grain_between_two_others():
    """A row of three, pressed with the force F: F d over three volumes in the middle one, half of that at the ends."""
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    frame = scenes.grains(place, np.full(3, 0.5), low=-np.ones(3), high=np.full(3, 3.0))
    pairs = np.array([[0, 1], [1, 2]])
    links = scenes.contacts(place[pairs[:, 0]], np.tile([1.0, 0.0, 0.0], (2, 1)), np.tile([-6.0, 0.0, 0.0], (2, 1)), pairs)
    middle = 6.0 * 1.0 / (3.0 * np.pi / 6.0)
    np.testing.assert_allclose(packings.grain_pressure(frame, links), [0.5 * middle, middle, 0.5 * middle])
    wall = WallContacts(np.array([[-0.5, 0.0, 0.0]]), place[:1], np.array([[6.0, 0.0, 0.0]]))
    np.testing.assert_allclose(packings.grain_pressure(frame, links, [wall]), [middle, middle, 0.5 * middle])
