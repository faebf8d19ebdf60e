"""Hard grains: events a second of elastic spheres, and a gas on a shaken plate that `drive_power` has in soft engines.

`python -m benchmarks.hard_grains speed` prints events per second of processor time with 1000, 4000 and 10 000 spheres.
`python -m benchmarks.hard_grains plate --gamma 16` prints the rise of the centre of mass (in d) with its 95 % interval, with the sizes,
masses and motion of the case's variant `gas_16`, over a bed at rest whose centre is REST high.
`python -m benchmarks.hard_grains map` compares height, its spectrum, and power with those of the campaign `drive_power-standard`.
docs/theory/hard_grains.md has the results.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from dembark.input_decks.drive_power.drive import spectrum
from dembark.input_decks.drive_power.measure import SPECTRUM
from dembark.physics import HardGrains, HardMotion, HardWall

DIAMETER, DENSITY, GRAVITY, FREQUENCY, SIDE = 5e-3, 2500.0, 9.81, 25.0, 0.02
# Diameters: of three packings of hard grains that have come to rest.
REST = 1.762
# Of a period.
SAMPLES = 16
QUANTITIES = ("height", "force_power", *SPECTRUM)


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


def shaken(gamma: float, seed: int, *, count: int = 60, restitution: float = 0.9, friction: float = 0.27, beta: float = 0.0,
           contact_duration: float = 1e-5, periods: int = 30) -> tuple[float, ...]:
    """Of `count` grains in the last `periods` of 25 more, of which the first ten are the ramp: mean height (d) of the centre of mass over
    the middle of the plate, power of the plate over M g V, and the `spectrum` (d) of that height."""
    random = np.random.default_rng(seed)
    diameter = random.uniform(0.9, 1.1, count) * DIAMETER
    place = np.array([[i, j, k] for k in range(-(-count // 9)) for i in range(3) for j in range(3)][:count]) + 0.5
    place = place * [SIDE / 3, SIDE / 3, 6.2e-3] + random.uniform(-2e-4, 2e-4, place.shape)
    mass = DENSITY * np.pi / 6 * diameter**3
    amplitude = gamma * GRAVITY / (2 * np.pi * FREQUENCY)**2
    plate = HardWall(point=(0, 0, 0), normal=(0, 0, 1), motion=f"harmonic amplitude 0 0 {amplitude!r} frequency {FREQUENCY} ramp 10")
    gas = HardGrains(mass, diameter / 2, place, random.normal(size=place.shape) * 0.05, restitution=restitution, friction=friction,
                     tangential_restitution=beta, gravity=(0, 0, -GRAVITY), periods=[(0, SIDE), (0, SIDE), None], walls=[plate],
                     contact_duration=contact_duration)
    gas.run(25 / FREQUENCY)
    motion = gas.run(periods / FREQUENCY, samples=SAMPLES * periods)
    heights = np.average(motion.position[1:, :, 2], weights=mass, axis=1).reshape(periods, SAMPLES) / DIAMETER
    speed = amplitude * 2 * np.pi * FREQUENCY
    power = float(np.diff(motion.wall_work[[0, -1], 0])[0] / (mass.sum() * GRAVITY * speed * periods / FREQUENCY))
    return float(heights.mean()), power, *spectrum(heights)


def compared(folder: Path, packings: int, law: Mapping[str, Any]) -> Iterator[str]:
    """Rows of a table: the points of the campaign `drive_power-standard` in `folder`, in a soft engine, and the same gas of hard grains."""
    for path in sorted(folder.glob("drive_power/*/*/metrics.json")):
        found = json.loads(path.read_text())
        p, soft = found["parameters"], {one["name"]: one for one in found["quantities"]}
        if (p["cell_width"], p["cell_depth"]) != (SIDE, SIDE):
            raise SystemExit(f"{path}: the cell is {p['cell_width']} m wide and {p['cell_depth']} m deep, not {SIDE} m")
        hard = np.array([shaken(p["motion_gamma"], seed, count=p["grain_count"], restitution=p["restitution"], **law)
                         for seed in range(packings)])
        ratios = [f"{soft[name]['value'] / values.mean():.3f} ± {half_width(soft[name], values):.3f}"
                  for name, values in zip(QUANTITIES, hard.T, strict=True)]
        yield f"{p['grain_count']:3d} {p['restitution']} {p['motion_gamma']:4g} {p['youngs_modulus']:.1e} {' '.join(ratios)}"


def half_width(soft: Mapping[str, Any], hard: NDArray[np.float64]) -> float:
    """Of the 95 % interval of the ratio of a soft engine's quantity to the mean of `hard`."""
    low, high = soft["interval"]
    parts = 0.5 * (high - low) / soft["value"], half(hard) / hard.mean()
    return float(abs(soft["value"] / hard.mean()) * np.hypot(*parts))


def half(values: NDArray[np.float64]) -> float:
    """Half-width of the 95 % interval of the mean."""
    return float(stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / len(values)**0.5)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["speed", "plate", "map"])
    parser.add_argument("--campaign", type=Path, default=Path("results/campaigns/drive_power-standard"), help="results of the soft engine")
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
    law: dict[str, Any] = {"friction": given.friction, "beta": given.beta, "contact_duration": given.contact_duration}
    if given.what == "map":
        print("grains, restitution, peak acceleration over g, Young's modulus (Pa); soft over hard: height, power, "
              "first and second harmonic and fluctuation of the height")
        for row in compared(given.campaign, given.packings, law):
            print(row, flush=True)
        return 0
    values = np.array([shaken(given.gamma, seed, **law)[0] for seed in range(given.packings)]) - REST
    print(f"rise {values.mean():.3f} ± {half(values):.3f} d, {len(values)} packings")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
