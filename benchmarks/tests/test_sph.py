"""The benchmark of the SPH solver, on a cube of a few particles."""

import shutil

import pytest

from benchmarks import sph


@pytest.mark.skipif(shutil.which("liggghts") is None, reason="no stock LIGGGHTS")
def test_every_subject_is_measured():
    rows = sph.measure(16, 20, 1)
    names = [row["subject"] for row in rows]
    assert names[:3] == ["stock LIGGGHTS", "dembark in LIGGGHTS, cubic spline, delta = 0.1", "dembark in LIGGGHTS with a free body"]
    assert len(names) == len(set(names)) >= 7
    assert rows[0]["rate_ratio_median"] == 1.0
    assert all(row["rate_median"] > 0.0 for row in rows)
