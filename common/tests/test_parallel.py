"""Work in other processes: order, errors, and that none is left behind."""

import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

from dembark.common.parallel import parallel_map

several_cores = pytest.mark.skipif(len(os.sched_getaffinity(0)) == 1, reason="this process has one core")


def process_and_square(number):
    time.sleep(0.01)
    return os.getpid(), number**2


def refuse_three(number):
    if number == 3:
        raise ValueError("three is refused")
    return number


def test_results_are_in_the_order_of_the_items():
    assert [square for _, square in parallel_map(process_and_square, range(40))] == [number**2 for number in range(40)]


@several_cores
def test_many_items_are_worked_on_by_several_processes_and_few_by_this_one():
    many = {process for process, _ in parallel_map(process_and_square, range(40))}
    assert len(many) > 1
    assert os.getpid() not in many
    assert {process for process, _ in parallel_map(process_and_square, range(5))} == {os.getpid()}


@pytest.mark.parametrize("count", [5, 40])
def test_what_the_function_raises_is_raised_here(count):
    with pytest.raises(ValueError, match="three is refused"):
        parallel_map(refuse_three, range(count))


@several_cores
def test_processes_end_with_the_one_that_they_work_for(tmp_path):
    # A line is one write: print() makes two where Python does not buffer, and the other process may write between them.
    (tmp_path / "script.py").write_text(
        "import os, sys, time\nfrom dembark.common.parallel import parallel_map\n"
        "def wait(number):\n    os.write(sys.stdout.fileno(), f'{os.getpid()}\\n'.encode())\n    time.sleep(60)\n"
        "if __name__ == '__main__':\n    parallel_map(wait, range(40))\n")
    with subprocess.Popen([sys.executable, "script.py"], cwd=tmp_path, stdout=subprocess.PIPE, text=True) as started:
        lines = [started.stdout.readline() for _ in range(2)]
        started.send_signal(signal.SIGKILL)
    workers = [int(line) for line in lines]
    for _ in range(100):
        left = [one for one in workers if pathlib.Path(f"/proc/{one}").exists()]
        if not left:
            break
        time.sleep(0.1)
    assert not left
