"""Instruments: numbers with intervals from the files of a run, without judgement."""
