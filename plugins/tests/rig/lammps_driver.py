"""Runs LAMMPS decks, and scenarios as decks."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.validation.engines import call
from rig import input_script
from rig.liggghts_driver import COLUMNS, Run
from rig.motion import Motion
from rig.scenarios import Material, Scenario
from rig.walls import Key, motion_of

BIN = Path(__file__).resolve().parents[3] / "build/bin"


def engine() -> Path:
    """The launcher."""
    if not (BIN / "lammps-dembark").exists():
        raise DembarkError(f"no LAMMPS in {BIN}; run 'make lammps'")
    return BIN / "lammps-dembark"


def run_deck(folder: Path, deck: str, *, ranks: int = 1, name: str = "case.in") -> Run:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(deck)
    launcher = [BIN / "lammps-mpiexec", "-n", str(ranks)] if ranks > 1 else []
    done = call([*launcher, engine(), "-in", name, "-log", "none"], folder, os.environ | {"OMP_NUM_THREADS": "1"})
    return Run(done.returncode, done.stdout + done.stderr, folder)


def settings(m: Material) -> str:
    """The words of `pair_style`."""
    words = ["normal", m.normal_law, *([repr(m.characteristic_velocity)] if m.normal_law == "hooke" else []), "presliding", m.presliding,
             "friction_limit", m.friction_limit,
             "rolling_resistance", m.rolling_resistance, "healing_time", repr(m.healing_time)]
    if m.bridge_volume > 0.0:
        words += ["capillary_model", m.capillary_model, "surface_tension", repr(m.surface_tension)]
    if m.bridge_volume > 0.0 and m.viscosity > 0.0:
        words += ["viscous_liquid", repr(m.viscosity), repr(m.minimum_gap)]
    return " ".join(words)


def coefficients(m: Material) -> str:
    """The words of `pair_coeff` after the types."""
    values = {name: getattr(m, name) for name in ("youngs_modulus", "restitution", "static_friction", "kinetic_friction",
                                                  "critical_slip_distance", "rolling_friction", "rolling_damping_ratio")}
    if m.bridge_volume > 0.0:
        values |= {"bridge_volume": m.bridge_volume, "contact_angle": m.contact_angle}
    values |= {"poissons_ratio": m.poisson_ratio, "interface_shear_strength": min(m.interface_shear_strength, 1e300)}
    return " ".join(f"{name} {value!r}" for name, value in values.items())


def head(newton: str = "off", boundary: str = "f f f") -> str:
    """The first lines of a deck."""
    return input_script.head("sphere", "comm_modify vel yes", newton, boundary)


def deck(case: Scenario, *, newton: str = "off") -> str:
    m = case.material
    lines = [head(newton), input_script.domain(case), f"pair_style dembark/granular {settings(m)}", f"pair_coeff * * {coefficients(m)}",
             *input_script.grains(case, lambda g: f"omega {' '.join(map(repr, g.angular_velocity))}")]
    if case.wall:
        lines += ["region floor plane 0 0 0 0 0 1 units box", "fix floor all wall/dembark region floor type 2"]
    lines += input_script.motion(case)
    lines.append(f"dump grains all custom {case.stride} grains.dump {COLUMNS}\ndump_modify grains sort id format float %.17g\n"
                 f"thermo {case.steps}\nrun {case.steps}")
    return "\n".join(lines) + "\n"


def motions(folder: Path, decks: Mapping[Key, str], cases: Mapping[Key, Scenario]) -> dict[Key, Motion]:
    """Motions by name, from one start of the program; each dump gets its deck's number."""
    text = "clear\n".join(deck.replace("grains.dump", f"{number}.dump") for number, deck in enumerate(decks.values()))
    done = run_deck(folder, text)
    if done.code != 0 or done.error:
        raise RuntimeError(done.error or done.output[-2000:])
    return {key: motion_of(cases[key], folder / f"{number}.dump") for number, key in enumerate(decks)}
