"""Dam break against cubes: a column that ends at x = 0, a flume around y = 0, and cubes that stand on its floor, z = 0."""

import math

import numpy as np

from dembark.input_decks.common.packing import uniform
from dembark.input_decks.common.setup import Parameters, Setup
from dembark.input_decks.common.water import wall_layers


def cubes(p: Parameters) -> list[tuple[float, float, float]]:
    """Centres (m), the top one last, each displaced in its layer by up to `cube_noise` an axis, by the seed."""
    x, half = p.distance + 0.5 * p.edge, 0.5 * p.edge
    rows = {"one": (1,), "three": (1, 1, 1), "six": (3, 2, 1)}[p.arrangement]
    pitch = p.edge + p.gap
    places = [(x, (k - 0.5 * (count - 1)) * pitch, half + layer * p.edge) for layer, count in enumerate(rows) for k in range(count)]
    numbers = np.arange(1, len(places) + 1)
    noise = np.column_stack([p.cube_noise * (2.0 * uniform(numbers, p.seed, use) - 1.0) for use in (1, 2)])
    return [(a + float(da), b + float(db), c) for (a, b, c), (da, db) in zip(places, noise, strict=True)]


def prime(seed: int) -> int:
    """A prime above 10 000, which LIGGGHTS's random numbers want, another one for each seed."""
    number = 10007 + 1000 * seed
    while any(number % k == 0 for k in range(2, math.isqrt(number) + 1)):
        number += 1
    return number


def setup(p: Parameters) -> Setup:
    """Steps of the fluid; frames and rows at whole numbers of them."""
    step = p.courant * p.smoothing * p.spacing / p.sound_speed
    every = math.ceil(p.run_time / step / p.frames / p.rows)
    stride = every * p.rows
    places = cubes(p)
    numbers = {name: getattr(p, name) for name in ("sound_speed", "cube_mass", "cube_inertia", "particle_mass", "sphere_radius",
                                                   "grain_count")}
    made = {"stride": stride, "every": every, "cube_count": len(places), "layers": wall_layers(p), "prime_seed": prime(p.seed)}
    return Setup(stride * p.frames, step, None, {**numbers, **made},
                 tables={f"cube_{axis}": tuple(place[k] for place in places) for k, axis in enumerate("xyz")})
