"""Finnie's wear: the closed form against the motion of the grain from which he derived it, and its known features."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from dembark.postproc.wear import angle_function, removed_volume

MASS, SPEED, PRESSURE, WIDTH, K, PSI = 2e-4, 1.3, 8e8, 1e-4, 2.0, 2.0


def cut_by_the_motion(angle: float) -> float:
    """Volume (m^3) that the edge of a grain cuts, from its motion: the forces K p psi b y along the normal and p psi b y along the surface
    act at the edge, y deep in the surface of width b, and turn the grain about its centre (inertia m r^2 / 2)."""
    pace = np.sqrt(K * PRESSURE * PSI * WIDTH / MASS)
    depth = lambda t: SPEED * np.sin(angle) / pace * np.sin(pace * t)
    # Both the centre and the turning slow the edge, by three times what slows the centre alone.
    edge = lambda t: SPEED * np.cos(angle) - 3.0 / K * SPEED * np.sin(angle) * (1.0 - np.cos(pace * t))
    out = np.pi / pace
    end = out if edge(out) >= 0.0 else brentq(edge, 0.0, out)
    return float(WIDTH * quad(lambda t: depth(t) * edge(t), 0.0, end, epsabs=0.0, epsrel=1e-10)[0])


@pytest.mark.parametrize("degrees", [2.0, 10.0, 18.0, 18.4349, 19.0, 30.0, 60.0, 85.0])
def test_the_closed_form_is_the_cut_of_a_single_grain(degrees: float) -> None:
    angle = np.radians(degrees)
    assert removed_volume(MASS, SPEED, angle, PRESSURE) == pytest.approx(cut_by_the_motion(angle), rel=1e-6)


def test_wear_is_largest_at_17_degrees_and_none_along_the_normal() -> None:
    angles = np.radians(np.linspace(0.0, 90.0, 9001))
    found = angle_function(angles)
    # tan 2a = K / 3 at the top.
    assert np.degrees(angles[found.argmax()]) == pytest.approx(0.5 * np.degrees(np.arctan(2.0 / 3.0)), abs=0.02)
    assert found[0] == 0.0 and found[-1] == pytest.approx(0.0, abs=1e-30)
    assert np.abs(np.diff(found)).max() < 1e-3  # both branches meet


@pytest.mark.parametrize("wrong", [-0.1, 1.6, np.nan])
def test_an_angle_out_of_range_is_refused(wrong: float) -> None:
    with pytest.raises(ValueError, match="angle must be from 0 to pi/2"):
        angle_function(wrong)


def test_a_pressure_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="flow_pressure must be > 0 Pa, not 0"):
        removed_volume(1.0, 1.0, 0.3, 0.0)
