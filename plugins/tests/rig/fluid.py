"""The same fluid in the solver of dembark.physics and in LIGGGHTS's pair_style sph/coupled: scenes with walls and bodies."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.physics import SphFluid
from dembark.physics.sph import SphBody, lattice, tank_walls
from rig.liggghts_driver import read_dump, run_deck

Array = NDArray[np.float64]
COLUMNS = "id type x y z vx vy vz rho p"
ENERGIES = "kinetic potential compression bodies contact viscous diffusive boundary work".split()


@dataclass(frozen=True)
class Block:
    """A free body: its particles (m), mass (kg), moments about the axes (in the plane one number), centre (m) and velocity (m/s)."""

    points: Array
    mass: float
    inertia: Any
    centre: Array
    velocity: Array


@dataclass(frozen=True)
class Scene:
    """Fluid, a wall at rest and free bodies; `options` are those that the solver and the pair style share, by the solver's names."""

    points: Array
    wall: Array
    spacing: float
    sound_speed: float
    blocks: tuple[Block, ...] = ()
    velocity: Array | None = None
    options: dict[str, Any] = field(default_factory=dict)
    gravity: float = 9.81

    @property
    def dimension(self) -> int:
        return self.points.shape[1]

    @property
    def mass(self) -> float:
        return 1000.0 * self.spacing**self.dimension

    @property
    def step(self) -> float:
        """Of 0.3 h/c."""
        return 0.3 * self.options.get("smoothing", 1.3) * self.spacing / self.sound_speed


def dam(**options: Any) -> Scene:
    """A column in the plane that breaks, 12 particles wide, and a block in its way."""
    dx = 0.02
    points = lattice([0, 0], [0.24, 0.24], dx)
    # No symmetry, and velocities in it.
    velocity = np.stack([0.5 * np.sin(9 * points[:, 1]), 0.3 * np.cos(7 * points[:, 0])], axis=1)
    centre = np.array([0.31, 0.04])
    block = Block(lattice([0.26, 0.0], [0.36, 0.08], dx), 6.4, 0.009, centre, np.array([-0.4, 0.1]))
    return Scene(points, tank_walls([0, 0], [0.48, 0.3], dx), dx, 30.0, (block,), velocity, options)


def box(**options: Any) -> Scene:
    """Water in a box in space, 6 particles a side, with a block of 3 a side that turns in it."""
    dx = 0.02
    points = lattice([0, 0, 0], [0.16, 0.12, 0.12], dx)
    low, high = np.array([0.04, 0.02, 0.04]), np.array([0.10, 0.08, 0.10])
    inside = ((points > low) & (points < high)).all(axis=1)
    centre = np.array([0.071, 0.05, 0.07])
    block = Block(lattice(low, high, dx), 0.15, [1.0e-4, 1.5e-4, 2.0e-4], centre, np.array([0.3, -0.2, 0.1]))
    walls = tank_walls([0, 0, 0], [0.16, 0.12, 0.16], dx)
    return Scene(points[~inside], walls, dx, 20.0, (block,), None, options)


def standing(share: float) -> Scene:
    """Two blocks, nearly on the floor and on each other, with films of the pressure around them times `share`, that water runs against."""
    dx, gap = 0.02, 0.004
    lows = np.array([[0.08, 0.04, gap], [0.1, 0.05, 2 * gap + 0.06]])
    blocks = tuple(Block(lattice(low, low + 0.06, dx), 0.2, [1.2e-4] * 3, low + 0.03, velocity)
                   for low, velocity in zip(lows, np.array([[0.05, 0.0, 0.02], [0.0, 0.1, 0.06]]), strict=True))
    points = lattice([0, 0, 0], [0.24, 0.14, 0.14], dx)
    held = np.any([((points > low - 0.4 * dx) & (points < low + 0.06 + 0.4 * dx)).all(axis=1) for low in lows], axis=0)
    points = points[~held]
    velocity = np.stack([0.4 * (points[:, 0] < 0.08), 0.0 * points[:, 1], 0.0 * points[:, 2]], axis=1)
    return Scene(points, tank_walls([0, 0, 0], [0.24, 0.14, 0.2], dx), dx, 20.0, blocks, velocity, {"slit_pressure": share})


def neutral(scene: Scene, steps: int) -> tuple[SphFluid, list[SphBody]]:
    """The solver after `steps`, with the bodies."""
    down = np.zeros(scene.dimension)
    down[-1] = -scene.gravity
    fluid = SphFluid(scene.points, spacing=scene.spacing, sound_speed=scene.sound_speed, gravity=down,
                     velocity=0.0 if scene.velocity is None else scene.velocity, **scene.options)
    fluid.add_wall(scene.wall)
    if "slit_pressure" in scene.options:
        fluid.add_plane([0, 0, 0], [0, 0, 1])
    bodies = []
    for block in scene.blocks:
        if "slit_pressure" in scene.options:
            ends = block.points.min(axis=0) - 0.5 * scene.spacing, block.points.max(axis=0) + 0.5 * scene.spacing
            body = fluid.add_box(*ends, mass=block.mass, inertia=block.inertia)
        else:
            body = fluid.add_body(block.points, mass=block.mass, inertia=block.inertia, centre=block.centre)
        body.set_motion(block.velocity)
        bodies.append(body)
    fluid.run(steps * scene.step, scene.step)
    return fluid, bodies


def _three(values: Array) -> str:
    return " ".join(repr(float(value)) for value in [*values, 0.0][:3])


def _words(options: dict[str, Any]) -> str:
    """Options of the solver as keywords of the pair style."""
    given = {name: value for name, value in options.items() if name != "slit_pressure"}
    words = []
    if "contact_stiffness" in given:
        words.append(f"coupling potential {given.pop('contact_stiffness')!r} {given.pop('contact_exponent')}")
    for name, value in given.items():
        words.append(f"{name} {('yes' if value else 'no') if isinstance(value, bool) else value}")
    return " ".join(words)


def deck(scene: Scene, steps: int, *, ranks: int = 1, style: str = "hybrid granular sph", run: str = "", extra: str = "",
         changes: tuple[tuple[str, str], ...] = ()) -> str:
    """Types: 1 fluid, 2 wall, 3 ... bodies. `changes`: (old, new) pieces of the text."""
    plane, dx = scene.dimension == 2, scene.spacing
    groups = [scene.points, scene.wall, *(block.points for block in scene.blocks)]
    every = np.concatenate(groups)
    low, high = every.min(axis=0) - 2 * dx, every.max(axis=0) + 4 * dx
    sides = [(low[k], high[k]) if k < scene.dimension else (-dx, dx) for k in range(3)]
    grid = {1: "", 2: "processors 2 1 1\n", 4: "processors 2 2 1\n"}[ranks]
    lines = ["units si", f"dimension {scene.dimension}", f"atom_style {style}", "atom_modify map array",
             f"boundary f f {'p' if plane else 'f'}", "newton off", "communicate single vel yes", grid.strip(),
             "region domain block " + " ".join(f"{a!r} {b!r}" for a, b in np.array(sides).tolist()) + " units box",
             f"create_box {len(groups)} domain", f"neighbor {0.2 * 1.3 * dx!r} bin", "neigh_modify delay 0 check yes"]
    for number, points in enumerate(groups, 1):
        lines += [f"create_atoms {number} single {_three(point)} units box" for point in points]
        lines += [f"mass {number} {scene.mass!r}", f"group g{number} type {number}"]
    lines += ["set group all meso_rho 1000"]
    if "granular" in style:
        lines += [f"set group all diameter {dx!r} density 1000", f"set group all mass {scene.mass!r}"]
    if scene.velocity is not None:
        lines += [f"set atom {k} vx {v[0]!r} vy {v[1]!r} vz {[*v, 0.0][2]!r}" for k, v in enumerate(scene.velocity.tolist(), 1)]
    axis = "0 -1 0" if plane else "0 0 -1"
    lines += [f"pair_style sph/coupled spacing {dx!r} sound_speed {scene.sound_speed!r} {_words(scene.options)}", "pair_coeff * *",
              f"timestep {scene.step!r}", "fix fluid g1 nve/sph/coupled", "fix wall g2 sph/wall"]
    for number, block in enumerate(scene.blocks, 3):
        moments = " ".join(repr(float(one)) for one in np.atleast_1d(block.inertia))
        lines.append(f"fix body{number} g{number} sph/body mass {block.mass!r} inertia {moments} centre {_three(block.centre)} "
                     f"velocity {_three(block.velocity)}")
    if "slit_pressure" in scene.options:
        edges = np.ptp(scene.blocks[0].points, axis=0) + dx
        boxes = " ".join(f"box body{number} {_three(edges)}" for number in range(3, 3 + len(scene.blocks)))
        lines.append(f"fix touch all sph/contact stiffness 2e4 slit_pressure {scene.options['slit_pressure']!r} {boxes} "
                     "plane 0 0 0 0 0 1 0.4 0.6")
    lines += [f"fix weight all gravity {scene.gravity!r} vector {axis}",
              f"dump all all custom {steps} grains.dump {COLUMNS}", f'dump_modify all sort id format "%d %d{" %.17g" * 8}"',
              *(f"variable e{k} equal f_fluid[{k}]" for k in range(1, 10)), extra,
              f"thermo {max(steps, 1)}", "thermo_modify lost error norm no", run or f"run {steps}",
              'print "energies ' + " ".join(f"${{e{k}}}" for k in range(1, 10)) + '"', ""]
    text = "\n".join(lines)
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text


def resumed(text: str, types: int) -> str:
    """The deck `text` from the newest state on, with groups of `types` types."""
    groups = "".join(f"group g{number} type {number}\n" for number in range(1, types + 1))
    return (text[:text.index("region domain")] + "resume_state state\n" + text[text.index("neighbor "):text.index("create_atoms")] + groups
            + text[text.index("pair_style"):])


def solved(folder: Path, scene: Scene, steps: int, *, ranks: int = 1, **options: Any) -> tuple[Array, Array]:
    """The last frame of LIGGGHTS (n, 10), columns as COLUMNS, and the energies."""
    done = run_deck(folder, deck(scene, steps, ranks=ranks, **options), ranks=ranks)
    if done.code != 0 or done.error:
        raise RuntimeError(done.error or done.output[-2000:])
    line = next(line for line in done.output.splitlines() if line.startswith("energies "))
    return read_dump(folder / "grains.dump")[1][-1], np.array(line.split()[1:], float)
