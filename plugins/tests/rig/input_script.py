"""Lines that a scenario's deck has in engines with input scripts in LAMMPS's manner, whatever these call their styles."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rig.scenarios import Grain, Scenario, in_liggghts


def head(atom_style: str, velocities: str, newton: str, boundary: str) -> str:
    """The first lines of a deck; `velocities`: the command that gives them to ghosts."""
    return f"""\
units si
atom_style {atom_style}
atom_modify map array
boundary {boundary}
newton {newton}
{velocities}"""


def domain(case: Scenario) -> str:
    """Box and time step of a deck."""
    return f"""\
region domain block -0.05 0.05 -0.05 0.05 -0.05 0.05 units box
create_box 2 domain
neighbor 0.001 bin
neigh_modify delay 0
timestep {case.time_step!r}
variable t equal step*{case.time_step!r}"""


def grains(case: Scenario, spin: Callable[[Grain], str]) -> list[str]:
    """The grains with their velocities and, in the words of `spin`, their angular velocities; those on paths are moved."""
    lines = []
    for i, g in enumerate(case.grains, start=1):
        x, y, z = g.position
        velocity = " ".join(f"v{axis} {v!r}" for axis, v in zip("xyz", g.velocity, strict=True))
        lines += [f"create_atoms 1 single {x!r} {y!r} {z!r} units box", f"group g{i} id {i}",
                  f"set atom {i} diameter {2.0 * g.radius!r} density {g.density!r} {velocity} {spin(g)}"]
        if g.path:
            for kind, parts in (("d", g.path.displacement), ("v", g.path.velocity)):
                lines += [f'variable {kind}{axis}{i} equal "{in_liggghts(part)}"' for axis, part in zip("xyz", parts, strict=True)]
            lines.append(f"fix move{i} g{i} move variable v_dx{i} v_dy{i} v_dz{i} v_vx{i} v_vy{i} v_vz{i} units box")
    return lines


def motion(case: Scenario) -> list[str]:
    """Gravity, and what moves grains that are on no path."""
    strength = float(np.linalg.norm(case.gravity))
    weight = [f"fix weight all gravity {strength!r} vector " + " ".join(repr(c / strength) for c in case.gravity)] if strength > 0.0 else []
    return [*weight, *([] if case.prescribed else ["fix motion all nve/sphere"])]
