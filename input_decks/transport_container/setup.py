"""Transport container: a dilute bed between two walls on a base that will move, and the steps of its output."""

from dataclasses import replace

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.motion import about_y, motion
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rectangle, rows_and_frames, time_step


def setup(p: Parameters) -> Setup:
    """The container is 0 < x < L, z > 0, with all centres at y = 0; it begins to move at the first frame. 20 rows of time.csv between
    two frames."""
    step, d, d_max = time_step(p), p.grain_diameter, packing.largest(p)
    output = rows_and_frames(step, p.settle_time, p.run_time, p.frames)
    length = p.container_length * d
    moving = motion(p, start=output["first"] * step, point=(0.5 * length, 0.0, 0.0))
    places, high = packing.slab(p, length, 0.0, margin=0.15 * d_max, foot=0.15 * d_max, rows=1)
    top, half = high + 2.0 * d_max, 2.0 * d
    # Panels of about 10 d; side walls twice as high as the bed lies in the beginning.
    along, wide, up = (length / 4.0, 0.0, 0.0), (0.0, 2.0 * half, 0.0), (0.0, 0.0, top / 4.0)
    meshes = {"base": np.vstack([rectangle((length * k / 4.0, -half, 0.0), along, wide) for k in range(4)])}
    for name, x in (("left", 0.0), ("right", length)):
        meshes[name] = np.vstack([rectangle((x, -half, top * k / 4.0), wide, up) for k in range(4)])
    corners = np.array([(x, 0.0, z) for x in (0.0, length) for z in (0.0, top)])
    middle = np.array([0.5 * length, 0.0, 0.0])
    reach = [middle + (corners - middle) @ about_y(moving, t).T + np.asarray(moving.displacement(t))
             for t in np.linspace(0.0, output["steps"] * step, 400)]
    least, most = np.min(reach, axis=(0, 1)) - 2.0 * d, np.max(reach, axis=(0, 1)) + 2.0 * d
    bodies = packing.grains(p, places, [(least[0], most[0]), (-half - d, half + d), (least[2], most[2])])
    bodies = replace(bodies, positions=bodies.positions * np.array([1.0, 0.0, 1.0]))
    numbers = {"grain_count": p.grain_count, **output, "length": length}
    return Setup(output["steps"], step, bodies, {**numbers, **contacts(p, skin=0.3)}, meshes, {"motion_words": moving.words})
