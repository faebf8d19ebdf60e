"""LIGGGHTS, in the program liggghts-dembark: LIGGGHTS-PUBLIC with dembark's styles."""

from __future__ import annotations

from .base import EngineFacts
from .input_script import InputScript


class Liggghts(InputScript):
    """LIGGGHTS's input script; MPI ranks of Open MPI."""

    facts = EngineFacts.read("liggghts")
