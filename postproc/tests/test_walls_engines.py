"""Wall stresses from what engines wrote are the forces that they say themselves."""

from __future__ import annotations

import numpy as np
import pytest

from dembark.postproc import ContactsDump, GrainsDump, read_times
from dembark.postproc.walls import CylinderWall, Inclusion, MeshWall, Motion, PlaneWall
from dembark.postproc.walls.patches import box_patches, mesh_patches
from dembark.postproc.walls.stress import wall_stress
from dembark.validation import engines
from dembark.validation.case import deck, folders
from dembark.validation.case.resolve import portable, resolve

SMALL = {"grain_count": 150, "grain_diameter": 0.006, "gravity": 200.0, "settle_time": 0.03, "measure_time": 0.02, "frames": 4,
         "cylinder_radius": 0.02}


def simulated(case, name, values, folder):
    """Run a deck of `case` in `folder`; what was derived for it."""
    engine, one = engines.find(name), folders.find(case)
    made = deck.write(one, name, portable(resolve(one, changes=values)), folder)
    done = engines.call(engine.command(folder / one.deck(name).name, {}), folder, engine.environment())
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-1000:]
    return made


@pytest.mark.parametrize("name", ["liggghts", "yade"])
def test_integrated_stress_is_the_engines_own_wall_force(name, tmp_path):
    simulated("silo", name, SMALL, tmp_path)
    grains, history = GrainsDump(tmp_path / "grains.dump"), read_times(tmp_path / "time.csv")
    walls = [CylinderWall("side", SMALL["cylinder_radius"]), PlaneWall("base")]
    for wall in walls:
        found = wall_stress(grains, wall, box_patches(wall, grains[0], 0.004))
        local = found.series * found.patches.areas[:, None]
        rows = np.searchsorted(history["step"], found.steps)
        assert (history["step"][rows] == found.steps).all()
        own = np.column_stack([history[f"{wall.name}_f{axis}"] for axis in "xyz"])[rows]
        size = np.abs(own).max()
        assert size > 0.0 and not found.outside.any()
        # Dumps hold seven digits of each grain's force.
        np.testing.assert_allclose(found.force, own, atol=3e-6 * size, rtol=0.0)
        along = local[:, :, 1].sum(axis=1) if wall.name == "side" else local[:, :, 0].sum(axis=1)
        np.testing.assert_allclose(along, own[:, 2], atol=3e-6 * size, rtol=0.0)
        assert found.imbalance() < 1e-12
        assert 0.8 < found.reach[0] <= found.reach[1] <= 1.0 + 1e-6
    if name == "liggghts":
        return  # its contact forces are evaluated anew with the velocities at the end of the step, and so are not quite those that acted
    # What presses on a group of grains is all that acts on it, less its weight and the walls.
    contacts, frame = ContactsDump(tmp_path / "contacts.dump"), grains[-1]
    group = tuple(frame.ids[frame.positions[:, 2] < 0.012].tolist())
    members, _ = Inclusion("group", group).members(frame)
    body = Inclusion("group", group)
    found = wall_stress([frame], body, box_patches(body, frame, 0.01), contacts=[contacts[len(contacts) - 1]])
    rest = members.forces - members.masses[:, None] * [0.0, 0.0, -SMALL["gravity"]] - sum(members.wall_forces.values())
    assert len(group) > 5 and np.linalg.norm(rest.sum(axis=0)) > 0.1
    np.testing.assert_allclose(found.force[0], -rest.sum(axis=0), atol=1e-6 * np.abs(rest).sum())


def test_moving_mesh_has_the_engines_own_force_and_is_where_the_grains_touch_it(tmp_path):
    values = {"grain_count": 120, "channel_width": 0.04, "channel_depth": 0.02, "settle_time": 0.03, "run_in": 0.02, "travel": 0.1,
              "frames": 4, "gravity": 200.0, "base_speed": 0.02}
    made = simulated("plug_flow", "liggghts", values, tmp_path)
    steps, time_step = made.steps, made.time_step
    history = read_times(tmp_path / "time.csv")
    since = np.ceil(values["settle_time"] / time_step) * time_step
    plate = MeshWall.from_stl("base", tmp_path / "plate.stl", motion=Motion((0.0, 0.0, -values["base_speed"]), since))
    found = wall_stress(GrainsDump(tmp_path / "grains.dump"), plate, mesh_patches(plate), time_step=time_step)
    assert found.steps[-1] == steps and found.displacements[-1, 2] < -0.4e-3
    own = np.column_stack([history[f"base_f{axis}"] for axis in "xyz"])[np.searchsorted(history["step"], found.steps)]
    np.testing.assert_allclose((found.series[:, :, 0] * found.patches.areas).sum(axis=1), own[:, 2], rtol=3e-6)
    np.testing.assert_allclose(found.force, own, atol=3e-6 * own.max(), rtol=0.0)
    # Overlaps are a few hundredths of a radius, less than the way of the plate.
    assert 0.9 < found.reach[0] <= found.reach[1] <= 1.0 + 1e-5
