"""Tracks and what is measured of them as lines of text, as a Dataset and as figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
import xarray
from matplotlib.figure import Figure

from .output.netcdf import cf_dataset, variable, with_interval
from .statistics import Estimate
from .style import INK, PALETTE, STYLE
from .tracks import AXES, OTHERS, Movement, Tracks

# Names in Movement, with label and unit.
LABELS = {"velocity": ("mean velocity", "m/s"), "fluctuation": ("fluctuation of the velocity", "m/s"),
          "flatness": ("flatness (1: Gaussian)", ""), "coefficient": ("self-diffusion", "m²/s")}


def lines(seen: Sequence[Tracks], movements: Mapping[str, Movement]) -> list[str]:
    """The summary; of several tracks one after the other."""
    found = []
    for tracks in seen:
        one = movements[tracks.name]
        frames = np.isfinite(tracks.positions).all(axis=2)
        lost = f", {int((~frames).any(axis=0).sum())} of them not in all frames" if not frames.all() else ""
        found.append(f"{tracks.name}: {len(tracks.ids)} grains{lost}; {len(tracks.times)} frames, {1e3 * tracks.interval:.4g} ms apart; "
                     f"velocities over {1e3 * one.interval:.4g} ms, self-diffusion between {1e3 * one.between[0]:.4g} and "
                     f"{1e3 * one.between[1]:.4g} ms")
        for name, (label, unit) in LABELS.items():
            values = "; ".join(f"{axis} {_shown(value)}" for axis, value in zip(one.axes, getattr(one, name), strict=True))
            found.append(f"  {label}: {values}{unit and ' '}{unit}")
    return found


def _shown(one: Estimate) -> str:
    if math.isnan(one.value):
        return "not known"
    return f"{one.value:.4g}" + (f" ± {one.half:.2g}" if math.isfinite(one.half) else f" (interval not known: {one.basis})")


def dataset(tracks: Tracks, movement: Movement, **attributes: str | float) -> xarray.Dataset:
    """Tracks (time, grain, axis) with their further columns, and what is measured along each axis."""
    variables = {"position": variable(("time", "grain", "axis"), tracks.positions, "m", "position, without periodic jumps")}
    variables |= {name: variable(("time", "grain"), values, *OTHERS[name]) for name, values in tracks.others.items()}
    for name, (label, unit) in LABELS.items():
        units = {"": "1", "m²/s": "m2/s"}.get(unit, unit)
        variables |= with_interval({"coefficient": "self_diffusion"}.get(name, name), ("seen",), getattr(movement, name), units, label)
    variables["mean_square_displacement"] = variable(("lag", "seen"), movement.squares, "m2", "mean square displacement about the drift")
    coordinates = {"time": variable(("time",), tracks.times, "s", "simulated or measured time"),
                   "grain": variable(("grain",), tracks.ids, "1", "number of the grain"),
                   "axis": ("axis", list(tracks.axes)), "seen": ("seen", list(movement.axes)),
                   "lag": variable(("lag",), movement.lags, "s", "time between two positions")}
    return cf_dataset(variables, coordinates, **attributes)


def figures(movements: Mapping[str, Movement]) -> dict[str, Figure]:
    """Mean square displacements over the lag, and distributions of the velocities over their fluctuation."""
    found = {}
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 2.9), layout="constrained")
        squares, shares = figure.subplots(1, 2)
        for number, (name, one) in enumerate(movements.items()):
            for column, axis in enumerate(one.axes):
                paint, line = PALETTE[AXES.index(axis)], ("-", "--", ":")[number]
                label = f"{axis}, {name.rpartition('/')[2]}" if len(movements) > 1 else axis
                squares.loglog(one.lags, 1e6 * one.squares[:, column], line, color=paint, label=label)
                spread = one.fluctuation[column].value
                if spread > 0.0:
                    share, edges = np.histogram((one.speeds[:, column] - one.velocity[column].value) / spread, bins=41, range=(-6.0, 6.0),
                                                density=True)
                    shares.semilogy(0.5 * (edges[1:] + edges[:-1]), np.where(share > 0.0, share, np.nan), line, color=paint)
        place = np.linspace(-4.0, 4.0, 81)
        shares.semilogy(place, np.exp(-0.5 * place**2) / math.sqrt(2.0 * math.pi), color=INK, linewidth=0.6, label="Gaussian")
        squares.set(xlabel="lag / s", ylabel="mm²", title="Mean square displacement")
        shares.set(xlabel="velocity about the mean / fluctuation", ylabel="probability density", title="Velocities")
        squares.legend(fontsize=6)
        shares.legend(fontsize=6)
        found["tracks"] = figure
    return found
