"""Meshes in another unit than they are said to be, at the command line."""

import numpy as np
import pytest
from dumps import grains_text
from test_commands import BOX, RADIUS, STEPS, WEIGHT, packing, run, square  # noqa: F401 (a fixture)

from dembark.validation.cli import main


@pytest.fixture
def resting_later(run):  # noqa: F811
    """The run with grains that do not feel the base in its first two frames."""
    head, *frames = (run / "grains.dump").read_text().split("ITEM: TIMESTEP\n")
    place, floor, _, _ = packing()
    free = [grains_text(step, place, np.full(64, RADIUS), masses=np.full(64, WEIGHT / 9.81), walls={"base": 0.0 * floor}, box=BOX)
            for step in STEPS[:2]]
    (run / "grains.dump").write_text("".join([head, *free, *(f"ITEM: TIMESTEP\n{frame}" for frame in frames[2:])]))
    return run


@pytest.mark.parametrize("command", [["walls", "run", "--out", "w.nc"], ["fields", "run", "--out", "f.nc"]])
def test_a_mesh_that_is_felt_later_is_looked_at_then(resting_later, capsys, command):
    square(resting_later / "base.stl", 40.0, height=-1.0)
    wall = "base:mesh:file=run/base.stl:unit="
    assert main([*command, "--wall", wall + "in"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "radii away from it" in error and "with unit=mm" in error
    assert [path.name for path in resting_later.parent.iterdir()] == ["run"]
    assert main([*command, "--wall", wall + "mm"]) == 0


def test_a_mesh_of_another_size_than_the_box_is_doubted(run, capsys):  # noqa: F811
    """A flat wall fits at any size: much larger than the box it gets a note, smaller than a grain it is refused."""
    square(run / "base.stl", 40.0)
    wall = "base:mesh:file=run/base.stl:unit="
    assert main(["walls", "run", "--wall", wall + "in", "--out", "w.nc"]) == 0
    assert "note: the mesh base is 1016 mm wide, the box of the grains 60 mm; is unit= that of its file?" in capsys.readouterr().out
    assert main(["walls", "run", "--wall", wall + "mm", "--out", "w.nc"]) == 0
    assert "is unit=" not in capsys.readouterr().out
    square(run / "base.stl", 0.04)
    assert main(["walls", "run", "--wall", wall + "mm", "--out", "w.nc"]) == 2
    assert "the mesh is 0.04 x 0.04 x 0 mm, and the smallest grain is 10 mm wide" in capsys.readouterr().err
