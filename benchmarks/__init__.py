"""Measurements of dembark's styles and of the stock ones, in the same run and on the same settled bed."""
