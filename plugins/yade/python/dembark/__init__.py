"""What dembark's decks, and scripts, need inside YADE: scenes, logs, dumps and histories, states to resume from.

The files have the schema of the LIGGGHTS decks. Standard library only; SI units.
"""

from yade.dembark.logs import LogWriter, drum, log
from yade.dembark.report import announce, fail, finish
from yade.dembark.scene import (
    Recorder, contact_loop, engine_loop, grains, materials, packing, pairs, parameters, plane, spanning,
)
from yade.dembark.states import options, run
from yade.dembark.writers import DumpWriter, EnergyWriter, HistoryWriter, energies

__all__ = [
    "DumpWriter", "EnergyWriter", "HistoryWriter", "LogWriter", "Recorder", "announce", "contact_loop", "drum", "energies", "engine_loop",
    "fail", "finish", "grains", "log", "materials", "options", "packing", "pairs", "parameters", "plane", "run", "spanning",
]
