"""Which packages set-up asks for."""

import os
import subprocess
from pathlib import Path

HERE = Path(__file__).parents[1]


def named(**variables: str) -> set[str]:
    environment = {key: value for key, value in os.environ.items() if key not in ("YADE_PREFIX", "DEMBARK_NO_SYSTEM")} | variables
    done = subprocess.run([HERE / "system.sh", "--all"], capture_output=True, text=True, check=True, env=environment)
    return set(done.stdout.split())


def test_yade_is_a_package_or_has_what_its_build_includes():
    packages = named()
    assert {"g++", "libliggghts-dev", "python3-venv", "libboost-dev"} <= packages
    assert "yade" in packages or {"libsqlite3-dev", "libboost-python-dev"} <= packages
    # What does not exist on Debian 13 is not asked for there.
    assert ("python3-siconos" in packages) == ('VERSION_ID="13"' not in Path("/etc/os-release").read_text(encoding="utf-8"))


def test_a_group_with_its_own_yade_needs_none_of_it(tmp_path):
    assert not {name for name in named(YADE_PREFIX=str(tmp_path)) if name == "yade" or name.startswith(("libboost", "libsqlite3"))}


def test_without_system_packages_nothing_is_asked_for():
    assert named(DEMBARK_NO_SYSTEM="1") == set()
