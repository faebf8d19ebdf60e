"""One simulation: start the engine in a hidden folder, watch it, check what it wrote, and only then put the result in place.

A run that is stopped or killed leaves its hidden folder, named after the hash of its inputs, and the next attempt goes on from the last
state in it, on whatever host. A run that fails by its own fault begins anew.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from select import select
from typing import Any

from dembark.validation import provenance, restarts
from dembark.validation.cases import OUTPUTS
from dembark.validation.claim import claim
from dembark.validation.engines import end_with_parent
from dembark.validation.errors import DembarkError, Interrupted, Killed, RunError
from dembark.validation.files import DISK_FULL, check_impacts, check_times, count_frames, disk_error, move_into_place, sweep, write_json
from dembark.validation.parameters import Value
from dembark.validation.plan import Run, deck_files, finished
from dembark.validation.progress import Board, OutputParser

# A line of grains.dump and two to three of contacts.dump for each grain and frame.
_BYTES_PER_GRAIN_AND_FRAME = 800
_RESERVE = 4 << 20
_DUMPS = {"grains": "ATOMS", "contacts": "ENTRIES"}
_GRACE = 5.0
# Signals by which a user, a scheduler or the system ends what is sound; the others are faults of the engine.
_STOPPED = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGXCPU)
_RESUMED = re.compile(r"dembark: resumed at step (\d+) (exact|approximate)ly")


@dataclass(frozen=True)
class Resources:
    """What a run may use: MPI ranks (LIGGGHTS) and threads; and about how long it computes between states to resume from (s, 0: none)."""

    ranks: int = 1
    threads: int = 1
    restart_interval: float = 600.0


def simulate(run: Run, out: Path, board: Board, cancel: threading.Event, resources: Resources | None = None) -> Path:
    """Run `run` into `out/replica-<k>` unless its finished result stands there already; returns that folder.

    Until the run is finished and checked, an earlier result in that folder stays as it is. When it fails, RunError says why
    in one line and the engine's log is kept in `out/failed`. `cancel` ends the engine and raises Interrupted. A run that was cancelled
    or killed goes on from its last state when it is simulated again with the same inputs.
    """
    target = out / run.folder_name
    used = resources or Resources()
    with claim(out / f".{run.folder_name}.lock", f"{target} is being computed by another process", cancel) as lost:
        sweep(target)
        if finished(target, run):
            board.post(run.name, state="kept")
            return target
        began = time.time()
        board.post(run.name, state="running", started=began)
        try:
            _run_into(run, target, board, _Ended(cancel, lost), used)
        except DembarkError as error:
            # Another attempt may follow; it is not the run that failed.
            state = "stopped" if isinstance(error, Killed | Interrupted) else "failed"
            board.post(run.name, state=state, ended=time.time(), message=str(error))
            raise
        board.post(run.name, state="finished", ended=time.time())
    return target


@dataclass(frozen=True)
class _Ended:
    """Whether an attempt has to end, by whoever's will: its user's, or another process's that has taken its lock."""

    cancel: threading.Event
    lost: threading.Event

    def is_set(self) -> bool:
        return self.cancel.is_set() or self.lost.is_set()


def _run_into(run: Run, target: Path, board: Board, ended: _Ended, used: Resources) -> None:
    work = restarts.work_folder(run, target)
    computed = kept = False
    try:
        for other in restarts.work_folders(target):
            if other != work:
                shutil.rmtree(other)
        check_room(run, target.parent)
        step, computed = restarts.begin(run, work), True
        record = _execute(run, work, step, board, ended, used)
        restarts.clear(work)
        write_json(work / "run.json", record)
        move_into_place(work, target)
        _forget_failure(target)
    except OSError as error:
        kept, going_on = _going_on(run, work)
        raise RunError(f"{run.name} failed", str(disk_error(error, target)), going_on) from None
    except Interrupted:
        if ended.lost.is_set():
            kept = True
            raise Killed(f"{run.name} was given up", "another process has taken its lock, because this one was held up") from None
        kept, going_on = _going_on(run, work)
        raise Interrupted(f"{run.name} was interrupted", going_on) from None
    except Killed as error:
        kept, going_on = _going_on(run, work)
        raise Killed(f"{run.name} failed", str(error), going_on, _keep_log(work, target)) from None
    except RunError as error:
        # A run is at fault for what it did, but not for a disk without room.
        faulty = computed and not str(error).startswith(DISK_FULL)
        kept, going_on = (False, "") if faulty else _going_on(run, work)
        raise RunError(f"{run.name} failed", str(error), going_on, _keep_log(work, target)) from None
    finally:
        if not kept:
            shutil.rmtree(work, ignore_errors=True)


def _going_on(run: Run, work: Path) -> tuple[bool, str]:
    """Whether there is a state to resume from, and what the next attempt will do, in words."""
    step = restarts.newest(work, run.engine.name)
    how = "begins anew" if step is None else f"goes on from step {step}"
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


def check_room(run: Run, folder: Path) -> None:
    """RunError when the disk of `folder` has less room than the output of `run` will need by a rough estimate."""
    grains, frames = run.values.get("grain_count"), run.values.get("frames")
    if not isinstance(grains, int) or not isinstance(frames, int):
        return
    need = grains * frames * _BYTES_PER_GRAIN_AND_FRAME + _RESERVE
    free = shutil.disk_usage(folder).free
    if free < need:
        raise RunError("the disk is too full", f"{folder} has {free >> 20} MB free", f"the run needs about {need >> 20} MB")


def _wrapped(command: list[str]) -> list[str]:
    # The engine must not go on alone when this process is killed, and its lines must come when it writes them.
    return [*end_with_parent("TERM"), *(["stdbuf", "-oL"] if shutil.which("stdbuf") else []), *command]


def _execute(run: Run, work: Path, step: int | None, board: Board, ended: _Ended, used: Resources) -> dict[str, Any]:
    """One attempt in `work`, from `step` on (None: from the start); the record of the finished run."""
    words, every = dict(run.values), 0
    if restarts.supported(run):
        every = restarts.steps_between(run, used.restart_interval, used.ranks * used.threads)
        words |= {"restart_every": every} | ({"resume": "yes"} if step is not None else {})
    command = run.engine.command(run.case.deck(run.engine.name), words, used.ranks, used.threads)
    before = _heard(work, restarts.attempts(work))
    began, clock = datetime.now(UTC), time.monotonic()
    restarts.remember(work, replace(before, attempts=before.attempts + 1, ended=False))
    process = subprocess.Popen(_wrapped(command), cwd=work, env=run.engine.environment(used.threads), stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
    parser = OutputParser()
    board.post(run.name, attempt=before.attempts + 1, resumed_from=step or 0)

    def news() -> None:
        board.post(run.name, step=parser.step, steps=parser.steps, time_step=parser.time_step)

    try:
        _listen(process, work, parser, news, ended)
        code = process.wait()
    finally:
        end_group(process)
        wall = time.monotonic() - clock
        done = _heard(work, replace(before, attempts=before.attempts + 1, wall_time=before.wall_time + wall, ended=False))
        restarts.remember(work, done)
    _judge(code, parser, work)
    frames = _check_output(work, run.case.outputs, run.values.get("frames"))
    # The speed of this attempt: of the others nobody knows how many steps were done twice.
    speed = run.particles * (parser.steps - (step or 0)) / wall if run.particles else None
    return {
        "case": run.case.name, "variant": run.variant, "profile": run.profile, "engine": run.engine.name, "replica": run.replica,
        "parameters": dict(run.values), "seed": run.values.get("seed"), "steps": parser.steps, "time_step": parser.time_step,
        "frames": frames, "inputs": run.inputs, "deck": deck_files(run.case, run.engine.name), "command": command,
        "attempts": done.attempts, "resumed_at": list(done.resumed_at), "resume": done.resume, "restart_every": every,
        "provenance": {**provenance.collect(run.engine), "ranks": used.ranks, "threads": used.threads, "seed": run.values.get("seed"),
                       "started": began.isoformat(timespec="seconds"), "wall_time": done.wall_time, "particle_steps_per_second": speed},
    }


def _heard(work: Path, told: restarts.Attempts) -> restarts.Attempts:
    """The same with what the engine's log says of the last attempt, unless that was heard when it ended: a killed harness hears nothing."""
    if told.ended or not (work / "engine.log").is_file():
        return replace(told, ended=True)
    with (work / "engine.log").open(encoding="utf-8", errors="replace") as log:
        found = next(filter(None, map(_RESUMED.match, log)), None)
    if not found:
        return replace(told, ended=True)
    # One approximate resumption makes the whole run approximate.
    approximate = "approximate" in (found.group(2), told.resume)
    return replace(told, resumed_at=(*told.resumed_at, int(found.group(1))), resume="approximate" if approximate else "exact", ended=True)


def _listen(process: subprocess.Popen[bytes], work: Path, parser: OutputParser, news: Callable[[], None],
            ended: _Ended) -> None:
    assert process.stdout
    pending, looked = b"", time.monotonic()
    with (work / "engine.log").open("wb", buffering=0) as log:
        while True:
            if ended.is_set():
                raise Interrupted("interrupted")
            if time.monotonic() - looked > 2.0:
                looked = time.monotonic()
                if shutil.disk_usage(work).free < _RESERVE:
                    raise RunError(DISK_FULL, f"less than {_RESERVE >> 20} MB are free in {work.parent}")
            if not select([process.stdout], [], [], 0.3)[0]:
                # A grandchild may hold the pipe open although the engine itself has ended.
                if process.poll() is not None:
                    return
                continue
            chunk = os.read(process.stdout.fileno(), 1 << 16)
            if not chunk:
                return
            log.write(chunk)
            *lines, pending = (pending + chunk).split(b"\n")
            heard = [parser.feed(line.decode(errors="replace")) for line in lines]
            if any(heard):
                news()


def end_group(process: subprocess.Popen[bytes]) -> None:
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


def _tail(log: Path, size: int = 20000) -> list[str]:
    with log.open("rb") as handle:
        handle.seek(max(0, log.stat().st_size - size))
        return handle.read().decode(errors="replace").splitlines()


def reason(lines: list[str]) -> str:
    """The engine's own word about what went wrong: the last line that looks like an error, else its last line."""
    told = re.compile(r"^\s*(?:dembark: (?!steps|finished|resumed)|ERROR|\w*(?:Error|Exception)\b.*|.*[Nn]o space left)")
    spoken = [line.strip() for line in lines if line.strip()]
    return next((line for line in reversed(spoken) if told.match(line)), spoken[-1] if spoken else "it said nothing")


def _judge(code: int, parser: OutputParser, work: Path) -> None:
    lines = _tail(work / "engine.log")
    where = f"at step {parser.step} of {parser.steps}" if parser.steps else "before its first step"
    if any("No space left" in line for line in lines):
        raise RunError(DISK_FULL, f"the engine stopped {where}")
    relayed = re.search(r"exited on signal (\d+)", "\n".join(lines)) if code else None
    # srun tells of a signal as shells do, by 128 and its number.
    number = -code if code < 0 else int(relayed.group(1)) if relayed else code - 128 if code - 128 in _STOPPED else 0
    if number:
        hint = "by hand or because memory ran out" if number == signal.SIGKILL else ""
        kind = Killed if number in _STOPPED else RunError
        raise kind(f"the engine was killed by {signal.Signals(number).name} {where}", hint)
    if not parser.finished and any(line.startswith("SIGINT/SIGTERM caught") for line in lines):
        raise Killed(f"the engine was told to stop {where}")
    if code:
        raise RunError(f"the engine ended with exit code {code} {where}", reason(lines))
    if not parser.finished:
        raise RunError(f"the engine ended without 'dembark: finished' {where}", reason(lines))
    if not parser.steps:
        raise RunError("the engine never said 'dembark: steps <N> time_step <dt>'", "the deck must print this line")


def _check_output(work: Path, outputs: Sequence[str], wanted: Value) -> int:
    """Frames in the dumps (0 without any) of a run that wrote all of `outputs` whole; RunError otherwise."""
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
        # The engines do not notice a full disk: what tells is a file that was cut off and no room left.
        full = shutil.disk_usage(work).free < _RESERVE
        raise RunError(DISK_FULL if full else "", str(error)) from None
    return next(iter(counts.values()), 0)
