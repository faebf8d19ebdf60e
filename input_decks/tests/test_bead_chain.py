"""bead_chain: a wave of known speed is measured as it is, and each engine's runs as it must."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import jv

from dembark.input_decks.bead_chain.setup import LATTICES, hertz, plane_stiffness, row_frequency, setup, sphere_mass
from dembark.input_decks.tests.measuring import Control, defaults, judged, module, names, point
from dembark.postproc.tests.packings import frame_of

chain = module("bead_chain")
D, K, MASS, COUNT, DT = 0.005, 1.3e5, 1.6e-4, 50, 1e-5


def run(force: float = 0.4, lost: float = 0.0, heavier: float = 1.0) -> Any:
    """A wave that goes from contact to contact with the speed of its force, in spheres `heavier` than stated; by each contact
    it loses the part `lost` of its force."""
    speed = chain.SPEED * D * K ** (1.0 / 3.0) * force ** (1.0 / 6.0) / np.sqrt(heavier * MASS)
    lag, number = D / speed, np.arange(COUNT - 1)

    def frame(k: int) -> Any:
        # Five contacts wide.
        off = (k * 4 * DT - lag * number) / (2.5 * lag)
        push = np.where(np.abs(off) < 1.0, np.cos(0.5 * np.pi * off) ** 6, 0.0) * force * (1.0 - lost) ** number
        places = np.zeros((COUNT, 3))
        places[1:, 0] = np.cumsum(D - (push / K) ** (2.0 / 3.0))
        return frame_of(places, 0.5 * D, {}, step=4 * k)

    frames = [frame(k) for k in range(int(COUNT * lag / (4 * DT)))]
    return SimpleNamespace(parameters=defaults("bead_chain"), derived={"stiffness": K, "mass": MASS, "spacing": D}, time_step=DT,
                           grains=lambda: frames)


def verdicts(**changes: Any) -> dict[str, dict[str, Any]]:
    return judged("bead_chain", chain.measure([run(**changes)]))


def study(power: float, **changes: float) -> dict[str, dict[str, Any]]:
    """Waves whose speed grows with this power of their force."""
    points = [point(defaults("bead_chain", hit_speed=force, **changes),
                    {"peak_force": force, "velocity": 8.0 * force**power}) for force in (0.05, 0.4, 2.0)]
    return judged("bead_chain", chain.study("force", points, "hit_speed"))


def passed(stiffer: float = 1.0, **changes: float) -> dict[str, dict[str, Any]]:
    """A front in a layer whose springs are `stiffer` than stated."""
    p, turn = defaults("bead_chain", grain_count=120, lattice="hexagonal", columns=4, overlap=5e-6, hit_speed=2e-5, **changes), 2000.0
    steps = 20 * np.arange(1, 121)
    speeds = 1e-5 * chain.lattice(120, np.sqrt(stiffer) * turn * DT * steps)
    frames = [frame_of(np.zeros((480, 3)), 0.5 * D, {}, step=int(step), velocities=np.repeat(speed, 4)[:, None] * [1.0, 0.0, 0.0])
              for step, speed in zip(steps, speeds, strict=True)]
    replica = SimpleNamespace(parameters=p, derived={"row_frequency": turn}, time_step=DT, grains=lambda: frames)
    return judged("bead_chain", chain.measure([replica]))


def test_a_known_front() -> None:
    found = passed()
    assert names(found, "pass") == {"front_speed", "front_profile"} and found["front_profile"]["value"] < 1e-12
    assert passed(1.1)["front_speed"]["value"] == pytest.approx(1.1**0.5, rel=0.01)


def test_rows_swing_as_in_an_endless_lattice_until_the_fronts_meet() -> None:
    """Of a row that is given a speed the n-th next has J_2n(2 Omega t) of it (Schroedinger 1914)."""
    phases = np.linspace(0.0, 20.0, 9)
    due = [[sum(jv(2 * m, 2.0 * phase) for m in range(n, 60)) for n in range(1, 11)] for phase in phases]
    np.testing.assert_allclose(0.5 * chain.lattice(200, phases)[:, 100:110], due, atol=1e-12)


def bed(lattice: str, overlap: float) -> tuple[SimpleNamespace, Any, Any]:
    """Parameters, the spheres of a lattice (planes, n, 3), and the ways (n, 3) from a sphere of the second plane to all, the nearest image
    of each."""
    p = SimpleNamespace(**defaults("bead_chain", lattice=lattice, columns=4, overlap=overlap, grain_count=30))
    packing = setup(p).packing
    assert packing is not None
    ways = packing.positions - packing.positions[len(packing.positions) // 30 + 1]
    for axis in (1, 2)[lattice == "hexagonal":]:
        side = np.ptp(packing.box[axis])
        ways[:, axis] -= side * np.round(ways[:, axis] / side)
        assert (packing.positions[:, axis] > 0.0).all() and (packing.positions[:, axis] < side).all()
    return p, packing, ways


@pytest.mark.parametrize(("lattice", "around", "speed"), [("hexagonal", 6, 9 / 8), ("fcc", 12, 1.0), ("hcp", 12, 4 / 3)])
def test_planes_are_as_stiff_as_their_contacts(lattice: str, around: int, speed: float) -> None:
    """The force on a plane that is moved along x between two at rest, -2 m Omega^2 x a sphere, from the contacts of a sphere in both."""
    p, _, ways = bed(lattice, 5e-6)
    a, moved = p.grain_diameter - p.overlap, 1e-4 * p.overlap
    apart = np.linalg.norm(ways, axis=1)
    touching = (apart > 0.0) & (apart < 1.01 * a)
    assert touching.sum() == around and apart[touching] == pytest.approx(a, rel=1e-12)
    others = ways[touching & (np.abs(ways[:, 0]) > 0.1 * a)]
    assert len(others) == 2 * LATTICES[lattice].contacts
    arm = others - [moved, 0.0, 0.0]
    length = np.linalg.norm(arm, axis=1)
    force = -(hertz(p) * (p.grain_diameter - length) ** 1.5 * arm[:, 0] / length).sum()
    assert 2.0 * row_frequency(p) ** 2 == pytest.approx(-force / moved / sphere_mass(p), rel=1e-6)
    # Speed of long waves over a sqrt(K/m).
    stiff = 1.5 * hertz(p) * p.overlap**0.5
    long = (LATTICES[lattice].cosine * row_frequency(p)) ** 2 * sphere_mass(p) / stiff
    assert long == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("lattice", ["fcc", "hcp"])
def test_planes_that_get_closer_press_with_their_contacts(lattice: str) -> None:
    """The force along x between two planes that touch, when one has moved, from the contacts of a sphere."""
    p, _, ways = bed(lattice, 0.0)
    moved = 1e-6 * p.grain_diameter
    ahead = ways[(ways[:, 0] > 0.1 * p.grain_diameter) & (np.linalg.norm(ways, axis=1) < 1.01 * p.grain_diameter)] - [moved, 0.0, 0.0]
    length = np.linalg.norm(ahead, axis=1)
    force = (hertz(p) * np.maximum(p.grain_diameter - length, 0.0) ** 1.5 * ahead[:, 0] / length).sum()
    assert force == pytest.approx(plane_stiffness(p) * moved**1.5, rel=1e-4)


@pytest.mark.parametrize(("change", "named"), [({"bridge_volume": 8e-11}, "dry"), ({"restitution": 0.9}, "elastic")])
def test_wet_or_inelastic_spheres_are_not_judged_by_the_theory_of_dry_elastic_ones(change: dict[str, float], named: str) -> None:
    one = run()
    one.parameters |= change
    found = judged("bead_chain", chain.measure([one]))
    for name in ("wave_speed", "wave_decay"):
        assert found[name]["verdict"] == "info" and named in found[name]["reason"], name
    front = passed(**change)
    for name in ("front_speed", "front_profile"):
        assert front[name]["verdict"] == "info" and named in front[name]["reason"], name
    assert study(1.0 / 6.0, **change)["force_exponent"]["verdict"] == "info"
    rubs = passed(grain_friction=0.3)["front_speed"]
    assert rubs["verdict"] == "info" and "friction" in rubs["reason"]


def test_a_known_wave() -> None:
    found = verdicts()
    assert names(found, "pass") == {"wave_speed", "wave_decay"}
    assert found["peak_force"]["value"] == pytest.approx(0.4, rel=1e-3)
    assert found["wave_speed"]["value"] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_wave_in_an_engine(engine: str, simulate: Any) -> None:
    found = judged("bead_chain", chain.measure([simulate("bead_chain", engine, {"grain_count": 40}, "hit")]))
    assert names(found, "pass") == {"wave_speed", "wave_decay"}, found


@pytest.mark.parametrize("lattice", ["fcc", "hcp"])
@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_wave_in_a_lattice(engine: str, lattice: str, simulate: Any) -> None:
    found = judged("bead_chain", chain.measure([simulate("bead_chain", engine, {"grain_count": 40}, f"pulse_{lattice}")]))
    assert names(found, "pass") == {"wave_speed", "wave_decay"}, found


@pytest.mark.parametrize("variant", ["front", "front_fcc", "front_hcp"])
@pytest.mark.parametrize("engine", ["liggghts", "yade", "lammps"])
def test_the_front_in_an_engine(engine: str, variant: str, simulate: Any) -> None:
    found = judged("bead_chain", chain.measure([simulate("bead_chain", engine, {"grain_count": 80, "frames": 100}, variant)]))
    assert names(found, "pass") == {"front_speed", "front_profile"}, found


def controls_bead_chain(_folder: Path) -> Iterator[Control]:
    right = verdicts()
    yield Control("spheres a fiftieth too heavy", right, verdicts(heavier=1.02))
    yield Control("a contact that dissipates part of its energy", right, verdicts(lost=1e-3))
    yield Control("a spring of Hooke's law", study(1.0 / 6.0), study(0.0))
    yield Control("springs a tenth too stiff", passed(), passed(1.1))
