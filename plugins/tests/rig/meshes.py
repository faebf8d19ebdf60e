"""Meshes that several tests share, as lists of triangles: three corners each, m. Plain Python, for scripts inside YADE too."""

import math
import random

Point = tuple[float, float, float]
Triangles = list[tuple[Point, Point, Point]]


def patch(scale: float = 1.0) -> Triangles:
    """A flat floor of irregular triangles, corners of up to eight of them, some upside down."""
    chance = random.Random(3)
    nodes = [[(0.0031 * (i + chance.uniform(-0.3, 0.3)) * scale, 0.0031 * (j + chance.uniform(-0.3, 0.3)) * scale, 0.0)
              for j in range(-3, 4)] for i in range(-3, 4)]
    found: Triangles = []
    for i in range(6):
        for j in range(6):
            a, b, c, d = nodes[i][j], nodes[i + 1][j], nodes[i + 1][j + 1], nodes[i][j + 1]
            two = ((a, b, c), (a, c, d)) if (i + j) % 2 else ((a, b, d), (c, b, d))
            found += [(c, b, a) if (i + 2 * j) % 3 == 0 else (a, b, c) for a, b, c in two]
    return found


def bent(angle: float) -> Triangles:
    """Two strips of triangles that meet at x = 0; the second rises by `angle` (rad)."""
    c, s = math.cos(angle), math.sin(angle)
    found: Triangles = []
    for j in range(-2, 2):
        y, z = 0.004 * j + 0.001, 0.004 * (j + 1) + 0.001
        left: list[Point] = [(-0.02, y, 0), (0, y, 0), (0, z, 0), (-0.02, z, 0)]
        right: list[Point] = [(0, y, 0), (0.02 * c, y, 0.02 * s), (0.02 * c, z, 0.02 * s), (0, z, 0)]
        found += [part for p, q, r, t in (left, right) for part in ((p, q, r), (p, r, t))]
    return found


def box_corner(at: Point = (0.0, 0.0, 0.0)) -> Triangles:
    """Three square walls that meet at one point."""
    def along(*axes: int) -> Point:
        x, y, z = (at[k] + 0.02 * (k in axes) for k in range(3))
        return x, y, z

    return [three for u, v in ((0, 1), (1, 2), (2, 0)) for three in ((at, along(u), along(u, v)), (at, along(u, v), along(v)))]
