"""Reading what the engines wrote and turning it into fields: plain numpy arrays in SI units, whichever engine ran.

`GrainsDump`, `ContactsDump` and `read_times` read a run folder; `universe` opens its grains in MDAnalysis; `profiles` and `stress`
hold the fields.
"""

from dembark.postproc.contacts import ContactFrame, ContactsDump
from dembark.postproc.dumptext import DumpError, DumpWarning, TextDump, open_dump
from dembark.postproc.grains import GrainFrame, GrainsDump
from dembark.postproc.history import read_times
from dembark.postproc.trajectory import universe

__all__ = ["ContactFrame", "ContactsDump", "DumpError", "DumpWarning", "GrainFrame", "GrainsDump", "TextDump", "open_dump", "read_times",
           "universe"]
