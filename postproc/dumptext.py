"""Dumps frame by frame, as numpy arrays in double precision: the names that the rest of the package uses."""

from dembark.postproc.dumps.frames import Dump, DumpError, DumpWarning, RawFrame
from dembark.postproc.dumps.opening import open_dump
from dembark.postproc.dumps.text import TextDump

__all__ = ["Dump", "DumpError", "DumpWarning", "RawFrame", "TextDump", "open_dump"]
