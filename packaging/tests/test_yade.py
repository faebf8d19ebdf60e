"""packaging/yade.sh with an archive of the source."""

import os
import subprocess
import tarfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "yade.sh"


def archive(folder: Path, release: str) -> Path:
    """An archive that looks like YADE's source."""
    (folder / "yade/core").mkdir(parents=True)
    (folder / "yade/core/Scene.hpp").touch()
    (folder / "yade/RELEASE").write_text(f"{release}\n")
    with tarfile.open(folder / "yade.tar.bz2", "w:bz2") as file:
        file.add(folder / "yade", "yade")
    return folder / "yade.tar.bz2"


@pytest.mark.parametrize(("release", "what"), [("2020.01", "is not the source of YADE 2025.2.0"), ("", "cannot be unpacked"),
                                               (None, "cannot be read")])
def test_other_archives_are_refused(tmp_path: Path, release: str | None, what: str) -> None:
    file = tmp_path / "none.tar" if release is None else archive(tmp_path, release)
    if release == "":
        file.write_text("no archive\n")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("YADE_")}
    done = subprocess.run([SCRIPT], env=environment | {"XDG_CACHE_HOME": str(tmp_path / "cache"), "YADE_ARCHIVE": str(file)},
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and what in done.stderr and done.stderr.splitlines()[-1].startswith("dembark: "), done.stderr
    assert not list((tmp_path / "cache").glob("*/*/source/*"))
