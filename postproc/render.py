"""Pictures of grains, rendered off screen with PyVista.

A renderer may crash where graphics libraries are missing: it runs in a process of its own, and its crash is an error in one line.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dembark.common.errors import RunError

from .grains import GrainFrame
from .style import SEQUENTIAL, STYLE

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_PIXELS = 900
_TIMEOUT = 600


@dataclass(frozen=True, eq=False)
class Scene:
    """Grains by `positions` (n, 3) and `radii` (n,) in m, coloured by `values` (n,; NaN grey); `label` says what the values are."""

    positions: Array
    radii: Array
    values: Array
    label: str = ""


def grain_scene(frame: GrainFrame, values: Array | None = None, label: str = "", keep: NDArray[np.bool_] | None = None) -> Scene:
    """Grains of a frame, coloured by `values` (n,) or else by their speed (m/s); only those where `keep` (n,) is true."""
    if values is None:
        values, label = np.linalg.norm(frame.velocities, axis=1), "speed / (m/s)"
    chosen = np.ones(len(frame.radii), bool) if keep is None else keep
    return Scene(frame.wrapped[chosen], frame.radii[chosen], np.asarray(values, float)[chosen], label)


def limits(scene: Scene) -> tuple[float, float]:
    """Ends of a colour scale that leave out 2 % of the values at either end."""
    values = scene.values[np.isfinite(scene.values)]
    low, high = (float(edge) for edge in np.percentile(values, [2.0, 98.0])) if len(values) else (0.0, 1.0)
    return low, high if high > low else low + 1.0


def render(scene: Scene, scale: tuple[float, float], pixels: int = _PIXELS) -> Picture:
    """Picture (height, width, 3) of a scene on the colour `scale` (low, high).

    RunError in one line when there is nothing to show or the renderer does not finish.
    """
    if not len(scene.radii):
        raise RunError("there is nothing to render", "a scene without a grain")
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    try:
        process = subprocess.run([sys.executable, "-m", __name__], input=pickle.dumps((scene, scale, pixels)),
                                 env=environment | {"PYVISTA_OFF_SCREEN": "true"}, capture_output=True, timeout=_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        raise RunError("the renderer did not finish", f"within {_TIMEOUT} s") from None
    if process.returncode != 0:
        said = [line.strip() for line in process.stderr.decode(errors="replace").splitlines() if line.strip()]
        raise RunError(f"the renderer ended with code {process.returncode}", said[-1][:160] if said else "")
    return pickle.loads(process.stdout)


def _draw(scene: Scene, scale: tuple[float, float], pixels: int) -> Picture:
    """The picture of a scene."""
    import pyvista

    around = scene.radii[:, None]
    low, high = (scene.positions - around).min(axis=0), (scene.positions + around).max(axis=0)
    size, middle = high - low, 0.5 * (high + low)
    width, height = size[0] + 0.35 * size[1], size[2] + 0.18 * size[1]
    window = [int(pixels * np.clip(width / max(height, 1e-300), 0.45, 2.2)), pixels]
    style: dict[str, Any] = {"scalars": "value", "clim": scale, "cmap": SEQUENTIAL, "nan_color": "#b9bec5", "show_scalar_bar": False}
    plotter = pyvista.Plotter(off_screen=True, window_size=window)
    plotter.background_color = pyvista.Color("white")
    cloud = pyvista.PolyData(scene.positions)
    cloud["diameter"], cloud["value"] = 2.0 * scene.radii, scene.values
    detail = 18 if len(scene.radii) < 8000 else 10
    ball = pyvista.Sphere(radius=0.5, theta_resolution=detail, phi_resolution=detail)
    plotter.add_mesh(cloud.glyph(scale="diameter", orient=False, geom=ball), smooth_shading=True, ambient=0.25, diffuse=0.8, specular=0.15,
                     **style)
    plotter.camera.parallel_projection = True
    plotter.camera_position = [tuple(middle + np.array([0.25, -1.0, 0.18]) * 10.0 * size.max()), tuple(middle), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_scale = 0.5 * max(height, width * window[1] / window[0]) * 1.06
    plotter.enable_anti_aliasing("ssaa")
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


def picture(scene: Scene, scale: tuple[float, float] | None = None, height: float = 4.0) -> Figure:
    """A scene as a Figure with its colour scale; `height` in inches."""
    scale = limits(scene) if scale is None else scale
    image = render(scene, scale)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(height * image.shape[1] / image.shape[0] + 1.1, height), layout="constrained")
        axes = figure.subplots()
        axes.imshow(image, interpolation="antialiased")
        axes.axis("off")
        bar = figure.colorbar(ScalarMappable(Normalize(*scale), SEQUENTIAL), ax=axes, shrink=0.75, aspect=22, pad=0.02, extend="both")
        bar.set_label(scene.label)
        bar.outline.set_linewidth(0.4)
    return figure


if __name__ == "__main__":
    pickle.dump(_draw(*pickle.load(sys.stdin.buffer)), sys.stdout.buffer)
