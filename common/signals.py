"""Signals that end the program."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

from .errors import Interrupted

ENDING = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def interruptible(*numbers: int) -> Iterator[None]:
    """In the block these signals end what is under way at once, as Interrupted, whatever they did before; for the main thread."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in numbers}
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted("interrupted") from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
