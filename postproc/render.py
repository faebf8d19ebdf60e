"""Pictures of grains and slices through fields, rendered off screen with PyVista, and short animations of them as GIF.

A renderer may crash where graphics libraries are missing: it runs in a process of its own, and its crash is an error in one line.
"""

from __future__ import annotations

import io
import os
import pickle
import subprocess
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from dembark.common.errors import RunError
from dembark.common.files import write_atomic

from .fields.coarse_graining import interpolate
from .fields.field_set import FieldSet
from .grains import GrainFrame
from .plots import axis_label, scalar
from .style import STYLE

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


def sample(fields: FieldSet, name: str, places: Array) -> Array:
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


def field_scene(frame: GrainFrame, fields: FieldSet, name: str, axis: str = "y", place: float | None = None) -> Scene:
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
    return Scene(grains.positions, grains.radii, grains.values, axis_label(label, unit), corners[known], flat[known])


def limits(scenes: Sequence[Scene]) -> tuple[float, float]:
    """Ends of a colour scale that leave out 2 % of the values at either end."""
    parts = [part for one in scenes for part in (one.values, one.corner_values) if part is not None]
    values = np.concatenate([part[np.isfinite(part)] for part in parts]) if parts else np.zeros(0)
    low, high = (float(edge) for edge in np.percentile(values, [2.0, 98.0])) if len(values) else (0.0, 1.0)
    return low, high if high > low else low + 1.0


def render(scenes: Iterable[Scene], scale: tuple[float, float], pixels: int = _PIXELS) -> list[Picture]:
    """Pictures (height, width, 3) of scenes, all from the same camera, on the colour `scale` (low, high).

    RunError in one line when there is nothing to show or the renderer does not finish.
    """
    shown = list(scenes)
    corners = [one.corners.reshape(-1, 3) for one in shown if one.corners is not None]
    low = np.concatenate([np.full((1, 3), np.inf), *(one.positions - one.radii[:, None] for one in shown), *corners]).min(axis=0)
    high = np.concatenate([np.full((1, 3), -np.inf), *(one.positions + one.radii[:, None] for one in shown), *corners]).max(axis=0)
    if not np.isfinite(low).all():
        raise RunError("there is nothing to render", f"{len(shown)} scenes without a grain or a slice")
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    try:
        process = subprocess.run([sys.executable, "-m", __name__], input=pickle.dumps((shown, low, high, scale, pixels)),
                                 env=environment | {"PYVISTA_OFF_SCREEN": "true"}, capture_output=True, timeout=_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        raise RunError("the renderer did not finish", f"within {_TIMEOUT} s") from None
    if process.returncode != 0:
        said = [line.strip() for line in process.stderr.decode(errors="replace").splitlines() if line.strip()]
        raise RunError(f"the renderer ended with code {process.returncode}", said[-1][:160] if said else "")
    return pickle.loads(process.stdout)


def _draw(scene: Scene, low: Array, high: Array, scale: tuple[float, float], pixels: int) -> Picture:
    """The picture of a scene from a camera that sees the box from `low` to `high` (3,) in m."""
    import pyvista

    size, middle = high - low, 0.5 * (high + low)
    width, height = size[0] + 0.35 * size[1], size[2] + 0.18 * size[1]
    window = [int(pixels * np.clip(width / max(height, 1e-300), 0.45, 2.2)), pixels]
    style: dict[str, Any] = {"scalars": "value", "clim": scale, "cmap": _MAP, "nan_color": "#b9bec5", "show_scalar_bar": False}
    plotter = pyvista.Plotter(off_screen=True, window_size=window)
    plotter.background_color = pyvista.Color("white")
    if len(scene.radii):
        cloud = pyvista.PolyData(scene.positions)
        cloud["diameter"], cloud["value"] = 2.0 * scene.radii, scene.values
        detail = 18 if len(scene.radii) < 8000 else 10
        ball = pyvista.Sphere(radius=0.5, theta_resolution=detail, phi_resolution=detail)
        plotter.add_mesh(cloud.glyph(scale="diameter", orient=False, geom=ball), smooth_shading=True, ambient=0.25, diffuse=0.8,
                         specular=0.15, **style)
    if scene.corners is not None and scene.corner_values is not None and len(scene.corners):
        faces = np.column_stack([np.full(len(scene.corners), 4), np.arange(4 * len(scene.corners)).reshape(-1, 4)])
        surface = pyvista.PolyData(scene.corners.reshape(-1, 3), faces.ravel())
        surface.cell_data["value"] = scene.corner_values
        plotter.add_mesh(surface, lighting=False, **style)
    plotter.camera.parallel_projection = True
    plotter.camera_position = [tuple(middle + np.array([0.25, -1.0, 0.18]) * 10.0 * size.max()), tuple(middle), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_scale = 0.5 * max(height, width * window[1] / window[0]) * 1.06
    plotter.enable_anti_aliasing("ssaa")
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


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
    images = [Image.fromarray(image).quantize(64) for image in render(scenes, scale, pixels)]
    content = io.BytesIO()
    images[0].save(content, format="GIF", save_all=True, append_images=images[1:], duration=duration, loop=0, optimize=True)
    return write_atomic(Path(path), content.getvalue())


if __name__ == "__main__":
    _scenes, *_view = pickle.load(sys.stdin.buffer)
    pickle.dump([_draw(_one, *_view) for _one in _scenes], sys.stdout.buffer)
