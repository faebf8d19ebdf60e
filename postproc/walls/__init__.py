"""Walls that grains press on: planes, cylinders, triangle meshes, and the surface of an inclusion (a group of grains).

A dump holds the force of each wall on each grain, not where it acts: that is taken as the point of the wall nearest to the grain's
centre, which is exact for spheres on a plane or a cylinder. A grain that touches several triangles of a mesh counts for the nearest.

Everywhere a force is that of the wall on the grains. It is taken apart along a basis that belongs to the contact point: `normal` from
the wall to the grains (a wall that is pressed has a positive normal stress), `shear_1` and `shear_2` along the wall.
"""

from .contacts import into_box, touching, wall_contacts
from .inclusion import Inclusion
from .surfaces import CylinderWall, MeshWall, Motion, Places, PlaneWall, Wall

__all__ = ["CylinderWall", "Inclusion", "MeshWall", "Motion", "Places", "PlaneWall", "Wall", "into_box", "touching", "wall_contacts"]
