"""Tables that users write: CSV files with a header."""

from __future__ import annotations

import csv
from itertools import dropwhile
from pathlib import Path

from .errors import DembarkError

# The number of a row's line, and its texts by the names of the columns.
NumberedRow = tuple[int, dict[str, str]]


def read_table(path: Path) -> tuple[list[str], list[NumberedRow]]:
    """The names of the columns of a CSV file, and its rows; blank lines, and lines before the header that begin with #, are left out, and a
    row that ends early has empty texts.

    DembarkError for a file that is no text, for a name that stands twice, and for a row with more fields than the header: where commas
    are both decimal signs and separators, each number would be another one.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, skipinitialspace=True)
            found = [(reader.line_num, row) for row in reader if any(word.strip() for word in row)]
    except UnicodeDecodeError:
        raise DembarkError(f"{path} is not UTF-8 text", "", "save it as CSV UTF-8") from None
    except (OSError, csv.Error) as error:
        raise DembarkError(f"{path} cannot be read", getattr(error, "strerror", None) or str(error)) from None
    found = list(dropwhile(lambda one: one[1][0].startswith("#"), found))
    if not found:
        return [], []
    names = [word.strip() for word in found[0][1]]
    if twice := next((name for name in names if name and names.count(name) > 1), ""):
        raise DembarkError(f"{path} has two columns {twice!r}", "", "give each a name of its own")
    for line, row in found[1:]:
        if any(word.strip() for word in row[len(names):]):
            raise DembarkError(f"{path}, line {line}, has {len(row)} fields, the header {len(names)}", "",
                               "separate fields by commas, and write the decimal point")
    return names, [(line, dict(zip(names, [*row, *[""] * len(names)], strict=False))) for line, row in found[1:]]
