"""A dilute column of grains of different sizes, for test scenes."""

import math


def uniform(number, seed, use):
    """A number in [0, 1) that depends on a grain's number, the seed and what it is used for."""
    x = 43758.5453 * math.sin(12.9898 * number + 78.233 * seed + use)
    return x - math.floor(x)


def dilute_column(counts, spacing, origin, count, diameter, spread, seed, jitter):
    """Rows (x, y, z, radius) in m of `count` grains on a lattice of `counts` cells, each shifted by up to `jitter` along each axis."""
    sites = [[low + (n + 0.5) * spacing for low, n in zip(origin, (i, j, k), strict=True)]
             for k in range(counts[2]) for j in range(counts[1]) for i in range(counts[0])]
    kept = [(number, site) for number, site in enumerate(sites, 1) if (number + seed) * 15485863 % len(sites) < count]
    return [(*(x + jitter * (2 * uniform(number, seed, use) - 1) for use, x in enumerate(site, 2)),
             0.5 * diameter * (1 + spread * (2 * uniform(number, seed, 1) - 1))) for number, site in kept]
