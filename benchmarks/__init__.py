"""Measurements of dembark's styles beside the stock ones, in the same run and on the same settled bed."""
