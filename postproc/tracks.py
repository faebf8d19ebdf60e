"""Tracks of single grains: of a run, or measured by a camera or by positron emission (PEPT), and what both are measured by.

The measures use positions at equal intervals only, as a camera has them: displacements over a lag, their mean, scatter and distribution,
and the self-diffusion that the growth of their scatter shows. So a run and an experiment are compared by the same instrument.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.common.errors import DembarkError
from dembark.common.files import write_atomic
from dembark.common.tables import read_table
from dembark.common.units import to_si

from .contacts import ContactFrame
from .dumps.frames import cell
from .grains import GrainFrame
from .resampling import resampled
from .sources import Selection
from .statistics import Estimate, TimeBlocks, correlation_time, time_blocks, variance_half

Array = NDArray[np.float64]

AXES = "xyz"
# Further columns of a file of tracks, with their units.
OTHERS = {**{f"{letter}{axis}": (unit, f"{name} along {axis}") for letter, unit, name in (
    ("v", "m/s", "velocity"), ("w", "rad/s", "angular velocity"), ("f", "N", "force")) for axis in AXES},
    "contacts": ("1", "number of contacts with grains"), "contact_force": ("N", "sum of the forces of these contacts")}
_HEAD = re.compile(r"\s*(\w+)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?\s*")
_LEAST = 8  # displacements of which a scatter is measured
# Frames over those in which any grain was seen.
_MOST_GAPS = 100


@dataclass(frozen=True)
class Displacements:
    """k displacements over a lag: `moves` (k, c) of c components, and the frames `start` (k,) in which they begin."""

    moves: Array
    start: NDArray[np.int64]

    @property
    def squares(self) -> Array:
        """Mean squares (c,)."""
        return np.asarray((self.moves**2).mean(axis=0))

    def in_frames(self, values: Array) -> Array:
        """Means of `values` (k,) of those that begin in each frame up to the last; where none does, the mean of all."""
        count = np.bincount(self.start)
        return np.divide(np.bincount(self.start, values), count, out=np.full(len(count), values.mean()), where=count > 0)

    def blocks(self, values: Array | None = None) -> TimeBlocks:
        """Time blocks of these frames by their means of `values` (k, m), default: the squares of all components; those of the slowest."""
        found = [time_blocks(self.in_frames(one)) for one in (self.moves**2 if values is None else values).T]
        return max(found, key=lambda one: (one.single, -one.count, one.widening))

    def over(self, keep: NDArray[np.bool_]) -> Displacements:
        """Those that begin in the frames that `keep` (frames,) marks."""
        chosen = keep[self.start]
        return Displacements(self.moves[chosen], self.start[chosen])

    def until(self, last: int) -> Displacements:
        """Those that begin in frame `last` at the latest."""
        return self.over(np.arange(int(self.start.max(initial=0)) + 1) <= last)


def growth(near: Displacements, far: Displacements, keep: NDArray[np.bool_]) -> Array:
    """How much larger the mean squares (c,) of `far`, of a longer lag, are, of those that begin in the frames that `keep` marks."""
    return far.over(keep).squares - near.over(keep).squares


@dataclass(frozen=True)
class Tracks:
    """Tracks of n grains at T times: `positions` (T, n, c), m, along the c `axes`, NaN where a grain is not seen; without the jumps of a
    periodic box. `ids` (n,), `times` (T,) in s. `others`: further columns (T, n) by their names in OTHERS. `name` begins messages;
    `notes` are lines about what may be wrong with them."""

    ids: NDArray[np.int64]
    times: Array
    positions: Array
    axes: str = AXES
    others: Mapping[str, Array] = field(default_factory=dict)
    name: str = "the tracks"
    notes: tuple[str, ...] = ()

    @property
    def interval(self) -> float:
        """Time (s) between two frames; DembarkError where it is not the same for all."""
        steps = np.diff(self.times)
        if not len(steps):
            raise DembarkError(f"{self.name} have one frame", "", "displacements need two")
        if (np.abs(steps - steps[0]) > 1e-3 * steps[0]).any():
            raise DembarkError(f"{self.name}: frames lie {steps.min():.4g} to {steps.max():.4g} s apart", "",
                               "displacements need equal intervals; choose the frames")
        return float(self.times[-1] - self.times[0]) / len(steps)

    def along(self, axes: str) -> Tracks:
        """The same with the positions along some of the axes only."""
        return replace(self, positions=self.positions[:, :, [self.axes.index(axis) for axis in axes]], axes=axes)

    def of(self, ids: Sequence[int] | None) -> Tracks:
        """Those of some grains (None: of all); DembarkError for one that has no track."""
        if ids is None:
            return self
        absent = sorted(set(ids) - set(self.ids.tolist()))
        if absent:
            raise DembarkError(f"there is no grain {absent[0]}", f"in {self.name}", f"it has {_named(self.ids)}")
        kept = np.isin(self.ids, ids)
        return replace(self, ids=self.ids[kept], positions=self.positions[:, kept],
                       others={name: values[:, kept] for name, values in self.others.items()})

    def at(self, frames: Sequence[int]) -> Tracks:
        """Those at some of the times, by their numbers."""
        return replace(self, times=self.times[frames], positions=self.positions[frames],
                       others={name: values[frames] for name, values in self.others.items()})

    def lag(self, time: float) -> int:
        """The frames in a time (s); DembarkError where it is no multiple of the interval, by more than 5 %, or the tracks are shorter."""
        frames = max(1, round(time / self.interval))
        if abs(frames * self.interval - time) > 0.05 * time:
            raise DembarkError(f"{self.name}: {time:g} s are no multiple of its {self.interval:.4g} s between frames", "",
                               "give an --interval and --diffusion that fit")
        if frames >= len(self.times):
            raise DembarkError(f"{self.name}: a lag of {time:g} s is not within {self.times[-1] - self.times[0]:.4g} s")
        return frames

    def displacements(self, frames: int) -> Displacements:
        """Over so many frames, of grains that are seen at both ends; DembarkError of fewer than eight."""
        moves = self.positions[frames:] - self.positions[:-frames]
        seen = np.isfinite(moves).all(axis=2)
        if seen.sum() < _LEAST:
            raise DembarkError(f"{self.name}: {seen.sum()} displacements over {frames * self.interval:.4g} s are too few")
        return Displacements(moves[seen], np.nonzero(seen)[0])

    @cached_property
    def drift(self) -> tuple[Array, int]:
        """Mean displacement (c,) in a frame (m) between the ends of the tracks, and the frames between these ends, of all grains."""
        seen = np.asarray(np.isfinite(self.positions).all(axis=2))
        first, last = seen.argmax(axis=0), len(seen) - 1 - seen[::-1].argmax(axis=0)
        known = np.flatnonzero(seen.any(axis=0))
        moves = self.positions[last[known], known] - self.positions[first[known], known]
        frames = int((last - first)[known].sum())
        return moves.sum(axis=0) / max(frames, 1), frames

    def scatter(self, frames: int) -> Displacements:
        """Displacements over so many frames about the drift, enlarged so that their mean squares are unbiased; NaN of a single one.

        Where each step has the variance s, l of them have s l; the drift over all M steps has s/M, and the covariance s/M with each. So
        squares about l drifts are s l - 2 s l l/M + s l l/M = s l (1 - l/M), with gaps and tracks of unequal length, too.
        """
        found, (drift, total) = self.displacements(frames), self.drift
        left = math.sqrt(1.0 - frames / total) if frames < total else math.nan
        return Displacements((found.moves - frames * drift) / left, found.start)


def common(one: Tracks, other: Tracks) -> list[Tracks]:
    """Both along the axes that both have."""
    axes = "".join(axis for axis in one.axes if axis in other.axes)
    if not axes:
        raise DembarkError(f"{one.name} and {other.name} have no axis in common")
    return [one.along(axes), other.along(axes)]


def diffusion(tracks: Tracks, lags: tuple[float, float]) -> list[Estimate]:
    """Self-diffusion coefficients (m2/s) along the axes: half the growth of the mean square between two lags (s), about the drift, over
    their difference. The interval is that of time blocks, or that of a random walk of independent grains where it is wider; there is none
    for a walk of fewer than four degrees of freedom."""
    short, long = (tracks.lag(time) for time in lags)
    if short >= long:
        raise DembarkError(f"the lags {lags[0]:g} and {lags[1]:g} s are {short} and {long} frames", "", "give two that rise")
    near, far = tracks.scatter(short), tracks.scatter(long)
    near = near.until(int(far.start.max()))  # of the same time
    if not (len(near.moves) and np.isfinite(far.moves).all()):
        return [Estimate(math.nan, math.inf, "too few displacements over the lags")] * len(tracks.axes)
    span, degrees = 2.0 * (long - short) * tracks.interval, walk_degrees(tracks, short, long)

    def along(axis: int) -> Estimate:
        one, other = (Displacements(each.moves[:, [axis]], each.start) for each in (near, far))
        found = resampled(lambda keep, _: float(growth(one, other, keep)[0]) / span, other.blocks())
        walk = Estimate(found.value, abs(found.value) * variance_half(degrees), f"a random walk of {degrees:.2g} degrees of freedom")
        return max(found, walk, key=lambda one: one.half)

    return [along(axis) for axis in range(len(tracks.axes))]


def walk_degrees(tracks: Tracks, short: int, long: int) -> float:
    """Degrees of freedom of chi-square of the growth of the mean square between two lags (frames) in a random walk that is seen as the
    `tracks` are: twice its squared mean over its variance.

    Of steps x of unit variance the growth is (Px)'B(Px), where P takes the drift out: its mean is tr PB, which is the difference of the
    lags, its variance 2 tr PBPB. B sums ll' over the displacements, with l = 1 in the steps of one: tr BB is that of squared overlaps.
    """
    seen, number = np.unique(np.isfinite(tracks.positions).all(axis=2), axis=1, return_counts=True)
    count, total, lags = len(seen), tracks.drift[1], (short, long)
    begin = [np.pad(seen[lag:] & seen[:-lag], ((0, lag), (0, 0))) for lag in lags]
    begin[0][np.flatnonzero(begin[1].any(axis=1))[-1] + 1 :] = False
    weights = [sign / (1.0 - lag / total) / float((one @ number).sum()) for lag, sign, one in zip(lags, (-1.0, 1.0), begin, strict=True)]
    pairs, sums, rest = np.zeros((2, 2, count + 1), complex), 0.0, 0.0
    for part in np.array_split(np.arange(len(number)), math.ceil(len(number) / 1000)):
        of = [weight * one[:, part] for weight, one in zip(weights, begin, strict=True)]
        spectra = [np.fft.rfft(one, 2 * count, axis=0) for one in of]
        pairs += [[(one.conj() * other) @ number[part] for other in spectra] for one in spectra]
        steps = np.sum([lag * np.cumsum(one - np.pad(one, ((lag, 0), (0, 0)))[:count], axis=0)
                        for lag, one in zip(lags, of, strict=True)], axis=0)
        sums, rest = sums + float(steps.sum(axis=0) @ number[part]), rest + float((steps**2).sum(axis=0) @ number[part])
    apart = np.arange(2 * count)
    apart[count:] -= 2 * count
    overlaps = [[np.clip(np.minimum(one, apart + other) - np.maximum(0, apart), 0, None) for other in lags] for one in lags]
    squares = float((np.fft.irfft(pairs, 2 * count) * np.square(overlaps)).sum())
    return (long - short) ** 2 / (squares - 2.0 * rest / total + (sums / total) ** 2)


@dataclass(frozen=True)
class Movement:
    """What `measure` finds, along each of the `axes`, of displacements over the `interval` (s): `velocity`, mean (m/s); `fluctuation`, root
    of the mean square about it and the variance of that mean (m/s), and `flatness`, fourth moment over that of a Gaussian distribution: 1
    of it. `coefficient` (m2/s): self-diffusion `between` two lags (s). `lags` (k,) in s and `squares` (k, c) in m2: mean square
    displacements about the drift; `speeds`: velocities over the interval, (m, c) in m/s."""

    axes: str
    interval: float
    between: tuple[float, float]
    velocity: Sequence[Estimate]
    fluctuation: Sequence[Estimate]
    flatness: Sequence[Estimate]
    coefficient: Sequence[Estimate]
    lags: Array
    squares: Array
    speeds: Array


def usual_lags(*tracks: Tracks) -> tuple[float, float]:
    """A tenth and four tenths of the time of the shortest of some tracks (s), as whole frames of that with the longest interval."""
    length, interval = min(float(one.times[-1] - one.times[0]) for one in tracks), max(one.interval for one in tracks)
    short = max(1, round(0.1 * length / interval))
    return short * interval, max(short + 1, round(0.4 * length / interval)) * interval


def measure(tracks: Tracks, interval: float | None = None, lags: tuple[float, float] | None = None) -> Movement:
    """Measure tracks; velocities are those over `interval` (s; default: one frame), the diffusion that between two `lags` (s; default: a
    tenth and four tenths of the time). DembarkError for lags that the tracks do not have."""
    frames = 1 if interval is None else tracks.lag(interval)
    time, moves, total = frames * tracks.interval, tracks.displacements(frames), tracks.drift[1]
    along = [replace(moves, moves=moves.moves[:, [axis]] / time) for axis in range(len(tracks.axes))]
    least = frames / max(total - frames, 1)
    known = np.unique(np.geomspace(1, max(1, len(tracks.times) // 2), 20).astype(int))
    squares = np.array([tracks.scatter(int(lag)).squares for lag in known])
    ends = lags or usual_lags(tracks)
    return Movement(
        tracks.axes, time, ends, [_resampled(lambda v, _: float(v.mean()), one, least) for one in along],
        [_resampled(lambda v, of_mean: math.sqrt(float(v.var()) + of_mean), one, least) for one in along],
        [_resampled(lambda v, _: _flatness(v), one, least) for one in along],
        diffusion(tracks, ends), known * tracks.interval, squares, moves.moves / time)


def _resampled(get: Callable[[Array, float], float], speeds: Displacements, least: float) -> Estimate:
    """`get` of the velocities (k,) along an axis (m/s) and the variance of their mean, by which their own variance is too small: that of
    correlated frames, or the part `least` of theirs if it is larger. The time blocks are those of the slower of velocity and square."""
    one = speeds.moves[:, 0]
    means = speeds.in_frames(one)
    of_mean = max(float(means.var()) * correlation_time(means) / len(means), least * float(one.var()))
    blocks = speeds.blocks(np.stack([one, (one - one.mean()) ** 2], axis=1))
    return resampled(lambda keep, _: get(speeds.over(keep).moves[:, 0], of_mean), blocks)


def _flatness(values: Array) -> float:
    about = values - values.mean()
    square = float((about**2).mean())
    return float((about**4).mean()) / (3.0 * square**2) if square > 0.0 else math.nan


def follow(chosen: Selection, ids: Sequence[int] | None = None, advance: Callable[[], None] = lambda: None) -> Tracks:
    """The tracks of the grains `ids` (default: those of the first frame) through the frames of a run. DembarkError for grains that no frame
    has. Positions inside a periodic box are joined over its faces where the dump has no image flags: a grain must then move less than half
    a period from frame to frame. Where the velocities of the dump say that one moves farther, a note says so."""
    source, first = chosen.source, chosen.first
    wanted = np.unique(np.asarray(first.ids if ids is None else ids, dtype=np.int64))
    shape = (len(chosen.numbers), len(wanted))
    places, times = np.full((*shape, 3), np.nan), np.empty(shape[0])
    columns: dict[str, Array] = {}
    joined = _Joined(len(wanted))
    for number, (grains, contacts) in enumerate(source.frames(chosen.numbers)):
        times[number] = source.time(grains)
        at = np.minimum(np.searchsorted(grains.ids, wanted), max(len(grains.ids) - 1, 0))
        there = grains.ids[at] == wanted if len(grains.ids) else np.zeros(len(wanted), bool)
        row = at[there]
        places[number, there] = joined(grains, row, there, times[number])
        for name, values in _columns(grains, contacts).items():
            columns.setdefault(name, np.full(shape, np.nan))[number, there] = values[row]
        advance()
    absent = wanted[~np.isfinite(places[:, :, 0]).any(axis=0)]
    if len(absent):
        raise DembarkError(f"there is no grain {absent[0]} in the chosen frames", f"{source.path}", f"the first has {_named(first.ids)}")
    if not source.timed:
        raise DembarkError("the times of the frames are not known", f"{source.path}", "give --time-step")
    return Tracks(wanted, times, places, others=columns, name=str(source.path), notes=joined.notes)


class _Joined:
    """Positions without the jumps at the faces of a periodic box."""

    def __init__(self, count: int) -> None:
        self.last, self.time = np.full((count, 3), np.nan), np.full(count, np.nan)  # place (m) and time (s) of each when it was last seen
        self.farthest = 0.0  # by the velocities since then, in periods

    @property
    def notes(self) -> tuple[str, ...]:
        """A line where a grain moved half a period or more from one frame that has it to the next."""
        note = (f"by their velocities grains move up to {self.farthest:.2g} periods from one frame that has them to the next, and the dump "
                "has no image flags: tracks may be wrong by periods; dump ix iy iz, or more frames")
        return (note,) if self.farthest >= 0.5 else ()

    def __call__(self, grains: GrainFrame, row: NDArray[np.intp], there: NDArray[np.bool_], time: float) -> Array:
        """Those of the grains in these rows of a frame at `time` (s), which are those of the tracks that `there` (n,) marks."""
        places = grains.positions[row]
        if grains.periodic.any() and not grains.unwrapped:
            # A box of a plane layer may have no thickness, where it is not periodic.
            flat = ~grains.periodic & ~(grains.high > grains.low)
            edges, before = cell(grains.low, np.where(flat, grains.low + 1.0, grains.high), grains.tilt), self.last[there]
            if grains.has("velocities"):
                away = np.nan_to_num(time - self.time[there])
                moves = np.linalg.solve(edges.T, away * grains.velocities[row].T)[grains.periodic]
                self.farthest = max(self.farthest, float(np.abs(moves).max(initial=0.0)))
            periods = np.where(grains.periodic, np.round(np.linalg.solve(edges.T, (places - before).T).T), 0.0)
            places = places - np.nan_to_num(periods) @ edges
        self.last[there], self.time[there] = places, time
        return places


def _columns(grains: GrainFrame, contacts: ContactFrame | None) -> dict[str, Array]:
    """Further columns (grains,) of a frame by name: what the dump has."""
    found: dict[str, Array] = {}
    for letter, name in (("v", "velocities"), ("w", "omegas"), ("f", "forces")):
        if grains.has(name):
            found |= {f"{letter}{axis}": getattr(grains, name)[:, column] for column, axis in enumerate(AXES)}
    if contacts is not None:
        size = np.linalg.norm(contacts.forces, axis=1)
        ends = [np.searchsorted(grains.ids, contacts.ids[:, side]) for side in (0, 1)]
        inside = [(end < len(grains.ids)) & (grains.ids[np.minimum(end, len(grains.ids) - 1)] == contacts.ids[:, side])
                  for side, end in enumerate(ends)]
        pairs = [(end[kept], size[kept]) for end, kept in zip(ends, inside, strict=True)]
        found["contacts"] = np.asarray(sum(np.bincount(end, minlength=len(grains.ids)) for end, _ in pairs), float)
        found["contact_force"] = np.asarray(sum(np.bincount(end, force, len(grains.ids)) for end, force in pairs), float)
    return found


def _named(ids: NDArray[np.int64]) -> str:
    return f"{len(ids)} grains, {ids.min()} to {ids.max()}" if len(ids) else "none"


def read_csv(path: Path) -> Tracks:
    """Measured tracks from a CSV file with a header: `time`, `grain`, two or three of `x`, `y`, `z`, and any of OTHERS, each with its unit
    in brackets unless it is that of SI: `time [ms],grain,x [mm],z [mm]`. A row for each grain that is seen at a time, in any order; other
    columns are not read. DembarkError in one line."""
    names, rows = read_table(path)
    if not rows:
        raise DembarkError(f"{path} has no tracks", "", "it needs a header, such as time,grain,x,z, and rows")
    columns = _heads(names, path)
    axes = "".join(axis for axis in AXES if axis in columns)
    lacking = [name for name in ("time", "grain") if name not in columns]
    if lacking or len(axes) < 2:
        raise DembarkError(f"{path}: its header has no {lacking[0] if lacking else 'two of x, y and z'}", "",
                           "it must be such as time,grain,x,z or time [ms],grain,x [mm],y [mm],z [mm]")
    table = {name: np.empty(len(rows)) for name in columns}
    for place, (line, row) in enumerate(rows):
        for name, (head, factor) in columns.items():
            try:
                value = float(row[head])
            except ValueError:
                word = f"{row[head]!r} is no number" if row[head].strip() else "it is missing"
                raise DembarkError(f"{path}, line {line}, column {name}: {word}") from None
            if not math.isfinite(value):
                raise DembarkError(f"{path}, line {line}, column {name}: {row[head]!r} is not finite", "",
                                   "leave rows out where a grain is not seen")
            table[name][place] = value * factor
    if (table["grain"] != np.round(table["grain"])).any():
        raise DembarkError(f"{path}: a number of a grain is no integer")
    ids, of_grain = np.unique(table["grain"].astype(np.int64), return_inverse=True)
    times, of_time = _frames(table["time"], table["grain"])
    cells = of_time * len(ids) + of_grain
    if len(np.unique(cells)) < len(cells):
        twice = int(cells[np.argmax(np.bincount(cells)[cells] > 1)])
        raise DembarkError(f"{path}: grain {ids[twice % len(ids)]} is there twice at {times[twice // len(ids)]:g} s")

    def spread(name: str) -> Array:
        out = np.full((len(times), len(ids)), np.nan)
        out[of_time, of_grain] = table[name]
        return out

    return Tracks(ids, times, np.stack([spread(axis) for axis in axes], axis=2), axes,
                  {name: spread(name) for name in OTHERS if name in table}, str(path))


def _heads(words: Sequence[str], path: Path) -> dict[str, tuple[str, float]]:
    """The text in the header, and the factor to SI, of each known column by its name."""
    known = {"time": "s", "grain": "1", **dict.fromkeys(AXES, "m"), **{name: unit for name, (unit, _) in OTHERS.items()}}
    found: dict[str, tuple[str, float]] = {}
    for word in words:
        match = _HEAD.fullmatch(word)
        name, unit = match.groups() if match else (word.strip(), None)
        if name not in known:
            continue
        if name in found:
            raise DembarkError(f"{path}: the column {name} is there twice")
        found[name] = word, to_si(f"1 {unit}", known[name], f"{path}, column {name}") if unit else 1.0
    return found


def _frames(values: Array, grains: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times of the frames, and which of them each of the `values` is. Values apart by less than a thousandth of the usual interval of a
    grain are one. Frames in which no grain was seen are there, too, when all intervals are multiples of the shortest."""
    times, which = np.unique(values, return_inverse=True)
    order = np.lexsort((values, grains))
    apart = np.diff(values[order])[np.diff(grains[order]) == 0.0]
    usual = float(np.median(apart)) if len(apart) else 0.0
    new = np.concatenate([[True], np.diff(times) > 1e-3 * usual])
    times, which = times[new], (np.cumsum(new) - 1)[which]
    steps = np.diff(times)
    parts = np.round(steps / steps.min()) if len(steps) else steps
    if len(steps) and parts.max() > 1.0 and np.abs(steps / steps.min() - parts).max() < 0.01 and parts.sum() < _MOST_GAPS * len(times):
        place = np.concatenate([[0], np.cumsum(parts)]).astype(np.intp)
        return np.linspace(times[0], times[-1], place[-1] + 1), place[which]
    return times, which


def write_csv(path: Path, tracks: Tracks) -> Path:
    """Write tracks as `read_csv` reads them: a row for each grain that is seen at a time, SI units."""
    names = ["time", "grain", *tracks.axes, *(name for name in OTHERS if name in tracks.others)]
    frame, grain = np.nonzero(np.isfinite(tracks.positions).all(axis=2))
    columns = [tracks.times[frame], tracks.ids[grain], *tracks.positions[frame, grain].T,
               *(tracks.others[name][frame, grain] for name in names[2 + len(tracks.axes):])]
    forms = ["%d" if name == "grain" else "%.10g" for name in names]
    text = io.StringIO()
    text.write(",".join(names) + "\n")
    np.savetxt(text, np.column_stack(columns), fmt=forms, delimiter=",")
    return write_atomic(path, text.getvalue().encode())
