"""Hard grains: events a second of elastic spheres, and the rise of a gas on a shaken plate that `drive_power` has in soft engines.

`python -m benchmarks.hard_grains speed` prints events per second of processor time with 1000, 4000 and 10 000 spheres.
`python -m benchmarks.hard_grains plate --gamma 16` prints the rise of the centre of mass (in d) with its 95 % interval, with the sizes,
masses and motion of the case's variant `gas_16`, over a bed at rest whose centre is REST high. docs/theory/hard_grains.md has the results.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np
from scipy import stats

from dembark.physics import HardGrains, HardMotion, HardWall

DIAMETER, DENSITY, GRAVITY, FREQUENCY, SIDE = 5e-3, 2500.0, 9.81, 25.0, 0.02
# Diameters: of three packings of hard grains that have come to rest.
REST = 1.762


def events_per_second(cells: int, fraction: float = 0.2, events: float = 1e6) -> float:
    """Of `cells`^3 elastic spheres at this volume fraction, per second of processor time, once they have left their lattice."""
    length = (cells**3 * np.pi / 6 / fraction)**(1 / 3)
    place = np.stack(np.meshgrid(*[np.arange(cells)] * 3), axis=-1).reshape(-1, 3) * length / cells
    gas = HardGrains(1.0, 0.5, place, np.random.default_rng(1).normal(size=place.shape), periods=[(0, length)] * 3)
    before = gas.run(3.0)
    # Some seven events a grain and unit of time.
    began = time.process_time()
    after = gas.run(events / (7.0 * cells**3))
    spent = time.process_time() - began

    def passed(motion: HardMotion) -> float:
        return float(motion.collisions[-1] + motion.report["cell_crossings"][-1] + motion.report["repeated_predictions"][-1])

    return (passed(after) - passed(before)) / spent


def rise(gamma: float, seed: int, friction: float, beta: float, contact_duration: float, periods: int = 30) -> float:
    """Mean rise (d) of 60 grains in the last `periods` of 25 more, of which the first ten are the ramp."""
    random = np.random.default_rng(seed)
    diameter = random.uniform(0.9, 1.1, 60) * DIAMETER
    place = np.array([[i, j, k] for k in range(8) for i in range(3) for j in range(3)][:60]) + 0.5
    place = place * [SIDE / 3, SIDE / 3, 6.2e-3] + random.uniform(-2e-4, 2e-4, place.shape)
    mass = DENSITY * np.pi / 6 * diameter**3
    amplitude = gamma * GRAVITY / (2 * np.pi * FREQUENCY)**2
    plate = HardWall(point=(0, 0, 0), normal=(0, 0, 1), motion=f"harmonic amplitude 0 0 {amplitude!r} frequency {FREQUENCY} ramp 10")
    gas = HardGrains(mass, diameter / 2, place, random.normal(size=place.shape) * 0.05, restitution=0.9, friction=friction,
                     tangential_restitution=beta, gravity=(0, 0, -GRAVITY), periods=[(0, SIDE), (0, SIDE), None], walls=[plate],
                     contact_duration=contact_duration)
    gas.run(25 / FREQUENCY)
    motion = gas.run(periods / FREQUENCY, samples=8 * periods)
    return float(np.average(motion.position[1:, :, 2], weights=mass, axis=1).mean() / DIAMETER - REST)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["speed", "plate"])
    parser.add_argument("--gamma", type=float, default=16.0, help="peak acceleration of the plate over gravity")
    parser.add_argument("--friction", type=float, default=0.27)
    parser.add_argument("--beta", type=float, default=0.0, help="tangential restitution")
    parser.add_argument("--contact-duration", type=float, default=1e-5, help="s")
    parser.add_argument("--packings", type=int, default=20)
    parser.add_argument("--events", type=float, default=1e6)
    given = parser.parse_args(arguments)
    if given.what == "speed":
        for cells in (10, 16, 22):
            print(f"{cells**3} spheres: {events_per_second(cells, events=given.events):.3g} events a second")
        return 0
    values = [rise(given.gamma, seed, given.friction, given.beta, given.contact_duration) for seed in range(given.packings)]
    half = stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / len(values)**0.5
    print(f"rise {np.mean(values):.3f} ± {half:.3f} d, {len(values)} packings")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
