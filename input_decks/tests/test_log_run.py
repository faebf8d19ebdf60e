"""Files of a run of logs are read as arrays, or refused."""

import pytest

from dembark.input_decks.common.log_run import read_touches
from dembark.postproc import DumpError


def test_touches_are_read_and_foreign_files_refused(tmp_path):
    head = "ITEM: TIMESTEP\n7\nITEM: NUMBER OF ENTRIES\n1\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ENTRIES "
    columns = " ".join(f"f_impacts[{i}]" for i in range(1, 14))
    (tmp_path / "contacts.dump").write_text(head + columns + "\n2 -1 0 1 0 -1e-5 500 3 0 0 0.1 0 0\n")
    (found,) = read_touches(tmp_path / "contacts.dump")
    assert (found.step, found.ids.tolist(), found.forces.tolist(), found.friction.tolist()) == (7, [[2, -1]], [500.0], [[3.0, 0.0, 0.0]])
    (tmp_path / "contacts.dump").write_text(head + "a b c\n1 2 3\n")
    with pytest.raises(DumpError, match="3 columns instead of 13"):
        read_touches(tmp_path / "contacts.dump")
