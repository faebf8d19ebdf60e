"""Runs scenes inside YADE, all that a module asks for in one process."""

import json
import subprocess
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation import engines

HERE = Path(__file__).parent


class Yade:
    """`yade(script, *words)` runs a script in `folder`; `yade.scenes(...)` gives what the scenes returned."""

    def __init__(self, folder: Path) -> None:
        try:
            self.engine = engines.find("yade")
        except DembarkError as error:
            pytest.skip(str(error))
        self.folder = folder

    def __call__(self, script: Path, *words: str, threads: int = 1) -> subprocess.CompletedProcess[str]:
        return engines.call([*self.engine.command(script, {}, threads=threads), *words], self.folder, self.engine.environment(threads))

    def scenes(self, *names: str, threads: int = 1) -> dict:
        out = self.folder / f"scenes-{threads}.json"
        done = self(HERE / "scenes.py", str(out), *names, threads=threads)
        assert "scenes: finished" in done.stdout, (done.stdout + done.stderr)[-3000:]
        return json.loads(out.read_text())


@pytest.fixture(scope="module")
def yade(tmp_path_factory: pytest.TempPathFactory) -> Yade:
    return Yade(tmp_path_factory.mktemp("yade"))
