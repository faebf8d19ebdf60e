"""Grains in a box whose walls move, for scenes of all engines, and what has to come of a grain on a shaken plate. Plain Python."""

import math

from rig.meshes import Point, Triangles

RADIUS, DENSITY, MODULUS, STEP = 0.0025, 2500.0, 5e6, 1e-5
WIDTH, HEIGHT, MARGIN = 0.021, 0.03, 0.06  # m: of the box, and around it


def rectangle(corner: Point, first: Point, second: Point, parts: int = 1) -> Triangles:
    """Triangles of a parallelogram, `parts` squared times two."""
    def at(i: int, j: int) -> Point:
        x, y, z = (c + (u * i + v * j) / parts for c, u, v in zip(corner, first, second, strict=True))
        return x, y, z

    return [three for i in range(parts) for j in range(parts)
            for three in ((at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1)))]


def box() -> Triangles:
    """A floor and four walls that are open above."""
    w, h = WIDTH, HEIGHT
    x, y, z = (w, 0.0, 0.0), (0.0, w, 0.0), (0.0, 0.0, h)
    return [*rectangle((0, 0, 0), x, y), *rectangle((0, 0, 0), x, z), *rectangle((0, w, 0), x, z), *rectangle((0, 0, 0), y, z),
            *rectangle((w, 0, 0), y, z)]


def grains(count: int = 4) -> list[tuple[Point, float, Point]]:
    """Place, radius and velocity of the grains, in `count` layers of nine."""
    found = []
    for k in range(count):
        for n in range(9):
            i, j = n % 3, n // 3
            number = 9 * k + n
            shift = [2e-4 * math.sin(7.0 * number + axis) for axis in range(3)]
            place = (0.0045 + 0.006 * i + shift[0], 0.0045 + 0.006 * j + shift[1], 0.0035 + 0.0058 * k + shift[2])
            speed = (0.15 * math.sin(3.0 * number), 0.15 * math.cos(5.0 * number), -0.25)
            found.append((place, RADIUS * (1.0 - 0.1 * (number % 3)), speed))
    return found


def moving_and_resting(accelerated: bool) -> tuple[str, list[tuple[Point, float, Point]], Point]:
    """Motion of a vessel at constant velocity or acceleration, its grains, and the gravity (m/s^2) in which one at rest is the same."""
    if accelerated:
        return "uniform velocity 0 0 0 acceleration 3 -2 1.5", grains(), (-3.0, 2.0, -9.81 - 1.5)
    moved = [(place, radius, (u + 0.4, v - 0.3, w + 0.2)) for place, radius, (u, v, w) in grains()]
    return "uniform velocity 0.4 -0.3 0.2", moved, (0.0, 0.0, -9.81)


# A grain that falls on a shaken plate: amplitude (m), frequency (Hz), restitution, gap at the start (m), modulus (Pa), time step (s).
BOUNCE_AMPLITUDE, BOUNCE_FREQUENCY, BOUNCE_RESTITUTION, BOUNCE_GAP, BOUNCE_MODULUS, BOUNCE_STEP = 8.747e-4, 25.0, 0.5, 0.01, 1e8, 2e-6


def landings(count: int, gravity: float = 9.81) -> list[float]:
    """Times (s) at which a point that falls on a plate at A sin(2 pi f t) meets it. It goes with it for as long as Hertz's contact lasts,
    and leaves it with the restitution."""
    amplitude, w = BOUNCE_AMPLITUDE, 2.0 * math.pi * BOUNCE_FREQUENCY

    def gap(t: float, t0: float, z0: float, v0: float) -> float:
        s = t - t0
        return z0 + v0 * s - 0.5 * gravity * s * s - amplitude * math.sin(w * t)

    found, t0, z0, v0 = [], 0.0, BOUNCE_GAP, 0.0
    for _ in range(count):
        t = t0 + 1e-7
        while gap(t + 1e-5, t0, z0, v0) > 0.0:
            t += 1e-5
        low, high = t, t + 1e-5
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(middle, t0, z0, v0) > 0.0 else (low, middle)
        speed = amplitude * w * math.cos(w * high) - v0 + gravity * (high - t0)
        found.append(high)
        t0 = high + contact_time(speed)
        z0, v0 = amplitude * math.sin(w * t0), amplitude * w * math.cos(w * t0) + BOUNCE_RESTITUTION * speed
    return found


def contact_time(speed: float) -> float:
    """How long (s) an elastic sphere touches a plane of the same matter that it hits at `speed` (m/s), after Hertz."""
    mass, effective = 4.0 / 3.0 * math.pi * RADIUS**3 * DENSITY, BOUNCE_MODULUS / (2.0 * (1.0 - 0.3**2))
    return 2.87 * (mass**2 / (RADIUS * effective**2 * speed)) ** 0.2
