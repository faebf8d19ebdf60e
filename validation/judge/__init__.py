"""Verdicts: quantities with intervals against their references, comparisons of engines, and the tally of both."""
