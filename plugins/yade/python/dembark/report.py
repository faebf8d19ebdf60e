"""Errors in one line, and what a run says of itself."""

import sys
import threading

from yade import IntegrationMonitor, Omega

O = Omega()


def fail(line, code=2):
    """Raise RuntimeError with one line about what is wrong, where and what would be right, as the classes of the plugin do.

    A script that runs by `yade -x` ends with this line on stderr and `code`; a session goes on.
    """
    sys.stdout.flush()
    # The start script reads this. What ends YADE's own thread is written into its log.
    sys.dembark_failure = f"dembark: {line}", code, threading.current_thread() is not threading.main_thread()
    raise RuntimeError(sys.dembark_failure[0])


def _show(kind, error, trace, show=sys.excepthook):
    # A PyRunner shows the exception and quotes it, with its trace, in the one that it throws: the line is enough.
    if str(error) == getattr(sys, "dembark_failure", ("",))[0]:
        sys.last_traceback = None
    else:
        show(kind, error, trace)


sys.excepthook = _show


def announce(steps):
    """First line of a run: its number of steps and the time step."""
    print(f"dembark: steps {steps} time_step {O.dt:.17g}", flush=True)


def monitor():
    """The scene's IntegrationMonitor, or None."""
    return next((one for one in O.engines if isinstance(one, IntegrationMonitor)), None)


def finish():
    """Last lines of a run that came to its end."""
    watch = monitor()
    if watch is not None:
        found = watch.figures()
        print("dembark: integration", *(f"{name} {found[name]:.15g}" for name in ("position", "velocity", "spin", "contact_steps")),
              flush=True)
    print("dembark: finished", flush=True)
