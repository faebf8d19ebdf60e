"""A free part as a rigid body of equal spheres on a square lattice in the layer, with mass and moment of inertia of a closed surface."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dembark.common.errors import DembarkError
from dembark.input_decks.common.bodies import closed, read_body, voxels
from dembark.input_decks.common.setup import Array, Parameters
from dembark.input_decks.common.trough import polygon

FOLDER = Path(__file__).parent
# Corners of the cylinder's cross-section.
CORNERS = 48


@dataclass(frozen=True)
class FreeBody:
    """Spheres of one `radius` (m) at `places` (n, 2) along x and z from the centre of mass (m); `mass` (kg) and `moment` of inertia about
    y (kg m2) of the inside of the `surface`: its triangles (n, 3, 3), from there, too."""

    surface: Array
    places: Array
    radius: float
    mass: float
    moment: float

    @property
    def reach(self) -> float:
        """How far (m) the spheres reach from the centre of mass."""
        return float(np.linalg.norm(self.places, axis=1).max()) + self.radius


def free_body(p: Parameters) -> FreeBody:
    """The cylinder, as long as a grain is wide, or the body of part.stl; DembarkError for spheres that are fewer than two."""
    mesh = closed(cylinder(p.part_diameter, p.grain_diameter), "cylinder") if p.part == "cylinder" else read_body(FOLDER / "part.stl")
    sizes = np.ptp(mesh.points, axis=0)
    if sizes[[0, 2]].max() > p.trough_width:
        raise DembarkError(f"part.stl is {sizes[[0, 2]].max():g} m wide", "it was drawn in mm, maybe", "write the file in m")
    # One sphere along y: the layer cuts the body in the middle of its length.
    middle = 0.5 * (mesh.points.max(axis=0) + mesh.points.min(axis=0))[1]
    flat = closed((mesh.triangles - [0.0, middle, 0.0]) * [1.0, p.part_sphere / sizes[1], 1.0], "part")
    spheres = voxels(flat, p.part_sphere)
    if len(spheres.radii) < 2:
        raise DembarkError("there is one sphere in the part", "", "lower part_sphere")
    return FreeBody(mesh.triangles - mesh.mass.centre, (spheres.centres - mesh.mass.centre)[:, [0, 2]], 0.5 * p.part_sphere,
                    p.part_density * mesh.mass.volume, float(p.part_density * mesh.mass.inertia[1, 1]))


def circle(diameter: float) -> Array:
    """Corners (n, 2) in m of the cylinder's cross-section."""
    return polygon(diameter, CORNERS, (0.0, 0.0))


def cylinder(diameter: float, length: float) -> Array:
    """Triangles (n, 3, 3) in m of a closed prism along y about the origin, with corners on a circle of `diameter` (m)."""
    x, z = circle(diameter).T
    near, far = (np.column_stack([x, np.full(CORNERS, side * length), z]) for side in (-0.5, 0.5))
    turn = np.roll(np.arange(CORNERS), -1)
    sides = [np.stack([near, far, far[turn]], axis=1), np.stack([near, far[turn], near[turn]], axis=1)]
    fan = np.arange(1, CORNERS - 1)
    caps = [np.stack([np.repeat(ring[:1], len(fan), axis=0), ring[fan + first], ring[fan + 1 - first]], axis=1)
            for ring, first in ((near, 0), (far, 1))]
    return np.concatenate([*sides, *caps])
