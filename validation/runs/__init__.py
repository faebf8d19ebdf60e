"""Runs: simulation of one run, the executor, here or on a cluster, and the steps after the runs."""
