"""Errors in one line, and what a run says of itself."""

import os
import sys

from yade import Omega

O = Omega()


def fail(line, code=2):
    """Say in one line on stderr what is wrong, where and what would be right, and end the process."""
    sys.stdout.flush()
    print(f"dembark: {line}", file=sys.stderr, flush=True)
    # SystemExit would not leave the thread in which YADE runs its engines.
    os._exit(code)


def announce(steps):
    """First line of a run: its number of steps and the time step."""
    print(f"dembark: steps {steps} time_step {O.dt:.17g}", flush=True)


def finish():
    """Last line of a run that came to its end."""
    print("dembark: finished", flush=True)
