"""Lines of text dumps, and STL files, as arrays."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


def skip(text: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)], begin: int, end: int, lines: int) -> tuple:
    """Pass over complete lines; (position, lines, fault, column)."""

def parse(text: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)], begin: int, end: int, place: Sequence[int], values: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], row: int, threads: int = 0) -> tuple:
    """
    Fill rows of `values` from `row` on; (position, rows, fault, column) with the fault of the row after them, or 0.
    """

def read_stl(path: str, precision: float) -> tuple:
    """
    Triangles of an STL file: (corners, solid of each, names, left out without area, left out as given again).
    """
