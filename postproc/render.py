"""Pictures of grains and slices through fields, rendered off screen with PyVista, and short animations of them as GIF.

A renderer may crash for want of graphics libraries, so it runs in a process of its own and its end is told in one line.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from dembark.common.errors import RunError
from dembark.postproc.fields.coarse_graining import interpolate
from dembark.postproc.grains import GrainFrame
from dembark.postproc.output.whole import Labelled, WholeFile
from dembark.postproc.plots import labelled, scalar
from dembark.postproc.style import STYLE

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_MAP = "cividis"
_PIXELS = 900
_TIMEOUT = 600


@dataclass(frozen=True, eq=False)
class Scene:
    """What is shown: grains by `positions` (n, 3), `radii` (n,) in m, coloured by `values` (n,; NaN grey), and slices of cells.

    `corners` (c, 4, 3) in m and `corner_values` (c,) are quadrilaterals on the same colour scale; `label` says what the values are.
    """

    positions: Array
    radii: Array
    values: Array
    label: str = ""
    corners: Array | None = None
    corner_values: Array | None = None


def sample(fields: Labelled, name: str, places: Array) -> Array:
    """A scalar of the fields (see `plots.scalar`) at `places` (n, 3) in m, linear between the centres of cells that have a value."""
    values, _, _ = scalar(fields, name)
    known = np.isfinite(values)
    both = interpolate(np.stack([np.where(known, values, 0.0), known.astype(float)], axis=-1), fields.grid, places)
    return np.divide(both[:, 0], both[:, 1], out=np.full(len(places), np.nan), where=both[:, 1] > 0.0)


def grain_scene(frame: GrainFrame, values: Array | None = None, label: str = "", keep: NDArray[np.bool_] | None = None) -> Scene:
    """Grains of a frame, coloured by `values` (n,) or else by their speed (m/s); only those where `keep` (n,) is true."""
    if values is None:
        values, label = np.linalg.norm(frame.velocities, axis=1), "speed / (m/s)"
    chosen = np.ones(len(frame.radii), bool) if keep is None else keep
    return Scene(frame.wrapped[chosen], frame.radii[chosen], np.asarray(values, float)[chosen], label)


def field_scene(frame: GrainFrame, fields: Labelled, name: str, axis: str = "y", place: float | None = None) -> Scene:
    """A scalar field cut across `axis` at `place` (m; in the middle when not given), and the grains behind the cut in its colours.

    The cells of the cut are shown on one half of it, where the density is more than a tenth of the largest; on the other half are the
    grains alone.
    """
    across = "xyz".index(axis)
    edges = [fields.grid.edges(one) for one in range(3)]
    at = 0.5 * (edges[across][0] + edges[across][-1]) if place is None else place
    layer = int(np.clip(np.searchsorted(edges[across], at, side="right") - 1, 0, fields.grid.shape[across] - 1))
    values, unit, label = scalar(fields, name)
    right, up = (one for one in range(3) if one != across)
    mesh = np.zeros((len(edges[right]), len(edges[up]), 3))
    mesh[..., across] = at
    mesh[..., right], mesh[..., up] = np.meshgrid(edges[right], edges[up], indexing="ij")
    corners = np.stack([mesh[:-1, :-1], mesh[1:, :-1], mesh[1:, 1:], mesh[:-1, 1:]], axis=2).reshape(-1, 4, 3)
    density = np.nan_to_num(fields.arrays()["density"])
    filled = np.isfinite(values) & (density > 0.1 * density.max())
    filled &= np.moveaxis(np.arange(fields.grid.shape[right])[:, None, None] >= fields.grid.shape[right] // 2, 0, right)
    known, flat = (np.take(one, layer, axis=across).ravel() for one in (filled, values))
    grains = grain_scene(frame, sample(fields, name, frame.wrapped), keep=frame.wrapped[:, across] > at + frame.radii)
    return Scene(grains.positions, grains.radii, grains.values, labelled(label, unit), corners[known], flat[known])


def limits(scenes: Sequence[Scene]) -> tuple[float, float]:
    """Ends of a colour scale that leave out 2 % of the values at either end."""
    parts = [part for one in scenes for part in (one.values, one.corner_values) if part is not None]
    values = np.concatenate([part[np.isfinite(part)] for part in parts]) if parts else np.zeros(0)
    low, high = (float(edge) for edge in np.percentile(values, [2.0, 98.0])) if len(values) else (0.0, 1.0)
    return low, high if high > low else low + 1.0


def render(scenes: Iterable[Scene], scale: tuple[float, float], pixels: int = _PIXELS) -> list[Picture]:
    """Pictures (height, width, 3) of scenes, all from the same camera, on the colour `scale` (low, high).

    RunError in one line when there is nothing to show or the renderer does not come to its end.
    """
    with tempfile.TemporaryDirectory(prefix="dembark-render-") as folder:
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        count = 0
        for one in scenes:
            corners = np.zeros((0, 4, 3)) if one.corners is None else one.corners
            np.savez(Path(folder, f"scene-{count:06d}.npz"), positions=one.positions, radii=one.radii, values=one.values, corners=corners,
                     corner_values=np.zeros(0) if one.corner_values is None else one.corner_values)
            for places, reach in ((one.positions, one.radii[:, None]), (corners.reshape(-1, 3), 0.0)):
                low = np.minimum(low, (places - reach).min(axis=0, initial=np.inf))
                high = np.maximum(high, (places + reach).max(axis=0, initial=-np.inf))
            count += 1
        if not np.isfinite(low).all():
            raise RunError("there is nothing to render", f"{count} scenes without a grain or a slice")
        view = {"low": low.tolist(), "high": high.tolist(), "scale": scale, "pixels": pixels, "map": _MAP}
        Path(folder, "view.json").write_text(json.dumps(view), encoding="utf-8")
        _call(folder)
        return [np.asarray(Image.open(path)) for path in sorted(Path(folder).glob("scene-*.png"))]


def _call(folder: str) -> None:
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment["PYVISTA_OFF_SCREEN"] = "true"
    command = [sys.executable, str(Path(__file__).with_name("render_draw.py"))]
    try:
        done = subprocess.run(command, input=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                              errors="replace", timeout=_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        raise RunError("the renderer did not come to its end", f"within {_TIMEOUT} s") from None
    if done.returncode != 0:
        said = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        raise RunError(f"the renderer ended with code {done.returncode}", said[-1][:160] if said else "")


def picture(scene: Scene, scale: tuple[float, float] | None = None, height: float = 4.0) -> Figure:
    """A scene as a Figure with its colour scale; `height` in inches."""
    scale = limits([scene]) if scale is None else scale
    image = render([scene], scale)[0]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(height * image.shape[1] / image.shape[0] + 1.1, height), layout="constrained")
        axes = figure.subplots()
        axes.imshow(image, interpolation="antialiased")
        axes.axis("off")
        bar = figure.colorbar(ScalarMappable(Normalize(*scale), _MAP), ax=axes, shrink=0.75, aspect=22, pad=0.02, extend="both")
        bar.set_label(scene.label)
        bar.outline.set_linewidth(0.4)
    return figure


def animate(path: str | Path, scenes: Iterable[Scene], scale: tuple[float, float], *, duration: int = 80, pixels: int = 400) -> Path:
    """Scenes one after the other as a GIF, each for `duration` ms, on one colour `scale`; returns the path."""
    with WholeFile(path) as part:
        images = [Image.fromarray(image).quantize(64) for image in render(scenes, scale, pixels)]
        images[0].save(part, format="GIF", save_all=True, append_images=images[1:], duration=duration, loop=0, optimize=True)
    return Path(path)
