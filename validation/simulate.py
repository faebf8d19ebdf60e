"""One simulation: start the engine in a hidden folder, watch it, check what it wrote, and only then put the result in place."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from select import select
from typing import Any

from dembark.validation import provenance
from dembark.validation.cases import OUTPUTS
from dembark.validation.errors import DembarkError, Interrupted, RunError
from dembark.validation.files import (
    check_impacts,
    check_times,
    count_frames,
    disk_error,
    lock,
    move_into_place,
    part_folder,
    sweep,
    write_json,
)
from dembark.validation.parameters import Value
from dembark.validation.plan import Run, deck_files, finished
from dembark.validation.progress import Board, OutputParser

# A line of grains.dump and two to three of contacts.dump for each grain and frame.
_BYTES_PER_GRAIN_AND_FRAME = 800
_RESERVE = 4 << 20
_DUMPS = {"grains": "ATOMS", "contacts": "ENTRIES"}
_GRACE = 5.0


@dataclass(frozen=True)
class Resources:
    """What a run may use: MPI ranks (LIGGGHTS) and threads."""

    ranks: int = 1
    threads: int = 1


def simulate(run: Run, out: Path, board: Board, cancel: threading.Event, resources: Resources | None = None) -> Path:
    """Run `run` into `out/replica-<k>` unless its finished result stands there already; returns that folder.

    Until the run is finished and checked, an earlier result in that folder stays as it is. When it fails, RunError says why
    in one line and the engine's log is kept in `out/failed`. `cancel` ends the engine and raises Interrupted.
    """
    target = out / run.folder_name
    used = resources or Resources()
    with lock(out / f".{run.folder_name}.lock", f"{target} is being computed by another process"):
        sweep(target)
        if finished(target, run):
            board.post(run.name, state="kept")
            return target
        began = time.time()
        board.post(run.name, state="running", started=began)
        try:
            _run_into(run, target, board, cancel, used)
        except DembarkError as error:
            board.post(run.name, state="failed", ended=time.time(), message=str(error))
            raise
        board.post(run.name, state="finished", ended=time.time())
    return target


def _run_into(run: Run, target: Path, board: Board, cancel: threading.Event, used: Resources) -> None:
    part = None
    try:
        check_room(run, target.parent)
        part = part_folder(target)
        record = _execute(run, part, board, cancel, used)
        write_json(part / "run.json", record)
        move_into_place(part, target)
        _forget_failure(target)
    except OSError as error:
        raise RunError(f"{run.name} failed", str(disk_error(error, target))) from None
    except Interrupted:
        raise
    except RunError as error:
        raise RunError(f"{run.name} failed", str(error), _keep_log(part, target)) from None
    finally:
        if part:
            shutil.rmtree(part, ignore_errors=True)


def _keep_log(part: Path | None, target: Path) -> str:
    if not part or not (part / "engine.log").is_file():
        return ""
    kept = target.parent / "failed" / f"{target.name}.log"
    try:
        kept.parent.mkdir(exist_ok=True)
        (part / "engine.log").replace(kept)
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
    guard = ["setpriv", "--pdeathsig", "TERM", "--"] if shutil.which("setpriv") else []
    return [*guard, *(["stdbuf", "-oL"] if shutil.which("stdbuf") else []), *command]


def _execute(run: Run, part: Path, board: Board, cancel: threading.Event, used: Resources) -> dict[str, Any]:
    command = run.engine.command(run.case.deck(run.engine.name), run.values, used.ranks, used.threads)
    began, clock = datetime.now(UTC), time.monotonic()
    process = subprocess.Popen(_wrapped(command), cwd=part, env=run.engine.environment(used.threads), stdin=subprocess.DEVNULL,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
    parser = OutputParser()

    def news() -> None:
        board.post(run.name, step=parser.step, steps=parser.steps, time_step=parser.time_step)

    try:
        _listen(process, part, parser, news, cancel)
        code = process.wait()
    finally:
        end_group(process)
    wall = time.monotonic() - clock
    _judge(code, parser, part)
    frames = _check_output(part, run.case.outputs, run.values.get("frames"))
    grains = run.values.get("grain_count", run.values.get("log_count"))
    speed = grains * parser.steps / wall if isinstance(grains, int) else None
    return {
        "case": run.case.name, "variant": run.variant, "profile": run.profile, "engine": run.engine.name, "replica": run.replica,
        "parameters": dict(run.values), "seed": run.values.get("seed"), "steps": parser.steps, "time_step": parser.time_step,
        "frames": frames, "inputs": run.inputs, "deck": deck_files(run.case, run.engine.name), "command": command,
        "provenance": {**provenance.collect(run.engine), "ranks": used.ranks, "threads": used.threads, "seed": run.values.get("seed"),
                       "started": began.isoformat(timespec="seconds"), "wall_time": wall, "particle_steps_per_second": speed},
    }


def _listen(process: subprocess.Popen[bytes], part: Path, parser: OutputParser, news: Callable[[], None],
            cancel: threading.Event) -> None:
    assert process.stdout
    pending, looked = b"", time.monotonic()
    with (part / "engine.log").open("wb", buffering=0) as log:
        while True:
            if cancel.is_set():
                raise Interrupted("interrupted", "the unfinished run was removed, finished ones are kept")
            if time.monotonic() - looked > 2.0:
                looked = time.monotonic()
                if shutil.disk_usage(part).free < _RESERVE:
                    raise RunError("the disk is full", f"less than {_RESERVE >> 20} MB are free in {part.parent}")
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
    told = re.compile(r"^\s*(?:dembark: (?!steps|finished)|ERROR|\w*(?:Error|Exception)\b.*|.*[Nn]o space left)")
    spoken = [line.strip() for line in lines if line.strip()]
    return next((line for line in reversed(spoken) if told.match(line)), spoken[-1] if spoken else "it said nothing")


def _judge(code: int, parser: OutputParser, part: Path) -> None:
    lines = _tail(part / "engine.log")
    where = f"at step {parser.step} of {parser.steps}" if parser.steps else "before its first step"
    if any("No space left" in line for line in lines):
        raise RunError("the disk is full", f"the engine stopped {where}")
    relayed = re.search(r"exited on signal (\d+)", "\n".join(lines)) if code else None
    number = -code if code < 0 else int(relayed.group(1)) if relayed else 0
    if number:
        hint = "by hand or because memory ran out" if number == signal.SIGKILL else ""
        raise RunError(f"the engine was killed by {signal.Signals(number).name} {where}", hint)
    if code:
        raise RunError(f"the engine ended with exit code {code} {where}", reason(lines))
    if not parser.finished:
        raise RunError(f"the engine ended without 'dembark: finished' {where}", reason(lines))
    if not parser.steps:
        raise RunError("the engine never said 'dembark: steps <N> time_step <dt>'", "the deck must print this line")


def _check_output(part: Path, outputs: Sequence[str], wanted: Value) -> int:
    """Frames in the dumps (0 without any) of a run that wrote all of `outputs` whole; RunError otherwise."""
    try:
        counts = {kind: count_frames(part / OUTPUTS[kind], key) for kind, key in _DUMPS.items() if kind in outputs}
        if len(set(counts.values())) > 1:
            raise RunError("grains.dump and contacts.dump have different numbers of frames")
        for kind, frames in counts.items():
            if isinstance(wanted, int) and frames != wanted:
                raise RunError(f"{OUTPUTS[kind]} holds {frames} frames instead of {wanted}")
        if "times" in outputs:
            check_times(part / OUTPUTS["times"])
        if "impacts" in outputs:
            check_impacts(part / OUTPUTS["impacts"])
    except RunError as error:
        # The engines do not notice a full disk: what tells is a file that was cut off and no room left.
        full = shutil.disk_usage(part).free < _RESERVE
        raise RunError("the disk is full" if full else "", str(error)) from None
    return next(iter(counts.values()), 0)
