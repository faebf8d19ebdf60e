"""Verdicts: quantities with intervals beside their references, engines beside each other, and the tally of all of it."""
