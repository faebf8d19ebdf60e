"""One body of spheres in each engine, as `dembark body` writes it: alone, or above a floor z = 0, or against another one.

Its motion is found from that of its spheres, in the same way for all engines.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dembark.input_decks.common import bodies
from dembark.validation import cli
from rig import lammps_driver, liggghts_driver, yade_driver
from rig.liggghts_driver import read_dump
from rig.scenarios import Material
from rig.walls import stl

Array = NDArray[np.float64]
SCRIPT = Path(__file__).parent / "rigid_bodies_yade.py"
NAME = "one"


@dataclass(frozen=True)
class Flight:
    """A body with its centre of mass `height` (m) above the origin, its velocity (m/s) and spin (rad/s). `grains`: places (m) and
    velocities (m/s) of single grains of `grain_radius` (m) and `grain_mass` (kg)."""

    triangles: Array
    spacing: float = 0.01  # m, of a lattice; not used with `spheres`
    spheres: int = 0       # so many of different sizes
    density: float = 2500.0
    height: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    floor: bool = False
    gravity: float = 0.0
    grains: tuple[tuple[float, float, float, float, float, float], ...] = ()
    grain_radius: float = 0.005
    grain_mass: float = 0.01
    time_step: float = 1e-5
    steps: int = 1000
    frames: int = 50
    own_loop: bool = False  # in YADE SphereContactLoop
    material: Material = field(default_factory=Material)


@dataclass(frozen=True)
class Motion:
    """Of the body by frames: place (m), velocity (m/s), turn from the start, spin (rad/s); and the velocities of the grains (f, g, 3)."""

    place: Array
    velocity: Array
    turn: Rotation
    spin: Array
    grain_velocities: Array


@cache
def _files(surface: str, words: tuple[str, ...]) -> dict[str, bytes]:
    """What `dembark body` writes, and the surface: many flights are of one body."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "one.stl").write_text(surface)
        assert cli.main(["body", str(folder / "one.stl"), *words, "--out", name]) == 0
        return {path.name: path.read_bytes() for path in folder.iterdir()}


def written(folder: Path, flight: Flight, engine: str) -> None:
    """Writes the body's files into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    words = ("--engine", engine, "--density", repr(flight.density), "--at", f"0,0,{flight.height!r}",
             *(["--spheres", str(flight.spheres)] if flight.spheres else ["--spacing", repr(flight.spacing)]))
    for name, content in _files(stl([tuple(map(tuple, corners)) for corners in flight.triangles.tolist()]), words).items():
        (folder / name).write_bytes(content)


@cache
def _rest(surface: bytes, spheres: int, spacing: float) -> Array:
    """Places of the spheres from the centre of mass (m)."""
    with TemporaryDirectory() as name:
        path = Path(name) / "one.stl"
        path.write_bytes(surface)
        mesh = bodies.read_body(path)
    return (bodies.covering(mesh, spheres) if spheres else bodies.voxels(mesh, spacing)).centres - mesh.mass.centre


def fly(engine: str, folder: Path, flight: Flight) -> Motion:
    """The flight in an engine."""
    written(folder, flight, engine)
    {"liggghts": _liggghts, "lammps": _lammps, "yade": _yade}[engine](folder, flight)
    steps, frames = read_dump(folder / "grains.dump")
    rest = _rest((folder / "one.stl").read_bytes(), flight.spheres, flight.spacing)
    table = np.array([frame for step, frame in zip(steps, frames, strict=True) if step > 0])[:, :, 1:]
    if engine == "liggghts":
        # There grains are made first: `set` does not go with bodies.
        table = np.roll(table, -len(flight.grains), axis=1)
    own, other = table[:, :len(rest)], table[:, len(rest):]
    turns, places, velocities, spins = [], [], [], []
    for frame in own:
        # Spheres that are not around the centre of mass: rotation about their own middle first.
        turn, _ = Rotation.align_vectors(frame[:, :3] - frame[:, :3].mean(0), rest - rest.mean(0))
        place = (frame[:, :3] - turn.apply(rest)).mean(0)
        arms = frame[:, :3] - place
        rows = np.zeros((len(rest), 3, 6))
        rows[:, :, :3] = np.eye(3)
        # v = V + omega x arm
        rows[:, 0, 4], rows[:, 0, 5] = arms[:, 2], -arms[:, 1]
        rows[:, 1, 3], rows[:, 1, 5] = -arms[:, 2], arms[:, 0]
        rows[:, 2, 3], rows[:, 2, 4] = arms[:, 1], -arms[:, 0]
        found = np.linalg.lstsq(rows.reshape(-1, 6), frame[:, 3:6].reshape(-1), rcond=None)[0]
        turns.append(turn.as_quat())
        places.append(place)
        velocities.append(found[:3])
        spins.append(found[3:])
    return Motion(np.array(places), np.array(velocities), Rotation.from_quat(turns), np.array(spins),
                  other[:, :, 3:6])


def _grain_lines(flight: Flight, first: int) -> str:
    density = flight.grain_mass / (4.0 / 3.0 * np.pi * flight.grain_radius**3)
    lines = [f"create_atoms 2 single {x!r} {y!r} {z!r} units box" for x, y, z, *_ in flight.grains]
    for number, (*_, vx, vy, vz) in enumerate(flight.grains, first):
        lines.append(f"set atom {number} diameter {2.0 * flight.grain_radius!r} density {float(density)!r} vx {vx!r} vy {vy!r} vz {vz!r}")
    return "\n".join([*lines, *(["group single type 2", "fix motion single nve/sphere"] if flight.grains else [])]) + "\n"


def _weight(flight: Flight, group: str = "all") -> str:
    return f"fix weight {group} gravity {flight.gravity!r} vector 0 0 -1\n" if flight.gravity else ""


_DOMAIN = """\
region domain block -0.2 0.2 -0.2 0.2 -0.05 0.2 units box
create_box 2 domain
neighbor 0.002 bin
neigh_modify delay 0
"""


def _liggghts(folder: Path, flight: Flight) -> None:
    m, numbers = flight.material, " ".join(map(repr, flight.velocity))
    floor = f"fix floor all wall/gran {liggghts_driver.models(m, wall='primitive type 2 zplane 0')}\n" if flight.floor else ""
    place = f"-1e-6 1e-6 -1e-6 1e-6 {flight.height - 1e-6!r} {flight.height + 1e-6!r}"
    done = liggghts_driver.run_deck(folder, f"""\
{liggghts_driver.head()}
{_DOMAIN}timestep {flight.time_step!r}
{liggghts_driver.properties(m)}
pair_style gran {liggghts_driver.models(m)}
pair_coeff * *
include one-liggghts.in
fix distribution all particledistribution/discrete 86028157 1 one 1.0
{floor}{_grain_lines(flight, 1)}{_weight(flight)}region place block {place} units box volume_limit 1e-20
fix insert all insert/pack seed 32452867 distributiontemplate distribution insert_every once overlapcheck no &
    orientation constant 1 0 0 0 vel constant {numbers} omega constant {" ".join(map(repr, flight.spin))} &
    particles_in_region 1 region place
fix body all multisphere
run 1
dump grains all custom {flight.steps // flight.frames} grains.dump id x y z vx vy vz
dump_modify grains sort id format "%d %.17g %.17g %.17g %.17g %.17g %.17g"
run {flight.steps}
""")
    assert done.code == 0 and not done.error, done.error or done.output[-2000:]


def _lammps(folder: Path, flight: Flight) -> None:
    m = flight.material
    floor = "region floor plane 0 0 0 0 0 1 units box\nfix floor all wall/dembark region floor type 2\n" if flight.floor else ""
    # Angular momentum and velocity are in the file.
    members = int((folder / "one.mol").read_text().partition(" atoms")[0].split()[-1])
    infile = (folder / "one.infile").read_text().splitlines()
    words = infile[2].split()
    moments = np.array(words[5:11], float)
    tensor = np.diag(moments[:3])
    for (i, j), value in zip(((0, 1), (0, 2), (1, 2)), moments[3:], strict=True):
        tensor[i, j] = tensor[j, i] = value
    words[11:17] = [repr(float(x)) for x in (*flight.velocity, *(tensor @ flight.spin))]
    (folder / "one.infile").write_text("\n".join([*infile[:2], " ".join(words)]) + "\n")
    done = lammps_driver.run_deck(folder, f"""\
{lammps_driver.head()}
fix property all property/atom mol ghost yes
comm_modify cutoff 0.06
{_DOMAIN}timestep {flight.time_step!r}
pair_style dembark/granular {lammps_driver.settings(m)}
pair_coeff * * {lammps_driver.coefficients(m)}
include one-lammps.in
group members type 1
{_grain_lines(flight, members + 1)}neigh_modify exclude molecule/intra members
group others subtract all members
{floor}{_weight(flight, "others")}fix body members rigid/small molecule infile one.infile {"gravity weight" if flight.gravity else ""}
dump grains all custom {flight.steps // flight.frames} grains.dump id x y z vx vy vz
dump_modify grains sort id format float %.17g
thermo_style custom step
run {flight.steps}
""")
    assert done.code == 0 and not done.error, done.error or done.output[-2000:]


def _yade(folder: Path, flight: Flight) -> None:
    m = flight.material
    names = ("velocity", "spin", "floor", "gravity", "grains", "grain_radius", "grain_mass", "time_step", "steps", "frames", "own_loop")
    given = {name: getattr(flight, name) for name in names}
    given |= {"young": m.youngs_modulus, "poisson": m.poisson_ratio, "pair": {
        "restitution": m.restitution, "staticFriction": m.static_friction, "kineticFriction": m.kinetic_friction,
        "criticalSlipDistance": m.critical_slip_distance, "rollingFriction": m.rolling_friction}}
    given["law"] = {"rollingResistance": m.rolling_resistance}
    if m.bridge_volume > 0.0:
        given["pair"] |= {"bridgeVolume": m.bridge_volume, "contactAngle": m.contact_angle, "surfaceTension": m.surface_tension}
        given["law"]["capillaryModel"] = m.capillary_model
    (folder / "flight.json").write_text(json.dumps(given))
    done = yade_driver.run_script(folder, SCRIPT)
    assert "rig: finished" in done.stdout, (done.stdout + done.stderr)[-3000:]
