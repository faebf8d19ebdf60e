"""Vibrated layer: waves at half the frequency of the drive, where they begin, and how long they are."""

import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from scipy.stats import spearmanr

from dembark.input_decks.common.momentum import unexplained_energy
from dembark.input_decks.common.power_law import ordered
from dembark.input_decks.common.vibration import PHASES
from dembark.postproc.measurement import Curve, Estimate, Measurement, Numbers, Points, Replicas, Value, exact, over_replicas, profile
from dembark.postproc.statistics import block_mean
from dembark.postproc.studies import measured

from .layer import Layer, mean_power, read, wave_amplitude
from .standing_waves import Waves, amplitude

# Accelerations (g) up to which a layer is flat, and those at which it has waves at f/2 and no others; not at the onset.
FLAT, WAVY = 2.0, (2.75, 4.0)
ONSET = 2.5
# Highest speed of the plate over sqrt(g d) below which no ordered waves were published: the slowest of Bizon et al. (1998) have 2.53.
# Grains of a slower plate do not move along the layer (P. B. Umbanhowar, H. L. Swinney, Physica A 288 (2000) 344).
LEAST_SPEED = 2.5
# The variant that the others of the study `changes` are compared with, and what these change.
PLAIN = "sweep"
CHANGES = {"sweep_blocked": "spins_blocked", "sweep_smooth": "no_friction", "sweep_wet": "wet", "sweep_strips": "floor_of_strips",
           "sweep_two": "two_frequencies"}


def quoted_length(number: float) -> float:
    """Length of the waves over H by the law that is quoted from memory, for f sqrt(H/g) = `number`."""
    return 1.0 + 1.1 * number**-1.32


# Simulated patterns of C. Bizon, M. D. Shattuck, J. B. Swift, W. D. McCormick, H. L. Swinney, Phys. Rev. Lett. 80 (1998) 57, as the first
# author's repository (github.com/cbizon/granular_benchmark) has them: by acceleration (g) and f sqrt(H/g) the periods of the drive until
# they repeat, and the strongest shell of the Fourier transform of a box 100 d wide.
PUBLISHED = {(3.0, 0.27): (2, 3), (3.0, 0.44): (2, 5), (4.0, 0.38): (2, 4), (5.79, 0.47): (4, 3), (6.0, 0.84): (4, 5), (7.0, 0.75): (4, 4)}
PUBLISHED_HEIGHT, PUBLISHED_WIDTH = 5.42, 100.0


def published(p: Numbers, gamma: float) -> tuple[int, int] | None:
    """What was published for a layer with the parameters `p` at the acceleration `gamma` (g), within their rounding."""
    number = p["motion_frequency"] * math.sqrt(p["layer_height"] * p["grain_diameter"] / p["gravity"])
    fits = plain(p) and abs(p["layer_height"] - PUBLISHED_HEIGHT) < 0.01
    return next((row for (one, other), row in PUBLISHED.items() if fits and abs(gamma - one) < 0.01 and abs(number - other) < 0.005), None)


def slow(p: Numbers, gamma: float) -> str:
    """Why waves at the acceleration `gamma` (g) cannot be judged; "" where the plate is fast enough."""
    speed = gamma * p["gravity"] / (2.0 * math.pi * p["motion_frequency"]) / math.sqrt(p["gravity"] * p["grain_diameter"])
    return "" if speed >= LEAST_SPEED else (f"the plate's highest speed at {gamma:g} g is {speed:.1f} √(g d); ordered waves are known "
                                            f"from about {LEAST_SPEED:g} √(g d) on")


def plain(p: Numbers) -> bool:
    """Whether the layer is one of dry spheres that rub and turn, on a flat floor that shakes with one frequency."""
    return (p["spins"] == "free" and p["floor"] == "flat" and p["bridge_volume"] == 0.0 and p["motion_second_amplitude"] == 0.0
            and p["grain_friction"] > 0.0 and p["static_friction"] is None)


def changed(p: Numbers) -> str:
    """Why what is known of plain layers cannot be asked of this one; "" where it can."""
    return "" if plain(p) else "known for dry spheres that rub and turn, on a flat floor that shakes with one frequency"


def measure(replicas: Replicas) -> Measurement:
    """Of one level its waves, of several the onset; profiles and the diagram of space and time of the first replica."""
    runs, p = [read(replica) for replica in replicas], replicas[0].parameters
    gammas = [one.gamma for one in runs[0].levels]
    values = {"energy_balance": Value(exact(max(unexplained_energy(one.rows) for one in runs)), exact(0.0)),
              "acceleration": Value(exact(max(gammas))),
              "plate_speed": Value(exact(replicas[0].derived["plate_speed"] / math.sqrt(p["gravity"] * p["grain_diameter"])))}
    coherent = [Estimate(max(waves.coherence() for waves in one.waves), math.inf, "a level has no interval") for one in runs]
    values["coherence"] = Value(over_replicas(coherent))
    values |= of_level(runs, gammas[0], p) if len(gammas) == 1 else of_sweep(runs, p)
    curves = [*spectra(runs), *crests(runs[0])] if len(gammas) == 1 else [powers(runs)]
    return Measurement(values, curves, fields=diagram(runs[0]))


def of_level(runs: list[Layer], gamma: float, p: Numbers) -> dict[str, Value]:
    """What is measured at one level."""
    d, height, frequency = runs[0].diameter, runs[0].height, p["motion_frequency"]
    # What the plate gives in a period at the power M g V.
    full = runs[0].weight * gamma * p["gravity"] / (2.0 * math.pi * frequency**2)

    def over(number: Callable[[Waves], float]) -> Estimate:
        return over_replicas([Estimate(number(one.waves[0]), math.inf, "a mode has no interval") for one in runs])

    def mean(number: Callable[[Waves], float]) -> float:
        return float(np.mean([number(one.waves[0]) for one in runs]))

    values = {
        "power": Value(over_replicas([block_mean(one.works[0] / full) for one in runs])),
        "height": Value(over_replicas([block_mean(one.centres[0].mean(axis=1) / d) for one in runs])),
        "wave_amplitude": Value(over_replicas([wave_amplitude(one.waves[0]) for one in runs])),
        "harmonic_amplitude": Value(over(lambda waves: amplitude(waves.harmonic()))),
        "noise_amplitude": Value(over(lambda waves: amplitude(float(waves.noise().sum())))),
        "doubling_amplitude": Value(over(lambda waves: amplitude(waves.doubling_power()))),
    }
    if gamma <= FLAT:
        return values | {"flat_peak": Value(exact(mean(Waves.peak)), exact(1.0), inapplicable=changed(p))}
    lengths = over(Waves.wavelength)
    law = quoted_length(frequency * math.sqrt(height / p["gravity"]))
    values |= {"wavelength": Value(Estimate(lengths.value / d, lengths.half / d, lengths.basis)),
               "mean_wavelength": Value(over(lambda waves: waves.mean_wavelength() / d)),
               "wavelength_over_height": Value(Estimate(lengths.value / height, math.inf, lengths.basis), exact(law))}
    if known := published(p, gamma):
        values["published_period"] = Value(exact(mean(lambda waves: 1.0 / waves.strongest())), exact(known[0]))
        values["published_waves"] = Value(exact(PUBLISHED_WIDTH * d / lengths.value), exact(known[1]))
    if WAVY[0] <= gamma <= WAVY[1]:
        # The run that is farthest off counts.
        found = max((one.waves[0].strongest() for one in runs), key=lambda value: abs(value - 0.5))
        values["strongest_frequency"] = Value(exact(found), exact(0.5), inapplicable=changed(p) or slow(p, gamma))
    return values


def of_sweep(runs: list[Layer], p: Numbers) -> dict[str, Value]:
    """From where on there are waves, and on the way back when there is one."""
    begin, brackets = over_replicas([one.onset() for one in runs]), [one.order_onset() for one in runs]
    # All runs have the same levels.
    order = over_replicas(brackets, shared=max(one.half for one in brackets))
    # A sweep that shows no onset decides nothing.
    values = {"onset": Value(begin, reason="" if math.isfinite(begin.value) else begin.basis),
              "order_onset": Value(order, exact(ONSET) if plain(p) else None,
                                   reason="" if math.isfinite(order.value) else order.basis, inapplicable=slow(p, ONSET))}
    if p["back"] == "yes":
        values["onset_back"] = Value(over_replicas([one.onset(back=True) for one in runs]))
    return values


def spectra(runs: list[Layer]) -> list[Curve]:
    """Power over the wave number at f/2, of noise, and at f."""
    first = runs[0].waves[0]
    place = runs[0].diameter / first.lengths()
    along, across = "d/λ", "power (d²)"
    noise = np.mean([one.waves[0].noise() for one in runs], axis=0)
    return [profile("power_half", "Power of the surface at f/2", along, across, place, [one.waves[0].line(0.5) for one in runs],
                    reference=noise, reference_label="noise next to f/2"),
            profile("power_full", "Power of the surface at f", along, across, place, [one.waves[0].line(1.0) for one in runs])]


def crests(run: Layer) -> list[Curve]:
    """The surface at the phase at which it differs most from that a period later, at the end of the window, and that one."""
    waves, d = run.waves[0], run.diameter
    now, later = waves.heights[-2 * PHASES : -PHASES], waves.heights[-PHASES:]
    phase = int(np.nanargmax(np.nanstd(now - later, axis=1)))
    x = (np.arange(now.shape[1]) + 0.5) * waves.length / now.shape[1] / d
    return [profile("surface", "Surface", "x / d", "z / d", x, [now[phase] / d], reference=later[phase] / d,
                    reference_label="a period later")]


def powers(runs: list[Layer]) -> Curve:
    """Power of the waves over the acceleration, of the levels from the first to the last."""
    outward = slice(0, runs[0].outward)
    half = np.array([mean_power(one).half for one in runs[0].waves[outward]]) if len(runs) == 1 else None
    place = np.array([one.gamma for one in runs[0].levels[outward]])
    return profile("power_over_acceleration", "Power of the waves at f/2", "Γ", "power (d²)", place,
                   [np.array([mean_power(waves).value for waves in one.waves[outward]]) for one in runs], half=half)


def diagram(run: Layer) -> xr.Dataset:
    """The surface over place and time, in all levels: height (level, frame, x) in m."""
    heights = np.array([one.heights for one in run.waves])
    x = (np.arange(heights.shape[2]) + 0.5) * run.waves[0].length / heights.shape[2]
    return xr.Dataset(
        {"height": (("level", "frame", "x"), heights, {"units": "m", "long_name": "height of the surface"})},
        coords={"acceleration": ("level", [one.gamma for one in run.levels], {"units": "1", "long_name": "of the plate, over g"}),
                "periods": ("frame", np.arange(heights.shape[1]) / PHASES, {"units": "1", "long_name": "time over the drive's period"}),
                "x": ("x", x, {"units": "m", "long_name": "place along the layer"})})


def study(name: str, points: Points, along: str) -> Measurement:
    """Length of the waves along the frequency or the length of the layer; or what shifts their onset."""
    if name == "changes":
        return shifts(points)
    points, place = ordered(points, along)
    lengths = np.array([measured(one, "wavelength").value for one in points])
    if name == "length":
        shortest = points[0]["parameters"]
        count = shortest["layer_length"] / (lengths[0] * shortest["grain_diameter"])
        return Measurement({"wavelength_ratio": Value(exact(lengths[-1] / lengths[0]), exact(1.0), bound=1.0 / round(count))},
                           [profile("wavelength", "Length of the waves", "length of the layer (m)", "λ / d", place, [lengths])])
    law = [quoted_length(p["motion_frequency"] * math.sqrt(p["layer_height"] * p["grain_diameter"] / p["gravity"])) * p["layer_height"]
           for p in (one["parameters"] for one in points)]
    means = np.array([measured(one, "mean_wavelength").value for one in points])
    return Measurement(
        {"wavelength_trend": Value(exact(float(np.nan_to_num(spearmanr(place, lengths).statistic))))},
        [profile("wavelength", "Length of the waves", "frequency (Hz)", "λ / d", place, [lengths], reference=np.array(law),
                 reference_label="law quoted from memory"),
         profile("mean_wavelength", "Length of the waves by their mean wave number", "frequency (Hz)", "λ / d", place, [means])])


# Half an interval of 99 % over one of 95 %: 0 lies outside one of five such by chance in a twentieth of all cases.
OF_FIVE = 2.576 / 1.960


def shifts(points: Points) -> Measurement:
    """Onset of each changed layer less that of the plain one."""
    by_name = {one["variant"]: measured(one, "onset") for one in points
               if any(quantity["name"] == "onset" and quantity["value"] is not None for quantity in one["quantities"])}
    if PLAIN not in by_name:
        return Measurement({}, remarks=["The plain layer shows no onset, so shifts of the onset are unknown."])
    values, seen = {}, []
    for variant, label in CHANGES.items():
        if variant not in by_name:
            continue
        one, other = by_name[variant], by_name[PLAIN]
        value = Estimate(one.value - other.value, math.hypot(one.half, other.half), "those of both onsets")
        values[f"onset_shift_{label}"] = Value(value)
        if abs(value.value) > OF_FIVE * value.half:
            seen.append(label.replace("_", " "))
    listed = f"seen: {', '.join(seen)}" if seen else "none is seen"
    values["shifts_seen"] = Value(exact(len(seen)), verdict="pass" if seen else "fail", detail=f"{listed}; passes with one")
    return Measurement(values)
