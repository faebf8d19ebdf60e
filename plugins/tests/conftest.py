"""Makes the rig importable, and runs every scenario once in every program."""

import sys
from functools import partial
from pathlib import Path
from types import ModuleType

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from rig import impact_decks, lammps_driver, liggghts_driver, python_driver, walls, yade_driver
from rig.motion import Motion
from rig.scenarios import SCENARIOS

from dembark.common.errors import DembarkError


def skip_without(driver: ModuleType) -> None:
    """Skips the test when the engine of a driver is not there."""
    try:
        driver.engine()
    except DembarkError as error:
        pytest.skip(str(error))


class Motions:
    """`motions(driver, scenario name)`; the first call for an engine runs all its scenarios."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.done: dict[tuple[str, str], Motion] = {}

    def __call__(self, driver: str, name: str) -> Motion:
        if (driver, name) not in self.done:
            if driver == "python":
                self.done[driver, name] = python_driver.run(SCENARIOS[name])
                return self.done[driver, name]
            skip_without({"liggghts": liggghts_driver, "yade": yade_driver, "lammps": lammps_driver}[driver])
            if driver == "yade":
                found = yade_driver.run_all(SCENARIOS.values(), self.folder / "yade")
            else:
                one, run_all = (liggghts_driver, walls.motions) if driver == "liggghts" else (lammps_driver, lammps_driver.motions)
                found = run_all(self.folder / driver, {each: one.deck(case) for each, case in SCENARIOS.items()}, SCENARIOS)
            self.done |= {(driver, each): motion for each, motion in found.items()}
        return self.done[driver, name]


@pytest.fixture(scope="session")
def motions(tmp_path_factory: pytest.TempPathFactory) -> Motions:
    return Motions(tmp_path_factory.mktemp("rig"))


@pytest.fixture(scope="session")
def liggghts_is_there() -> None:
    skip_without(liggghts_driver)


@pytest.fixture(scope="session")
def yade_is_there() -> None:
    skip_without(yade_driver)


@pytest.fixture(scope="session")
def lammps_is_there() -> None:
    skip_without(lammps_driver)


@pytest.fixture(params=impact_decks.DRIVERS)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine with `fix lcp/impact`."""
    request.getfixturevalue(f"{request.param}_is_there")
    return request.param


@pytest.fixture
def run(engine: str) -> partial[impact_decks.Result]:
    """`run(folder, case, ...)` in this engine."""
    return partial(impact_decks.run, engine=engine)
