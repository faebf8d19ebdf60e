"""How far a run is and how it ended: by the engine's output, exit code and files, and the disk."""

from __future__ import annotations

import re
import shutil
import signal
from collections.abc import Sequence
from pathlib import Path

from dembark.common.choices import Value
from dembark.common.errors import Killed, RunError
from dembark.common.files import DISK_FULL, check_impacts, check_times, count_frames
from dembark.common.units import size_text
from dembark.validation.campaigns.plan import Run
from dembark.validation.case.model import OUTPUTS

_RESERVE = 4 << 20
_DUMPS = {"grains": "ATOMS", "contacts": "ENTRIES"}
# Signals by which a user, a scheduler or the system ends what is sound; the others are faults of the engine.
_STOPPED = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGXCPU)

# What one rank says; it may begin in the middle of a line, because the output of ranks is interleaved.
_OF_ONE_RANK = re.compile(r"ERROR on proc \d+: ")
_STEPS = re.compile(r"dembark: steps (\d+) time_step ([-+.\de]+)\s*$")
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


def check_room(run: Run, folder: Path) -> None:
    """RunError when the disk of `folder` has less room than the output of `run` will need by a rough estimate."""
    if run.output_size is None:
        return
    need, free = run.output_size + _RESERVE, shutil.disk_usage(folder).free
    if free < need:
        raise RunError("the disk is too full", f"{folder} has {size_text(free)} free", f"the run needs about {size_text(need)}")


def check_disk(work: Path) -> None:
    """RunError when next to nothing is free on the disk of `work`, on which the run is writing."""
    if shutil.disk_usage(work).free < _RESERVE:
        raise RunError(DISK_FULL, f"less than {size_text(_RESERVE)} are free in {work.parent}")


def _tail(log: Path, size: int = 20000) -> list[str]:
    with log.open("rb") as handle:
        handle.seek(max(0, log.stat().st_size - size))
        return handle.read().decode(errors="replace").splitlines()


def reason(lines: list[str]) -> str:
    """The engine's message about what went wrong: the last line that looks like an error, else its last line."""
    message = re.compile(r"^(?:dembark: (?!steps|finished|resumed|integration)|ERROR|\w*(?:Error|Exception)\b.*|.*[Nn]o space left)"
                      f"|{_OF_ONE_RANK.pattern}")
    spoken = [line.strip() for line in lines if line.strip()]
    found = ((message.search(line), line) for line in reversed(spoken))
    return next((line[one.start():] for one, line in found if one), f"its last line: {spoken[-1]}" if spoken else "it printed nothing")


def judge(run: Run, code: int, parser: OutputParser, work: Path) -> None:
    """Killed or RunError, with the reason, unless the engine finished and printed so."""
    stop_message, lines = run.engine.facts.stop_message, _tail(work / "engine.log")
    where = f"at step {parser.step} of {parser.steps}" if parser.steps else "before its first step"
    if any("No space left" in line for line in lines):
        raise RunError(DISK_FULL, f"the engine stopped {where}")
    relayed = re.search(r"exited on signal (\d+)", "\n".join(lines)) if code else None
    # srun reports a signal as shells do, as 128 plus its number.
    number = -code if code < 0 else int(relayed.group(1)) if relayed else code - 128 if code - 128 in _STOPPED else 0
    # With an error of one rank the launcher ends the others by a signal.
    faulty = any(_OF_ONE_RANK.search(line) for line in lines)
    if number and not (faulty and number in _STOPPED):
        hint = "by hand or because memory ran out" if number == signal.SIGKILL else ""
        kind = Killed if number in _STOPPED else RunError
        name = next((one.name for one in signal.Signals if one == number), f"signal {number}")
        raise kind(f"the engine was killed by {name} {where}", hint)
    if stop_message and not parser.finished and not faulty and any(stop_message in line for line in lines):
        raise Killed(f"the engine was asked to stop {where}")
    if code:
        raise RunError(f"the engine ended with exit code {code} {where}", reason(lines))
    if not parser.finished:
        raise RunError(f"the engine ended without 'dembark: finished' {where}", reason(lines))
    if not parser.steps:
        raise RunError("the engine did not print 'dembark: steps <N> time_step <dt>'", "the deck must print this line")


def integration(work: Path) -> dict[str, float]:
    """What the run's integration monitor found (largest errors of one step, fewest steps of a contact); empty where it had none, or where
    its line is cut off."""
    words = next((line for line in reversed(_tail(work / "engine.log")) if line.startswith("dembark: integration ")), "").split()[2:]
    try:
        return {name: float(value) for name, value in zip(words[::2], words[1::2], strict=True)}
    except ValueError:
        return {}


def check_output(work: Path, outputs: Sequence[str], wanted: Value) -> int:
    """Frames in the dumps (0 without any) of a run that wrote all of `outputs` completely; RunError otherwise."""
    try:
        counts = {kind: count_frames(work / OUTPUTS[kind], key) for kind, key in _DUMPS.items() if kind in outputs}
        if len(set(counts.values())) > 1:
            raise RunError("grains.dump and contacts.dump have different numbers of frames")
        for kind, frames in counts.items():
            if isinstance(wanted, int) and frames != wanted:
                raise RunError(f"{OUTPUTS[kind]} holds {frames} frames instead of {wanted}")
        if "times" in outputs:
            check_times(work / OUTPUTS["times"])
        if "impacts" in outputs:
            check_impacts(work / OUTPUTS["impacts"])
    except RunError as error:
        # The engines do not notice a full disk; a file that was cut off and no free space are its signs.
        full = shutil.disk_usage(work).free < _RESERVE
        raise RunError(DISK_FULL if full else "", str(error)) from None
    return next(iter(counts.values()), 0)
