"""Runs: what there is to run, what has run (one table), and one executor that runs it, here or on a cluster."""
