"""One simulation: start the engine in a hidden folder, watch it, check what it wrote, and only then put the result in place.

A run that is stopped or killed leaves its hidden folder, named after the hash of its inputs, and the next attempt goes on from the last
state in it, on whatever host. A run that fails by its own fault begins anew.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from select import select
from tempfile import TemporaryDirectory
from typing import Any

from dembark.common.choices import Value
from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.common.files import DISK_FULL, disk_error, move_into_place, sweep, write_json
from dembark.common.lock import lock
from dembark.validation import provenance
from dembark.validation.campaigns.plan import Resources, Run, is_finished
from dembark.validation.case import deck, walls
from dembark.validation.engines import end_with_parent
from dembark.validation.results import State, lock_file, status_file

from . import outcome, restarts
from .outcome import OutputParser

_RESUMED = re.compile(r"dembark: resumed at step (\d+) (exact|approximate)ly")
# Gets the changed fields of a run's State.
Progress = Callable[..., None]
_GRACE = 5.0


class Status:
    """How far a run is, for whoever reads its status file: about once a second, and at once when its state changes. `follow` gets every
    change."""

    def __init__(self, run: Run, target: Path, follow: Progress) -> None:
        self._path, self._follow, self._written = status_file(target), follow, 0.0
        self._state = State(run.name, inputs=run.inputs, host=socket.gethostname())

    def __call__(self, **facts: Any) -> None:
        """Change fields of the State."""
        self._state = replace(self._state, **facts)
        self._follow(**facts)
        if "state" in facts or time.monotonic() - self._written >= 1.0:
            self._written = time.monotonic()
            # Progress is never worth a run: a full disk is reported by what needs the space.
            with suppress(DembarkError):
                write_json(self._path, self._state.as_json())

    def remove(self) -> None:
        """The run is finished: its run.json says the rest."""
        self._path.unlink(missing_ok=True)


@contextmanager
def running(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    """The process of `command` in `folder`, with both its outputs in one pipe; at the end of the block it and its children are gone."""
    # It must not go on alone when this process is killed, and its lines must come when it writes them.
    words = [*end_with_parent("TERM"), *(["stdbuf", "-oL"] if shutil.which("stdbuf") else []), *command]
    process = subprocess.Popen(words, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, start_new_session=True)
    try:
        yield process
    finally:
        _end_group(process)


def chunks(process: subprocess.Popen[bytes], pause: float = 0.3) -> Iterator[bytes]:
    """What `process` writes, as it comes, until it ends; b"" whenever it was silent for `pause` (s)."""
    assert process.stdout
    while True:
        if select([process.stdout], [], [], pause)[0]:
            chunk = os.read(process.stdout.fileno(), 1 << 16)
            if not chunk:
                return
            yield chunk
        # A grandchild may hold the pipe open although the engine itself has ended.
        elif process.poll() is not None:
            # What it wrote after that look, and before it ended.
            while select([process.stdout], [], [], 0.0)[0] and (chunk := os.read(process.stdout.fileno(), 1 << 16)):
                yield chunk
            return
        else:
            yield b""


def _end_group(process: subprocess.Popen[bytes]) -> None:
    """End the process and all that it started (its process group): politely first, after some seconds for good."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
        except ProcessLookupError:
            break
        deadline = time.monotonic() + _GRACE
        while time.monotonic() < deadline and _group_lives(process):
            time.sleep(0.05)
    process.wait()
    if process.stdout:
        process.stdout.close()


def _group_lives(process: subprocess.Popen[bytes]) -> bool:
    process.poll()
    try:
        os.killpg(process.pid, 0)
    except ProcessLookupError:
        return False
    return True


def no_progress(**facts: object) -> None:
    """The callback of callers that need no progress."""


def simulate(run: Run, out: Path, cancel: threading.Event, used: Resources | None = None, follow: Progress = no_progress) -> bool:
    """Run `run` into `out/replica-<k>`; False when its finished result is there already.

    Until the run is finished and checked, an earlier result in that folder stays as it is. When it fails, RunError says why
    in one line and the engine's log is kept in `out/failed`. `cancel` ends the engine and raises Interrupted. A run that was cancelled
    or killed goes on from its last state when it is simulated again with the same inputs. Its status file says meanwhile how far it is,
    afterwards why it is not finished.
    """
    target = out / run.folder_name
    with lock(lock_file(target), f"{target} is being computed by another process", cancel) as lost:
        sweep(target)
        status = Status(run, target, follow)
        if is_finished(target, run):
            status.remove()
            return False
        status(state="running", began=time.time())
        try:
            _run_into(run, target, status, cancel, lost, used or Resources())
        except DembarkError as error:
            again = isinstance(error, Killed | Interrupted)
            status(state="stopped" if again else "failed", message=str(error).removeprefix(f"{run.name} failed, "), ended=time.time())
            raise
        status.remove()
    return True


def _run_into(run: Run, target: Path, progress: Progress, cancel: threading.Event, lost: threading.Event, used: Resources) -> None:
    work = restarts.work_folder(run, target)
    computed = kept = False

    def ended() -> bool:
        """Whether the attempt has to end, by whoever's will: its user's, or another process's that has taken its lock."""
        return cancel.is_set() or lost.is_set()

    try:
        for other in restarts.work_folders(target):
            if other != work:
                shutil.rmtree(other)
        outcome.check_room(run, target.parent)
        step, computed = restarts.begin(run, work), True
        setup = deck.write(run.case, run.engine.name, run.values, work) if step is None else deck.prepare(run.case, run.values)
        if replace(run).inputs != run.inputs:
            raise RunError("its deck was changed since this was planned", f"in {run.case.folder}", "start again")
        derived = deck.derived(setup)
        about = {"derived": derived, "walls": walls.resolved(run.case, {**run.values, **derived})}
        record = _execute(run, work, step, progress, ended, used) | about
        restarts.clear(run, work)
        deck.archive(run.case, work)
        write_json(work / "run.json", record)
        move_into_place(work, target)
        _forget_failure(target)
    except OSError as error:
        kept, going_on = _resumption(run, work)
        raise RunError(f"{run.name} failed", str(disk_error(error, target)), going_on) from None
    except Interrupted:
        if lost.is_set():
            kept = True
            raise Killed(f"{run.name} was given up", "another process has taken its lock, because this one was held up") from None
        kept, going_on = _resumption(run, work)
        raise Interrupted(f"{run.name} was interrupted", going_on) from None
    except RunError as error:
        # A run is at fault for what it did, but not when it was killed, or for a disk without room.
        faulty = computed and not isinstance(error, Killed) and not str(error).startswith(DISK_FULL)
        kept, going_on = (False, "") if faulty else _resumption(run, work)
        raise type(error)(f"{run.name} failed", str(error), going_on, _keep_log(work, target)) from None
    except Exception:
        # What went wrong around the run is no reason to lose its state.
        kept, _ = _resumption(run, work)
        raise
    finally:
        if not kept:
            shutil.rmtree(work, ignore_errors=True)


def _resumption(run: Run, work: Path) -> tuple[bool, str]:
    """Whether there is a state to resume from, and what the next attempt will do, in words."""
    step = restarts.newest(work, run.engine.name)
    how = "starts again from its beginning" if step is None else f"continues from step {step}"
    return step is not None, f"it {how} when it is started again"


def _keep_log(work: Path, target: Path) -> str:
    if not (work / "engine.log").is_file():
        return ""
    kept = target.parent / "failed" / f"{target.name}.log"
    try:
        kept.parent.mkdir(exist_ok=True)
        shutil.copyfile(work / "engine.log", kept)
    except OSError:
        return "its log could not be kept"
    return f"see {kept}"


def _forget_failure(target: Path) -> None:
    kept = target.parent / "failed"
    (kept / f"{target.name}.log").unlink(missing_ok=True)
    if kept.is_dir() and not any(kept.iterdir()):
        kept.rmdir()


def _execute(run: Run, work: Path, step: int | None, progress: Progress, ended: Callable[[], bool], used: Resources) -> dict[str, Any]:
    """One attempt in `work`, from `step` on (None: from the start); the record of the finished run."""
    words: dict[str, Value] = {}
    every = 0
    if restarts.writes_restarts(run):
        interval = restarts.INTERVAL if used.restart_interval is None else used.restart_interval
        every = restarts.steps_between(run, interval, used.cores)
        words = {"restart_every": every} | ({"resume": "yes"} if step is not None else {})
    command = run.engine.command(work / run.engine.facts.deck, words, used.ranks, used.threads)
    before = _with_log(work, restarts.attempts(work))
    began, clock = datetime.now(UTC), time.monotonic()
    restarts.remember(work, replace(before, attempts=before.attempts + 1, ended=False))
    parser = OutputParser()
    progress(attempt=before.attempts + 1, resumed_from=step or 0)

    def update() -> None:
        progress(step=parser.step, steps=parser.steps, time_step=parser.time_step)

    try:
        # Open MPI makes its session folder without regard to others that do so at the same time.
        with TemporaryDirectory(prefix="dembark-", ignore_cleanup_errors=True) as own:
            environment = run.engine.environment(used.threads) | {"TMPDIR": own}
            with running(command, work, environment) as process:
                _listen(process, work, parser, update, ended)
                code = process.wait()
    finally:
        wall = time.monotonic() - clock
        done = _with_log(work, replace(before, attempts=before.attempts + 1, wall_time=before.wall_time + wall, ended=False))
        restarts.remember(work, done)
    outcome.judge(run, code, parser, work)
    frames = outcome.check_output(work, run.case.outputs, run.values.get("frames"))
    # The speed of this attempt: of the others nobody knows how many steps were done twice.
    speed = run.particles * (parser.steps - (step or 0)) / wall if run.particles else None
    return {
        "case": run.case.name, "variant": run.variant, "profile": run.profile, "engine": run.engine.name, "replica": run.replica,
        "parameters": dict(run.values), "seed": run.values.get("seed"),
        "steps": parser.steps, "time_step": parser.time_step, "impact_id_offset": run.engine.facts.impact_id_offset, "frames": frames,
        **({"fitted": dict(run.fitted)} if run.fitted else {}),
        "inputs": run.inputs, "deck": deck.sources(run.case, run.engine.name), "command": command,
        "attempts": done.attempts, "resumed_at": list(done.resumed_at), "resume": done.resume, "restart_every": every,
        "integration": outcome.integration(work),
        "provenance": {**provenance.collect(run.engine), "ranks": used.ranks, "threads": used.threads, "seed": run.values.get("seed"),
                       "started": began.isoformat(timespec="seconds"), "wall_time": done.wall_time, "particle_steps_per_second": speed},
    }


def _with_log(work: Path, known: restarts.Attempts) -> restarts.Attempts:
    """The same with what the engine's log says of the last attempt, unless that was read when it ended: a killed harness reads nothing."""
    if known.ended or not (work / "engine.log").is_file():
        return replace(known, ended=True)
    with (work / "engine.log").open(encoding="utf-8", errors="replace") as log:
        found = next(filter(None, map(_RESUMED.match, log)), None)
    if not found:
        return replace(known, ended=True)
    # One approximate resumption makes the run approximate.
    approximate = "approximate" in (found.group(2), known.resume)
    return replace(known, resumed_at=(*known.resumed_at, int(found.group(1))), resume="approximate" if approximate else "exact", ended=True)


def _listen(process: subprocess.Popen[bytes], work: Path, parser: OutputParser, update: Callable[[], None],
            ended: Callable[[], bool]) -> None:
    looked = time.monotonic()
    with (work / "engine.log").open("wb", buffering=0) as log:
        for chunk in chunks(process):
            if ended():
                raise Interrupted("interrupted")
            if time.monotonic() - looked > 2.0:
                looked = time.monotonic()
                outcome.check_disk(work)
            log.write(chunk)
            if parser.feed(chunk):
                update()
