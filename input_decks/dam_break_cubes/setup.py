"""Dam break against cubes: a column that ends at x = 0, a flume around y = 0, and cubes that stand on its floor, z = 0."""

import math

from dembark.input_decks.common.setup import Parameters, Setup


def cubes(p: Parameters) -> list[tuple[float, float, float]]:
    """Centres (m), the top one last."""
    x, half = p.distance + 0.5 * p.edge, 0.5 * p.edge
    rows = {"one": (1,), "three": (1, 1, 1), "six": (3, 2, 1)}[p.arrangement]
    pitch = p.edge + p.gap
    return [(x, (k - 0.5 * (count - 1)) * pitch, half + layer * p.edge) for layer, count in enumerate(rows) for k in range(count)]


def setup(p: Parameters) -> Setup:
    """Steps of the fluid; frames and rows at whole numbers of them."""
    step = p.courant * p.smoothing * p.spacing / p.sound_speed
    every = math.ceil(p.run_time / step / p.frames / p.rows)
    stride = every * p.rows
    places = cubes(p)
    numbers = {name: getattr(p, name) for name in ("sound_speed", "cube_mass", "cube_inertia", "particle_mass", "grain_count")}
    return Setup(stride * p.frames, step, None, {**numbers, "stride": stride, "every": every, "cube_count": len(places)},
                 tables={f"cube_{axis}": tuple(place[k] for place in places) for k, axis in enumerate("xyz")})
