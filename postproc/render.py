"""Pictures of scenes, spheres and surfaces, drawn off screen by VTK, with a colour scale, a length and the time.

VTK may crash where graphics libraries are missing: it runs in a process of its own, whose crash is an error in one line.
"""

from __future__ import annotations

import importlib.util
import io
import os
import pickle
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import write_atomic

from .style import GREY, INK, PALETTE, SEQUENTIAL, STYLE

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure
    from PIL.Image import Image

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

# Directions from what is seen to the eye.
VIEWS = {"front": (0.0, -1.0, 0.0), "back": (0.0, 1.0, 0.0), "side": (1.0, 0.0, 0.0), "top": (0.0, 0.0, 1.0), "iso": (1.0, -1.0, 1.0)}
STILLS, FILMS = (".png", ".jpg", ".webp"), (".webp", ".gif")
UNKNOWN = "#b9bec5"  # of grains without a value
_MARGINS = 0.04, 0.08  # to the left and right, above and below, over the size of the picture
_LARGEST, _LEAST = (1200, 900), (480, 400)  # pixels of a picture whose size is not given
_COMMAND = ("-m", __name__)
_TIMEOUT = 600.0  # s, for one picture
_HEAD = struct.Struct("<q")


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles (t, 3, 3) in m of one `colour`, or with `colours` (t, 3, 3) of their corners; `edges`: lines along sharp edges and where
    the surface ends; `smooth`: it is shaded as if it were curved."""

    triangles: Array
    colour: str = GREY
    opacity: float = 1.0
    colours: Bytes | None = None
    edges: bool = False
    smooth: bool = False


@dataclass(frozen=True, eq=False)
class Scene:
    """Spheres by `positions` (n, 3) and `radii` (n,) in m with `colours` (n, 3), and surfaces, at a `time` (s; NaN: unknown)."""

    positions: Array
    radii: Array
    colours: Bytes
    surfaces: tuple[Surface, ...] = ()
    time: float = np.nan


@dataclass(frozen=True, eq=False)
class View:
    """A parallel projection along `axes`, whose rows point to the right, up and to the eye."""

    axes: Array

    @classmethod
    def named(cls, name: str) -> View:
        """The view of a name of VIEWS, or from the direction `x,y,z`; DembarkError for what is neither."""
        try:
            toward = np.array(VIEWS.get(name) or [float(part) for part in name.split(",")])
        except ValueError:
            raise DembarkError(f"unknown view {name!r}", "in --view",
                               f"{nearest(name, VIEWS)} (or give the direction to the eye: 1,-1,0.5)") from None
        if toward.shape != (3,) or not np.isfinite(toward).all() or not toward.any():
            raise DembarkError(f"{name!r} is no direction", "in --view", "give three finite numbers, not all zero: 1,-1,0.5")
        toward = toward / np.linalg.norm(toward)
        up = np.array([0.0, 0.0, 1.0] if abs(toward[2]) < 1.0 - 1e-9 else [0.0, 1.0, 0.0])
        right = np.cross(up, toward)
        right /= np.linalg.norm(right)
        return cls(np.array([right, np.cross(toward, right), toward]))

    def extent(self, points: Array, radii: Array | float = 0.0) -> Array:
        """Lowest and highest coordinates (2, 3) along the axes of spheres at `points` (n, 3); infinite without a point."""
        places, reach = points.reshape(-1, 3) @ self.axes.T, np.broadcast_to(radii, len(points.reshape(-1, 3)))[:, None]
        return np.array([(places - reach).min(axis=0, initial=np.inf), (places + reach).max(axis=0, initial=-np.inf)])


@dataclass(frozen=True, eq=False)
class Camera:
    """What a picture of `size` (width, height) pixels shows: `centre` (3,) in m is in its middle, a pixel is `pixel` (m) wide."""

    view: View
    centre: Array
    pixel: float
    size: tuple[int, int]

    @classmethod
    def around(cls, view: View, extent: Array, size: tuple[int, int]) -> Camera:
        """The camera that shows an `extent` (2, 3), see View.extent, with margins."""
        span = np.maximum(extent[1] - extent[0], 1e-12)
        room = [one * (1.0 - 2.0 * margin) for one, margin in zip(size, _MARGINS, strict=True)]
        return cls(view, extent.mean(axis=0) @ view.axes, float(max(span[0] / room[0], span[1] / room[1])), size)

    def pixels(self, points: Array) -> Array:
        """Where points (n, 3) in m are in the picture (n, 2): to the right and down from its upper left corner."""
        across = (points - self.centre) @ self.view.axes[:2].T / self.pixel
        return np.asarray(0.5 * np.array(self.size) + across * [1.0, -1.0])


@dataclass(frozen=True, eq=False)
class Colours:
    """Colours of values from `low` to `high` on the map `name` of matplotlib, or of the `kinds` among them, each with one of its own;
    `label` says what the values are."""

    label: str
    low: float = 0.0
    high: float = 1.0
    kinds: tuple[int, ...] = ()
    name: str = SEQUENTIAL

    def rgb(self, values: Array) -> Bytes:
        """Colours (..., 3) of values (...); those that are NaN are grey."""
        scale = self._scale()
        flat = np.ma.masked_invalid(np.asarray(values, float))
        return np.asarray(np.round(255.0 * scale.to_rgba(flat.ravel())[:, :3]), np.uint8).reshape(*flat.shape, 3)

    def _scale(self) -> Any:
        import matplotlib as mpl
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize

        if self.kinds:
            edges = [self.kinds[0] - 0.5, *(0.5 * (a + b) for a, b in zip(self.kinds, self.kinds[1:], strict=False)), self.kinds[-1] + 0.5]
            colours = ListedColormap([PALETTE[k % len(PALETTE)] for k in range(len(self.kinds))]).with_extremes(bad=UNKNOWN)
            return ScalarMappable(BoundaryNorm(edges, len(self.kinds)), colours)
        return ScalarMappable(Normalize(self.low, self.high), mpl.colormaps[self.name].with_extremes(bad=UNKNOWN))

    def bar(self, axes: Any) -> None:
        """Draw the scale into `axes` of matplotlib."""
        bar = axes.figure.colorbar(self._scale(), cax=axes, spacing="uniform", extend="neither" if self.kinds else "both")
        if self.kinds:
            bar.set_ticks(list(self.kinds), labels=[str(kind) for kind in self.kinds])
        bar.set_label(self.label)
        bar.outline.set_linewidth(0.4)


@dataclass(frozen=True, eq=False)
class Sheet:
    """A picture of `size` (width, height) pixels in a `view` of everything in `extent`, see View.extent, with the scale of `colours` on its
    right (None: none). Without a size it has the shape of the extent. `letters` are so high, over the height of a picture of 4 by 3."""

    view: View
    extent: Array
    colours: Colours | None = None
    size: tuple[int, int] | None = None
    letters: float = 0.02
    camera: Camera = field(init=False)

    def __post_init__(self) -> None:
        if self.size is None:
            span = np.maximum(self.extent[1] - self.extent[0], 1e-12)[:2] / (1.0 - 2.0 * np.array(_MARGINS))
            fitting = np.clip(span * (np.array(_LARGEST) / span).min(), _LEAST, _LARGEST)
            object.__setattr__(self, "size", (round(fitting[0]), round(fitting[1])))
        assert self.size
        width, height = self.size
        bar = round(min(max(8.0 * self.letters * max(0.75 * width, height), 90.0), 0.3 * width)) if self.colours else 0
        object.__setattr__(self, "camera", Camera.around(self.view, self.extent, (width - bar, height)))

    def compose(self, image: Bytes, time: float) -> Bytes:
        """The picture (height, width, 3): the `image` of the scene, scales and the time (s; none where it is NaN)."""
        import matplotlib as mpl
        from matplotlib.figure import Figure

        assert self.size
        width, height = self.size
        dots, shown = 100.0, self.camera.size[0]
        letters = max(7.0, self.letters * max(0.75 * width, height) * 72.0 / dots)  # points
        with mpl.rc_context({**STYLE, "font.size": letters}):
            figure = Figure(figsize=(width / dots, height / dots), dpi=dots, facecolor="white")
            figure.figimage(image, 0, 0, origin="upper")
            if np.isfinite(time):
                figure.text(0.5 * _MARGINS[0], 1.0 - 0.5 * _MARGINS[1], f"t = {time:.4g} s", va="center", color=INK)
            length, text = _round_length(0.2 * shown * self.camera.pixel)
            left, low, end = 0.5 * _MARGINS[0], 0.3 * _MARGINS[1], length / self.camera.pixel / width
            figure.add_artist(mpl.lines.Line2D([left, left + end], [low, low], color=INK, linewidth=1.6, solid_capstyle="butt"))
            figure.text(left, low + 0.12 * _MARGINS[1], text, va="bottom", color=INK)
            if self.colours:
                axes = figure.add_axes(((shown + 0.1 * (width - shown)) / width, 0.14, 0.11 * (width - shown) / width, 0.72))
                self.colours.bar(axes)
            return pixels(figure)


def pixels(figure: Figure) -> Bytes:
    """A figure of matplotlib as a picture (height, width, 3)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = FigureCanvasAgg(figure)  # without types
    canvas.draw()
    return np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _round_length(most: float) -> tuple[float, str]:
    """A length of one digit, 1, 2 or 5, of at most `most` (m), and how it is written."""
    power = 10.0 ** np.floor(np.log10(most))
    length = next(step * power for step in (5.0, 2.0, 1.0) if step * power <= most * (1.0 + 1e-9))
    factor, unit = next((one for one in ((1.0, "m"), (1e3, "mm")) if length * one[0] >= 1.0), (1e6, "µm"))
    return length, f"{length * factor:g} {unit}"


class Renderer:
    """Draws scenes, one at a time, in a process that lasts as long as the `with` block."""

    def __init__(self, camera: Camera) -> None:
        """ModuleNotFoundError where VTK is not installed."""
        if importlib.util.find_spec("pyvista") is None:
            raise ModuleNotFoundError("no module pyvista", name="pyvista")
        self._camera = camera

    def __enter__(self) -> Self:
        environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
        self._said = tempfile.TemporaryFile()
        self._process = subprocess.Popen([sys.executable, *_COMMAND], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said,
                                         env=environment | {"PYVISTA_OFF_SCREEN": "true"})
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._process.kill()
        self._process.communicate()
        self._said.close()

    def draw(self, scene: Scene) -> Bytes:
        """The image (height, width, 3) of a scene; RunError in one line when the renderer fails or does not finish."""
        late = threading.Event()

        def end() -> None:
            late.set()
            self._process.kill()

        timer = threading.Timer(_TIMEOUT, end)
        timer.start()
        assert self._process.stdin
        assert self._process.stdout
        try:
            _send(self._process.stdin, (scene, self._camera))
            return np.asarray(_receive(self._process.stdout), np.uint8)
        except (OSError, EOFError):
            if late.is_set():
                raise RunError("the renderer did not finish", f"within {_TIMEOUT:.0f} s") from None
            code = self._process.wait()
            self._said.seek(0)
            said = [line.strip() for line in self._said.read().decode(errors="replace").splitlines() if line.strip()]
            raise RunError(f"the renderer ended with code {code}", said[-1][:160] if said else "") from None
        finally:
            timer.cancel()


def _send(pipe: Any, content: Any) -> None:
    data = pickle.dumps(content, protocol=pickle.HIGHEST_PROTOCOL)
    pipe.write(_HEAD.pack(len(data)) + data)
    pipe.flush()


def _receive(pipe: Any) -> Any:
    head = pipe.read(_HEAD.size)
    if len(head) < _HEAD.size:
        raise EOFError
    count = _HEAD.unpack(head)[0]
    data = pipe.read(count)
    if len(data) < count:
        raise EOFError
    return pickle.loads(data)


def _image(scene: Scene, camera: Camera) -> Bytes:
    """The image of a scene, by VTK."""
    import pyvista

    # The types of PyVista misread some of its methods.
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(camera.size))
    plotter.background_color = pyvista.Color("white")
    eye = camera.view
    if len(scene.radii):
        _add_spheres(plotter, scene, camera.centre)
    for one in scene.surfaces:
        _add_surface(plotter, one, camera.centre)
    # The nearest is as far from the eye as the farthest from the nearest; single precision wants places around 0.
    depths = np.array([eye.extent(scene.positions - camera.centre, scene.radii),
                       *(eye.extent(one.triangles - camera.centre) for one in scene.surfaces)])[:, :, 2]
    nearest_one, span = float(depths[:, 1].max()), max(float(depths[:, 1].max() - depths[:, 0].min()), camera.pixel)
    plotter.camera.parallel_projection = True
    plotter.camera_position = [tuple((nearest_one + span) * eye.axes[2]), (0.0, 0.0, 0.0), tuple(eye.axes[1])]
    plotter.camera.parallel_scale = 0.5 * camera.size[1] * camera.pixel
    if any(one.opacity < 1.0 for one in scene.surfaces):
        plotter.enable_depth_peeling(8)
    if len(scene.radii):
        # Grains cast shade on those that they touch; from farther away, VTK counts the empty background, too.
        size = float(np.median(scene.radii))
        plotter.enable_ssao(radius=2.0 * size, bias=0.1 * size, kernel_size=64)
    plotter.enable_anti_aliasing("ssaa")
    plotter.camera.clipping_range = (0.9 * span, 2.1 * span)
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


def _add_spheres(plotter: pyvista.Plotter, scene: Scene, centre: Array) -> None:
    """Spheres are computed for each pixel, not made of triangles."""
    import pyvista
    from vtkmodules.vtkRenderingCore import vtkActor
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSphereMapper

    cloud = pyvista.PolyData(np.asarray(scene.positions - centre, np.float32))
    cloud["radius"], cloud["colour"] = np.asarray(scene.radii, np.float32), scene.colours
    mapper, actor = vtkOpenGLSphereMapper(), vtkActor()
    mapper.SetInputData(cloud)
    mapper.SetScaleArray("radius")
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("colour")
    mapper.SetColorModeToDirectScalars()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetAmbient(0.4)
    look.SetDiffuse(0.7)
    look.SetSpecular(0.15)
    look.SetSpecularPower(20.0)
    plotter.renderer.AddActor(actor)


def _add_surface(plotter: pyvista.Plotter, surface: Surface, centre: Array) -> None:
    from .walls.mesh import surface_of

    mesh = surface_of(surface.triangles - centre)
    how: dict[str, Any] = {"color": surface.colour}
    if surface.colours is not None:
        mesh["colour"] = surface.colours.reshape(-1, 3)
        how = {"scalars": "colour", "rgb": True}
    mesh = mesh.clean()
    actor = plotter.add_mesh(mesh, opacity=surface.opacity, smooth_shading=surface.smooth, ambient=0.4, diffuse=0.65,
                     specular=0.4 if surface.smooth else 0.0, specular_power=30.0, show_scalar_bar=False, **how)
    if surface.opacity < 1.0 and not surface.smooth:
        # Of a wall and the water at it, the water is seen.
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 20.0)
    if surface.edges:
        lines = mesh.extract_feature_edges(30.0, boundary_edges=True, feature_edges=True, manifold_edges=False, non_manifold_edges=True)
        if lines.n_cells:
            plotter.add_mesh(lines, color=GREY, line_width=1.2, lighting=False)


def still(image: Bytes, suffix: str) -> bytes:
    """A picture as the content of a file with a suffix of STILLS."""
    from PIL import Image

    return _saved(Image.fromarray(image), suffix, quality=90)


def write_film(path: Path, pictures: Iterable[tuple[float, Bytes]], duration: float, advance: Callable[[], None] = lambda: None,
               colours: int = 128) -> Path:
    """Write times and pictures (height, width, 3) as a film with a suffix of FILMS, each picture for `duration` (ms); a GIF has so many
    `colours`. Calls `advance` after each picture; returns the path."""
    from PIL import Image

    images = []
    for _, picture in pictures:
        image = Image.fromarray(picture)
        images.append(image.quantize(colours) if path.suffix == ".gif" else image)
        advance()
    return write_atomic(path, _saved(images[0], path.suffix, save_all=True, append_images=images[1:], duration=round(duration), loop=0,
                                     quality=80, optimize=True))


def _saved(image: Image, suffix: str, **how: Any) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, {".png": "PNG", ".jpg": "JPEG", ".webp": "WEBP", ".gif": "GIF"}[suffix], **how)
    return buffer.getvalue()


if __name__ == "__main__":
    # VTK may write to the standard output.
    with os.fdopen(os.dup(1), "wb") as _out, suppress(EOFError):
        os.dup2(2, 1)
        while True:
            _send(_out, _image(*_receive(sys.stdin.buffer)))
