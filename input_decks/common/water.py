"""Steps and numbers of a fluid of particles in the plane, and the thickness of its walls."""

import math

from .setup import Number, Parameters, Setup


def fluid_setup(p: Parameters, box: tuple[float, float, float, float], rows: int = 400, **more: Number) -> Setup:
    """A run of `run_time` (s) with `frames` frames and about `rows` rows of time.csv in the box (x, x, y, y) (m) of all particles, with
    half a spacing around it."""
    step = p.courant * p.smoothing * p.spacing / p.sound_speed
    stride = math.ceil(p.run_time / step / p.frames)
    low_x, high_x, low_y, high_y = (edge + (1 if k % 2 else -1) * 0.5 * p.spacing for k, edge in enumerate(box))
    numbers = {"stride": stride, "every": max(1, stride * p.frames // rows), "particle_mass": p.fluid_density * p.spacing**2,
               "low_x": low_x, "high_x": high_x, "low_y": low_y, "high_y": high_y}
    return Setup(stride * p.frames, step, None, {**numbers, **more})


def wall_layers(p: Parameters) -> int:
    """Layers of particles in a wall, as many as fill the support of the kernel, 2 h."""
    return math.ceil(2.0 * p.smoothing)


def full_spacings(length: float, spacing: float) -> float:
    """The length (m) as a whole number of spacings."""
    return round(length / spacing) * spacing
