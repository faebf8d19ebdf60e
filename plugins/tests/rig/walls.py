"""Kinds of walls for one and the same prescribed contact: what each engine calls them, and the law on them in Python alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import TypeVar

import numpy as np

from rig import liggghts_driver
from rig.motion import Motion
from rig.python_driver import contact, prescribed
from rig.scenarios import Path, Scenario

CYLINDER = 0.05
Key = TypeVar("Key")
Three = tuple[float, float, float]
Triangle = tuple[Three, Three, Three]


@dataclass(frozen=True, kw_only=True)
class Surface:
    """The floor z = 0, or the inside of a cylinder that touches it along x; `velocity` and `spin` (rad/s, about the origin, of a cylinder
    about its axis) are those of the surface."""

    shape: str = "plane"
    velocity: Three = (0.0, 0.0, 0.0)
    spin: Three = (0.0, 0.0, 0.0)

    def below(self, centre: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Vector (3,) from the nearest point of the wall to a grain's centre, and the wall's velocity there, m and m/s."""
        moved = time * np.array(self.velocity)
        if self.shape == "plane":
            away = np.array([0.0, 0.0, centre[2] - moved[2]])
            arm = centre - away - moved
        else:
            across = centre - moved - [0.0, 0.0, CYLINDER]
            across[0] = 0.0
            distance = np.linalg.norm(across)
            away = across * ((distance - CYLINDER) / distance)
            arm = centre - away - moved - [0.0, 0.0, CYLINDER]
        return away, np.array(self.velocity) + np.cross(self.spin, arm)


def moved_with(case: Scenario, velocity: Three) -> Scenario:
    """The same paths as seen from a frame that moves with minus `velocity` (m/s)."""
    def along(path: Path) -> Path:
        return Path(displacement=tuple(f"{d}+({u!r})*t" for d, u in zip(path.displacement, velocity, strict=True)),
                    velocity=tuple(f"{v}+({u!r})" for v, u in zip(path.velocity, velocity, strict=True)))

    return replace(case, grains=tuple(replace(g, path=along(g.path)) for g in case.grains))


def follow(case: Scenario, surface: Surface) -> Motion:
    """A prescribed case of one grain against `surface`, by `dembark.physics` alone."""
    x, v, w = prescribed(case)
    grain, state = case.grains[0], contact(case.material).begin()
    force, torque = np.zeros_like(x), np.zeros_like(x)
    for k in range(case.steps + 1):
        away, speed = surface.below(x[k, 0].copy(), k * case.time_step)
        out = state.step(tuple(away), tuple(v[k, 0]), tuple(speed), tuple(w[k, 0]), surface.spin, grain.radius, np.inf, grain.mass, np.inf,
                         case.time_step, k > 0)
        force[k, 0], torque[k, 0] = out[0], out[1]
    keep = slice(case.stride, None, case.stride)
    return Motion((case.time_step * np.arange(case.steps + 1))[keep], x[keep], v[keep], w[keep], force[keep], torque[keep])


def stl(triangles: list[Triangle]) -> str:
    """A mesh file."""
    corners = ["\n".join("   vertex " + " ".join(f"{c:.17g}" for c in point) for point in triangle) for triangle in triangles]
    facets = "\n".join(f" facet normal 0 0 1\n  outer loop\n{three}\n  endloop\n endfacet" for three in corners)
    return f"solid floor\n{facets}\nendsolid floor\n"


FLOOR: list[Triangle] = [((1e-5, -0.04, 0.0), (1e-5, 0.04, 0.0), (-0.04, 0.0, 0.0)),
                         ((1e-5, -0.04, 0.0), (0.04, 0.0, 0.0), (1e-5, 0.04, 0.0))]


def on_mesh(text: str, folder: FilePath, triangles: list[Triangle], move: str = "", words: str = "", name: str = "floor.stl") -> str:
    """A deck with the plane floor replaced by a mesh, which is written to `folder`; `move`: words after `fix ID all move/mesh mesh stl`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(stl(triangles))
    plane = next(line for line in text.splitlines() if line.startswith("fix floor"))
    lines = f"fix stl all mesh/surface file {name} type 2 {words}\n" + (f"fix carry all move/mesh mesh stl {move}\n" if move else "")
    return text.replace(plane, lines + plane.replace("primitive type 2 zplane 0", "mesh n_meshes 1 meshes stl"))


def batch(folder: FilePath, decks: dict[Key, str], ranks: int = 1) -> None:
    """Runs decks one after the other in one start of LIGGGHTS; each dump gets its deck's number."""
    text = "\nclear\n".join(deck.replace("grains.dump", f"{number}.dump") for number, deck in enumerate(decks.values()))
    done = liggghts_driver.run_deck(folder, text, ranks=ranks)
    assert done.code == 0 and not done.error, done.error or done.output[-2000:]


def motions(folder: FilePath, decks: dict[Key, str], cases: dict[Key, Scenario]) -> dict[Key, Motion]:
    """What `batch` gives, read back, with the keys of `decks`."""
    batch(folder, decks)
    return {key: motion_of(cases[key], folder / f"{number}.dump") for number, key in enumerate(decks)}


def motion_of(case: Scenario, dump: FilePath) -> Motion:
    """The motion in one dump of a batch."""
    steps, frames = liggghts_driver.read_dump(dump)
    later = steps > 0
    table = np.array(frames)[later]
    return Motion(case.time_step * steps[later], *(table[:, :, k : k + 3] for k in (1, 4, 7, 10, 13)))
