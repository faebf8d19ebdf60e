"""Angle of repose: a dilute bed on a plate between two walls, which make way at the outlets at its sides, and a pit below."""

import math

import numpy as np

from dembark.input_decks.common import packing
from dembark.input_decks.common.setup import Parameters, Setup, contacts, rows_and_frames, strip, time_step


def setup(p: Parameters) -> Setup:
    """The plate is 0 < x < plate_width, z = 0; its side walls stand at its ends and move outwards by the outlet at the first frame. 20 rows
    of time.csv between two frames. With confinement, front and rear walls stand at y = 0 and y = thickness."""
    step, d, d_max = time_step(p), p.grain_diameter, packing.largest(p)
    output = rows_and_frames(step, p.settle_time, p.discharge_time, p.frames)
    walled = p.confinement > 0.0
    margin = 0.15 * d_max if walled else 0.0
    sites, height = packing.slab(p, p.plate_width, p.thickness - 2.0 * margin, margin=0.15 * d_max, foot=0.15 * d_max)
    # All grains fit into the pit, in heaps that rise by 0.4 towards the walls.
    pit = math.sqrt(0.4 * p.grain_count * math.pi / 6.0 * d**3 / 0.58 / p.thickness) + 4.0 * d
    top, room = height + 2.0 * d_max, p.outlet_width + 2.0 * d_max
    across = d_max if walled else 0.0
    box = [(-room, p.plate_width + room), (-across, p.thickness + across), (-pit - 2.0 * d_max, top)]
    grains = packing.grains(p, sites + np.array([0.0, margin, 0.0]), box)
    numbers = {**output, "opened": output["first"] + math.ceil(p.outlet_width / (p.gate_speed * step)),
               "walled": int(walled), "thickness": p.thickness, "pit": -pit, "middle": 0.5 * p.plate_width}
    # The plate is as thick as a grain.
    plate = np.vstack([strip((0.0, 0.0, 0.0), (p.plate_width, 0.0, 0.0), p.thickness),
                       *(strip((x, 0.0, -d), (0.0, 0.0, d), p.thickness) for x in (0.0, p.plate_width))])
    sides = {name: strip((x, 0.0, -pit - d), (0.0, 0.0, top + pit + d), p.thickness)
             for name, x in (("left", 0.0), ("right", p.plate_width))}
    return Setup(output["steps"], step, grains, {**numbers, **contacts(p, skin=0.4)}, {"plate": plate, **sides})
