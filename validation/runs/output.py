"""The output of an engine while it runs: how many steps there are, which it is at, and whether it has finished."""

from __future__ import annotations

import re

_STEPS = re.compile(r"dembark: steps (\d+) time_step (\S+)")
_STEP = re.compile(r"\s*(\d+)\s+[-+]?(?:\d|\.\d|nan|inf)")


class OutputParser:
    """Reads an engine's output: the line `dembark: steps N time_step dt`, lines that begin with the step, `dembark: finished`."""

    def __init__(self) -> None:
        self.steps, self.step, self.time_step, self.finished = 0, 0, 0.0, False
        self._unfinished = b""

    def feed(self, chunk: bytes) -> bool:
        """Take some bytes of the output, lines or parts of them; True when something changed."""
        *lines, self._unfinished = (self._unfinished + chunk).split(b"\n")
        # Every line is read, also after one that changed something.
        changes = [self.read(line.decode(errors="replace")) for line in lines]
        return any(changes)

    def read(self, line: str) -> bool:
        """Take one line; True when something changed."""
        announced = _STEPS.match(line)
        if announced:
            self.steps, self.time_step = int(announced.group(1)), float(announced.group(2))
            return True
        if line.startswith("dembark: finished"):
            self.finished = True
            return True
        step = _STEP.match(line)
        if step and self.steps and self.step < int(step.group(1)) <= self.steps:
            self.step = int(step.group(1))
            return True
        return False
