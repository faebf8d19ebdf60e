"""Runs scenes inside YADE, all that a module asks for in one process."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.validation import engines

HERE = Path(__file__).parent


class Yade:
    """`yade(script, *words)` runs a script in `folder`, which may import the modules here; `yade.scenes(...)` gives what the scenes of
    a script returned."""

    def __init__(self, folder: Path) -> None:
        try:
            self.engine = engines.find("yade")
        except DembarkError as error:
            pytest.skip(str(error))
        self.folder = folder

    def __call__(self, script: Path, *words: str, threads: int = 1) -> subprocess.CompletedProcess[str]:
        environment = self.engine.environment(threads)
        path = os.pathsep.join(filter(None, (str(HERE), environment.get("PYTHONPATH"))))
        return engines.call([*self.engine.command(script, {}, threads=threads), *words], self.folder, environment | {"PYTHONPATH": path})

    def scenes(self, *names: str, script: str = "scenes.py", threads: int = 1) -> dict:
        out = self.folder / f"{Path(script).stem}-{threads}.json"
        done = self(HERE / script, str(out), *names, threads=threads)
        assert "scenes: finished" in done.stdout, (done.stdout + done.stderr)[-3000:]
        return json.loads(out.read_text())


@pytest.fixture(scope="module")
def yade(tmp_path_factory: pytest.TempPathFactory) -> Yade:
    return Yade(tmp_path_factory.mktemp("yade"))
