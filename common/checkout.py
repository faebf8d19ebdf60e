"""The source tree that this package runs from."""

from __future__ import annotations

from pathlib import Path


def checkout() -> Path | None:
    """Top of the source tree this package runs from; None for an installed copy."""
    root = Path(__file__).resolve().parents[1]
    return root if (root / "pyproject.toml").is_file() else None
