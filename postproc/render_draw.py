"""The process that renders scenes for `render.py`; it loads nothing but what it needs, and then waits for the name of their folder."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pyvista
from PIL import Image


def draw(folder: Path) -> None:
    """Draw every scene-*.npz of `folder` from the camera of view.json into a PNG beside it."""
    view = json.loads((folder / "view.json").read_text())
    low, high, scale = np.array(view["low"]), np.array(view["high"]), view["scale"]
    size, middle = high - low, 0.5 * (high + low)
    share = (size[0] + 0.35 * size[1]) / max(size[2] + 0.18 * size[1], 1e-300)
    window = int(view["pixels"] * np.clip(share, 0.45, 2.2)), int(view["pixels"])
    style = {"clim": scale, "cmap": view["map"], "nan_color": "#b9bec5", "show_scalar_bar": False}
    for path in sorted(folder.glob("scene-*.npz")):
        data = np.load(path)
        plotter = pyvista.Plotter(off_screen=True, window_size=list(window))
        plotter.background_color = pyvista.Color("white")
        if len(data["radii"]):
            cloud = pyvista.PolyData(data["positions"])
            cloud["diameter"], cloud["value"] = 2.0 * data["radii"], data["values"]
            detail = 18 if len(data["radii"]) < 8000 else 10
            ball = pyvista.Sphere(radius=0.5, theta_resolution=detail, phi_resolution=detail)
            plotter.add_mesh(cloud.glyph(scale="diameter", orient=False, geom=ball), scalars="value", smooth_shading=True, ambient=0.25,
                             diffuse=0.8, specular=0.15, **style)
        if len(data["corners"]):
            faces = np.column_stack([np.full(len(data["corners"]), 4), np.arange(4 * len(data["corners"])).reshape(-1, 4)])
            surface = pyvista.PolyData(data["corners"].reshape(-1, 3), faces.ravel())
            surface.cell_data["value"] = data["corner_values"]
            plotter.add_mesh(surface, scalars="value", lighting=False, **style)
        plotter.camera.parallel_projection = True
        plotter.camera_position = [tuple(middle + np.array([0.25, -1.0, 0.18]) * 10.0 * size.max()), tuple(middle), (0.0, 0.0, 1.0)]
        plotter.camera.parallel_scale = 0.5 * max(size[2] + 0.18 * size[1], (size[0] + 0.35 * size[1]) * window[1] / window[0]) * 1.06
        plotter.enable_anti_aliasing("ssaa")
        Image.fromarray(np.asarray(plotter.screenshot(return_img=True))).save(path.with_suffix(".png"))
        plotter.close()


if __name__ == "__main__":
    # Nothing comes where the process that wanted pictures has ended.
    if wanted := sys.stdin.read():
        draw(Path(wanted))
