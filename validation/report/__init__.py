"""The report of a profile: one self-contained HTML file, the same as PDF, and the data of each figure as CSV."""

from .build import build

__all__ = ["build"]
