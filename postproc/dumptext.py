"""Dumps frame by frame, as numpy arrays in double precision: the names that the rest of the package uses."""

from .dumps.frames import Dump, DumpError, DumpWarning, RawFrame
from .dumps.opening import open_dump
from .dumps.text import TextDump

__all__ = ["Dump", "DumpError", "DumpWarning", "RawFrame", "TextDump", "open_dump"]
