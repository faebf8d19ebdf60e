"""What LIGGGHTS writes in every format it has, read back: all of them are the same grains and contacts."""

import shutil

import numpy as np
import pytest
from dumps import contacts_text

from dembark.common.errors import DembarkError
from dembark.postproc import ContactsDump, DumpError, GrainsDump, open_dump, universe
from dembark.validation import engines

COLUMNS = "id type x y z ix iy iz vx vy vz radius mass fx fy fz omegax omegay omegaz".split()
PAIRS = {"first": (1, 2, 3), "second": (4, 5, 6), "ids": (7, 8), "forces": (10, 11, 12), "delta": 13}
PROPERTIES = "\n".join(f"fix {name} all property/global {name} {values}" for name, values in {
    "youngsModulus": "peratomtype 5e6 5e6", "poissonsRatio": "peratomtype 0.3 0.3",
    "coefficientRestitution": "peratomtypepair 2 0.5 0.5 0.5 0.5", "coefficientFriction": "peratomtypepair 2 0.5 0.5 0.5 0.5"}.items())
DECK = """
units si
atom_style granular
atom_modify map array
boundary p p f
newton off
communicate single vel yes
region domain prism 0 0.03 0 0.03 -0.01 0.05 0.006 0 0 units box
create_box 2 domain
neighbor 0.001 bin
neigh_modify delay 0
{properties}
pair_style gran model hertz tangential history
pair_coeff * *
timestep 1e-5
lattice sc 0.00499
region column block 0.004 0.028 0.004 0.028 0.004 0.02 units box
create_atoms 1 region column
set group all density 2500 diameter 0.005
variable second atom id<20
group second variable second
set group second type 2
set group second image 2 -1 NULL
velocity all set 0.5 0.2 -1
fix weight all gravity 9.81 vector 0 0 -1
fix motion all nve/sphere
compute pairs all pair/gran/local pos id force force_normal force_tangential torque history contactArea delta
dump text all custom 10 grains.dump id type element x y z ix iy iz vx vy vz radius mass fx fy fz omegax omegay omegaz
dump_modify text format "%d %d %s %.17g %.17g %.17g %d %d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
dump binary all custom 10 grains.bin id type x y z ix iy iz vx vy vz radius mass fx fy fz omegax omegay omegaz
dump scaled all custom 10 scaled.dump id xs ys zs xu yu zu diameter density
dump_modify scaled format "%d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
dump polydata all custom/vtk 10 grains*.vtp id type x y z ix iy iz vx vy vz radius mass
dump legacy all custom/vtk 10 grains*.vtk id type x y z vx vy vz radius mass fx fy fz
dump atoms all atom/vtk 10 atoms*.vtk
dump pairs all local 10 pairs.dump c_pairs[1] c_pairs[2] c_pairs[3] c_pairs[4] c_pairs[5] c_pairs[6] c_pairs[7] c_pairs[8] c_pairs[9] &
  c_pairs[10] c_pairs[11] c_pairs[12] c_pairs[26]
dump_modify pairs format "%.17g %.17g %.17g %.17g %.17g %.17g %.0f %.0f %.0f %.17g %.17g %.17g %.17g"
dump lines all local/gran/vtk 10 pairs*.vtk pairs
dump files all custom 10 each*.dump id x y z radius mass
thermo_modify lost ignore norm no
run 20
delete_atoms group second compress no
run 10
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Grains that touch in a sheared, periodic box, of two types; the second have image flags, and are deleted before the last step."""
    try:
        engine = engines.find("liggghts")
    except DembarkError as error:
        pytest.skip(str(error))
    folder = tmp_path_factory.mktemp("formats")
    (folder / "deck.in").write_text(DECK.format(properties=PROPERTIES))
    done = engines.call(engine.command(folder / "deck.in", {}), folder, engine.environment(), timeout=100)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr
    return folder


@pytest.fixture
def text(run):
    return GrainsDump(run / "grains.dump")


def test_numbers_of_grains_change(text):
    assert text.steps.tolist() == [0, 10, 20, 30]
    assert text.counts[0] > text.counts[-1] > 0
    assert set(text[0].types.tolist()) == {1, 2}
    assert set(text[3].types.tolist()) == {1}


def test_binary_dump_is_the_text_dump_to_the_last_bit(run, text):
    binary = GrainsDump(run / "grains.bin", columns=COLUMNS)
    assert binary.counts.tolist() == text.counts.tolist()
    for one, other in zip(text, binary, strict=True):
        assert one.step == other.step
        for name in ("ids", "types", "wrapped", "velocities", "omegas", "forces", "radii", "masses", "periodic", "tilt"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
        np.testing.assert_allclose(one.positions, other.positions, rtol=0, atol=1e-12)
        np.testing.assert_allclose([one.low, one.high], [other.low, other.high], atol=1e-12)
    assert [one.step for one in GrainsDump(run / "grains.bin", columns=COLUMNS, stream=True)] == [0, 10, 20, 30]


def test_unwrapped_positions_in_a_sheared_box_are_the_engines(run, text):
    scaled = GrainsDump(run / "scaled.dump")
    np.testing.assert_allclose((text[1].positions - text[1].wrapped)[text[1].types == 2], [[0.054, -0.03, 0.0]] * 19, atol=1e-12)
    for one, other in zip(text, scaled, strict=True):
        np.testing.assert_allclose(other.positions, one.positions, atol=1e-12)
        np.testing.assert_allclose(other.wrapped, one.wrapped, atol=1e-12)
        np.testing.assert_allclose(other.masses, one.masses, rtol=1e-12)
        np.testing.assert_array_equal(other.radii, one.radii)


@pytest.mark.parametrize("pattern", ["grains*.vtp", "grains*.vtk", "atoms*.vtk"])
def test_vtk_files_are_the_text_dump_in_single_precision(run, text, pattern):
    files = GrainsDump(str(run / pattern))
    assert files.steps.tolist() == [0, 10, 20, 30]
    assert files.counts.tolist() == text.counts.tolist()
    one, other = text[2], files[2]
    np.testing.assert_array_equal(one.ids, other.ids)
    np.testing.assert_array_equal(one.types, other.types)
    np.testing.assert_allclose(other.wrapped, one.wrapped, atol=1e-7)
    np.testing.assert_allclose(other.velocities, one.velocities, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose([*other.radii, *other.masses], [*one.radii, *one.masses], rtol=1e-5)
    if pattern != "atoms*.vtk":
        np.testing.assert_allclose([other.low, other.high, other.tilt], [one.low, one.high, one.tilt], atol=1e-6)
    if pattern == "grains*.vtp":
        assert not hasattr(other, "forces")
        with pytest.raises(DumpError, match=r"grains0\.vtp, step 20: forces are not known, the dump has no fx fy fz"):
            _ = other.forces
        assert not other.select(other.ids > 5).has("forces")


def test_contacts_with_named_columns_and_those_of_vtk(run):
    local, lines = ContactsDump(run / "pairs.dump", columns=PAIRS), ContactsDump(str(run / "pairs*.vtk"))
    assert local.counts.tolist() == lines.counts.tolist()
    one, other = local[1], lines[1]
    assert len(one.ids) > 50
    order, twin = np.lexsort(one.ids.T), np.lexsort(other.ids.T)
    np.testing.assert_array_equal(one.ids[order], other.ids[twin])
    np.testing.assert_allclose(one.branch[order], other.branch[twin], atol=1e-7)
    np.testing.assert_allclose(one.forces[order], other.forces[twin], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(one.extra["delta"], 0.005 - np.linalg.norm(one.branch, axis=1), atol=1e-9)
    assert set(one.extra) == {"delta", "c_pairs[9]"}


def test_pairs_across_a_sheared_border_have_short_branches(tmp_path):
    path = tmp_path / "contacts.dump"
    shift = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.3, 2.0, 0.0], [-0.7, 2.0, 0.0], [0.0, 0.0, 3.0]])
    first, branch = np.full((5, 3), 0.4), np.array([0.01, -0.02, 0.03])
    text = contacts_text(5, first, first + branch + shift, np.ones((5, 2)), np.ones((5, 3)), box=((0.0, 1.3), (0.0, 2.0), (0.0, 3.0)))
    text = text.replace("BOX BOUNDS ff ff ff\n0 1.3\n0 2\n0 3", "BOX BOUNDS xy xz yz pp pp ff\n0 1.3 0.3\n0 2 0\n0 3 0")
    path.write_text(text)
    found = ContactsDump(path)[0].branch
    np.testing.assert_allclose(found, branch + np.array([[0.0, 0.0, 0.0]] * 4 + [[0.0, 0.0, 3.0]]), atol=1e-12)


def test_a_file_a_step(run, text):
    assert [len(one.ids) for one in GrainsDump(str(run / "each*.dump"))] == text.counts.tolist()


@pytest.mark.parametrize("cut", [1, 500, 100000])
def test_truncated_binary_dump(run, tmp_path, cut):
    path = tmp_path / "a.bin"
    whole = (run / "grains.bin").read_bytes()
    path.write_bytes(whole[: max(len(whole) - cut, 60)])
    if cut == 100000:
        with pytest.raises(DumpError, match="nor a binary one"):
            GrainsDump(path, columns=COLUMNS)
        return
    with pytest.raises(DumpError, match=r"a\.bin, frame 4: truncated"):
        GrainsDump(path, columns=COLUMNS)
    for stream in (False, True):
        dump = GrainsDump(path, columns=COLUMNS, skip_truncated=True, stream=stream)
        assert [one.step for one in dump] == [0, 10, 20]
        assert dump.remarks


def test_truncated_vtk_file(run, tmp_path):
    for path in run.glob("grains*.vtk"):
        shutil.copy(path, tmp_path)
    last = tmp_path / "grains30.vtk"
    last.write_bytes(last.read_bytes()[:-800])
    with pytest.raises(DumpError, match=r"grains30\.vtk, frame 1: truncated"):
        GrainsDump(str(tmp_path / "grains*.vtk"))
    assert len(GrainsDump(str(tmp_path / "grains*.vtk"), skip_truncated=True)) == 3


@pytest.mark.parametrize(
    ("read", "message"),
    [
        (lambda run: open_dump(run / "grains.bin"), "does not name its 19 columns; give columns="),
        (lambda run: open_dump(run / "grains.bin", columns=COLUMNS[1:]), "has 19 columns, but columns= names 18"),
        (lambda run: open_dump(run / "grains.dump", columns=COLUMNS), "columns= is for binary dumps"),
        (lambda run: ContactsDump(run / "pairs.dump")[1], "has 13 columns instead of 12; .*columns="),
        (lambda run: ContactsDump(run / "pairs.dump", columns={"first": (1, 2, 3)}), "columns= must name forces, ids"),
        (lambda run: ContactsDump(run / "pairs.dump", columns=PAIRS | {"branch": (1, 2, 3)}), "either second or branch"),
        (lambda run: ContactsDump(run / "pairs.dump", columns=PAIRS | {"ids": (7, 99)})[1],
         "column 99 for ids, but there are columns 1 to 13"),
        (lambda run: ContactsDump(run / "pairs.dump", columns=PAIRS | {"ids": (7,)})[1], "gives 1 columns for ids, not 2"),
        (lambda run: ContactsDump(run / "pairs.dump", columns=PAIRS | {"area": "c_x"})[1], "column c_x is missing"),
        (lambda run: GrainsDump(run / "pairs.dump")[1], "column id is missing"),
        (lambda run: GrainsDump(run / "deck.in"), "neither a text dump, which begins with .ITEM: TIMESTEP., nor a binary one"),
    ],
)
def test_errors_say_what_would_be_right(run, read, message):
    with pytest.raises(DumpError, match=message) as caught:
        read(run)
    assert "\n" not in str(caught.value)


def test_universe_of_grains_that_go(run, text):
    for world in (universe(run / "grains.dump"), universe(run / "grains.bin", columns=COLUMNS)):
        assert (len(world.atoms), len(world.trajectory)) == (text.counts[0], 4)
        assert world.dimensions[3:] == pytest.approx([90.0, 90.0, np.degrees(np.arctan2(0.03, 0.006))], rel=1e-5)
        kept = world.select_atoms("prop x > -1e30", updating=True)
        counts = []
        for step in world.trajectory:
            counts.append(len(kept))
            assert step.data["present"].sum() == len(kept)
            np.testing.assert_array_equal(kept.ids, step.data["frame"].ids)
        assert counts == text.counts.tolist()
        assert np.isnan(world.trajectory[3].positions[world.atoms.types == "2"]).all()
