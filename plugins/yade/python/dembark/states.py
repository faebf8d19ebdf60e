"""Runs with states to resume from: whole or not at all, and equal to the bit to a run that was not interrupted, on one thread."""

import glob
import gzip
import json
import os
import re
import shutil
import sys
import zlib
from functools import cache

from yade import IntegrationMonitor, NewtonIntegrator, Omega, Sphere
from yade.dembark.report import announce, fail, finish, monitor

O = Omega()
_KEPT_STATES = 2
_SUMMED_BYTES = 1 << 16


@cache
def options():
    """What the words restart_every=<steps> and resume=yes|no behind the script say: (steps between saved states, 0 never; resume or not).

    Other words are the script's own.
    """
    words = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word)
    every, resume = words.get("restart_every", "0"), words.get("resume", "no")
    if not every.isdecimal():
        fail(f"argument 'restart_every={every}': it must be a whole number of steps, 0 for none")
    if resume not in ("no", "yes"):
        fail(f"argument 'resume={resume}': it must be yes or no")
    return int(every), resume == "yes"


def _sync(path):
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _check_sum(path):
    crc, size = 0, 0
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            crc, size = zlib.crc32(block, crc), size + len(block)
    return f"{size} {crc:08x}"


def _states(base):
    """Steps and files of all saved states `base`.<step>.yade.gz, the newest first."""
    found = ((re.fullmatch(re.escape(base) + r"\.(\d+)\.yade\.gz", path), path) for path in glob.glob(glob.escape(base) + ".*.yade.gz"))
    return sorted(((int(match.group(1)), path) for match, path in found if match), reverse=True)


def _is_whole(path):
    try:
        with open(path + ".crc", encoding="ascii") as mark:
            return mark.read().strip() == _check_sum(path)
    except (OSError, ValueError):
        return False


def _can_be_read(path):
    """Whether a packed file ends as it should."""
    try:
        with gzip.open(path) as file:
            while file.read(1 << 20):
                pass
    except (EOFError, OSError, zlib.error):
        return False
    return True


def _number(line):
    """The integer >= 0 that is the first field of a line; None when that is something else."""
    found = re.match(rb"\d+(?=[,\s])", line)
    return int(found.group()) if found else None


def _save(base, outputs):
    """Save the scene as `base`.<step>.yade.gz: whole or not at all, and marked with its check sum when it is; keep the last two."""
    path = f"{base}.{O.iter}.yade.gz"
    part = f"{base}.part.yade.gz"
    O.tags["dembark_outputs"] = json.dumps([_known(name) for name in outputs if os.path.isfile(name)], separators=(",", ":"))
    # YADE would try for ever to write on a full disk. A packed body with its contacts takes about 150 bytes.
    if shutil.disk_usage(os.path.dirname(path) or ".").free < 1000 * len(O.bodies) + (1 << 20):
        fail(f"file {path} cannot be written: No space left on the disk")
    O.save(part, quiet=True)
    if not _can_be_read(part):
        fail(f"file {part} could not be written whole. No space left on the disk?")
    for name in (*filter(os.path.isfile, outputs), part):
        _sync(name)
    if os.path.exists(path + ".crc"):
        os.unlink(path + ".crc")
    os.replace(part, path)
    with open(path + ".crc.part", "w", encoding="ascii") as mark:
        mark.write(_check_sum(path) + "\n")
    _sync(path + ".crc.part")
    os.replace(path + ".crc.part", path + ".crc")
    _sync(os.path.dirname(path) or ".")
    _forget(_states(base)[_KEPT_STATES:])


def _forget(states):
    for _, path in states:
        for name in (path + ".crc", path):
            if os.path.exists(name):
                os.unlink(name)


def _known(path):
    """A file by its name, its length and a check sum of its last bytes."""
    size = os.path.getsize(path)
    return [path, size, _sum_before(path, size)]


def _sum_before(path, end):
    with open(path, "rb") as file:
        file.seek(max(0, end - _SUMMED_BYTES))
        return zlib.crc32(file.read(min(end, _SUMMED_BYTES)))


def _cut(path, step, known):
    """Cut `path` to its length in the state, or else, if the state does not know it, before the first row or frame at or after `step`.

    A file that cannot be cut so is left as it is, with one line that says why.
    """
    if not os.path.isfile(path):
        return
    if known:
        end = known[1] if os.path.getsize(path) >= known[1] and _sum_before(path, known[1]) == known[2] else None
    else:
        end = _end_before(path, step)
    if end is None:
        why = f"another one than at step {step}" if known else "not a dump, nor a table whose first column is the step"
        print(f"dembark: file {path} is left as it is: it is {why}; look for what stands there twice", flush=True)
    else:
        os.truncate(path, end)


def _end_before(path, step):
    """Bytes of a dump or a table before the first row or frame at or after `step`, or the first that is not complete; None: unknown."""
    with open(path, "rb") as file:
        first = file.readline()
        if first == b"ITEM: TIMESTEP\n":
            return _end_of_frames(file, step)
        if re.match(rb"[#\s\"]*step[\"\s,]", first, re.IGNORECASE):
            return _end_of_rows(file, step)
    return None


def _end_of_frames(file, step):
    end, last = 0, -1
    while (text := file.readline()).endswith(b"\n"):
        now = _number(text)
        if now is None or now < last:
            return None
        last = now
        file.readline()
        rows = _number(file.readline())
        if now >= step or rows is None or sum(file.readline().endswith(b"\n") for _ in range(rows + 5)) < rows + 5:
            break
        end, line = file.tell(), file.readline()
        if not line.endswith(b"\n"):
            break
        if line != b"ITEM: TIMESTEP\n":
            return None
    return end


def _end_of_rows(file, step):
    end, cut, last = file.tell(), None, -1
    for line in file:
        if not line.endswith(b"\n"):
            break
        now = _number(line)
        if now is None or now <= last:
            return None
        last = now
        if now >= step and cut is None:
            cut = end
        end += len(line)
    return end if cut is None else cut


def run(steps, restart_every=None, resume=None, outputs=("time.csv", "energies.csv", "grains.dump", "contacts.dump"), base="state",
        saving=None, loaded=None):
    """Run the scene until step `steps` is written; say how many steps there are, and that it is finished.

    `restart_every` and `resume` are what the words behind the script say unless they are given. Every `restart_every` steps (0: never)
    the scene is saved as `base`.<step>.yade.gz. With `resume` the newest of these that is whole takes the scene's place, and what
    `outputs` (tables that begin with the step, and dumps) got after it is cut off, for it comes again. Call it when the scene is
    complete. It gets an IntegrationMonitor before its NewtonIntegrator if it has none
    and no clumps. A scene goes on from the saved copy of itself, so
    that a run that was killed and resumed is the same to the bit as one that was not, on one thread. `saving()` is called before the scene
    is saved, `loaded()` after it was resumed.
    """
    announce(steps)
    given = options()
    restart_every = given[0] if restart_every is None else restart_every
    resume = given[1] if resume is None else resume
    if resume:
        whole = [path for _, path in _states(base) if _is_whole(path)]
        if not whole:
            fail(f"resume=yes: there is no whole state {base}.<step>.yade.gz in this folder; start with restart_every > 0 first")
        O.load(whole[0], quiet=True)
        known = {one[0]: one for one in json.loads(O.tags["dembark_outputs"] if O.tags.has_key("dembark_outputs") else "[]")}
        for path in outputs:
            _cut(path, O.iter, known.get(path))
        exact = "exactly" if O.numThreads == 1 else f"approximately: sums of {O.numThreads} threads round differently each time"
        print(f"dembark: resumed at step {O.iter} {exact}", flush=True)
        if loaded:
            loaded()
    elif restart_every:
        # They could be mixed up later with those of this run.
        found = _states(base)
        whole = [path for _, path in found if _is_whole(path)]
        if whole:
            fail(f"there is a state of an earlier run, {whole[0]}; go on from it by resume=yes, move it away, or use another folder")
        _forget(found)
    watch()
    # The last row and frame are written in the step that starts from their state.
    end = steps + 1
    while O.iter < end:
        O.run(min(end, (O.iter // restart_every + 1) * restart_every if restart_every else end) - O.iter, True)
        if restart_every and O.iter < end:
            if saving:
                saving()
            _save(base, outputs)
            O.load(f"{base}.{O.iter}.yade.gz", quiet=True)
    finish()


def watch():
    """Add an IntegrationMonitor that only counts, with errors of velocities over 1 m/s, to a scene without one.

    Not where there are clumps, whose motion it cannot judge, or no spheres at all.
    """
    if any(body.isClump for body in O.bodies) or not any(isinstance(body.shape, Sphere) for body in O.bodies):
        return
    engines = O.engines
    places = [k for k, one in enumerate(engines) if isinstance(one, NewtonIntegrator)]
    if monitor() is None and len(places) == 1:
        O.engines = [*engines[: places[0]], IntegrationMonitor(speed=1.0, reaction="report"), *engines[places[0] :]]


def table(path, header):
    """A file to append rows to: with a header, or as a run left it that is resumed."""
    file = open(path, "a" if options()[1] else "w", encoding="ascii")
    if not options()[1]:
        file.write(header + "\n")
        file.flush()
    return file
