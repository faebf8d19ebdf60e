"""Pictures of what was simulated: drawn from the trajectory when a series is measured, so that reports need only include them."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dembark.common.errors import DembarkError
from dembark.common.extras import missing_extra
from dembark.common.files import write_atomic

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURE, ANIMATION = "picture.png", "animation.gif"


def draw(folder: Path, wanted: Mapping[str, Any] | None) -> list[str]:
    """Write `picture.png`, and `animation.gif` of a cross-section, of the first replica of a series into its `folder`.

    `wanted` is what the case's `picture(parameters)` returned, None for no picture. Returns a remark where one cannot be drawn; an older
    picture does not stay.
    """
    for name in (PICTURE, ANIMATION):
        (folder / name).unlink(missing_ok=True)
    if not wanted:
        return []
    try:
        from ..render import still
        from . import scenes, sections
    except ModuleNotFoundError as error:
        return [f"No picture: {missing_extra(error, 'it')}."]
    replica = next(iter(sorted(folder.glob("replica-*/grains.dump"))), None)
    if replica is None:
        return ["No picture: the run's grains.dump is no longer there."]
    try:
        if "cross_section" in wanted:
            scene = sections.scene(replica.parent, **wanted)
            image = sections.picture(scene)
            if len(scene.times) > 2:
                sections.animate(scene, folder / ANIMATION)
        else:
            image = still(scenes.picture(replica.parent, wanted), ".png")
    except Exception as error:  # noqa: BLE001 - the measurement does without it
        return [f"No picture: {error if isinstance(error, DembarkError) else f'{type(error).__name__}: {error}'}."]
    write_atomic(folder / PICTURE, image)
    return []


def saved(figure: Figure, kind: str = "png", dots: float = 180.0) -> bytes:
    """A figure as the content of a file of that `kind`, the same for the same data; images have so many `dots` an inch."""
    import matplotlib

    from ..style import STYLE

    buffer = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(buffer, format=kind, dpi=dots, metadata={"Date": None} if kind == "svg" else None)
    return buffer.getvalue()
