"""SphFluid: the bodies of a scene in its fluid move as those of the solver itself; momentum, saved runs, files, input."""

import numpy as np
import pytest

from dembark.physics import SphFluid
from dembark.physics.sph import lattice, tank_walls
from dembark.postproc import GrainsDump

DX, SOUND, G, STEP = 0.02, 25.0, 9.81, 3e-4


@pytest.fixture(scope="module")
def found(yade):
    return yade.scenes("falling_plane", "falling_space", "moved", "momentum", "floats_on_substeps", "saved", "written",
                       "wrong_writers", "messages", "moved_out_of_the_water", script="fluid_scenes.py")


def pool(low, high, top, **options):
    """The pool of the scenes, in the solver without an engine."""
    points, d = lattice(low, high, DX), len(low)
    gravity = np.zeros(d)
    gravity[-1] = -G
    water = SphFluid(points, spacing=DX, sound_speed=SOUND, gravity=gravity, pressure=1000.0 * G * (high[-1] - points[:, -1]), **options)
    water.add_wall(tank_walls(low, [*high[:-1], top], DX))
    return water


def assert_same(water, body, told, steps):
    """Fluid and forces after `steps`, the place of the body one later: YADE moves bodies after the fluid."""
    d = water.positions.shape[1]
    water.run(steps * STEP, STEP)
    assert water.steps == steps
    assert water.time == pytest.approx(told["time"], rel=1e-12)
    np.testing.assert_allclose(np.array(told["fluid"])[:, :d], water.positions, rtol=0.0, atol=1e-9 * 0.4)
    scale = np.abs(water.pressures).max()
    np.testing.assert_allclose(told["pressures"], water.pressures, rtol=0.0, atol=1e-9 * scale)
    np.testing.assert_allclose(told["force"][:d], body.force, rtol=0.0, atol=1e-9 * scale * DX)
    for name in ("kinetic", "potential", "compression", "viscous", "diffusive", "boundary"):
        assert told["energies"][name] == pytest.approx(getattr(water.energies(), name), rel=1e-8, abs=1e-9)
    water.run(STEP, STEP)
    np.testing.assert_allclose(told["place"][:d], body.position, rtol=0.0, atol=1e-9 * 0.4)
    np.testing.assert_allclose(told["turn"], body.orientation, rtol=0.0, atol=1e-9)


def test_a_block_falls_in_the_plane_as_in_the_solver(found):
    water = pool([0, 0], [0.4, 0.12], 0.4, delta=0.1, alpha=0.05, no_slip=True, moment="particles")
    body = water.add_body(lattice([0.14, 0.22], [0.24, 0.32], DX), mass=8.0, inertia=0.0133, centre=[0.19, 0.27])
    body.set_motion([0.2, -1.0], 2.0)
    assert_same(water, body, found["falling_plane"], 800)
    assert body.position[1] < 0.2 and abs(body.spin - 2.0) > 0.1


def test_a_cube_falls_in_space_as_in_the_solver(found):
    water = pool([0, 0, 0], [0.2, 0.2, 0.1], 0.3, xsph=0.5, shepard=20)
    body = water.add_body(lattice([0.05, 0.07, 0.19], [0.13, 0.15, 0.27], DX), mass=0.4096, inertia=[4.4e-4] * 3, centre=[0.09, 0.11, 0.23])
    body.set_motion([0.0, 0.1, -1.0], [1.0, 2.0, 3.0])
    assert_same(water, body, found["falling_space"], 400)
    assert body.velocity[2] > -1.0 and np.linalg.norm(body.force) > 0.1


def test_a_moved_wall_moves_the_fluid_as_in_the_solver(found):
    water = pool([0, 0], [0.4, 0.12], 0.3)
    body = water.add_wall(lattice([0.16, 0.18], [0.24, 0.28], DX))
    body.set_motion([0.1, -1.0])
    water.run(300 * STEP, STEP)
    told = found["moved"]
    assert np.abs(np.array(told["force"])[:2]).max() > 1.0
    np.testing.assert_allclose(np.array(told["fluid"])[:, :2], water.positions, rtol=0.0, atol=1e-9 * 0.4)
    np.testing.assert_allclose(told["force"][:2], body.force, rtol=0.0, atol=1e-9 * np.abs(water.pressures).max() * DX)


@pytest.mark.parametrize("substeps", ["1", "4"])
def test_momentum_of_fluid_and_bodies_stays(found, substeps):
    """1e-12 of the fluid's, in each step of the scene: the impulse of sub-steps is that which the fluid felt."""
    rows = np.array(found["momentum"][substeps])
    start = 216 * 1000.0 * DX**3 * 2.0
    assert rows[-1, 3] > 0.02 * start
    np.testing.assert_allclose(rows[:, 0], start, rtol=1e-12)
    assert np.abs(rows[:, 1:3] - [0.05 * start, 0.0]).max() < 1e-12 * start


def test_sub_steps_change_little(found):
    """A free body on ten steps of the scene in one of the fluid: as many steps of the fluid, and the same place within 1 % of dx."""
    (one, steps), (ten, others) = (found["floats_on_substeps"][name] for name in ("1", "10"))
    assert steps == others == 500
    assert np.abs(np.array(ten) - one).max() < 0.01 * DX


@pytest.mark.parametrize("ending", ["xml", "yade.gz", "bin"])
def test_a_saved_fluid_goes_on_to_the_bit(found, ending):
    same, early, late = found["saved"][ending]
    assert same
    assert 0.0 < early < late


def test_frames_and_rows_can_be_read(found, tmp_path):
    (tmp_path / "fluid.dump").write_text(found["written"]["dump"])
    frames = GrainsDump(tmp_path / "fluid.dump")
    assert frames.steps.tolist() == [0, 50, 100]
    frame = frames[2]
    assert len(frame.ids) == 120 and (frame.masses == pytest.approx(found["written"]["mass"]))
    assert frame.extra["density"].min() > 990.0 and frame.extra["pressure"].max() == pytest.approx(1000.0 * G * 0.11, rel=0.2)
    (tmp_path / "part.dump").write_text(found["written"]["part"])
    (part,) = GrainsDump(tmp_path / "part.dump")
    assert (part.positions[:, :2] <= 0.1).all() and 20 <= len(part.ids) < 120
    header, *rows = found["written"]["rows"].splitlines()
    assert header.split(",")[:4] == ["step", "time", "block_x", "block_y"] and header.split(",")[-1] == "work"
    assert [row.split(",")[0] for row in rows] == ["0", "50", "100"]


@pytest.mark.parametrize(("name", "line"), [
    ("spacing", "SphFluid: spacing must be a number > 0 (m)"), ("sound", "SphFluid: soundSpeed must be a number > 0 (m/s)"),
    ("kernel", "SphFluid.kernel is 'gauss'; it must be wendland_c2 or cubic_spline"),
    ("smoothing", "smoothing (h over the spacing) must be between 0.8 and 3"), ("substeps", "SphFluid.substeps is 0; it must be 1 or more"),
    ("damping", "NewtonIntegrator.damping is 0.2; it must be 0 with SphFluid"), ("order", "before NewtonIntegrator"),
    ("long", "the time step must be > 0 and at most 0.6 h/soundSpeed = 0.624000 ms, not 2.000000 ms"),
    ("long sub-steps", "not 2.000000 ms (10 steps of O.dt)"), ("empty", "addWall has no points"),
    ("points", "addWall must be a list of points"), ("out of plane", "has z = 1; in the plane it must be 0"),
    ("no body", "body 99 does not exist"), ("member", "belongs to the clump 2; add that"),
    ("body without particles", "body 2 has no points"), ("pressures", "pressures must be a list of 1 numbers (Pa)"),
    ("torn", "SphFluid: a pressure must be > -"),
    ("stranger", "body 2 is not in the fluid"), ("twice", "body 2 is in the fluid already"), ("late", "the fluid has begun"),
    ("overlap", "m overlaps others: there are 1.92 times as many as in the lattice; leave out fluid where walls and bodies are"),
    ("changed alpha", "SphFluid: alpha has changed since the fluid began"), ("changed soundSpeed", "SphFluid: soundSpeed has changed"),
    ("changed kernel", "SphFluid: kernel has changed"), ("gravity", "NewtonIntegrator.gravity has changed"),
    ("no fluid", "there is no fluid"), ("blows up", "the fluid blew up at t =")])
def test_wrong_input_is_told_in_one_line(found, name, line):
    said = found["messages"][name]
    assert said.startswith("dembark: ") and line in said and "\n" not in said


def test_an_overlap_has_nothing_to_do_with_steps(found):
    assert found["messages"]["overlap"].endswith("give them its spacing")


def test_a_body_that_was_in_the_way_can_be_moved(found):
    """A start that was refused goes on when the body is elsewhere."""
    said, steps = found["moved_out_of_the_water"]
    assert "overlaps" in said and steps == 1


def test_a_writer_says_what_is_no_box_and_no_body(found):
    box, within, *bodies = found["wrong_writers"]
    assert within == "dembark: FluidWriter: within must be ((xlo, xhi), (ylo, yhi), (zlo, zhi)) (m), not [(0, 1), (0, 1)]"
    assert box.startswith("dembark: FluidWriter: bounds must be ((xlo, xhi), (ylo, yhi), (zlo, zhi)) (m), not [(0, 0, 0)")
    assert bodies == [f"dembark: FluidWriter: there is no body {body} for 'block'" for body in (99, -1)]
