"""Hard grains against kinetic theory, and what Python makes of the solver: shapes, checks, states."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from dembark.physics import HardGrains, HardWall, WallMotion


def lattice(n: int, length: float) -> np.ndarray:
    """n^3 places in a cube (0, length)."""
    return np.stack(np.meshgrid(*[np.arange(n)] * 3), axis=-1).reshape(-1, 3) * (length / n) + 0.5 * length / n


def gas(n: int, fraction: float, seed: int, **settings: object) -> tuple[HardGrains, float]:
    """n^3 spheres of diameter and mass 1, kT = 1, in a periodic cube; and its side."""
    count = n**3
    length = (count * np.pi / 6 / fraction)**(1 / 3)
    velocity = np.random.default_rng(seed).normal(size=(count, 3))
    velocity -= velocity.mean(axis=0)
    velocity *= np.sqrt(3 * (count - 1) / (velocity**2).sum())
    return HardGrains(1.0, 0.5, lattice(n, length), velocity, periods=[(0, length)] * 3, **settings), length  # type: ignore[arg-type]


def carnahan_starling(phi: float) -> float:
    """Pressure over n kT of elastic spheres (J. Chem. Phys. 51 (1969) 635)."""
    return (1 + phi + phi**2 - phi**3) / (1 - phi)**3


def interval(values: np.ndarray) -> float:
    """Half of the 99.9 % interval of the mean."""
    return float(stats.t.ppf(0.9995, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))


@pytest.mark.parametrize("phi", [0.1, 0.2, 0.3, 0.4])
def test_pressure_of_an_elastic_gas_is_that_of_carnahan_and_starling(phi: float) -> None:
    system, _ = gas(8, phi, 1)
    system.run(4.0)
    motion = system.run(60.0, samples=10)
    virial = np.trace(motion.virial, axis1=1, axis2=2)
    # Of N - 1 free grains with kT = 1: 2 E / 3 + virial / 3 a second, over N kT.
    compressibility = 1 + np.diff(virial) / np.diff(motion.time) / (3 * 511)
    # The equation itself is within 0.3 % of simulations.
    assert abs(compressibility.mean() - carnahan_starling(phi)) < interval(compressibility) + 0.003 * carnahan_starling(phi)
    assert interval(compressibility) < 0.02 * carnahan_starling(phi)
    assert motion.overlap.max() < 1e-13
    assert motion.kinetic_energy == pytest.approx(motion.kinetic_energy[0], rel=1e-12)
    # Negative control: what spheres 2 % larger would have.
    assert abs(compressibility.mean() - carnahan_starling(phi * 1.02**3)) > interval(compressibility) + 0.003 * carnahan_starling(phi)


def haff_rate(phi: float, e: float) -> float:
    """Of T = T0 / (1 + rate t)^2, for m = d = T0 = 1: P. K. Haff, J. Fluid Mech. 134 (1983) 401, with Enskog's frequency of collisions and
    the first correction of the velocities' distribution (T. P. C. van Noije, M. H. Ernst, Granular Matter 1 (1998) 57)."""
    density, contact = 6 * phi / np.pi, (1 - phi / 2) / (1 - phi)**3
    a2 = 16 * (1 - e) * (1 - 2 * e**2) / (81 - 17 * e + 30 * e**2 * (1 - e))
    return (1 - e**2) / 6 * 4 * np.sqrt(np.pi) * density * contact * (1 + 3 * a2 / 16)


@pytest.mark.parametrize("e", [0.95, 0.9])
def test_a_gas_cools_by_haffs_law(e: float) -> None:
    phi, rates = 0.1, []
    for seed in range(8):
        system, _ = gas(8, phi, seed)
        system.run(3.0)  # elastic: away from the lattice
        positions, velocities = system.run(0.0).position[-1], system.run(0.0).velocity[-1]
        length = (512 * np.pi / 6 / phi)**(1 / 3)
        cooling = HardGrains(1.0, 0.5, positions, velocities, periods=[(0, length)] * 3, restitution=e)
        motion = cooling.run(1.5 / haff_rate(phi, e), samples=15)
        roots = np.sqrt(motion.kinetic_energy[0] / motion.kinetic_energy)
        rates.append(np.polyfit(motion.time, roots, 1)[0])
        assert motion.kinetic_energy[-1] < 0.2 * motion.kinetic_energy[0]
        assert motion.energy_balance == pytest.approx(motion.energy_balance[0], rel=1e-12)
    # First-order theory is good to a per cent.
    assert abs(np.mean(rates) - haff_rate(phi, e)) < interval(np.array(rates)) + 0.01 * haff_rate(phi, e)
    # Negative control: Enskog's factor left out.
    dilute = haff_rate(phi, e) * (1 - phi)**3 / (1 - phi / 2)
    assert abs(np.mean(rates) - dilute) > interval(np.array(rates)) + 0.01 * dilute


def test_grains_that_fall_in_a_box_settle_with_the_barometric_law() -> None:
    """Elastic, dilute, above a floor: density ∝ exp(-m g z / T), the mean height over the lowest is T / (m g)."""
    place = lattice(6, 12.0) + np.array([0, 0, 0.1])
    velocity = np.random.default_rng(3).normal(size=place.shape)
    system = HardGrains(1.0, 0.1, place, velocity, gravity=(0, 0, -0.5), periods=[(0, 12), (0, 12), None],
                        walls=[HardWall(point=(0, 0, 0), normal=(0, 0, 1))])
    motion = system.run(400.0, samples=100)
    temperature = 2 * motion.kinetic_energy[20:].mean() / (3 * len(place))
    height = motion.position[20:, :, 2].mean() - 0.1
    assert height == pytest.approx(temperature / 0.5, rel=0.05)
    assert motion.energy_balance == pytest.approx(motion.energy_balance[0], rel=1e-12)
    force = motion.wall_impulse[-1, 0, 2] / 400
    assert force == pytest.approx(0.5 * len(place), rel=0.01)


def test_a_sheared_gas_has_the_walls_power_as_its_loss() -> None:
    rng = np.random.default_rng(5)
    place = np.stack(np.meshgrid(np.arange(8), np.arange(6)), axis=-1).reshape(-1, 2) * 1.5 + 0.8
    walls = [HardWall(point=(0, 0), normal=(0, 1), motion="uniform velocity -1 0 0", friction=0.8),
             HardWall(point=(0, 9.5), normal=(0, -1), motion=WallMotion("uniform velocity 1 0 0"), friction=0.8)]
    system = HardGrains(1.0, 0.5, place, rng.normal(size=place.shape), restitution=0.9, friction=0.3, periods=[(0, 12), None], walls=walls)
    motion = system.run(200.0, samples=4)
    assert motion.spin.shape == (5, 48) and motion.virial.shape == (5, 2, 2) and motion.wall_impulse.shape == (5, 2, 2)
    assert motion.energy_balance == pytest.approx(motion.energy_balance[0], rel=1e-11)
    late = motion.wall_work[-1].sum() - motion.wall_work[2].sum()
    assert late == pytest.approx((motion.normal_loss + motion.friction_loss)[-1] - (motion.normal_loss + motion.friction_loss)[2], rel=0.2)
    moved = motion.velocity[-1].sum(axis=0) - motion.velocity[0].sum(axis=0)
    assert motion.wall_impulse[-1].sum(axis=0) == pytest.approx(moved, abs=1e-9)


def test_samples_change_nothing_and_states_go_on_bit_for_bit() -> None:
    once, _ = gas(4, 0.3, 6, restitution=0.9, friction=0.5, tangential_restitution=0.3)
    often, _ = gas(4, 0.3, 6, restitution=0.9, friction=0.5, tangential_restitution=0.3)
    end = once.run(2.0)
    first = often.run(1.0, samples=50)
    state = often.state()
    often.run(1.0)
    assert np.array_equal(often.state(), once.state())
    fresh, _ = gas(4, 0.3, 6, restitution=0.9, friction=0.5, tangential_restitution=0.3)
    fresh.restore(state)
    assert fresh.time == first.time[-1]
    assert np.array_equal(fresh.run(1.0).position[-1], end.position[-1])
    smaller, _ = gas(3, 0.3, 6)
    with pytest.raises(ValueError, match="the saved state is that of other grains or walls"):
        smaller.restore(state)


def test_velocities_can_be_set() -> None:
    system, _ = gas(3, 0.3, 7)
    motion = system.run(0.7)
    system.set_velocities(-motion.velocity[-1])
    back = system.run(0.7)
    assert back.position[-1] == pytest.approx(motion.position[0], abs=1e-8)


def test_positions_go_on_beyond_the_period() -> None:
    one = HardGrains(1.0, 0.1, [[0.5, 0.5]], [[1.0, -2.0]], periods=[(0, 1), (0, 1)])
    assert one.run(10.0).position[-1, 0] == pytest.approx([10.5, -19.5], rel=1e-13)


BALL = {"mass": 1.0, "radius": 0.1, "position": [[0.0, 0.0, 1.0]]}
FLOOR = HardWall(point=(0, 0, 0), normal=(0, 0, 1))


@pytest.mark.parametrize(("change", "message"), [
    ({"restitution": 1.2}, "restitution must be between 0 and 1 and finite, not 1.2"),
    ({"restitution": -0.1}, "restitution must be between 0 and 1 and finite, not -0.1"),
    ({"friction": -1}, "friction must be >= 0, not -1"),
    ({"tangential_restitution": 2}, "tangential_restitution must be between -1 and 1 and finite, not 2"),
    ({"position": [[0.0, float("nan"), 1.0]]}, "position must be a finite number (m), not nan"),
    ({"position": [0.0, 1.0]}, "position must have the shape (grains, 2) or (grains, 3), not (2,)"),
    ({"velocity": [[1.0, 2.0]]}, "velocity must have the shape (1, 3), not (1, 2) (m/s)"),
    ({"mass": [1.0, 2.0]}, "mass must be a number or have one value a grain, shape (1,), not (2,) (kg)"),
    ({"radius": 0.0}, "radius must be > 0 m and finite, not 0"),
    ({"inertia": "cube"}, "inertia must be 'sphere' or 'cylinder', not 'cube'"),
    ({"position": [[0, 0, 1], [0, 0, 1.15]]}, "grains 0 and 1 overlap by 0.05 m at the start"),
    ({"position": [[0, 0, 0.05]], "walls": [FLOOR]}, "grain 0 is 0.05 m inside wall 0 at the start"),
    ({"walls": [replace(FLOOR, restitution=2)]}, "restitution must be between 0 and 1 and finite, not 2"),
    ({"walls": [replace(FLOOR, normal=(0, 0, 0))]}, "normal must not be zero"),
    ({"walls": [replace(FLOOR, motion="harmonic amplitude 0 0 nan frequency 2")]}, "motion harmonic: amplitude 'nan' is not a number"),
    ({"walls": [replace(FLOOR, motion="rotation point 0 0 0 axis 0 1 0 rate 1")]},
     "wall 0: it must not turn: hard grains have walls that keep their direction"),
    ({"periods": [None, None]}, "periods must have 3 entries, each None or (low, high) in m, not 2"),
    ({"periods": [(1, 0), None, None]}, "a period must be (low, high) in m with low < high, not (1, 0)"),
    ({"periods": [(0, 0.5), None, None]}, "the period along x, 0.5 m, must be longer than three of the largest diameters, 0.6 m"),
    ({"contact_duration": -1}, "contact_duration must be >= 0 s and finite, not -1"),
])
def test_wrong_arguments_get_one_line(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 (the message is compared)
        HardGrains(**{**BALL, **change})  # type: ignore[arg-type]
    assert str(caught.value) == message


def test_a_collapse_gets_one_line() -> None:
    ball = HardGrains(**BALL, restitution=0.5, gravity=(0, 0, -9.81), walls=[FLOOR])  # type: ignore[arg-type]
    with pytest.raises(RuntimeError, match=r"inelastic collapse at 1\.28\d* s: grain 0 collides without end; set contact_duration"):
        ball.run(10.0)
    with pytest.raises(ValueError, match="samples must be a whole number >= 1, not 0"):
        ball.run(1.0, samples=0)
    with pytest.raises(ValueError, match="duration must be >= 0 s and finite, not -1"):
        ball.run(-1.0)


def test_there_are_no_warnings_without_walls() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert HardGrains(1.0, 0.1, [[0.0, 0.0]]).run(1.0).wall_work.shape == (2, 0)
