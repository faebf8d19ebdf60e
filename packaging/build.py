#!/usr/bin/python3
"""Run the steps of a build with a progress line, an estimate of what is left, and one line that says why it failed.

    packaging/build.py --name YADE --log build.log [--resume "make ..."] -- cmake ... -- ninja ...

Steps are separated by `--`. Their output goes into the log. `-j 0` of ninja becomes as many jobs as cores and memory allow (3 GB a
compiler). The estimate is what the machine has shown: the time passed, over the share of the work that is done. What a step of ninja
weighs next to the others was measured once (build_weights.txt); how fast this machine is was not.
"""

from __future__ import annotations

import argparse
import os
import re
import select
import subprocess
import sys
import time
from pathlib import Path

TELL_EVERY = 20.0
STEP = re.compile(r"\[(\d+)/(\d+)\] (.*)")
# The first line of a log that matches is the cause; what to do about it follows from what it says.
CAUSES = (
    (re.compile(r"No space left on device"), "free some space"),
    (re.compile(r"(Killed signal terminated program|virtual memory exhausted|cannot allocate memory|out of memory)", re.IGNORECASE),
     "the compiler ran out of memory: close other programs, or build with JOBS=1"),
    (re.compile(r"fatal error: \S+: No such file or directory"),
     "a header is missing: run 'make system', which installs the packages that the build needs"),
    (re.compile(r"cannot find -l\S+|Could NOT find|not found \(missing:|Could not find a package configuration file"),
     "a library is missing: run 'make system', which installs the packages that the build needs"),
    (re.compile(r"CMake Error: The source .* does not match the source"), "the checkout was moved: run 'make clean', then make again"),
    (re.compile(r"\berror:|undefined reference to|multiple definition of|CMake Error|^ninja: error|ERROR: "), ""),
)


def weights() -> list[tuple[re.Pattern[str], float]]:
    """Patterns of ninja's step texts with what the step costs, s on the machine where it was measured."""
    lines = (Path(__file__).with_name("build_weights.txt")).read_text(encoding="utf-8").splitlines()
    return [(re.compile(words[1]), float(words[0])) for words in (line.split(None, 1) for line in lines) if words and words[0] != "#"]


def jobs() -> int:
    """As many compilers as there are cores and 3 GB of free memory for each, at least one."""
    free = 0
    for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
        if line.startswith("MemAvailable:"):
            free = int(line.split()[1]) // (3 << 20)
    return max(1, min(len(os.sched_getaffinity(0)), free))


def cause(log: Path) -> str:
    """The first real error in a log, and what to do about it, in one line."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines):
        for pattern, hint in CAUSES:
            if pattern.search(line):
                found, advice = line.strip(), hint
                if found.startswith("CMake Error"):
                    # CMake puts the reason into the indented lines below.
                    rest = [text.strip() for text in lines[number + 1:number + 6] if text.startswith("  ")]
                    found = " ".join([found, *rest])
                    advice = next((better for known, better in CAUSES if better and known.search(found)), hint)
                return "; ".join(part for part in (" ".join(found.split())[:400], advice) if part)
    last = next((line.strip() for line in reversed(lines) if line.strip()), "no output")
    return last[:400]


class Progress:
    """Progress lines on stderr: rewritten in a terminal, else one about every 20 s."""

    def __init__(self, name: str) -> None:
        self.name, self.begun, self.shown = name, time.monotonic(), time.monotonic()
        self.live, self.weights = sys.stderr.isatty(), weights()
        self.plan: list[float] = []
        self.done = self.base = 0.0
        self.count = self.total = 0

    def weigh(self, text: str) -> float:
        """Cost of the step of ninja with this text."""
        return next((weight for pattern, weight in self.weights if pattern.search(text)), 1.0)

    def expect(self, steps: list[str]) -> None:
        """The texts of the steps that ninja is going to run."""
        self.plan = [self.weigh(text) for text in steps]
        self.done, self.base, self.count, self.total = 0.0, time.monotonic(), 0, len(steps)

    def step(self, text: str) -> None:
        """A step is done."""
        self.done += self.weigh(text)
        self.count += 1

    def tell(self) -> None:
        """Write the line, if it is time for one."""
        now = time.monotonic()
        if now - self.shown < (1.0 if self.live else TELL_EVERY):
            return
        self.shown = now
        words = f"dembark: {self.name}: {_span(now - self.begun)} passed"
        work = sum(self.plan)
        if work:
            words += f", step {self.count} of {self.total}"
            # Before a tenth of the work is done the rest is a guess.
            if self.done > 0.1 * work:
                words += f", about {_span((now - self.base) * (work - min(self.done, work)) / self.done)} left"
        print(f"\r\033[K{words}" if self.live else words, end="" if self.live else "\n", file=sys.stderr, flush=True)

    def end(self) -> None:
        """Clear the line of a terminal."""
        if self.live:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min"


def planned(words: list[str]) -> list[str]:
    """What ninja would run, by its own account."""
    done = subprocess.run([*words, "-n"], capture_output=True, text=True, check=False)
    return [found.group(3) for found in map(STEP.match, done.stdout.splitlines()) if found]


def run(words: list[str], log: Path, progress: Progress) -> int:
    """Run one step into the log; returns its exit code."""
    if Path(words[0]).name == "ninja":
        progress.expect(planned(words))
    # Ninja finishes a step when it prints its line, as its output is no terminal.
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               env=os.environ | {"LC_ALL": "C.UTF-8", "NINJA_STATUS": "[%f/%t] "})
    assert process.stdout is not None
    pipe = process.stdout.fileno()
    with log.open("ab") as out:
        rest = b""
        while True:
            ready, _, _ = select.select([pipe], [], [], 0.5)
            text = os.read(pipe, 1 << 16) if ready else b""
            if ready and not text:
                return process.wait()
            out.write(text)
            out.flush()
            *lines, rest = (rest + text).split(b"\n")
            for line in lines:
                found = STEP.match(line.decode(errors="replace"))
                if found and "Re-checking" not in found.group(3):
                    progress.step(found.group(3))
            progress.tell()


def main() -> int:
    """Run all steps; exit code 0, or 1 after the line that says why."""
    parser = argparse.ArgumentParser(description="run a build with progress and a clear end")
    parser.add_argument("--name", required=True)
    parser.add_argument("--log", required=True, type=Path)
    parser.add_argument("--resume", default="make")
    own, *steps = _split(sys.argv[1:])
    given = parser.parse_args(own)
    given.log.parent.mkdir(parents=True, exist_ok=True)
    given.log.write_text("", encoding="utf-8")
    progress = Progress(given.name)
    for words in steps:
        if "-j" in words and words[words.index("-j") + 1] == "0":
            words[words.index("-j") + 1] = str(jobs())
        try:
            code = run(words, given.log, progress)
        except KeyboardInterrupt:
            progress.end()
            print(f"dembark: {given.name}: interrupted; '{given.resume}' goes on where it was", file=sys.stderr)
            return 130
        if code:
            progress.end()
            print(f"dembark: {given.name} did not build: {cause(given.log)}; all output is in {given.log}, "
                  f"'{given.resume}' goes on where it was", file=sys.stderr)
            return 1
    progress.end()
    return 0


def _split(words: list[str]) -> list[list[str]]:
    parts: list[list[str]] = [[]]
    for word in words:
        if word == "--":
            parts.append([])
        else:
            parts[-1].append(word)
    return parts


if __name__ == "__main__":
    sys.exit(main())
