"""Random small scenes for all engines, and the conservation laws that their frames obey.

A scene runs in two parts. Grains enter at the start, between the parts or during the second; the floor may start to move between the parts.
Nothing here computes a contact law but Hertz's own, for scenes without friction and damping: there the forces follow from positions.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from dembark.physics import WallMotion
from rig.scenarios import SPRING, Material

Array = NDArray[np.float64]
STEP, FIRST, LAST, EVERY, STATES = 1e-5, 500, 2000, 100, 400
SIDE, DENSITY, GRAVITY = 0.024, 2500.0, 9.81  # m: period along x and y; kg/m^3; m/s^2
MODULUS, POISSON = 5e6, 0.3
CONTENT = 0.005
MOTIONS = ("", "harmonic amplitude 3e-4 0 5e-4 frequency 60 ramp 0", "harmonic amplitude 0 0 5e-4 frequency 80 ramp 1",
           "uniform velocity 0.05 -0.02 0.04")
ENTERING = ("start", "later", "larger later", "into the empty box", "grown", "inserted", "larger inserted")
COLUMNS = "id x y z vx vy vz fx fy fz radius mass"


@dataclass(frozen=True)
class Scene:
    """What a deck of any engine is written from. `late`: the motion is given between the two parts."""

    material: str = "friction"
    liquid: str = "dry"
    floor: str = "plane"
    motion: str = ""
    late: bool = False
    entering: str = "start"
    resumed: bool = False

    @property
    def carried(self) -> bool:
        return self.liquid == "carried"

    @property
    def elastic(self) -> bool:
        """Forces follow from positions alone."""
        return self.material == "elastic" and self.liquid == "dry"

    @property
    def start(self) -> float:
        """Time (s) at which the motion is given."""
        return STEP * FIRST if self.late else 0.0

    @property
    def law(self) -> Material:
        dry = Material(youngs_modulus=MODULUS, poisson_ratio=POISSON, restitution=0.6, static_friction=0.5, kinetic_friction=0.4)
        dry = {"friction": dry, "elastic": replace(dry, restitution=1.0, static_friction=0.0, kinetic_friction=0.0),
               "partial slip": replace(dry, presliding="partial_slip"), "rolling": replace(dry, **SPRING)}[self.material]
        return dry if self.liquid == "dry" else replace(dry, bridge_volume=1e-10)


@st.composite
def scenes(draw: st.DrawFn, moving_planes: bool = True, empty_box: bool = True) -> Scene:
    """`moving_planes`: a plane can be given a motion, not only an STL surface; `empty_box`: a run can begin without a grain."""
    floor = draw(st.sampled_from(["plane", "stl"]))
    motion = draw(st.sampled_from(MOTIONS)) if floor == "stl" or moving_planes else ""
    entering = [each for each in ENTERING if empty_box or each != "into the empty box"]
    return Scene(material=draw(st.sampled_from(["friction", "elastic", "partial slip", "rolling"])),
                 liquid=draw(st.sampled_from(["dry", "bridges", "carried"])), floor=floor, motion=motion,
                 late=bool(motion) and draw(st.booleans()), entering=draw(st.sampled_from(entering)), resumed=draw(st.booleans()))


@dataclass(frozen=True)
class Grain:
    radius: float
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]


def bed(count: int = 32) -> list[Grain]:
    """Grains of many sizes in layers of sixteen, on their way down."""
    found = []
    for n in range(count):
        i, j, k = n % 4, n // 4 % 4, n // 16
        found.append(Grain(0.0024 * (1.0 + 0.1 * math.sin(37.0 * n)), (0.003 + 0.006 * i, 0.003 + 0.006 * j, 0.0032 + 0.0056 * k),
                           (0.3 * math.sin(91.0 * n), 0.3 * math.sin(53.0 * n), -0.4 + 0.2 * math.sin(17.0 * n))))
    return found


def second(scene: Scene) -> list[Grain]:
    """Grains that a script creates between the parts."""
    if scene.entering == "into the empty box":
        return bed()
    if scene.entering not in {"later", "larger later"}:
        return []
    radius = 0.0042 if scene.entering == "larger later" else 0.0024
    return [Grain(radius, (0.006 + 0.012 * i, 0.006 + 0.012 * j, 0.022 + 0.001 * (i + 2 * j)), (0.05, -0.03, -1.5))
            for i in range(2) for j in range(2)]


def first(scene: Scene) -> list[Grain]:
    return [] if scene.entering == "into the empty box" else bed()


INSERTED = {"inserted": (6, 0.0024), "larger inserted": (2, 0.0042)}  # number, radius (m)
GROWTH = 1.1


def record(scene: Scene) -> dict[str, object]:
    """The scene as plain data, for scripts that run inside an engine; these know which grains are inserted."""
    count, radius = INSERTED.get(scene.entering, (0, 0.0))
    inserted = [Grain(radius, (0.004 + 0.009 * (n % 3), 0.006 + 0.011 * (n // 3), 0.024), (0.0, 0.0, -1.5)) for n in range(count)]
    grains = {"first": first(scene), "second": second(scene), "inserted": inserted}
    return {name: [asdict(grain) for grain in part] for name, part in grains.items()} | {
        "scene": asdict(scene), "law": asdict(scene.law), "step": STEP, "first_steps": FIRST, "steps": LAST, "every": EVERY,
        "gravity": GRAVITY, "density": DENSITY, "content": CONTENT, "growth": GROWTH}


def all_grains(scene: Scene) -> list[Grain]:
    """All that are in the box at the end, those that an engine inserts at random included."""
    count, radius = INSERTED.get(scene.entering, (0, 0.0))
    return [*first(scene), *second(scene), *[Grain(radius, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * count]


def floor_height(scene: Scene, time: float) -> float:
    """Height (m) of the floor: it starts where it stands when the motion is given."""
    if not scene.motion or time < scene.start:
        return 0.0
    motion = WallMotion(scene.motion)
    return float(motion.displacement(time - scene.start)[2] - motion.displacement(0.0)[2])


def elastic_forces(x: Array, radius: Array, height: float, period: float | None) -> tuple[Array, Array]:
    """Hertz's forces (n, 3) in N of all pairs, by brute force, and of the floor."""
    effective = MODULUS / (2.0 * (1.0 - POISSON**2))
    apart = x[:, None] - x[None, :]
    if period:
        apart[..., :2] -= period * np.round(apart[..., :2] / period)
    distance = np.linalg.norm(apart, axis=2) + np.eye(len(x))
    overlap = np.clip(radius[:, None] + radius - distance, 0.0, None) * (1.0 - np.eye(len(x)))
    reduced = radius[:, None] * radius / (radius[:, None] + radius)
    size = 4.0 / 3.0 * effective * np.sqrt(reduced) * overlap**1.5
    floor = np.zeros_like(x)
    floor[:, 2] = 4.0 / 3.0 * effective * np.sqrt(radius) * np.clip(radius - (x[:, 2] - height), 0.0, None) ** 1.5
    return np.einsum("ij,ijk->ik", size / distance, apart), floor


def assert_physical(scene: Scene, steps: Array, frames: list[Array], period: float | None) -> None:
    """No overlap is without a force and no force without a contact; without friction and damping forces are those of Hertz.

    frames : (grains, 12) each, with the columns of `COLUMNS`
    """
    for step, table in zip(steps, frames, strict=True):
        if step == 0 or not len(table):
            continue
        x, force, radius, mass = table[:, 1:4], table[:, 7:10], table[:, 10], table[:, 11]
        where = f"{scene}, step {step}"
        np.testing.assert_allclose(mass, DENSITY * 4.0 / 3.0 * math.pi * radius**3, rtol=1e-9, err_msg=where)
        pairs, floor = elastic_forces(x, radius, floor_height(scene, STEP * step), period)
        contact = force + np.array([0.0, 0.0, GRAVITY]) * mass[:, None]
        scale = max(np.abs(pairs + floor).max(), GRAVITY * mass.max())
        if scene.elastic:
            assert np.abs(contact - pairs - floor).max() < 1e-6 * scale, where
        # Overlaps near zero are round-off of the dump's digits.
        touches = np.linalg.norm(pairs, axis=1) + floor[:, 2] > 1e-6 * scale
        acts = np.linalg.norm(contact, axis=1) > 1e-9 * scale
        assert not (touches & ~acts).any(), f"{where}: overlap without a force, grains {table[touches & ~acts, 0]}"
        if scene.liquid == "dry":
            assert not (acts & ~touches).any() or np.linalg.norm(contact[acts & ~touches], axis=1).max() < 1e-3 * scale, where


def assert_third_law(scene: Scene, table: Array, walls: Array) -> None:
    """All that acts on the grains but weight and walls adds up to zero."""
    if not len(table):
        return
    weight = np.array([0.0, 0.0, -GRAVITY]) * table[:, 11].sum()
    left = table[:, 7:10].sum(axis=0) - weight - walls
    assert np.abs(left).max() < 1e-10 * max(np.abs(table[:, 7:10]).max(), GRAVITY * table[:, 11].sum()), scene
