"""Plates below a held grain that get their motions when the engine has run for a while, with another time step before."""

from rig import vessel

RADIUS, OVERLAP = 0.004, 2e-4
GRAIN = (0.005, -0.003, RADIUS - OVERLAP)
PLATE = vessel.rectangle((-0.01, -0.01, 0.0), (0.02, 0.0, 0.0), (0.0, 0.02, 0.0))
# Steps of STEPS[0] s, then of STEPS[1] s; the motions come at BEGUN. They run in two parts of PART steps; every EVERYth is looked at.
STEPS, COUNTS, PART, EVERY = (1e-5, 5e-6), (500, 1000), 200, 20
BEGUN = sum(h * n for h, n in zip(STEPS, COUNTS, strict=True))
TABLE = "0 0 0 0\n5e-4 0 0 2e-5\n1.5e-3 1e-5 0 5e-5\n"
MOTIONS = [
    "harmonic amplitude 0 0 1e-4 frequency 50 ramp 0",
    "harmonic amplitude 0 0 1e-4 frequency 500 ramp 0.5",
    "circular first 0 0 5e-5 second 1e-4 0 0 frequency 200 ramp 0",
    "uniform velocity 0 0 0.01 acceleration 0 0 2",
    "rotation point 0 0 0 axis 0 0 1 rate 3 acceleration 5",
    "rocking point 0 0 0 axis 0 1 0 angle 0.01 frequency 100 ramp 0",
    "jolts shape half_sine acceleration 0 0 20 duration 5e-4",
    "table file late.csv",
    # Given starts, before and after, and terms together.
    "uniform velocity 0 0 0.01 start 0",
    "harmonic amplitude 0 0 1e-4 frequency 60 ramp 0 start 0.002",
    "uniform velocity 0 0 0.02 start 0.0105",
    "harmonic amplitude 0 0 5e-5 frequency 50 ramp 0 rotation point 0 0 0 axis 0 0 1 rate 3 uniform velocity 0 0 0.005 start 0.001",
]
