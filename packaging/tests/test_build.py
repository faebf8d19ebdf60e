"""A build that fails says why in one line; one that is interrupted goes on; the estimate follows from the machine."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parents[1]
sys.path.insert(0, str(HERE))

import build  # noqa: E402  (a script beside this folder, no package)

LOGS = {
    "header": (("[1/3] Building CXX object a.o\n"
                "py/_libVersions.cpp:21:10: fatal error: sqlite3.h: No such file or directory\n   21 | #include\n"
                "compilation terminated.\nninja: build stopped: subcommand failed."),
               ("sqlite3.h", "run 'make system'")),
    "error": (("warning: something\nIn file included from b.hpp:2:\n"
               "a.cpp:7:3: error: 'x' was not declared in this scope\na.cpp:9:1: error: y"), ("a.cpp:7:3",)),
    "memory": ("g++: fatal error: Killed signal terminated program cc1plus\ncompilation terminated.", ("Killed", "JOBS=1")),
    "disk": ("fatal error: error writing to /tmp/x.s: No space left on device", ("No space left", "free some space")),
    "cmake": ("-- Looking\nCMake Error at CMakeLists.txt:205 (find_package):\n  Could NOT find Eigen3 (missing: EIGEN3_DIR)\n\nCall Stack",
              ("Eigen3", "make system")),
    "link": ("/usr/bin/ld: cannot find -lliggghts: No such file", ("-lliggghts", "make system")),
    "nothing": ("", ("no output",)),
}


@pytest.mark.parametrize("name", LOGS)
def test_first_error_and_what_to_do(name, tmp_path):
    text, parts = LOGS[name]
    (tmp_path / "log").write_text(text)
    line = build.cause(tmp_path / "log")
    assert "\n" not in line
    assert all(part in line for part in parts), line


def make(folder: Path, body: str) -> subprocess.CompletedProcess[str]:
    (folder / "build.ninja").write_text("rule run\n  command = $do\n  description = $out\n" + body)
    return subprocess.run([HERE / "build.py", "--name", "thing", "--log", folder / "out/thing.log", "--resume", "make thing", "--",
                           "ninja", "-C", folder, "-j", "0"], capture_output=True, text=True, check=False)


def test_failure_is_one_line_and_a_second_run_goes_on(tmp_path):
    body = ("build one: run\n  do = echo x >> count; touch one\n"
            "build two: run one\n  do = if [ -e mended ]; then touch two; else cat broken; exit 1; fi\n")
    (tmp_path / "broken").write_text("a.cpp:1:1: error: broken\n")
    done = make(tmp_path, body)
    assert done.returncode == 1
    assert done.stderr.strip().count("\n") == 0
    assert "thing did not build: a.cpp:1:1: error: broken" in done.stderr and "'make thing' goes on" in done.stderr
    (tmp_path / "mended").touch()
    done = make(tmp_path, body)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "count").read_text() == "x\n"


def test_estimate_is_the_time_passed_over_the_share_done(monkeypatch, capsys):
    now = [1000.0]
    monkeypatch.setattr(build.time, "monotonic", lambda: now[0])
    progress = build.Progress("thing")
    progress.live = False
    progress.weights = [(re.compile("large"), 9.0)]
    progress.expect(["large one", "large two", "small", "small"])
    progress.tell()
    assert capsys.readouterr().err == ""
    now[0] += 30.0
    progress.tell()
    assert "left" not in capsys.readouterr().err
    now[0] += 60.0
    progress.step("large one")
    progress.step("small")
    progress.tell()
    # 10 of 20 took 90 s on this machine.
    assert capsys.readouterr().err == "dembark: thing: 90 s passed, step 2 of 4, about 90 s left\n"


def test_weights_name_steps_that_exist():
    assert all(weight > 1 for _, weight in build.weights())
