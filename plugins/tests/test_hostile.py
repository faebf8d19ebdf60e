"""Extreme but meaningful input: all programs give the same finite answer."""

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from rig import lammps_driver, liggghts_driver, python_driver, walls, yade_driver
from rig.motion import QUANTITIES, deviation
from rig.scenarios import ALL_OF_IT, STILL, Grain, Material, Path, Scenario

R = 5e-3
# Down by 0.1 mm and sideways beyond the slip distance, and up again to 0.9 mm.
PUSH = Path(displacement=("0.00003*sin(2*PI*300*t)", "0.00002*t", "-0.0005*(1-cos(2*PI*100*t))"),
            velocity=("0.00003*2*PI*300*cos(2*PI*300*t)", "0.00002", "-0.0005*2*PI*100*sin(2*PI*100*t)"))


def pushed(path: Path = PUSH, radius: float = R, gap: float = 9e-4, **material: float) -> Scenario:
    m = replace(ALL_OF_IT, **material)
    return Scenario(name="", material=m, time_step=1e-5, steps=1200, grains=(
        Grain(radius=radius, position=(0.0, 0.0, radius + gap), path=path, angular_velocity=(1.0, 2.0, 0.0)),
        Grain(path=STILL, position=(0.0, 0.0, -R))))


def free(time_step: float = 1e-6, steps: int = 1500, gap: float = 1e-4, speed: float = 0.5, **material: float) -> Scenario:
    return Scenario(name="", material=replace(ALL_OF_IT, **material), time_step=time_step, steps=steps, grains=(
        Grain(position=(0.0, 0.0, R + gap), velocity=(0.1, 0.0, -speed), angular_velocity=(20.0, -10.0, 5.0)),
        Grain(position=(0.0, 0.0, -R))))


REST = Path(displacement=("0", "0", "0"), velocity=("0", "0", "0"))
CASES = {
    "vanishing volume": pushed(bridge_volume=1e-24),
    "volume of twice the radius cubed": pushed(bridge_volume=2.5e-7),
    "no surface tension": pushed(surface_tension=0.0),
    "complete wetting": pushed(contact_angle=0.0),
    "no wetting": pushed(contact_angle=0.5 * pi),
    "size ratio 20": pushed(radius=R / 20.0, gap=8.5e-4, bridge_volume=1e-12),
    "touching with no gap at all": pushed(path=REST, gap=0.0),
    "overlap at rest": pushed(path=REST, gap=-1e-4),
    "overlap of half a radius": pushed(path=REST, gap=-0.5 * R),
    "no friction": free(static_friction=0.0, kinetic_friction=0.0),
    "friction of 100": free(static_friction=100.0, kinetic_friction=100.0),
    "no slip distance": free(critical_slip_distance=0.0),
    "slip distance of 1e-30 m": free(critical_slip_distance=1e-30),
    "slip distance of a metre": free(critical_slip_distance=1.0),
    "unlimited strength": free(interface_shear_strength=inf),
    "strength of 1 mPa": free(interface_shear_strength=1e-3),
    "strength of 1 mPa, exponential": free(interface_shear_strength=1e-3, presliding="exponential"),
    "stiff by a million": free(youngs_modulus=1e13, time_step=2e-9, steps=2000, gap=1e-7, speed=0.5),
    "soft by a thousand": free(youngs_modulus=1e4, time_step=2e-6, steps=1500),
    "time step much too large": free(time_step=2e-4, steps=30, gap=1e-4),
    "restitution of 0.06": free(restitution=0.06),
    "healing that never ends": free(healing_time=1e300),
}
CASES = {name: replace(case, name=name, stride=1 if case.steps < 100 else 10) for name, case in CASES.items()}


def worst(expected, found) -> dict[str, float]:
    """Deviations; of the tangential force, which is got from the whole one, less what is round-off of that."""
    result = deviation(expected, found)
    whole, part = (np.abs(force).max() for force in (expected.force, expected.tangential_force))
    if part < 1e-12 * whole:
        assert np.abs(found.tangential_force).max() < 1e-12 * whole
        del result["tangential_force"]
    elif part > 0.0:
        result["tangential_force"] = max(0.0, result["tangential_force"] - 4.0 * np.finfo(float).eps * whole / part)
    return result


def finite(motion) -> bool:
    return all(np.isfinite(getattr(motion, name)).all() for name in QUANTITIES)


@pytest.fixture(scope="module")
def expected():
    return {name: python_driver.run(case) for name, case in CASES.items()}


@pytest.fixture(scope="module")
def liggghts(liggghts_is_there, tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    # The engine refuses moduli out of its range unless told that they are meant.
    meant = "units si\nhard_particles yes\nsoft_particles yes\n"
    decks = {name: liggghts_driver.deck(case).replace("units si\n", meant) for name, case in CASES.items()}
    return walls.motions(folder, decks, CASES)


@pytest.fixture(scope="module")
def yade(yade_is_there, tmp_path_factory):
    return yade_driver.run_all(CASES.values(), tmp_path_factory.mktemp("hostile"))


@pytest.fixture(scope="module")
def lammps(lammps_is_there, tmp_path_factory):
    # Its bridges must not be longer than the skin.
    decks = {name: lammps_driver.deck(case).replace("neighbor 0.001 bin", "neighbor 0.03 bin") for name, case in CASES.items()}
    return lammps_driver.motions(tmp_path_factory.mktemp("hostile"), decks, CASES)


@pytest.mark.parametrize("name", CASES)
def test_python_gives_numbers(expected, name):
    assert finite(expected[name])
    if name != "touching with no gap at all":
        assert np.abs(expected[name].force).max() > 0.0


@pytest.mark.parametrize("name", CASES)
def test_liggghts_gives_the_same(expected, liggghts, name):
    found = worst(expected[name], liggghts[name])
    assert max(found.values()) < 1e-9, found


@pytest.mark.parametrize("name", CASES)
def test_yade_gives_the_same(expected, yade, name):
    found = worst(expected[name], yade[name])
    assert max(found.values()) < 1e-9, found


@pytest.mark.parametrize("name", CASES)
def test_lammps_gives_the_same(expected, lammps, name):
    found = worst(expected[name], lammps[name])
    assert max(found.values()) < 1e-9, found


def test_nothing_happens_at_an_exact_touch(expected):
    assert (expected["touching with no gap at all"].force == 0.0).all()


@pytest.mark.parametrize("change", [{"static_friction": -0.1}, {"kinetic_friction": 0.9}, {"critical_slip_distance": -1.0},
                                    {"interface_shear_strength": 0.0}, {"healing_time": -1.0}, {"bridge_volume": -1e-10},
                                    {"bridge_volume": inf}, {"surface_tension": inf}, {"surface_tension": float("nan")},
                                    {"contact_angle": 20.0},
                                    {"restitution": 0.0}, {"restitution": 1.1}, {"youngs_modulus": inf}, {"youngs_modulus": float("nan")},
                                    {"presliding": "bent"}, {"capillary_model": "wet"}, {"normal_law": "hertzian"}])
def test_python_refuses_in_one_line(change):
    with pytest.raises((ValueError, TypeError)) as error:
        python_driver.contact(replace(Material(bridge_volume=1e-10), **change))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("wrong", [{"separation": (0.0, 0.0, float("nan"))}, {"velocity_1": (float("nan"), 0.0, 0.0)},
                                   {"time_step": float("nan")}])
def test_python_refuses_a_contact_without_numbers(wrong):
    """The state stays as it was."""
    words = {"separation": (0.0, 0.0, 1.99 * R), "velocity_1": (0.1, 0.0, 0.0), "time_step": 1e-6}
    zero = (0.0, 0.0, 0.0)
    state, twin = (python_driver.contact(ALL_OF_IT).begin() for _ in range(2))

    def step(contact, separation, velocity_1, time_step):
        return contact.step(separation, velocity_1, zero, zero, zero, R, R, 1e-3, 1e-3, time_step, True)

    for contact in (state, twin):
        step(contact, **words)
    with pytest.raises(ValueError, match="no finite force"):
        step(state, **(words | wrong))
    assert step(state, **words) == step(twin, **words)
