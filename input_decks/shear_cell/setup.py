"""Shear cell: a layer between two plates, the speed of the upper one, and the steps of the loads and of the output."""

import math

from dembark.input_decks.common.plates import dense_height, layer
from dembark.input_decks.common.setup import Parameters, Setup, contacts, time_step

# Under how many loads the layer is sheared; rows of time.csv between two frames.
LOADS, ROWS = 3, 100


def setup(p: Parameters) -> Setup:
    """After the plate has come down the layer is sheared by `run_in` once more, before the first load is measured."""
    step, height = time_step(p), dense_height(p)
    speed = p.inertial_number * math.sqrt(p.normal_stress / p.grain_density) * height / p.grain_diameter
    sheared, each, strained = layer(p, speed), p.frames // LOADS, height / speed / step
    stride = ROWS * math.ceil((p.run_in + p.strain) * strained / (ROWS * each))
    start, load_steps = math.ceil(sheared.fall / step + p.run_in * strained), stride * each
    output = {"first": start + stride, "stride": stride, "every": stride // ROWS, "steps": start + LOADS * load_steps}
    loads = {"load_steps": load_steps, "second_load": start + load_steps, "third_load": start + 2 * load_steps}
    return Setup(output["steps"], step, sheared.packing, {**output, **loads, **sheared.numbers, **contacts(p, skin=0.3)})
