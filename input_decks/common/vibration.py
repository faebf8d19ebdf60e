"""What the set-ups of vibrated runs share: a step that suits the impacts, and output at fixed phases of the drive."""

import math

from dembark.common.errors import DembarkError

from .motion import amplitude
from .setup import Parameters, time_step

# Frames a period.
PHASES = 8
# How far grains may give way in an impact at the highest speed of the wall, over d; steps that such an impact has to last.
DEEPEST, SHORTEST = 0.02, 25
# Samples of the grains on a part in an impact at that speed.
SAMPLES = 12


def highest_speed(p: Parameters) -> float:
    """A omega (m/s) of a harmonic or circular motion."""
    return 2.0 * math.pi * p.motion_frequency * amplitude(p)


def impact(p: Parameters, speed: float) -> tuple[float, float]:
    """Overlap (m) and duration (s) of the impact of two mean grains at `speed` (m/s): Hertz, without damping. delta^(5/2) = 15 m* v^2 / (16
    E* sqrt(R*)), T = 2.9433 delta / v; K. L. Johnson, Contact Mechanics (1985) section 11.4."""
    radius = 0.5 * p.grain_diameter
    mass = 0.5 * p.grain_density * 4.0 / 3.0 * math.pi * radius**3
    modulus = 0.5 * p.youngs_modulus / (1.0 - p.poisson_ratio**2)
    depth = (15.0 * mass * speed**2 / (16.0 * modulus * math.sqrt(0.5 * radius))) ** 0.4
    return depth, 2.9433 * depth / speed


def suitable_step(p: Parameters, speed: float) -> float:
    """Time step (s) by `time_step_fraction`; DembarkError when grains are too soft, or it is too long, for impacts at `speed` (m/s)."""
    depth, lasts = impact(p, speed)
    if depth > DEEPEST * p.grain_diameter:
        raise DembarkError(f"an impact at the wall's highest speed, {speed:.3g} m/s, has an overlap of {depth / p.grain_diameter:.3g} d",
                           f"raise youngs_modulus until it is below {DEEPEST} d")
    if lasts < SHORTEST * time_step(p):
        raise DembarkError(f"an impact at the wall's highest speed, {speed:.3g} m/s, lasts {lasts / time_step(p):.3g} steps",
                           f"lower time_step_fraction until it lasts {SHORTEST}")
    return time_step(p)


def sample_stride(p: Parameters, speed: float, step: float) -> int:
    """Steps of `step` (s) from one sample of the grains on a part to the next: twelve in an impact at `speed` (m/s)."""
    _, lasts = impact(p, speed)
    return max(1, int(lasts / (SAMPLES * step)))


def fixed_phases(frequency: float, time_step: float, start: float, periods: int, rows: int = 16) -> tuple[float, dict[str, int]]:
    """Time step (s), at most `time_step`, of which a whole number makes a period of the drive with `frequency` (Hz); and output steps.
    Frames from the end of period `start` (rounded up) on to the end of `periods` more, eight a period and the first one; `rows`
    rows of time.csv from one frame to the next, over the run. `period_steps` are the steps of a period."""
    every = math.ceil(1.0 / (frequency * time_step * PHASES * rows))
    stride = every * rows
    period, begun = stride * PHASES, math.ceil(start)
    return 1.0 / (frequency * period), {"period_steps": period, "first": begun * period, "stride": stride,
                                        "steps": (begun + periods) * period, "every": every}
