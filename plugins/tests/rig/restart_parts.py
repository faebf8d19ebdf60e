"""What fixes wrote into a restart file, changed as if another version had written it."""

from __future__ import annotations

import struct
from pathlib import Path

FORMAT = b"dembark1"
OTHER = "this restart file was written by another version of dembark; go on with that version, or give the fix another ID"


def cut(fix: str) -> str:
    """What a part that is too short is refused with."""
    return "the saved state is incomplete or damaged" if fix == "watch" else OTHER


def spoil(path: Path, fix: str, *, size: bool = False) -> None:
    """The part of a fix gets another format, or a size that is 8 bytes smaller."""
    data = bytearray(path.read_bytes())
    at = data.index(FORMAT, data.index(fix.encode() + b"\0"))
    if size:
        (bytes_,) = struct.unpack_from("<Q", data, at + len(FORMAT))
        struct.pack_into("<Q", data, at + len(FORMAT), bytes_ - 8)
    else:
        data[at:at + len(FORMAT)] = b"dembark0"
    path.write_bytes(data)
