"""pair_style dembark/granular/kk against the style without suffix. Skipped where no LAMMPS with KOKKOS was built (make lammps-kokkos)."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lammps_bed import WET, bed
from rig.liggghts_driver import read_dump
from rig.scenarios import Material

from dembark.validation.engines import call

pytestmark = pytest.mark.full

BIN = Path(__file__).resolve().parents[3] / "build/lammps-kokkos/bin"
DRY = Material(static_friction=0.5, kinetic_friction=0.4, rolling_resistance="elastic_plastic", rolling_friction=0.05)
MATERIALS = {"linear": replace(DRY, presliding="linear"),
             "exponential": replace(DRY, presliding="exponential"),
             "partial_slip": replace(DRY, presliding="partial_slip"),
             "hooke": replace(DRY, normal_law="hooke", characteristic_velocity=0.5),
             "bridges": WET}


@pytest.fixture(scope="module", autouse=True)
def kokkos_is_there():
    if not (BIN / "lammps-dembark").exists():
        pytest.skip("no LAMMPS with KOKKOS; run 'make lammps-kokkos'")


def start(folder, text, *, threads=1, ranks=1, kokkos=True):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.in").write_text(text)
    words = ["-k", "on", "t", str(threads), "-sf", "kk", "-pk", "kokkos", "neigh", "half", "newton", "off"] if kokkos else []
    launcher = [BIN / "lammps-mpiexec", "-n", str(ranks)] if ranks > 1 else []
    # Open MPI starts neither as root nor with more ranks than cores unless it is allowed to.
    environment = os.environ | {"OMP_NUM_THREADS": str(threads), "OMP_PROC_BIND": "false", "OMPI_ALLOW_RUN_AS_ROOT": "1",
                                "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
    return call([*launcher, BIN / "lammps-dembark", "-in", "case.in", "-log", "none", *words], folder, environment)


def run(folder, text, **options):
    done = start(folder, text, **options)
    assert done.returncode == 0, (done.stdout + done.stderr)[-1500:]
    return read_dump(folder / "grains.dump")[1]


def on_frozen_grains(text):
    """The bed with a layer of frozen grains as its floor."""
    lines = [line for line in text.splitlines() if not line.startswith(("region floor", "fix floor"))]
    text = "\n".join(lines).replace("fix motion all nve/sphere", "fix motion moving nve/sphere\nfix held held freeze")
    text = text.replace("fix weight all", "region low block EDGE EDGE EDGE EDGE EDGE 0.004 units box\n"
                        "group held region low\ngroup moving subtract all held\nvelocity held set 0 0 0\nfix weight all")
    return text.replace(" f_floor[1] f_floor[2] f_floor[3]", "")


def assert_same(a, b, tolerance):
    """Each vector of all grains, relative to its largest component."""
    assert (a[:, 0] == b[:, 0]).all()
    for k in range(1, 16, 3):
        assert np.abs(a[:, k : k + 3] - b[:, k : k + 3]).max() <= tolerance * np.abs(a[:, k : k + 3]).max(), k


@pytest.fixture(scope="module", params=MATERIALS)
def settled(request, tmp_path_factory):
    """A restart of the style without suffix has no histories for KOKKOS: both begin with a data file of grains that lie."""
    folder = tmp_path_factory.mktemp(request.param)
    material = MATERIALS[request.param]
    settle = "fix calm all viscous 1e-4\nrun 8000\nwrite_data settled.data nocoeff"
    run(folder, on_frozen_grains(bed(settle, material=material)), kokkos=False)
    create = f"read_data {folder / 'settled.data'}"
    return lambda steps, every=1000: on_frozen_grains(bed(f"run {steps}", material=material, create=create, state="", every=every))


@pytest.mark.parametrize(("steps", "tolerance"), [(1, 1e-12), (1000, 1e-9)])
def test_forces_are_those_of_the_host(settled, tmp_path, steps, tolerance):
    # Sums in another order: round-off grows in 1000 steps.
    host = run(tmp_path / "host", settled(steps, steps), kokkos=False)
    device = run(tmp_path / "device", settled(steps, steps))
    assert np.abs(host[-1][:, 10:13]).max() > 0.0
    for before, after in zip(host, device, strict=True):
        assert_same(before, after, tolerance)


def test_threads_add_in_another_order(settled, tmp_path):
    one, two = (run(tmp_path / str(threads), settled(1000), threads=threads) for threads in (1, 2))
    assert_same(one[-1], two[-1], 1e-9)


WALLS = {
    "plane": ("plane 0 0 0 0 0 1", ""),
    "plane_out": ("plane 0 0 0 0 0 -1 side out", ""),
    "oblique": ("plane 0.012 0.012 -0.002 0.1 0.05 1", ""),
    "block": ("block EDGE EDGE EDGE EDGE 0 0.04", ""),
    "cylinder": ("cylinder z 0.012 0.012 0.0165 0 INF", ""),
    "drum": ("cylinder y 0.012 0.0125 0.0165 INF INF", "motion rotation point 0.012 0 0.0125 axis 0 1 0 rate 5"),
    "shaken": ("plane 0 0 0 0 0 1", "motion harmonic amplitude 0 0 0.0005 frequency 40 ramp 1"),
    "open": ("block EDGE EDGE EDGE EDGE 0 0.04 open 6", ""),  # a region that the device does not know
    "union": ("plane 0 0 0 0 0 1 units box\nregion roof plane 0 0 0.04 0 0 -1 units box\nregion both intersect 2 floor roof", ""),
}


def in_vessel(text, wall):
    region, motion = WALLS[wall]
    units = "" if wall == "union" else " units box"
    text = text.replace("region floor plane 0 0 0 0 0 1 units box", f"region floor {region}{units}")
    if wall in {"oblique", "cylinder", "drum"}:  # they are not periodic
        text = text.replace("boundary p p f", "boundary f f f")
        text = text.replace("block 0 0.024 0 0.024 -0.001 0.05", "block -0.02 0.044 -0.02 0.044 -0.02 0.06")
    name = "both" if wall == "union" else "floor"
    return text.replace("region floor type 3", f"region {name} type 3 {motion}")


@pytest.mark.parametrize("ranks", [1, 2])
@pytest.mark.parametrize("wall", WALLS)
@pytest.mark.parametrize("material", ["linear", "bridges"])
def test_walls_are_those_of_the_host(tmp_path, material, wall, ranks):
    """Grains fall, and some go over the periodic edges to the other rank with their contacts."""
    text = in_vessel(bed("run 2000", material=MATERIALS[material], head="processors * * 1", every=500), wall)
    host, device = run(tmp_path / "host", text, kokkos=False), run(tmp_path / "device", text, ranks=ranks)
    assert np.abs(host[-1][:, 16:19]).max() > 0.0
    assert_same(host[-1], device[-1], 1e-8)
    assert np.abs(host[-1][:, 16:19] - device[-1][:, 16:19]).max() <= 1e-8 * np.abs(host[-1][:, 16:19]).max()


@pytest.mark.parametrize("wall", ["drum", "shaken"])
def test_totals_of_walls_are_those_of_the_host(tmp_path, wall):
    numbers = " ".join(f"f_floor[{k}]" for k in range(1, 26))
    text = in_vessel(bed(f"fix out all ave/time 500 1 500 {numbers} file totals.txt format ' %.15g'\nrun 1000"), wall)
    for folder in ("host", "device"):
        run(tmp_path / folder, text, kokkos=folder == "device")
    host, device = (np.loadtxt(tmp_path / folder / "totals.txt") for folder in ("host", "device"))
    assert host.shape == (3, 26) and (np.abs(host).max(axis=0)[[1, 4, 7]] > 0.0).any()
    assert np.allclose(device, host, rtol=1e-7, atol=1e-9 * np.abs(host[:, 1:]).max())


def test_histories_at_walls_go_into_restart_files(tmp_path):
    """And goes on in the style without suffix, which reads the same file."""
    text = in_vessel(bed("run 1000\nwrite_restart cut.restart\nrun 500", every=500, material=DRY), "block")
    long = run(tmp_path, text)
    again = in_vessel(bed("run 500", create="read_restart cut.restart", state="", every=500, material=DRY), "block")
    assert_same(long[-1], run(tmp_path, again)[-1], 1e-8)


def test_contacts_with_walls_go_on_where_grains_enter(tmp_path):
    """Arrays grow, and grains get other places in memory."""
    enter = "".join(f"create_atoms 1 single {0.003 + 0.006 * k} 0.012 0.03\n" for k in range(3))
    enter += "set atom 49*51 diameter 0.005 density 2500\n"
    leave = "group gone id 4\ndelete_atoms group gone compress no\n"
    text = bed(f"run 1500\n{enter}run 500\n{leave}run 500", material=DRY, every=500, head="atom_modify sort 100 0.005")
    host, device = run(tmp_path / "host", text, kokkos=False), run(tmp_path / "device", text)
    assert len(host[0]) == 48 and len(host[-1]) == 50
    assert_same(host[-1], device[-1], 1e-8)
    assert np.abs(host[-1][:, 16:19] - device[-1][:, 16:19]).max() <= 1e-8 * np.abs(host[-1][:, 16:19]).max()


def test_walls_of_kokkos_leave_energies_to_the_host(tmp_path):
    text = bed("fix account all energy/account\nrun 0").replace("pair_style", "suffix off\npair_style", 1)
    done = start(tmp_path, text.replace("region floor", "suffix on\nregion floor", 1))
    assert done.returncode != 0 and "suffix off" in done.stdout + done.stderr, (done.stdout + done.stderr)[-1500:]


@pytest.mark.parametrize("material", MATERIALS)
def test_histories_go_from_rank_to_rank(tmp_path, material):
    text = on_frozen_grains(bed("run 2000", material=MATERIALS[material], head="processors 2 1 1"))
    one, two = run(tmp_path / "one", text.replace("processors 2 1 1", "")), run(tmp_path / "two", text, ranks=2)
    assert_same(one[2], two[2], 1e-8)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_restart_has_the_histories(tmp_path, ranks):
    """And goes on like a run that was not cut, but for the order of sums."""
    text = bed("run 1000\nwrite_restart cut.restart\nrun 500", every=500)
    long = run(tmp_path, on_frozen_grains(text), ranks=ranks)
    again = run(tmp_path, on_frozen_grains(bed("run 500", create="read_restart cut.restart", state="", every=500)), ranks=ranks)
    assert_same(long[-1], again[-1], 1e-8)


@pytest.mark.parametrize(("line", "instead", "named"), [
    ("thermo 1000", "fix account all energy/account\nthermo 1000", "energy/account"),
    ("capillary_model", "carried_liquid on capillary_model", "carried_liquid"),
    ("units si", "units si\npackage kokkos neigh full", "half lists"),
    ("newton off", "newton on", "newton off"),
])
def test_what_is_missing_is_refused(tmp_path, line, instead, named):
    done = start(tmp_path, on_frozen_grains(bed("run 0")).replace(line, instead, 1))
    said = done.stdout + done.stderr
    assert done.returncode != 0 and "dembark/granular/kk" in said and named in said, said[-1500:]
