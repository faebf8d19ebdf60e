"""Scenarios of one contact, as data.

A scenario is free (grains fly, collide, bounce) or prescribed (each grain follows given expressions of time); positions are in m,
velocities in m/s, angular velocities in rad/s, all SI.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Material:
    """What both bodies are made of, and the laws between them."""

    youngs_modulus: float = 1e7
    poisson_ratio: float = 0.3
    restitution: float = 0.8
    normal_law: str = "hertz"
    characteristic_velocity: float = 1.0
    static_friction: float = 0.5
    kinetic_friction: float = 0.3
    critical_slip_distance: float = 1e-5
    interface_shear_strength: float = inf
    healing_time: float = 0.0
    presliding: str = "linear"
    friction_limit: str = "total"
    rolling_resistance: str = "off"
    rolling_friction: float = 0.0
    rolling_damping_ratio: float = 0.0
    bridge_volume: float = 0.0
    surface_tension: float = 0.072
    contact_angle: float = 0.35
    capillary_model: str = "exact"
    viscosity: float = 0.0
    minimum_gap: float = 1e-5


@dataclass(frozen=True, kw_only=True)
class Path:
    """Displacement from the start (m) and velocity (m/s), three expressions each.

    Numbers, ``t`` (s), ``PI``, + - * / ( ), sin, cos, exp: the common part of Python's and LIGGGHTS's formulas.
    """

    displacement: tuple[str, str, str]
    velocity: tuple[str, str, str]

    def rotated(self, rotation: NDArray[np.float64]) -> Path:
        def turn(parts: tuple[str, str, str]) -> tuple[str, str, str]:
            return tuple("+".join(f"({float(a)!r})*({p})" for a, p in zip(row, parts, strict=True)) for row in rotation)

        return Path(displacement=turn(self.displacement), velocity=turn(self.velocity))

    def spinning(self, axis: tuple[float, float, float], rate: float, start: tuple[float, float, float]) -> Path:
        """The same path, from the point `start` on, as drawn in a frame that turns about `axis` through the origin at `rate` (rad/s)."""
        k = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
        cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
        square = cross @ cross
        sine, cosine = f"sin({rate!r}*t)", f"cos({rate!r}*t)"
        displacement, velocity = [], []
        for i in range(3):
            where, speed = [], []
            for j in range(3):
                point = f"({start[j]!r}+{self.displacement[j]})"
                turn = f"({float(i == j)!r}+({float(cross[i, j])!r})*{sine}+({float(square[i, j])!r})*(1-{cosine}))"
                change = f"({rate!r}*(({float(cross[i, j])!r})*{cosine}+({float(square[i, j])!r})*{sine}))"
                where.append(f"{turn}*{point}")
                speed.append(f"{change}*{point}+{turn}*({self.velocity[j]})")
            displacement.append(f"{'+'.join(where)}-({start[i]!r})")
            velocity.append("+".join(speed))
        return Path(displacement=tuple(displacement), velocity=tuple(velocity))


STILL = Path(displacement=("0", "0", "0"), velocity=("0", "0", "0"))


@dataclass(frozen=True, kw_only=True)
class Grain:
    radius: float = 5e-3
    density: float = 2500.0
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    path: Path | None = None

    @property
    def mass(self) -> float:
        return 4.0 / 3.0 * pi * self.radius**3 * self.density


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """`grains` alone (two), or one grain above a wall at z = 0. Every `stride`-th step is returned."""

    name: str
    material: Material
    grains: tuple[Grain, ...]
    wall: bool = False
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time_step: float = 1e-6
    steps: int = 2000
    stride: int = 5

    @property
    def prescribed(self) -> bool:
        return self.grains[0].path is not None

    def rotated(self, rotation: NDArray[np.float64], name: str) -> Scenario:
        """The same case in another frame; two grains only, the wall cannot turn."""
        assert not self.wall

        def turn(vector: tuple[float, float, float]) -> tuple[float, float, float]:
            return tuple(float(c) for c in rotation @ np.array(vector))

        grains = tuple(replace(g, position=turn(g.position), velocity=turn(g.velocity), angular_velocity=turn(g.angular_velocity),
                               path=g.path and g.path.rotated(rotation)) for g in self.grains)
        return replace(self, name=name, grains=grains, gravity=turn(self.gravity))

    def spinning(self, axis: tuple[float, float, float], rate: float, name: str) -> Scenario:
        """A prescribed case as seen in a frame that turns: paths turn about the origin, and the grains spin with it."""
        spin = tuple(float(c) for c in rate * np.asarray(axis, dtype=float) / np.linalg.norm(axis))
        grains = tuple(replace(g, path=g.path.spinning(axis, rate, g.position), angular_velocity=tuple(
            float(a + b) for a, b in zip(g.angular_velocity, spin, strict=True))) for g in self.grains)
        return replace(self, name=name, grains=grains)


def evaluate(expression: str, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """Value of a path's expression at each time (s)."""
    names = {"sin": np.sin, "cos": np.cos, "exp": np.exp, "PI": np.pi, "t": time}
    return np.broadcast_to(np.asarray(eval(expression, {"__builtins__": {}}, names), dtype=float), time.shape)


def in_liggghts(expression: str) -> str:
    return re.sub(r"\bt\b", "v_t", expression)


def rotation_matrix(axis: tuple[float, float, float], angle: float) -> NDArray[np.float64]:
    """Right-handed rotation by `angle` (rad) about `axis` (Rodrigues)."""
    k = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


DRY = Material()
WET = Material(bridge_volume=2e-10)
VISCOUS = Material(bridge_volume=2e-10, viscosity=0.2)
ALL_OF_IT = Material(interface_shear_strength=2e4, bridge_volume=2e-10)
SPRING = {"rolling_resistance": "elastic_plastic", "rolling_friction": 0.1, "rolling_damping_ratio": 0.3}
CONSTANT = {"rolling_resistance": "constant_torque", "rolling_friction": 0.1}
TURN = rotation_matrix((0.3, -0.7, 0.5), 1.1)


def _lower(radius: float = 5e-3) -> Grain:
    return Grain(radius=radius, path=STILL, position=(0.0, 0.0, -radius))


def _approach(name: str, material: Material, radius: float = 5e-3, wall: bool = False) -> Scenario:
    """Gap from 0.9 mm to an overlap of 0.1 mm and back, twice: the bridge forms, holds, breaks, and again."""
    path = Path(displacement=("0", "0", "-0.0005*(1-cos(2*PI*100*t))"), velocity=("0", "0", "-0.0005*2*PI*100*sin(2*PI*100*t)"))
    upper = Grain(position=(0.0, 0.0, 5.9e-3), path=path)
    grains = (upper,) if wall else (upper, _lower(radius))
    return Scenario(name=name, material=material, grains=grains, wall=wall, time_step=1e-5, steps=2000)


def _dragged(name: str, material: Material, radius: float = 5e-3, wall: bool = False) -> Scenario:
    """As `_approach`, but the grains also slide and spin, so that the liquid is sheared over overlap and gap."""
    path = Path(displacement=("0.0002*sin(2*PI*300*t)", "0.0001*(1-cos(2*PI*200*t))", "-0.0005*(1-cos(2*PI*100*t))"),
                velocity=("0.0002*2*PI*300*cos(2*PI*300*t)", "0.0001*2*PI*200*sin(2*PI*200*t)", "-0.0005*2*PI*100*sin(2*PI*100*t)"))
    upper = Grain(position=(0.0, 0.0, 5.9e-3), angular_velocity=(20.0, -10.0, 30.0), path=path)
    grains = (upper,) if wall else (upper, replace(_lower(radius), angular_velocity=(-5.0, 25.0, 10.0)))
    return Scenario(name=name, material=material, grains=grains, wall=wall, time_step=1e-5, steps=2000)


def _cycles(name: str, material: Material, wall: bool = False) -> Scenario:
    """Tangential loops with reversals along two axes while the normal load comes, swings and goes."""
    path = Path(
        displacement=("0.00004*sin(2*PI*400*t)", "0.00001*sin(2*PI*900*t)", "-0.00007*(1-cos(2*PI*100*t))"),
        velocity=("0.00004*2*PI*400*cos(2*PI*400*t)", "0.00001*2*PI*900*cos(2*PI*900*t)", "-0.00007*2*PI*100*sin(2*PI*100*t)"))
    upper = Grain(position=(0.0, 0.0, 5.02e-3), angular_velocity=(2.0, -1.0, 3.0), path=path)
    return Scenario(name=name, material=material, grains=(upper,) if wall else (upper, _lower()), wall=wall, time_step=5e-6, steps=2200)


def loaded(material: Material, time_step: float = 1e-5) -> Scenario:
    """Two grains pressed together; a small tangential displacement builds up and then rests."""
    path = Path(displacement=("0.000003*(1-exp(-t/0.0005))", "0.000002*(1-exp(-t/0.0005))", "-0.00002*(1-exp(-t/0.0002))"),
                velocity=("0.006*exp(-t/0.0005)", "0.004*exp(-t/0.0005)", "-0.1*exp(-t/0.0002)"))
    return Scenario(name="loaded", material=material, time_step=time_step, steps=round(0.02 / time_step), stride=round(1e-4 / time_step),
                    grains=(Grain(position=(0.0, 0.0, 5.0e-3 + 1e-6), path=path), _lower()))


def pressed(material: Material, wall: bool = False) -> Scenario:
    """Pressed together for good. At the wall loops with reversals and slip; two grains spin about axes across a normal that stays."""
    path = Path(
        displacement=("0.00003*sin(2*PI*400*t)", "0.00002*(1-cos(2*PI*700*t))", "-0.000005*(1-cos(2*PI*300*t))"),
        velocity=("0.00003*2*PI*400*cos(2*PI*400*t)", "0.00002*2*PI*700*sin(2*PI*700*t)", "-0.000005*2*PI*300*sin(2*PI*300*t)"))
    start = (0.0, 0.0, 4.98e-3)
    if wall:
        grains = (Grain(position=start, path=path),)
        return Scenario(name="pressed on the wall", material=material, wall=True, time_step=5e-6, grains=grains)
    path = Path(displacement=("0", "0", path.displacement[2]), velocity=("0", "0", path.velocity[2]))
    upper = Grain(position=start, angular_velocity=(1.0, 2.0, 0.0), path=path)
    return Scenario(name="pressed, spinning", material=material, time_step=5e-6,
                    grains=(upper, replace(_lower(), angular_velocity=(0.5, -0.7, 0.0))))


def _sliding(name: str, material: Material) -> Scenario:
    """Dragged from rest at constant speed under constant load, far beyond the critical slip distance."""
    path = Path(displacement=("0.02*t", "0", "0"), velocity=("0.02", "0", "0"))
    upper = Grain(position=(0.0, 0.0, 4.98e-3), path=path)
    return Scenario(name=name, material=material, grains=(upper,), wall=True, time_step=5e-6, steps=2000, stride=1)


def _collision(name: str, material: Material, ratio: float) -> Scenario:
    """Oblique impact with spins along all axes."""
    return Scenario(
        name=name, material=material, time_step=1e-6, steps=2000,
        grains=(Grain(position=(1e-3, 5e-4, 9e-3), velocity=(-0.3, 0.2, -0.8), angular_velocity=(40.0, -25.0, 60.0)),
                Grain(radius=5e-3 * ratio, density=2500.0 / ratio, position=(0.0, 0.0, 4e-3 - 5e-3 * ratio - 2.6e-4),
                      velocity=(0.1, -0.1, 0.2), angular_velocity=(-10.0, 30.0, 15.0))))


def _head_on(name: str, material: Material) -> Scenario:
    """Slow central impact without spin that ends after the bridge broke: all that is lost goes into the liquid."""
    return Scenario(name=name, material=replace(material, restitution=1.0), time_step=2e-6, steps=14000, stride=4,
                    grains=(Grain(position=(0.0, 0.0, 5.02e-3), velocity=(0.0, 0.0, -0.08)),
                            Grain(radius=3e-3, position=(0.0, 0.0, -3e-3))))


def _drop(name: str, material: Material) -> Scenario:
    """A spinning grain falls on the wall and bounces."""
    return Scenario(name=name, material=material, wall=True, gravity=(0.0, 0.0, -9.81), time_step=2e-6, steps=2500,
                    grains=(Grain(position=(0.0, 0.0, 5.2e-3), velocity=(0.2, -0.1, -0.5), angular_velocity=(30.0, 50.0, -20.0)),))


def _rolling(name: str, material: Material) -> Scenario:
    """A grain rolls on the wall, is slowed down, stops and rocks."""
    return Scenario(name=name, material=material, wall=True, gravity=(0.0, 0.0, -9.81), time_step=5e-6, steps=4000, stride=20,
                    grains=(Grain(position=(0.0, 0.0, 5.001e-3), velocity=(0.008, 0.004, -0.02), angular_velocity=(-0.8, 1.6, 3.0)),))


def _all() -> dict[str, Scenario]:
    undamped = replace(DRY, restitution=1.0)
    strong = replace(DRY, interface_shear_strength=2e4)
    partial = replace(DRY, presliding="partial_slip")
    elastic = replace(DRY, friction_limit="elastic", restitution=0.4)
    rolling, constant = replace(DRY, **SPRING), replace(DRY, **CONSTANT)
    rolling_cycles = _cycles("cycles, rolling spring", rolling)
    linear = _cycles("cycles, linear, limited strength", strong)
    wet_collision = _collision("collision, wet", ALL_OF_IT, 0.6)
    cases = [
        _approach("approach, dry", DRY),
        _approach("approach, bridge", WET),
        _approach("approach, bridge, unequal", WET, radius=2.5e-3),
        _approach("approach, bridge, wall", WET, wall=True),
        *(_approach(f"approach, bridge, {model}", replace(WET, capillary_model=model))
          for model in ("willett", "willett_full", "rabinovich", "bagheri", "constant")),
        _approach("approach, viscous bridge", VISCOUS),
        _approach("approach, viscous bridge, unequal", VISCOUS, radius=2.5e-3),
        _approach("approach, viscous bridge, wall", VISCOUS, wall=True),
        _dragged("dragged, viscous bridge", VISCOUS),
        _dragged("dragged, viscous bridge, unequal", VISCOUS, radius=2.5e-3),
        _dragged("dragged, viscous bridge, wall", VISCOUS, wall=True),
        _cycles("cycles, linear", DRY),
        linear,
        _cycles("cycles, exponential", replace(DRY, presliding="exponential")),
        _cycles("cycles, exponential, limited strength", replace(strong, presliding="exponential")),
        _cycles("cycles, partial slip", partial),
        _cycles("cycles, partial slip, wall", replace(strong, presliding="partial_slip"), wall=True),
        _cycles("cycles, partial slip, rotated frame", partial).rotated(TURN, "cycles, partial slip, rotated frame"),
        rolling_cycles,
        rolling_cycles.rotated(TURN, "cycles, rolling spring, rotated frame"),
        _cycles("cycles, rolling spring, wall", rolling, wall=True),
        # Below its limit, with these spins.
        _cycles("cycles, strong rolling spring", replace(rolling, rolling_friction=3.0)),
        _cycles("cycles, rolling spring, partial slip", replace(partial, **SPRING)),
        _cycles("cycles, rolling spring, hooke", replace(rolling, normal_law="hooke", characteristic_velocity=0.5)),
        _cycles("cycles, constant torque", constant),
        _cycles("cycles, constant torque, wall", constant, wall=True),
        replace(_cycles("cycles, rolling spring, contact lost in between", rolling), steps=4500),
        _cycles("cycles, healing time", replace(DRY, healing_time=1e-3)),
        _cycles("cycles, wall", strong, wall=True),
        _cycles("cycles, exponential, wall", replace(strong, presliding="exponential"), wall=True),
        _cycles("cycles, hooke", replace(strong, normal_law="hooke", characteristic_velocity=0.5)),
        linear.rotated(TURN, "cycles, rotated frame"),
        _sliding("sliding, slow weakening", undamped),
        _sliding("sliding, sudden weakening", replace(undamped, critical_slip_distance=1e-6)),
        _sliding("sliding, exponential", replace(undamped, presliding="exponential")),
        _sliding("sliding, partial slip", replace(undamped, presliding="partial_slip")),
        _sliding("sliding, hooke", replace(undamped, normal_law="hooke", critical_slip_distance=0.0)),
        replace(_cycles("cycles, contact lost in between", DRY), steps=4500),
        loaded(DRY).spinning((1.0, 2.0, 2.0), 200.0, "loaded, rigidly rotating"),
        _collision("collision, equal", DRY, 1.0),
        _collision("collision, unequal", strong, 0.6),
        _collision("collision, exponential", replace(strong, presliding="exponential"), 0.6),
        _collision("collision, partial slip", replace(strong, presliding="partial_slip"), 0.6),
        *(_collision(f"collision, elastic limit{more}", replace(elastic, **change), 0.6) for more, change in (
            ("", {}), (", exponential", {"presliding": "exponential"}), (", partial slip", {"presliding": "partial_slip"}),
            (", hooke", {"normal_law": "hooke", "characteristic_velocity": 0.5}))),
        _collision("collision, elastic limit, wet", replace(ALL_OF_IT, friction_limit="elastic"), 0.6),
        _drop("drop, elastic limit", replace(elastic, interface_shear_strength=2e4)),
        _collision("collision, partial slip, viscous", replace(ALL_OF_IT, viscosity=0.05, presliding="partial_slip"), 0.6),
        loaded(partial).spinning((1.0, 2.0, 2.0), 200.0, "loaded, partial slip, rigidly rotating"),
        _collision("collision, rolling spring", replace(strong, **SPRING), 0.6),
        _collision("collision, constant torque", constant, 0.6),
        _collision("collision, rolling spring, viscous", replace(ALL_OF_IT, viscosity=0.05, **SPRING), 0.6),
        loaded(rolling).spinning((1.0, 2.0, 2.0), 200.0, "loaded, rolling spring, rigidly rotating"),
        _rolling("rolling to rest", replace(rolling, restitution=0.3)),
        _drop("drop, rolling spring", rolling),
        _drop("drop, constant torque", constant),
        _collision("collision, hooke", replace(DRY, normal_law="hooke", characteristic_velocity=0.5), 0.6),
        wet_collision,
        wet_collision.rotated(TURN, "collision, wet, rotated frame"),
        _collision("collision, viscous", replace(ALL_OF_IT, viscosity=0.05), 0.6),
        _collision("collision, viscous, hooke", replace(ALL_OF_IT, viscosity=0.05, normal_law="hooke", characteristic_velocity=0.5), 0.6),
        _head_on("head-on, bridge", WET),
        _head_on("head-on, viscous bridge", replace(WET, viscosity=0.005)),
        _drop("drop, dry", strong),
        _drop("drop, wet", ALL_OF_IT),
        _drop("drop, viscous", replace(ALL_OF_IT, viscosity=0.05)),
        _drop("drop, hooke", replace(DRY, normal_law="hooke", characteristic_velocity=0.5)),
    ]
    return {case.name: case for case in cases}


SCENARIOS = _all()
