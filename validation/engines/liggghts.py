"""LIGGGHTS, in the program liggghts-dembark: LIGGGHTS-PUBLIC with dembark's styles."""

from __future__ import annotations

from dembark.validation.engines.base import EngineFacts
from dembark.validation.engines.input_script import InputScript


class Liggghts(InputScript):
    """LIGGGHTS's input script; MPI ranks of Open MPI."""

    facts = EngineFacts.read("liggghts")
