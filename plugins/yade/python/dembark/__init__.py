"""What dembark's decks, and scripts, need inside YADE: scenes, logs, dumps and histories, states to resume from.

The files have the schema of the LIGGGHTS decks. Standard library only; SI units.
"""

from yade.dembark.frames import FrameWriter, StepMeans
from yade.dembark.logs import LogWriter, drum, log, log_loop, log_wall, logs
from yade.dembark.report import fail, finish
from yade.dembark.scene import (
    Recorder,
    begin,
    box,
    contact_loop,
    engine_loop,
    grains,
    materials,
    packing,
    pairs,
    parameters,
    periodic,
    plane,
    planes,
    slab_loop,
)
from yade.dembark.states import options, run, table
from yade.dembark.writers import DumpWriter, EnergyWriter, HistoryWriter, energies

__all__ = [
    "DumpWriter", "EnergyWriter", "FrameWriter", "HistoryWriter", "LogWriter", "Recorder", "StepMeans", "begin", "box", "contact_loop",
    "drum", "energies", "engine_loop", "fail", "finish", "grains", "log", "log_loop", "log_wall", "logs", "materials", "options",
    "packing", "pairs", "parameters", "periodic", "plane", "planes", "run", "slab_loop", "table",
]
