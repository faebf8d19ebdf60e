"""Packings rendered off screen. A renderer may crash for want of graphics libraries, so it runs in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from dembark.postproc import ContactFrame, ContactsDump, GrainFrame, GrainsDump
from dembark.postproc.fields.coarse_graining import WallContacts, rows_of
from dembark.postproc.spheres import volume
from dembark.postproc.walls import CylinderWall, PlaneWall, wall_contacts
from dembark.validation.report.figures import engine_name
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import cKDTree

_MAP = "cividis"
_TIMEOUT = 180


@dataclass(frozen=True)
class Scene:
    """Grains to show: `positions` (n, 3) and `radii` (n,) in m, `values` (n,) to colour them by (NaN: grey) and what these are."""

    positions: NDArray[np.float64]
    radii: NDArray[np.float64]
    values: NDArray[np.float64]
    label: str


def scene(folder: Path, colour_by: str, scale: float, cut: bool, radius: float = 0.0) -> Scene:
    """The last frame of the run in `folder`.

    `colour_by` is "velocity" (downward, over `scale` in m/s), "force" (sum of the normal contact forces on a grain over the mean
    weight of a grain, `scale` being gravity in m/s2) or "stress" (pressure in a grain by its contacts with others, and with wall
    and base of a silo of `radius` (m), over `scale` in Pa); `cut` leaves out the half that is nearer to the eye.
    """
    grains = GrainsDump(folder / "grains.dump")
    frame = grains[len(grains) - 1]
    if colour_by == "velocity":
        values, label = -frame.velocities[:, 2] / scale, "downward velocity v / v₀"
    elif colour_by == "stress":
        contacts = ContactsDump(folder / "contacts.dump")[len(grains) - 1]
        walls = [wall_contacts(frame, wall) for wall in (CylinderWall("side", radius), PlaneWall("base"))] if radius else []
        values = grain_pressure(frame, contacts, walls) / scale
        label = "pressure in a grain" + (" (kPa)" if scale == 1e3 else f" / {scale:g} Pa")
    else:
        contacts = ContactsDump(folder / "contacts.dump")[len(grains) - 1]
        length = np.linalg.norm(contacts.branch, axis=1)
        normal = np.abs(np.sum(contacts.forces * contacts.branch, axis=1)) / np.maximum(length, 1e-300)
        index = np.searchsorted(frame.ids, contacts.ids)
        values = sum(np.bincount(index[:, side], normal, len(frame.ids)) for side in (0, 1)) / (frame.masses.mean() * scale)
        label = "normal contact forces on a grain / its weight"
    values = np.where(frame.types == 1, values, np.nan)
    keep = frame.wrapped[:, 1] >= 0.0 if cut else np.ones(len(frame.ids), bool)
    # Glued grains of a rough wall reach far beyond the packing.
    free = frame.positions[frame.types == 1, 2]
    keep &= (frame.positions[:, 2] >= free.min() - 3.0 * frame.radii.max()) & (
        frame.positions[:, 2] <= free.max() + 3.0 * frame.radii.max()
    )
    return Scene(frame.wrapped[keep], frame.radii[keep], values[keep], label)


def grain_pressure(frame: GrainFrame, contacts: ContactFrame, walls: Sequence[WallContacts] = ()) -> NDArray[np.float64]:
    """Pressure (n,) in Pa in each grain: -1/3 of the sum of f . r over its contacts, over its volume, r from its centre to the contact;
    compression positive."""
    index = rows_of(frame.ids, contacts.ids, contacts.step)
    # The contact lies where the two grains share the way between their centres by their radii.
    share = frame.radii[index] / np.maximum(frame.radii[index].sum(axis=1), 1e-300)[:, None]
    moment = -np.sum(contacts.forces * contacts.branch, axis=1)[:, None] * share
    total = sum(np.bincount(index[:, side], moment[:, side], len(frame.ids)) for side in (0, 1))
    for wall in walls:
        _, row = cKDTree(frame.positions).query(wall.positions)
        total = total - np.bincount(row, np.sum(wall.forces * (wall.points - wall.positions), axis=1), len(frame.ids))
    return np.asarray(total / (3.0 * volume(frame.radii)))


def picture(scenes: dict[str, Scene | str], height: float = 3.3) -> tuple[Figure | None, list[str]]:
    """The engines' packings side by side on one colour scale, and for each one that is not there the reason in one line.

    A scene given as text is already a reason.
    """
    reasons = [f"No picture of {engine_name(engine)}: {one}." for engine, one in scenes.items() if isinstance(one, str)]
    shown = {engine: one for engine, one in scenes.items() if isinstance(one, Scene)}
    if not shown:
        return None, reasons
    everything = np.concatenate([one.values[np.isfinite(one.values)] for one in shown.values()])
    low, high = (float(edge) for edge in np.percentile(everything, [2.0, 98.0]))
    images = {}
    for engine, one in shown.items():
        image, reason = _rendered(one, low, high)
        if image is None:
            reasons.append(f"No picture of {engine_name(engine)}: {reason}.")
        else:
            images[engine] = image
    if not images:
        return None, reasons
    label = next(iter(shown.values())).label
    with matplotlib.rc_context({"font.size": 7.5, "text.color": "#22262b"}):
        widths = [image.shape[1] / image.shape[0] for image in images.values()]
        figure = Figure(figsize=(min(7.2, sum(widths) * height + 1.4), height), layout="constrained")
        axes = figure.subplots(1, len(images), squeeze=False, width_ratios=widths)[0]
        for one, (engine, image) in zip(axes, images.items(), strict=True):
            one.imshow(image, interpolation="antialiased")
            one.set_title(engine_name(engine), fontsize=8.5, fontweight="bold")
            one.axis("off")
        bar = figure.colorbar(ScalarMappable(Normalize(low, high), _MAP), ax=list(axes), shrink=0.75, aspect=22, pad=0.02, extend="both")
        bar.set_label(label)
        bar.outline.set_linewidth(0.4)
    return figure, reasons


def _rendered(one: Scene, low: float, high: float) -> tuple[NDArray[np.uint8] | None, str]:
    with tempfile.TemporaryDirectory(prefix="dembark-picture-") as folder:
        source, target = Path(folder, "scene.npz"), Path(folder, "picture.npy")
        np.savez(source, positions=one.positions, radii=one.radii, values=one.values, limits=[low, high])
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")} | {
            "PYVISTA_OFF_SCREEN": "true"
        }
        try:
            done = subprocess.run(
                [sys.executable, "-m", __name__, str(source), str(target)],
                env=environment,
                capture_output=True,
                text=True,
                timeout=_TIMEOUT,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return None, f"the renderer did not finish within {_TIMEOUT} s"
        if done.returncode == 0 and target.is_file():
            return np.load(target), ""
        said = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        return None, f"the renderer ended with code {done.returncode}" + (f" ({said[-1][:160]})" if said else "")


def _draw(source: Path, target: Path) -> None:
    import pyvista

    data = np.load(source)
    positions, radii, values = data["positions"], data["radii"], data["values"]
    cloud = pyvista.PolyData(positions)
    cloud["diameter"], cloud["value"] = 2.0 * radii, values
    detail = 18 if len(radii) < 8000 else 12
    spheres = cloud.glyph(scale="diameter", orient=False, geom=pyvista.Sphere(radius=0.5, theta_resolution=detail, phi_resolution=detail))
    low, high = (positions - radii[:, None]).min(axis=0), (positions + radii[:, None]).max(axis=0)
    size, middle = high - low, 0.5 * (high + low)
    pixels = 900
    plotter = pyvista.Plotter(
        off_screen=True, window_size=(int(pixels * max(0.45, min(2.2, (size[0] + 0.35 * size[1]) / size[2]))), pixels)
    )
    plotter.set_background("white")
    plotter.add_mesh(
        spheres,
        scalars="value",
        cmap=_MAP,
        clim=list(data["limits"]),
        nan_color="#b9bec5",
        show_scalar_bar=False,
        smooth_shading=True,
        ambient=0.25,
        diffuse=0.8,
        specular=0.15,
    )
    plotter.enable_parallel_projection()
    plotter.camera_position = [tuple(middle + np.array([0.25, -1.0, 0.18]) * 10.0 * size.max()), tuple(middle), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_scale = 0.5 * size[2] * 1.06
    plotter.enable_anti_aliasing("ssaa")
    np.save(target, plotter.screenshot(return_img=True))


if __name__ == "__main__":
    _draw(Path(sys.argv[1]), Path(sys.argv[2]))
