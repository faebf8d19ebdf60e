"""Hard grains: events a second of elastic spheres, and gases and layers on a shaken plate that soft engines have as well.

`python -m benchmarks.hard_grains speed` prints events per second of processor time with 1000, 4000 and 10 000 spheres.
`python -m benchmarks.hard_grains plate --gamma 16` prints the rise of the centre of mass (in d) with its 95 % interval, with the sizes,
masses and motion of the case's variant `gas_16`, over a bed at rest whose centre is REST high.
`python -m benchmarks.hard_grains map` compares height, its spectrum, and power with those of the campaign `drive_power-standard`.
`python -m benchmarks.hard_grains layer` compares height, power and waves with those of the campaign `vibrated_layer-standard`.
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

from dembark.input_decks.common.vibration import PHASES
from dembark.input_decks.drive_power.drive import spectrum
from dembark.input_decks.drive_power.measure import SPECTRUM
from dembark.input_decks.vibrated_layer.layer import wave_amplitude
from dembark.input_decks.vibrated_layer.standing_waves import Waves, amplitude, surface_levels
from dembark.physics import HardGrains, HardMotion, HardWall
from dembark.postproc.grains import GrainFrame

DIAMETER, DENSITY, GRAVITY, FREQUENCY, SIDE = 5e-3, 2500.0, 9.81, 25.0, 0.02
# Diameters: of three packings of hard grains that have come to rest.
REST = 1.762
# Of a period.
SAMPLES = 16
QUANTITIES = ("height", "force_power", *SPECTRUM)
LAYER_QUANTITIES = ("height", "power", "harmonic_amplitude", "wave_amplitude", "noise_amplitude")


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


def layered(p: Mapping[str, Any], seed: int, *, beta: float, contact_duration: float, restitution_speed: float = 0.0) -> tuple[float, ...]:
    """Of a layer with the parameters `p` of `vibrated_layer`, at one acceleration: mean height (d) of the centre of mass over the middle of
    the plate, power of the plate over M g V, and amplitudes (d) of the surface at the frequency of the plate and at half of it, and of
    noise next to that."""
    random, d, frequency, periods = np.random.default_rng(seed), p["grain_diameter"], p["motion_frequency"], p["periods"]
    spread, sides = p["grain_diameter_spread"], np.array([p["layer_length"], p["layer_depth"]])
    # As many as the case has.
    grains = int(0.6 * p["layer_height"] * d * sides.prod() / (np.pi / 6 * d**3 * (1 + spread**2)) + 0.5)
    diameter = random.uniform(1.0 - spread, 1.0 + spread, grains) * d
    size = 1.02 * (1.0 + spread) * d
    count = (sides / size).astype(int)
    level, place = np.divmod(np.arange(grains), count.prod())
    across = (np.column_stack(np.divmod(place, count[1])) + random.uniform(0.49, 0.51, (grains, 2))) * sides / count
    position = np.column_stack([across, (level + 1.0) * size])
    mass = p["grain_density"] * np.pi / 6 * diameter**3
    reach = p["motion_gamma"] * p["gravity"] / (2 * np.pi * frequency)**2
    plate = HardWall(point=(0, 0, 0), normal=(0, 0, 1), friction=p["wall_friction"],
                     motion=f"harmonic amplitude 0 0 {reach!r} frequency {frequency} ramp {p['motion_ramp']}")
    layer = HardGrains(mass, diameter / 2, position, random.normal(size=position.shape) * 0.05, restitution=p["restitution"],
                       restitution_speed=restitution_speed, friction=p["grain_friction"], tangential_restitution=beta,
                       gravity=(0, 0, -p["gravity"]), periods=[(0, p["layer_length"]), (0, p["layer_depth"]), None], walls=[plate],
                       contact_duration=contact_duration)
    layer.run((p["motion_ramp"] + p["run_in"]) / frequency)
    motion = layer.run(periods / frequency, samples=PHASES * periods)
    waves = Waves(np.array([surface_levels(frame, p["layer_length"], p["layer_depth"], d)
                            for frame in frames(motion.position[:-1], diameter / 2, mass)]), p["layer_length"], d)
    power = np.diff(motion.wall_work[[0, -1], 0])[0] / (mass.sum() * p["gravity"] * reach * 2 * np.pi * periods)
    return (float(np.average(motion.position[:-1, :, 2], weights=mass, axis=1).mean() / d), float(power), amplitude(waves.harmonic()),
            wave_amplitude(waves).value, amplitude(float(waves.noise().sum())))


def frames(positions: NDArray[np.float64], radii: NDArray[np.float64], masses: NDArray[np.float64]) -> Iterator[GrainFrame]:
    """Frames of grains without a box, at `positions` (times, grains, 3)."""
    for step, place in enumerate(positions):
        yield GrainFrame(step=step, low=place.min(axis=0), high=place.max(axis=0), periodic=np.zeros(3, bool), ids=np.arange(len(radii)),
                         positions=place, wrapped=place, radii=radii, masses=masses, wall_forces={},
                         types=None, velocities=None, omegas=None, forces=None)


def measured(folder: Path, case: str) -> Iterator[tuple[Path, dict[str, Any], dict[str, Any]]]:
    """Of each point of a campaign in `folder`: file, parameters, and quantities by name."""
    for path in sorted(folder.glob(f"{case}/*/*/metrics.json")):
        found = json.loads(path.read_text())
        yield path, found["parameters"], {one["name"]: one for one in found["quantities"]}


def compared(folder: Path, packings: int, law: Mapping[str, Any]) -> Iterator[str]:
    """Rows of a table: the points of the campaign `drive_power-standard` in `folder`, in a soft engine, and the same gas of hard grains."""
    for path, p, soft in measured(folder, "drive_power"):
        if (p["cell_width"], p["cell_depth"]) != (SIDE, SIDE):
            raise SystemExit(f"{path}: the cell is {p['cell_width']} m wide and {p['cell_depth']} m deep, not {SIDE} m")
        hard = np.array([shaken(p["motion_gamma"], seed, count=p["grain_count"], restitution=p["restitution"], **law)
                         for seed in range(packings)])
        yield row(f"{p['grain_count']:3d}", p, [ratio(soft[name], values) for name, values in zip(QUANTITIES, hard.T, strict=True)])


def compared_layers(folder: Path, packings: int, law: Mapping[str, Any]) -> Iterator[str]:
    """The same of the campaign `vibrated_layer-standard`; of amplitudes, which may be none, both values."""
    for _, p, soft in measured(folder, "vibrated_layer"):
        hard = np.array([layered(p, seed, **law) for seed in range(packings)])
        ratios = [ratio(soft[name], values) for name, values in zip(LAYER_QUANTITIES[:2], hard.T, strict=False)]
        both = [f"{soft[name]['value']:.3f} ± {soft_half(soft[name]):.3f} {values.mean():.3f} ± {half(values):.3f}"
                for name, values in zip(LAYER_QUANTITIES[2:], hard.T[2:], strict=True)]
        yield row(f"{p['layer_height']:g}", p, ratios + both)


def row(size: str, p: Mapping[str, Any], numbers: Sequence[str]) -> str:
    """Of a table: the number of grains or height of a layer, the parameters that the campaigns vary, and `numbers`."""
    return f"{size} {p['restitution']} {p['motion_gamma']:4g} {p['youngs_modulus']:.1e} {' '.join(numbers)}"


def ratio(soft: Mapping[str, Any], hard: NDArray[np.float64]) -> str:
    """A soft engine's quantity over the mean of `hard`, with its 95 % interval."""
    return f"{soft['value'] / hard.mean():.3f} ± {half_width(soft, hard):.3f}"


def soft_half(soft: Mapping[str, Any]) -> float:
    """Half-width of the interval of a soft engine's quantity; NaN where it has none."""
    low, high = soft["interval"] or (np.nan, np.nan)
    return 0.5 * float(high - low)


def half_width(soft: Mapping[str, Any], hard: NDArray[np.float64]) -> float:
    """Of the 95 % interval of the ratio of a soft engine's quantity to the mean of `hard`."""
    parts = soft_half(soft) / soft["value"], half(hard) / hard.mean()
    return float(abs(soft["value"] / hard.mean()) * np.hypot(*parts))


def half(values: NDArray[np.float64]) -> float:
    """Half-width of the 95 % interval of the mean."""
    return float(stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / len(values)**0.5)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["speed", "plate", "map", "layer"])
    parser.add_argument("--campaign", type=Path, help="results of the soft engine (default: results/campaigns/ and the campaign's name)")
    parser.add_argument("--gamma", type=float, default=16.0, help="peak acceleration of the plate over gravity")
    parser.add_argument("--friction", type=float, default=0.27, help="of a gas; a layer has that of its soft grains")
    parser.add_argument("--beta", type=float, default=0.0, help="tangential restitution")
    parser.add_argument("--contact-duration", type=float, default=1e-5, help="s")
    parser.add_argument("--restitution-speed", type=float, default=0.0, help="of a layer, m/s, below which restitution grows to 1")
    parser.add_argument("--packings", type=int, default=20)
    parser.add_argument("--events", type=float, default=1e6)
    given = parser.parse_args(arguments)
    if given.what == "speed":
        for cells in (10, 16, 22):
            print(f"{cells**3} spheres: {events_per_second(cells, events=given.events):.3g} events a second")
        return 0
    law: dict[str, Any] = {"beta": given.beta, "contact_duration": given.contact_duration}
    if given.what == "plate":
        values = np.array([shaken(given.gamma, seed, friction=given.friction, **law)[0] for seed in range(given.packings)]) - REST
        print(f"rise {values.mean():.3f} ± {half(values):.3f} d, {len(values)} packings")
        return 0
    campaigns = Path("results/campaigns")
    if given.what == "map":
        print("grains, restitution, peak acceleration over g, Young's modulus (Pa); soft over hard: height, power, "
              "first and second harmonic and fluctuation of the height")
        rows = compared(given.campaign or campaigns / "drive_power-standard", given.packings, law | {"friction": given.friction})
    else:
        print("height (d), restitution, peak acceleration over g, Young's modulus (Pa); soft over hard: height, power; soft and hard (d): "
              "amplitude of the surface at the frequency of the plate, at half of it, and of noise")
        rows = compared_layers(given.campaign or campaigns / "vibrated_layer-standard", given.packings,
                               law | {"restitution_speed": given.restitution_speed})
    for one in rows:
        print(one, flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
