"""Files of grains and contacts as frames of numbers: text dumps and binary dumps, plain or gzipped, and VTK files."""

from .frames import Dump, DumpError, DumpWarning, RawFrame
from .opening import open_dump
from .text import TextDump

__all__ = ["Dump", "DumpError", "DumpWarning", "RawFrame", "TextDump", "open_dump"]
