"""What scenes leave for the tests; imported inside YADE."""

import json
import sys
from pathlib import Path

from yade import Omega


def refusal(do, otherwise="accepted"):
    """What YADE says when `do()` is wrong."""
    try:
        do()
    except RuntimeError as error:
        return str(error)
    return otherwise


def advance(count):
    """Make so many steps; O.run(count, True) looks only every 40 ms whether it is over."""
    scene = Omega()
    for _ in range(count):
        scene.step()


def write_results(scenes):
    """Write what the functions in `scenes` return that are named on the command line, after the file to write into."""
    out, *names = sys.argv[1:]
    Path(out).write_text(json.dumps({name: scenes[name]() for name in names}), encoding="utf-8")
    print("scenes: finished", flush=True)
