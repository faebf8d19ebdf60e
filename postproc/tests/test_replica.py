"""A replica: what it wrote is read once, and bodies are counted alike in every engine."""

import pytest

from dembark.postproc import DumpError
from dembark.postproc.impacts import COLUMNS
from dembark.postproc.replica import Replica, cached_per_replica


def test_what_was_read_is_kept_with_the_replica(tmp_path):
    calls = []

    @cached_per_replica
    def read(replica):
        calls.append(replica)
        return len(calls)

    one, other = Replica(tmp_path, {}), Replica(tmp_path, {})
    assert [read(one), read(one), read(other), read(one)] == [1, 1, 2, 1]


def test_a_record_without_derived_numbers_has_none(tmp_path):
    assert Replica(tmp_path, {}).derived == {}
    assert Replica(tmp_path, {"derived": {"steps": 7}}).derived["steps"] == 7


def test_bodies_are_counted_from_one_in_every_engine(tmp_path):
    header, rest = f"# {' '.join(COLUMNS)}\n", " 0" * (len(COLUMNS) - 2)
    (tmp_path / "impacts.txt").write_text(f"{header}0 3{rest}\n1 -2{rest}\n")
    assert Replica(tmp_path, {"impact_id_offset": 1}).impacts()[:, :2].tolist() == [[1, 4], [2, -2]]
    assert Replica(tmp_path, {}).impacts()[:, :2].tolist() == [[0, 3], [1, -2]]
    (tmp_path / "impacts.txt").write_text(f"{header}0 3 0\n")
    with pytest.raises(DumpError, match="17 numbers"):
        Replica(tmp_path, {}).impacts()


def test_frames_are_mapped_in_order_and_few_at_a_time(monkeypatch, tmp_path):
    ahead = []

    def frames(_):
        for number in range(200):
            ahead.append(number)
            yield number, -number

    monkeypatch.setattr(Replica, "paired_frames", frames)
    mapped = Replica(tmp_path, {}).mapped(lambda grains, contacts: grains - contacts)
    assert next(mapped) == (0, 0) and len(ahead) < 200
    assert list(mapped) == [(number, 2 * number) for number in range(1, 200)]


def test_what_fails_in_a_frame_is_raised(monkeypatch, tmp_path):
    monkeypatch.setattr(Replica, "paired_frames", lambda _: iter([(1, 1), (2, 0), (3, 1)]))
    with pytest.raises(ZeroDivisionError):
        list(Replica(tmp_path, {}).mapped(lambda grains, contacts: grains / contacts))
