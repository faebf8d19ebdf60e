"""Makes the rig of plugins/tests importable, and these tests' own decks; without LAMMPS the tests are skipped."""

import sys
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2] / "tests")]

from rig import lammps_driver  # noqa: E402 - the path is set above

from dembark.common.errors import DembarkError  # noqa: E402


@pytest.fixture(scope="session", autouse=True)
def lammps_is_there() -> None:
    try:
        lammps_driver.engine()
    except DembarkError as error:
        pytest.skip(str(error))
