"""Dumps that the engines write with options that change their headers, and those of a run that begins with an empty box."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.postproc import ContactsDump, DumpError, DumpWarning, GrainsDump, universe
from dembark.validation import engines
from dembark.validation.cli import main

IN_CGS = """
units cgs
atom_style sphere
boundary p p f
newton off
comm_modify vel yes
region domain prism 0 3 0 3 -1 5 0.6 0 0 units box
create_box 2 domain
labelmap atom 1 glass 2 steel
lattice sc 0.499
region column block 0.4 2.8 0.4 2.8 0.4 2 units box
create_atoms 1 region column
set group all diameter 0.5
set group all density 2.5
group second id < 20
set group second type 2
pair_style dembark/granular
pair_coeff * * youngs_modulus 5e7 poissons_ratio 0.3 restitution 0.5 static_friction 0.5 kinetic_friction 0.4 critical_slip_distance 1e-3
velocity all set 50 20 -100 units box
fix motion all nve/sphere
fix weight all gravity 981 vector 0 0 -1
fix clock all dt/reset 10 1e-7 1e-4 0.005 units box
timestep 1e-5
neighbor 0.1 bin
dump plain all custom 100 plain.dump id type typelabel x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass
dump_modify plain units yes time yes format float %.17g sort id
dump scaled all custom 100 scaled*.dump id type xs ys zs ix iy iz vx vy vz diameter mass
dump_modify scaled units yes time yes format float %.17g
dump unwrapped all custom 100 unwrapped.dump id xu yu zu vx vy vz radius mass
dump_modify unwrapped units yes time yes format float %.17g
dump lamda all custom 100 lamda.dump id xsu ysu zsu vx vy vz radius mass
dump_modify lamda units yes time yes format float %.17g
dump packed all custom/gz 100 packed.dump.gz id x y z ix iy iz vx vy vz radius mass
dump_modify packed units yes time yes
dump binary all custom 100 binary.bin id x y z radius mass
run 300
"""
EMPTY = """
units si
atom_style granular
atom_modify map array
boundary p p f
newton off
communicate single vel yes
region domain block 0 0.03 0 0.03 -0.01 0.05 units box
create_box 1 domain
neighbor 0.001 bin
neigh_modify delay 0
fix youngsModulus all property/global youngsModulus peratomtype 5e6
fix poissonsRatio all property/global poissonsRatio peratomtype 0.3
fix restitution all property/global coefficientRestitution peratomtypepair 1 0.5
fix friction all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
fix template all particletemplate/sphere 10487 atom_type 1 density constant 2500 radius constant 0.0025
fix mixture all particledistribution/discrete 32452867 1 template 1.0
region filled block 0.0 0.03 0.0 0.03 0.0 0.04 units box
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
compute pairs all pair/gran/local pos id force
dump text all custom 10 text.dump id type x y z ix iy iz vx vy vz radius mass
dump polydata all custom/vtk 10 polydata*.vtp id type x y z ix iy iz vx vy vz radius mass
dump legacy all custom/vtk 10 legacy*.vtk id type x y z vx vy vz radius mass
dump grid all custom/vtk 10 grid*.vtu id type x y z vx vy vz radius mass
dump atoms all atom/vtk 10 atoms*.vtk
dump lines all local/gran/vtk 10 pairs*.vtk pairs
run 20
fix inserted all insert/pack seed 32452843 distributiontemplate mixture insert_every once overlapcheck yes all_in yes &
  particles_in_region 50 region filled
run 20
"""


def run_of(name, deck, folder):
    """The folder in which the engine has run the deck."""
    try:
        engine = engines.find(name)
    except DembarkError as error:
        pytest.skip(str(error))
    (folder / "deck.in").write_text(deck)
    done = engines.call(engine.command(folder / "deck.in", {}), folder, engine.environment(), timeout=100)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr
    return folder


@pytest.fixture(scope="module")
def cgs(tmp_path_factory):
    """LAMMPS in cgs units with a step that changes; grains of 5 mm go through the borders of a tilted box."""
    return run_of("lammps", IN_CGS, tmp_path_factory.mktemp("cgs"))


@pytest.fixture(scope="module")
def empty(tmp_path_factory):
    """LIGGGHTS with grains from step 20 on."""
    return run_of("liggghts", EMPTY, tmp_path_factory.mktemp("empty"))


def test_what_lammps_writes_in_cgs_is_read_in_si(cgs):
    plain = GrainsDump(cgs / "plain.dump")
    assert plain.steps.tolist() == [0, 100, 200, 300] and np.unique(np.round(np.diff(plain.times), 5)).size > 1
    for number, frame in enumerate(plain):
        assert frame.radii == pytest.approx(0.0025) and frame.masses == pytest.approx(2500 * 4 / 3 * np.pi * 0.0025**3, rel=1e-9)
        assert frame.time == plain.times[number] and (frame.high - frame.low).tolist() == pytest.approx([0.03, 0.03, 0.06])
        assert frame.forces[:, 2].sum() / frame.masses.sum() == pytest.approx(-9.81) and set(frame.types.tolist()) == {1, 2}
    np.testing.assert_allclose(plain[0].velocities, [[0.5, 0.2, -1.0]] * len(plain[0].ids))
    assert not plain.remarks


@pytest.mark.parametrize("pattern", ["scaled*.dump", "unwrapped.dump", "lamda.dump", "packed.dump.gz"])
def test_whatever_lammps_dumps_the_places_are_the_same(cgs, pattern):
    plain, other = GrainsDump(cgs / "plain.dump"), GrainsDump(str(cgs / pattern))
    np.testing.assert_allclose(other.times, plain.times)
    for one, twin in zip(plain, other, strict=True):
        np.testing.assert_allclose(twin.positions, one.positions, atol=1e-12 if "gz" not in pattern else 1e-7)
        np.testing.assert_allclose(twin.velocities, one.velocities, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose([*twin.radii, *twin.masses], [*one.radii, *one.masses], rtol=1e-5)
    assert [one.time for one in universe(str(cgs / pattern)).trajectory] == pytest.approx(plain.times)


def test_a_binary_dump_of_lammps_is_refused_by_name(cgs):
    with pytest.raises(DumpError, match="is a binary dump in a format that cannot be read; write a text dump"):
        GrainsDump(cgs / "binary.bin")


@pytest.mark.parametrize("pattern", ["polydata*.vtp", "legacy*.vtk", "grid*.vtu", "atoms*.vtk"])
def test_a_vtk_series_may_begin_with_an_empty_box(empty, pattern):
    text = GrainsDump(empty / "text.dump")
    for stream in (False, True):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DumpWarning)
            frames = list(GrainsDump(str(empty / pattern), stream=stream))
        assert [len(frame.ids) for frame in frames] == text.counts.tolist() and text.counts[0] == 0 < text.counts[-1]
        for one, other in zip(text, frames, strict=True):
            np.testing.assert_allclose(other.wrapped, one.wrapped, atol=1e-7)
            np.testing.assert_allclose(other.velocities, one.velocities, rtol=1e-5, atol=1e-7)
            if pattern != "atoms*.vtk":
                np.testing.assert_allclose([other.low, other.high], [one.low, one.high], atol=1e-7)
    with pytest.warns(DumpWarning, match="which axes are periodic"):
        assert len(universe(str(empty / pattern)).atoms) == text.counts[-1]
    assert len(GrainsDump(min(empty.glob(pattern)))[0].ids) == 0


def test_fields_of_a_vtk_series_that_begins_with_an_empty_box(empty, capsys, monkeypatch):
    monkeypatch.chdir(empty)
    assert main(["fields", "legacy*.vtk", "--contacts", "pairs*.vtk", "--width", "1d", "--grid", "9", "--out", "f.nc"]) == 0
    said = capsys.readouterr().out
    assert "5 frames, 0 to 4 of 5" in said and "d = 5 mm" in said
    with pytest.warns(DumpWarning, match="which axes are periodic"):
        assert [len(frame.ids) for frame in ContactsDump(str(empty / "pairs*.vtk"))][:2] == [0, 0]
    assert main(["fields", "legacy*.vtk", "--frames", ":2", "--width", "1d", "--out", "f.nc"]) == 2
    assert "there are no grains in frames 0 to 1, which are the chosen ones" in capsys.readouterr().err
