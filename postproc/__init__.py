"""Reading what the engines wrote and turning it into fields: plain numpy arrays in SI units, whichever engine ran.

`GrainsDump`, `ContactsDump` and `read_times` read a run folder; `universe` opens its grains in MDAnalysis; `profiles` and `stress`
hold the fields.
"""

from dembark.postproc.contacts import ContactFrame, ContactsDump
from dembark.postproc.dumptext import DumpError, TextDump
from dembark.postproc.grains import GrainFrame, GrainsDump, universe
from dembark.postproc.history import read_times

__all__ = ["ContactFrame", "ContactsDump", "DumpError", "GrainFrame", "GrainsDump", "TextDump", "read_times", "universe"]
