"""What dembark's decks, and scripts, need inside YADE: scenes, logs, dumps and histories, states to resume from.

The files have the schema of the LIGGGHTS decks. Standard library only; SI units.
"""

from yade.dembark.balance import Balance
from yade.dembark.cells import StressedCell
from yade.dembark.fluids import CubesRecorder, FluidRecorder, FluidWriter, fluid, fluid_engine, fluid_loop, lattice, tank_walls
from yade.dembark.frames import FrameWriter, StepMeans
from yade.dembark.friction import set_friction
from yade.dembark.logs import LogWriter, drum, log, log_loop, log_wall, logs
from yade.dembark.machines import PartWriter, TouchWriter, machine_history
from yade.dembark.moving import mesh, motion, motion_columns, motion_values
from yade.dembark.plates import LoadedPlates
from yade.dembark.report import fail, finish
from yade.dembark.scene import (
    Recorder,
    begin,
    block,
    box,
    contact_loop,
    engine_loop,
    grains,
    materials,
    mesh_loop,
    packing,
    pairs,
    parameters,
    periodic,
    plane,
    planes,
    slab_loop,
)
from yade.dembark.sorts import of_sorts, sort_materials
from yade.dembark.states import options, run, table
from yade.dembark.writers import DumpWriter, EnergyWriter, HistoryWriter, energies

__all__ = [
    "Balance", "CubesRecorder", "DumpWriter", "EnergyWriter", "FluidRecorder", "FluidWriter", "FrameWriter", "HistoryWriter",
    "LoadedPlates", "LogWriter", "PartWriter", "Recorder", "StepMeans", "StressedCell", "TouchWriter", "begin", "block", "box",
    "contact_loop", "drum", "energies", "engine_loop", "fail", "finish", "fluid", "fluid_engine", "fluid_loop", "grains", "lattice", "log",
    "log_loop", "log_wall", "logs", "machine_history", "materials", "mesh", "mesh_loop", "motion", "motion_columns", "motion_values",
    "of_sorts", "options", "packing", "pairs", "parameters", "periodic", "plane", "planes", "run", "set_friction", "slab_loop",
    "sort_materials", "table", "tank_walls",
]
