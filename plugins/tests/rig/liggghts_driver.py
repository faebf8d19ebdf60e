"""Runs LIGGGHTS decks, and scenarios as decks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dembark.validation.engines import Engine, call, find
from rig import input_script
from rig.motion import Motion
from rig.scenarios import Grain, Material, Scenario

COLUMNS = "id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz"


@cache
def engine() -> Engine:
    return find("liggghts")


@dataclass
class Run:
    """What a run left behind."""

    code: int
    output: str
    folder: Path

    @property
    def error(self) -> str:
        """The line with which the engine stopped, '' for none."""
        return next((line for line in self.output.splitlines() if line.startswith("ERROR")), "")


def run_deck(folder: Path, deck: str, *, ranks: int = 1, name: str = "case.in") -> Run:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(deck)
    # Ranks that wait must not keep the others from the processors of a machine that is busy.
    environment = engine().environment() | {"OMPI_MCA_mpi_yield_when_idle": "1"}
    done = call(engine().command(folder / name, {}, ranks), folder, environment)
    return Run(done.returncode, done.stdout + done.stderr, folder)


def read_dump(path: Path) -> tuple[NDArray[np.int64], list[NDArray[np.float64]]]:
    """Steps, and for each the table of its rows (as written, one line an item)."""
    lines = path.read_text(encoding="utf-8").splitlines()
    steps, frames = [], []
    at = 0
    while at < len(lines):
        assert lines[at] == "ITEM: TIMESTEP", lines[at]
        count = int(lines[at + 3])
        steps.append(int(lines[at + 1]))
        frames.append(np.array([line.split() for line in lines[at + 9 : at + 9 + count]], dtype=float))
        at += 9 + count
    return np.array(steps), frames


def properties(m: Material, **overrides: str) -> str:
    """The `fix property/global` lines of a material for two atom types; an override replaces a property's values or, '', drops it."""
    pair = "peratomtypepair 2 " + " ".join(["{0!r}"] * 4)
    each = "peratomtype {0!r} {0!r}"
    values = {
        "youngsModulus": each.format(m.youngs_modulus),
        "poissonsRatio": each.format(m.poisson_ratio),
        "coefficientRestitution": pair.format(m.restitution),
        "characteristicVelocity": f"scalar {m.characteristic_velocity!r}",
        "coefficientFriction": pair.format(m.static_friction),  # of stock models
        "staticFriction": pair.format(m.static_friction),
        "kineticFriction": pair.format(m.kinetic_friction),
        "criticalSlipDistance": pair.format(m.critical_slip_distance),
        "interfaceShearStrength": pair.format(min(m.interface_shear_strength, 1e300)),
        "healingTime": f"scalar {m.healing_time!r}",
        "surfaceTension": f"scalar {m.surface_tension!r}",
        "contactAngle": each.format(m.contact_angle),
        "bridgeVolume": pair.format(m.bridge_volume),
    }
    if m.viscosity > 0.0:
        values |= {"liquidViscosity": f"scalar {m.viscosity!r}", "minimumGap": f"scalar {m.minimum_gap!r}"}
    if m.rolling_resistance != "off":
        values |= {"coefficientRollingFriction": pair.format(m.rolling_friction),
                   "coefficientRollingViscousDamping": pair.format(m.rolling_damping_ratio)}
    assert not overrides.keys() - values.keys()
    values |= overrides
    return "\n".join(f"fix p_{name} all property/global {name} {value}" for name, value in values.items() if value)


def models(m: Material, tangential: str = "finnie_rabinowicz", wall: str = "") -> str:
    """The words of `pair_style gran` or `fix wall/gran` that choose the models; `wall` stands between models and settings."""
    wet = m.bridge_volume > 0.0
    settings = f" presliding {m.presliding}" if tangential == "finnie_rabinowicz" else ""
    settings += f" friction_limit {m.friction_limit}" if m.friction_limit != "total" else ""
    settings += f" rolling_resistance {m.rolling_resistance}" if m.rolling_resistance != "off" else ""
    settings += f" capillary_model {m.capillary_model}" if wet else ""
    settings += " viscous_liquid on" if wet and m.viscosity > 0.0 else ""
    return f"model {m.normal_law} tangential {tangential}{' cohesion capillary' if wet else ''} {wall}{settings}"


def head(newton: str = "off", boundary: str = "f f f") -> str:
    """The first lines of a deck."""
    return input_script.head("granular", "communicate single vel yes", newton, boundary)


def deck(case: Scenario, *, tangential: str = "finnie_rabinowicz", newton: str = "off", material_lines: str | None = None,
         finish: str = "", start: str = "") -> str:
    def spin(g: Grain) -> str:
        return " ".join(f"omega{axis} {w!r}" for axis, w in zip("xyz", g.angular_velocity, strict=True))

    m = case.material
    lines = [head(newton), input_script.domain(case), properties(m) if material_lines is None else material_lines,
             f"pair_style gran {models(m, tangential)}", "pair_coeff * *\n",
             *input_script.grains(case, spin)]
    if case.wall:
        lines.append(f"fix floor all wall/gran {models(m, tangential, 'primitive type 2 zplane 0')}")
    lines += input_script.motion(case)
    lines.append(f"dump grains all custom {case.stride} grains.dump {COLUMNS}\n"
                 f'dump_modify grains sort id format "%d{" %.17g" * 15}"\n'
                 f"{start}\nthermo {case.steps}\nrun {case.steps}\n{finish}\n")
    return "\n".join(lines)


def motion(case: Scenario, folder: Path) -> Motion:
    steps, frames = read_dump(folder / "grains.dump")
    later = steps > 0
    steps, table = steps[later], np.array(frames)[later]
    return Motion(case.time_step * steps, *(table[:, :, k : k + 3] for k in (1, 4, 7, 10, 13)))


def run(case: Scenario, folder: Path, **options: str) -> Motion:
    done = run_deck(folder, deck(case, **options))
    if done.code != 0 or done.error:
        raise RuntimeError(f"{case.name}: {done.error or done.output[-2000:]}")
    return motion(case, folder)
