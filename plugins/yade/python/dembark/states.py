"""Runs with states to resume from: whole or not at all, and equal to the bit to a run that was not interrupted, on one thread."""

import gzip
import json
import os
import shutil
import sys
import zlib
from functools import cache

from yade import DembarkStates, IntegrationMonitor, NewtonIntegrator, Omega, Sphere
from yade.dembark.report import announce, fail, finish, monitor

O = Omega()
# How a word behind the script of a deck begins.
WORDS = ("restart_every=", "resume=")


@cache
def options():
    """What the words restart_every=<steps> and resume=yes|no behind the script say: (steps between saved states, 0 never; resume or not).

    Other words are the script's own; `parameters`, in decks, refuses them.
    """
    words = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word)
    every, resume = words.get("restart_every", "0"), words.get("resume", "no")
    if not every.isdecimal():
        fail(f"argument 'restart_every={every}': it must be a whole number of steps, 0 for none")
    if resume not in ("no", "yes"):
        fail(f"argument 'resume={resume}': it must be yes or no")
    return int(every), resume == "yes"


def _can_be_read(path):
    """Whether a packed file ends as it should."""
    try:
        with gzip.open(path) as file:
            while file.read(1 << 20):
                pass
    except (EOFError, OSError, zlib.error):
        return False
    return True


def _save(base, outputs):
    """Save the scene as `base`.<step>.yade.gz: complete or not at all, with its check sum next to it; keep the last two."""
    part = f"{base}.part.yade.gz"
    O.tags["dembark_outputs"] = json.dumps(DembarkStates.record(list(outputs)))
    # YADE would try for ever to write on a full disk. A packed body with its contacts takes about 150 bytes.
    if shutil.disk_usage(os.path.dirname(part) or ".").free < 1000 * len(O.bodies) + (1 << 20):
        fail(f"file {part} cannot be written: No space left on the disk")
    O.save(part, quiet=True)
    if not _can_be_read(part):
        fail(f"file {part} could not be written whole. No space left on the disk?")
    DembarkStates.keep(part, base, O.iter)


def run(steps, restart_every=None, resume=None, outputs=("time.csv", "energies.csv", "grains.dump", "contacts.dump"), base="state",
        saving=None, loaded=None):
    """Run the scene until step `steps` is written; say how many steps there are, and that it is finished.

    `restart_every` is what the words behind the script say unless it is given; `resume` must not contradict them. Every `restart_every`
    steps (0: never) the scene is saved as `base`.<step>.yade.gz. With `resume` the newest complete one replaces the scene, and what
    `outputs` (tables that begin with the step, and dumps) got after it is cut off, for it comes again. Call it when the scene is
    complete: it gets an IntegrationMonitor before its NewtonIntegrator, unless it has one, or has clumps. A scene goes on from the
    saved copy of itself, so that a run that was killed and resumed is the same to the bit as one that was not, on one thread.
    `saving()` is called before the scene is saved, `loaded()` after it was resumed.
    """
    announce(steps)
    every, resumes = options()
    if resume not in (None, resumes):
        # The writers have opened their files by the words.
        fail(f"run(resume={resume}) contradicts the words behind the script; start it with resume={'yes' if resume else 'no'}")
    restart_every = every if restart_every is None else restart_every
    if resumes:
        step = DembarkStates.newest(base)
        if step < 0:
            fail(f"resume=yes: there is no whole state {base}.<step>.yade.gz in this folder; start with restart_every > 0 first")
        O.load(f"{base}.{step}.yade.gz", quiet=True)
        for line in DembarkStates.cut(list(outputs), json.loads(O.tags["dembark_outputs"]), O.iter):
            print(f"dembark: {line}", flush=True)
        exact = "exactly" if O.numThreads == 1 else f"approximately: sums of {O.numThreads} threads round differently each time"
        print(f"dembark: resumed at step {O.iter} {exact}", flush=True)
        if loaded:
            loaded()
    elif restart_every:
        # They could be mixed up later with those of this run.
        step = DembarkStates.newest(base)
        if step >= 0:
            fail(f"there is a state of an earlier run, {base}.{step}.yade.gz; go on from it by resume=yes, move it away, or use another "
                 "folder")
        DembarkStates.remove(base)
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
