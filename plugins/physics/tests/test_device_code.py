"""Clang accepts every law as device code of CUDA and HIP, and refuses what a device cannot run."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
# Without the toolkits: device_code.cpp declares what it needs of them.
LANGUAGES = {
    "cuda": ["-x", "cuda", "--cuda-device-only", "-nocudainc", "-nocudalib"],
    "hip": ["-x", "hip", "--cuda-device-only", "-nogpuinc", "-nogpulib", "--offload-arch=gfx90a"],
}


def errors(folder: Path, language: str, *options: str) -> str:
    """What clang-tidy, whose wheel needs no compiler, finds wrong in device_code.cpp."""
    tidy = shutil.which("clang-tidy", path=str(Path(sys.executable).parent)) or shutil.which("clang-tidy")
    if tidy is None:
        pytest.skip("no clang-tidy: `make lint` installs it")
    (folder / "dembark").symlink_to(TESTS.parent)
    command = [
        tidy,
        "--checks=-*",
        "--allow-no-checks",
        "--quiet",
        str(TESTS / "device_code.cpp"),
        "--",
        *LANGUAGES[language],
        "-std=c++17",
    ]
    run = subprocess.run([*command, f"-I{folder}", *options], capture_output=True, text=True, check=False)
    assert (run.returncode == 0) == (": error: " not in run.stdout), run.stdout + run.stderr
    return run.stdout


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_law_is_device_code(tmp_path: Path, language: str) -> None:
    assert not errors(tmp_path, language)


REFUSED = {
    "no macro": ("inline double refused(double x) { return x; }", "call to __host__ function"),
    "no macro inside": (
        "template <class T> T inner(T x) { return x; } DEMBARK_FUNCTION inline double refused(double x) { return inner(x); }",
        "'inner<double>'",
    ),
    "container": ("DEMBARK_FUNCTION inline double refused(double x) { return std::vector<double>{x}.back(); }", "'vector'"),
    "allocation": ("DEMBARK_FUNCTION inline double refused(double x) { return *new double(x); }", "'malloc'"),
    "exception": ("DEMBARK_FUNCTION inline double refused(double x) { return x > 0.0 ? x : throw 1; }", "'throw'"),
    "variable of the host": (
        "inline double table[] = {1.0}; DEMBARK_FUNCTION inline double refused(double) { return table[0]; }",
        "'table'",
    ),
}


@pytest.mark.parametrize(("language", "what"), [*(("cuda", what) for what in REFUSED), ("hip", "no macro inside")])
def test_what_a_device_cannot_run_is_refused(tmp_path: Path, language: str, what: str) -> None:
    function, says = REFUSED[what]
    (tmp_path / "refused.hpp").write_text(function + "\n", encoding="utf-8")
    assert says in errors(tmp_path, language, f'-DREFUSED="{tmp_path}/refused.hpp"')


@pytest.mark.parametrize("language", LANGUAGES)
def test_frames_of_moving_walls_are_device_code(tmp_path: Path, language: str) -> None:
    """Which kernels of walls take along; every_law.hpp has laws only."""
    (tmp_path / "frame.hpp").write_text(
        '#include "dembark/motion/wall_frame.hpp"\n'
        "DEMBARK_FUNCTION inline double refused(double x) {\n"
        "  const dembark::WallFrame frame;\n"
        "  return dembark::norm(frame.inside({x, x, x}) + frame.outside({x, x, x}));\n"
        "}\n",
        encoding="utf-8",
    )
    assert not errors(tmp_path, language, f'-DREFUSED="{tmp_path}/frame.hpp"')
