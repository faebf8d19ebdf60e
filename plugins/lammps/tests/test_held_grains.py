"""Grains that are frozen, or whose centres lie on each other or on a wall: the same in packs and one by one."""

from dataclasses import replace

import numpy as np
import pytest
from rig.lammps_driver import coefficients, head, run_deck, settings
from rig.scenarios import Material

WET = Material(bridge_volume=2e-11, static_friction=0.5, kinetic_friction=0.4, restitution=0.6, rolling_friction=0.1,
               rolling_resistance="elastic_plastic", rolling_damping_ratio=0.3)
PLACES = ("0 0 0.0049", "0.0095 0 0.0049", "0.0048 0 0.0128")  # two that are held touch each other and the floor; a third falls on them


def deck(material: Material, places=PLACES, run: str = "run 400") -> str:
    lines = "\n".join(f"create_atoms 1 single {place} units box" for place in places)
    return f"""\
{head()}
region domain block -0.05 0.05 -0.05 0.05 -0.05 0.05 units box
create_box 2 domain
{lines}
set group all diameter 0.01 density 2500.0
group held id 1 2
set group held vx 0.01 omega 3 2 1
neighbor 0.002 bin
pair_style dembark/granular {settings(material)}
pair_coeff * * {coefficients(material)}
region floor plane 0 0 0 0 0 1 units box
fix floor all wall/dembark region floor type 2
fix weight all gravity 9.81 vector 0 0 -1
fix hold held freeze
fix motion all nve/sphere
fix account all energy/account
compute pairs all property/local patom1 patom2
compute data all pair/local dist p1 p2 p3 p4 p5 p6 p7 p8 p9 p11 p12
dump pairs all local 50 pairs.dump c_pairs[1] c_pairs[2] c_data[*]
dump_modify pairs format float %.15g
dump grains all custom 50 grains.dump id x y z vx vy vz omegax omegay omegaz
dump_modify grains sort id format float %.15g
thermo_style custom step press f_floor[3] f_account[*]
thermo_modify format float %.15g
timestep 1e-5
thermo 50
{run}
"""


def numbers(path) -> np.ndarray:
    rows = [line.split() for line in path.read_text().splitlines()]
    return np.array([[float(word) for word in row] for row in rows if row and row[0].lstrip("-")[:1].isdigit() and len(row) > 5])


@pytest.mark.parametrize("normal", ["hertz", "hooke"])
def test_frozen_wet_grains_are_the_same_in_packs_and_one_by_one(tmp_path, monkeypatch, normal):
    material = replace(WET, normal_law=normal)
    found = []
    for lanes in ("8", "1"):
        monkeypatch.setenv("DEMBARK_LANES", lanes)
        folder = tmp_path / lanes
        folder.mkdir()
        done = run_deck(folder, deck(material))
        assert done.code == 0, done.error or done.output[-2000:]
        assert "nan" not in done.output.lower()
        found.append([numbers(folder / name) for name in ("pairs.dump", "grains.dump")])
    for packs, single in zip(*found, strict=True):
        assert packs.shape == single.shape and np.isfinite(packs).all()
        np.testing.assert_allclose(packs, single, rtol=1e-9, atol=1e-12)
    pairs = found[0][0]
    between = pairs[(pairs[:, 0] + pairs[:, 1] == 3.0) & (pairs[:, 2] < 0.0101)]
    # Their bridge, and their spring without damping.
    assert len(between) and (between[1:, -1] == 2e-11).all()


@pytest.mark.parametrize("normal", ["hertz", "hooke"])
@pytest.mark.parametrize(("places", "line"), [
    (("0 0 0.02", "0 0 0.02", "0.02 0 0.02"), "grains 1 and 2 are at the same place"),
    (("0 0 0.02", "0.02 0 0.02", "0.03 0 0"), "the centre of grain 3 lies on the wall")])
def test_what_has_no_normal_ends_the_run(tmp_path, normal, places, line):
    done = run_deck(tmp_path, deck(Material(normal_law=normal), places, "run 10"))
    assert done.code != 0 and line in done.output, done.output[-1000:]
