"""Exact motions of small set-ups, solved without any of the engines' code: what runs of deterministic cases are compared with."""
