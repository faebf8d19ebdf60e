"""Reading what the engines wrote and turning it into fields: plain numpy arrays in SI units, whichever engine ran.

`GrainsDump`, `ContactsDump` and `read_times` read a run folder; `universe` opens its grains in MDAnalysis; `fields` holds
coarse graining; `profiles` and `stress` sum over slabs.
"""

from typing import TYPE_CHECKING, Any

from .contacts import ContactFrame, ContactsDump
from .dumps import DumpError, DumpWarning, TextDump, open_dump
from .grains import GrainFrame, GrainsDump
from .history import read_times

if TYPE_CHECKING:
    from .trajectory import universe

__all__ = ["ContactFrame", "ContactsDump", "DumpError", "DumpWarning", "GrainFrame", "GrainsDump", "TextDump", "open_dump", "read_times",
           "universe"]


def __getattr__(name: str) -> Any:
    """`universe`, with MDAnalysis, which takes longer to import than all else here."""
    if name != "universe":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .trajectory import universe

    return universe
