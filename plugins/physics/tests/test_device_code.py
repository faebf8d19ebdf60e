"""Clang accepts every law as device code of CUDA, and refuses what a device cannot run."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
CUDA = ["-x", "cuda", "--cuda-device-only", "-nocudainc", "-nocudalib", "-std=c++17"]


def errors(folder: Path, *options: str) -> str:
    """What clang-tidy, whose wheel needs no compiler, finds wrong in device_code.cpp."""
    tidy = shutil.which("clang-tidy", path=str(Path(sys.executable).parent)) or shutil.which("clang-tidy")
    if tidy is None:
        pytest.skip("no clang-tidy: `make lint` installs it")
    (folder / "dembark").symlink_to(TESTS.parent)
    command = [tidy, "--checks=-*", "--allow-no-checks", "--quiet", TESTS / "device_code.cpp", "--", *CUDA, f"-I{folder}", *options]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (run.returncode == 0) == (": error: " not in run.stdout), run.stdout + run.stderr
    return run.stdout


def test_every_law_is_device_code(tmp_path: Path) -> None:
    assert not errors(tmp_path)


@pytest.mark.parametrize(
    ("function", "says"),
    [
        ("inline double refused(double x) { return x; }", "call to __host__ function"),
        (
            "template <class T> T inner(T x) { return x; } DEMBARK_FUNCTION inline double refused(double x) { return inner(x); }",
            "'inner<double>'",
        ),
        ("DEMBARK_FUNCTION inline double refused(double x) { return std::vector<double>{x}.back(); }", "'vector'"),
        ("DEMBARK_FUNCTION inline double refused(double x) { return *new double(x); }", "'malloc'"),
        ("DEMBARK_FUNCTION inline double refused(double x) { return x > 0.0 ? x : throw 1; }", "'throw'"),
        ("inline double table[] = {1.0}; DEMBARK_FUNCTION inline double refused(double) { return table[0]; }", "'table'"),
    ],
    ids=["no word", "no word inside", "container", "allocation", "exception", "variable of the host"],
)
def test_what_a_device_cannot_run_is_refused(tmp_path: Path, function: str, says: str) -> None:
    (tmp_path / "refused.hpp").write_text(function + "\n", encoding="utf-8")
    found = errors(tmp_path, f'-DREFUSED="{tmp_path}/refused.hpp"')
    assert says in found
