"""Text dumps: numbers to the last bit, every frame that is there, and one line about what is wrong."""

import gzip
import itertools
import pickle
import warnings

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from dembark import _dumps
from dembark.postproc import DumpError, DumpWarning, TextDump, open_dump
from dembark.postproc.dumps import source

HEAD = "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS pp ff pp\n0 1\n0 2\n-1 1\nITEM: ATOMS {columns}\n"


def frame(step, rows, columns="id x y", count=None):
    """Text of one frame."""
    lines = "".join(" ".join(str(value) for value in row) + " \n" for row in rows)
    return HEAD.format(step=step, count=len(rows) if count is None else count, columns=columns) + lines


def plain(step, count=3):
    """A frame whose numbers tell where they are from."""
    return frame(step, [(number + 1, step + 0.5, number) for number in range(count)])


@pytest.fixture
def write(tmp_path):
    def writer(*frames, name="a.dump"):
        path = tmp_path / name
        path.write_bytes("".join(frames).encode())
        return path

    return writer


def read_words(words, threads=1):
    text = np.frombuffer(("\n".join(words) + "\n").encode(), np.uint8)
    values = np.empty((len(words), 1))
    _, rows, fault, _ = _dumps.parse(text, 0, len(text), [0], values, 0, threads)
    return values[:rows, 0], fault


@settings(max_examples=100)
@given(st.lists(st.tuples(st.floats(-1e300, 1e300), st.sampled_from(["%.17g", "%.10g", "%g", "%.8e", "%.3f", "%.25g"])),
                min_size=1, max_size=30))
def test_numbers_are_the_nearest_doubles(pairs):
    words = [form % value for value, form in pairs]
    values, fault = read_words(words)
    assert fault == 0
    np.testing.assert_array_equal(values.view(np.int64), np.array([float(word) for word in words]).view(np.int64))


@settings(max_examples=100)
@given(st.integers(0, 10**19 - 1), st.integers(-30, 30))
def test_long_mantissas_round_once(mantissa, power):
    # Near half-way between doubles a second rounding would show.
    words = [f"{mantissa}e{power}", f"-{mantissa + 1}e{power}", f"0.{mantissa:019d}e{power}"]
    np.testing.assert_array_equal(read_words(words)[0], [float(word) for word in words])


@settings(max_examples=60)
@given(st.integers(2**52, 2**53 - 1), st.integers(1, 10))
def test_ties_round_to_even(mantissa, bits):
    # The middle between two doubles, and its neighbours on both sides.
    middle = (2 * mantissa + 1) << (bits - 1)
    words = [f"{10 * middle + shift}e-1" for shift in (-1, 0, 1)] + [f"{middle}.0", f"{middle}"]
    np.testing.assert_array_equal(read_words(words)[0], [float(word) for word in words])


@pytest.mark.parametrize("word", ["-0", "+3", ".5", "5.", "0e999999", "1e-400", "-1e-310", "123456789012345678901234567890", "00012.50"])
def test_odd_numbers(word):
    values, fault = read_words([word])
    assert fault == 0
    assert values.view(np.int64)[0] == np.array([float(word)]).view(np.int64)[0]


@pytest.mark.parametrize(("word", "fault"), [("nan", 4), ("-nan", 4), ("inf", 4), ("1e400", 4), ("C", 3), ("-", 3), ("1e", 3), ("--1", 3),
                                             ("0x10", 3), ("1.5x", 3), (".", 3), ("1 2", 2)])
def test_what_is_no_number(word, fault):
    values, found = read_words(["1", word, "2"])
    assert (values.tolist(), found) == ([1.0], fault)


def test_threads_do_not_change_the_table():
    rng = np.random.default_rng(3)
    table = rng.normal(size=(40000, 3)) * 10.0 ** rng.integers(-8, 8, (40000, 3))
    text = np.frombuffer("".join(f"{a:.12g} {b:.17g}  {c:.6g} \r\n" for a, b, c in table).encode(), np.uint8)
    results = []
    for threads in (1, 2, 5):
        values = np.full((40000, 3), np.nan)
        end, rows, fault, _ = _dumps.parse(text, 0, len(text), [2, 1, 0], values, 0, threads)
        assert (end, rows, fault) == (len(text), 40000, 0)
        results.append(values.tobytes())
    assert results[0] == results[1] == results[2]
    np.testing.assert_array_equal(np.frombuffer(results[0]).reshape(-1, 3)[:, 1], table[:, 1])


def test_only_the_rows_that_are_wanted_are_read():
    text = np.frombuffer(b"1\n2\n3\n4", np.uint8)
    values = np.zeros((2, 1))
    assert _dumps.parse(text, 0, 7, [0], values, 0, 2) == (4, 2, 0, 1)
    assert _dumps.parse(text, 4, 7, [0], values, 0, 2)[:3] == (6, 1, 0)
    assert _dumps.skip(text, 0, 7, 9)[:3] == (6, 3, 0)
    with pytest.raises(IndexError):
        _dumps.parse(text, 0, 8, [0], values, 0, 1)
    with pytest.raises(IndexError):
        _dumps.parse(text, 0, 7, [1], values, 0, 1)


def test_frames_of_different_sizes(write):
    dump = TextDump(write(plain(0, 3), plain(10, 0), plain(20, 5)))
    assert (dump.steps.tolist(), dump.counts.tolist()) == ([0, 10, 20], [3, 0, 5])
    assert [len(one.values) for one in dump] == [3, 0, 5]
    assert dump.frame(2).values[4].tolist() == [5.0, 20.5, 4.0]
    assert (dump.frame(0).periodic.tolist(), dump.frame(0).high.tolist()) == ([True, False, True], [1.0, 2.0, 1.0])
    assert dump.frame(2, ("y", "id")).values[4].tolist() == [4.0, 5.0]
    with pytest.raises(IndexError):
        dump.frame(3)


def test_small_windows_read_the_same(write, monkeypatch):
    path = write(*(plain(10 * number, 40 + number) for number in range(9)))
    whole = [one.values for one in TextDump(path)]
    monkeypatch.setattr(source, "_WINDOW", 700)
    for dump in (TextDump(path), TextDump(path, stream=True)):
        for one, other in zip(dump, whole, strict=True):
            np.testing.assert_array_equal(one.values, other)


def test_units_time_tilt_words_and_line_ends(write):
    text = (
        "ITEM: UNITS\nsi\nITEM: TIME\n0.25\nITEM: TIMESTEP\n7\nITEM: NUMBER OF ENTRIES\n2\nITEM: BOX BOUNDS xy xz yz pp pp ff\n"
        "-0.3 1.2 0.2\n0 1.1 -0.3\n0 2 0.1\nITEM: ENTRIES id element x\n1 Fe 0.5\n2 I 1\n"
    )
    raw = TextDump(write(text.replace("\n", "\r\n"))).frame(0)
    assert (raw.units, raw.time, raw.columns) == ("si", 0.25, ("id", "x"))
    assert raw.values.tolist() == [[1.0, 0.5], [2.0, 1.0]]
    np.testing.assert_allclose([*raw.low, *raw.high], [0.0, 0.0, 0.0, 1.0, 1.0, 2.0], atol=1e-15)
    np.testing.assert_allclose(raw.tilt, [0.2, -0.3, 0.1])


@pytest.mark.parametrize("stream", [False, True])
@pytest.mark.parametrize("cut", [3, 17, 40, 110])
def test_cut_off_last_frame(write, cut, stream):
    path = write(plain(0), plain(10))
    path.write_bytes(path.read_bytes()[:-cut])
    with pytest.raises(DumpError, match=r"a\.dump, frame 2: truncated.*skip_truncated=True"):
        list(TextDump(path, stream=stream))
    dump = TextDump(path, skip_truncated=True, stream=stream)
    assert [one.step for one in dump] == [0]
    assert dump.remarks == (dump.truncated,)
    assert "\n" not in dump.truncated


def test_file_that_grows_is_looked_at_anew(write):
    path = write(plain(0), plain(10)[:-6])
    dump = TextDump(path, skip_truncated=True)
    assert len(dump) == 1
    path.write_text(plain(0) + plain(10) + plain(20))
    assert len(dump) == 1
    dump.refresh()
    assert (len(dump), dump.truncated) == (3, "")


def test_restarted_run_keeps_the_later_frames(write):
    again = [frame(step, [(1, 9.0, 9.0)]) for step in (10, 20)]
    path = write(plain(0), plain(10), plain(20), *again, plain(30))
    with pytest.warns(DumpWarning, match="steps go back in frame 4.* 2 that a resumed run replaces were left out") as caught:
        dump = TextDump(path)
    assert dump.remarks == (str(caught[0].message),)
    assert dump.steps.tolist() == [0, 10, 20, 30]
    assert [len(one.values) for one in dump] == [3, 1, 1, 3]
    streamed = iter(TextDump(path, stream=True))
    assert [next(streamed).step for _ in range(3)] == [0, 10, 20]
    with pytest.raises(DumpError, match=r"frame 4: step 10 comes after step 20"):
        next(streamed)


def test_frames_of_a_run_that_was_given_up_do_not_follow_those_of_the_resumed_one(write):
    """Resumed at step 10 and killed at once: steps 20 and 30 are of the run before."""
    path = write(plain(0), plain(10), plain(20), plain(30), frame(10, [(1, 9.0, 9.0)]))
    with pytest.warns(DumpWarning, match="3 that a resumed run replaces"):
        assert TextDump(path).steps.tolist() == [0, 10]


def test_a_run_resumed_between_two_frames_replaces_what_follows(write):
    path = write(plain(0), plain(10), plain(20), plain(30), *(frame(step, [(1, 9.0, 9.0)]) for step in (15, 25, 35)))
    with pytest.warns(DumpWarning, match="steps go back in frame 5; frames were sorted by step, 2 that a resumed run replaces"):
        dump = TextDump(path)
    assert dump.steps.tolist() == [0, 10, 15, 25, 35] and [len(one.values) for one in dump] == [3, 3, 1, 1, 1]


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(given_up=st.lists(st.integers(0, 200), min_size=3, max_size=9, unique=True).map(sorted), state=st.integers(0, 200),
       spacing=st.integers(1, 40), count=st.integers(1, 9))
def test_a_resumed_run_in_a_file_of_its_own_replaces_what_follows(write, given_up, state, spacing, count):
    """Whether or not it has a step of the run before."""
    assume(given_up[1] <= state < given_up[-1])
    resumed = [state + spacing * number for number in range(count)]
    files = [write(*map(plain, given_up), name="1.dump"), write(*(plain(step, 2) for step in resumed), name="2.dump")]
    left = [step for step in given_up if step < state]
    with pytest.warns(DumpWarning, match=f"2.dump: steps go back in frame 1; .* {len(given_up) - len(left)} that a resumed run replaces"):
        dump = open_dump(files)
    assert dump.steps.tolist() == left + resumed and dump.counts.tolist() == [3] * len(left) + [2] * count


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.integers(0, 200), min_size=2, max_size=24, unique=True).map(sorted), st.integers(2, 4), st.booleans(), st.randoms())
def test_frames_dealt_to_files_in_turn_or_in_parts_are_all_there(tmp_path, steps, count, turns, order):
    """One after another to each of the files, or in parts whose files have any names; one frame each, too."""
    size = -(-len(steps) // count)
    parts = [part for number in range(count) if (part := steps[number::count] if turns else steps[number * size:(number + 1) * size])]
    names = list(range(len(parts)))
    order.shuffle(names)
    files = []
    for name, part in zip(names, parts, strict=True):
        files.append(tmp_path / f"{name}.dump")
        files[-1].write_text("".join(map(plain, part)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dump = open_dump(files)
    assert dump.steps.tolist() == steps and "replace" not in str(dump.remarks)


@pytest.mark.parametrize(("cut", "skip"), [(5, False), (9, False), (12, False), (27, True), (32, True), (60, True)])
def test_run_killed_within_a_line_and_restarted(write, cut, skip):
    whole = plain(10, 2)
    path = write(plain(0), whole[:-cut], whole, plain(20))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dump = TextDump(path, skip_truncated=skip)
    assert dump.steps.tolist() == [0, 10, 20]
    assert [one.values.shape[0] for one in dump] == [3, 2, 3]


def test_streaming_goes_on_after_a_cut_off_frame_inside(write):
    path = write(plain(0), plain(10)[:-20], plain(10), plain(20))
    with pytest.raises(DumpError, match="frame 2: truncated, it has 1 of 3 lines"):
        next(itertools.islice(TextDump(path, stream=True), 1, None))
    dump = TextDump(path, stream=True, skip_truncated=True)
    streamed = iter(dump)
    assert [next(streamed).step for _ in range(3)] == [0, 10, 20] and "frame 2" in dump.truncated


def test_columns_of_one_name_and_a_count_beyond_all_memory(write):
    dump = TextDump(write(frame(0, [(1, 2, 3)], columns="id x x")))
    assert dump.frame(0).values.tolist() == [[1.0, 2.0, 3.0]]
    assert dump.frame(0, ("x", "id")).values.tolist() == [[2.0, 1.0]]
    path = write(frame(0, [(1, 2, 3)], count=10**18))
    with pytest.raises(DumpError, match="truncated, it has 1 of 1000000000000000000"):
        TextDump(path)


def test_frames_out_of_order_are_sorted(write):
    with pytest.warns(DumpWarning, match="frames were sorted by step$"):
        dump = TextDump(write(plain(30), plain(40), plain(0), plain(10)))
    assert [one.step for one in dump] == [0, 10, 30, 40]


@pytest.mark.parametrize(
    ("rows", "message"),
    [([(1, 2, 3), (2, "nan", 3)], r"frame 2, line 23: column x holds a number that is not finite, 'nan'"),
     ([(1, 2, 3), (2, 5, "-inf")], r"line 23: column y holds a number that is not finite, '-inf'"),
     ([(1, "Fe", 3)], r"line 22: column x holds no number, 'Fe'"), ([(1, 2, 3), (1, 2)], r"line 23: a line does not hold 3 numbers but 2"),
     ([(1, 2, 3), (1, 2, 3, 4)], r"line 23: a line does not hold 3 numbers but 4"),
     ([(1, 2, 3), ()], r"line 23: a line does not hold 3 numbers but 0")],
)
@pytest.mark.parametrize("stream", [False, True])
def test_what_cannot_be_read_is_told_with_its_line(write, rows, message, stream):
    dump = TextDump(write(plain(0, 3), frame(10, rows)), stream=stream)
    with pytest.raises(DumpError, match=message) as caught:
        list(dump)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [(plain(0) + "7\n" + plain(10), "line 13: frame 1 has more than its 3 lines"),
     (frame(0, [(1, 2, 3)] * 4, count=3), "frame 1 has more than its 3 lines"),
     (plain(0).replace("ITEM: TIMESTEP\n0\n", "ITEM: TIMESTEP\nzero\n"), "frame 1: header cannot be read"),
     (plain(0).replace("0 2", "0 two"), "frame 1: header cannot be read"),
     (plain(0).replace("-1 1\n", "-1 nan\n"), "frame 1: header cannot be read"),
     (plain(0).replace("\n3\n", "\n-3\n"), "frame 1: header cannot be read"),
     (plain(0).replace("BOX BOUNDS", "BOX SIZE"), "frame 1: header cannot be read")],
)
def test_foreign_text_is_refused(write, text, message):
    with pytest.raises(DumpError, match=message):
        TextDump(write(text))


def test_gzipped_dump(write, tmp_path):
    text = "".join(plain(10 * number, 2000) for number in range(5)).encode()
    path = tmp_path / "a.dump.gz"
    path.write_bytes(gzip.compress(text))
    dump = open_dump(path)
    assert dump.steps.tolist() == [0, 10, 20, 30, 40]
    assert dump.frame(3).values[-1].tolist() == [2000.0, 30.5, 1999.0]
    assert pickle.loads(pickle.dumps(dump)).frame(1).step == 10
    assert [one.step for one in open_dump(path, stream=True)] == [0, 10, 20, 30, 40]
    path.write_bytes(gzip.compress(text)[:-200])
    assert len(open_dump(path, skip_truncated=True)) == 4
    with pytest.raises(DumpError, match="frame 5: truncated"):
        open_dump(path)
    damaged = bytearray(gzip.compress(text))
    damaged[len(damaged) // 2] ^= 255
    path.write_bytes(damaged)
    with pytest.raises(DumpError, match=r"compression is damaged|truncated|line|header"):
        list(open_dump(path))


def test_one_file_a_step(write, tmp_path):
    for step in (0, 5, 10, 100):
        write(plain(step), name=f"part{step}.dump")
    dump = open_dump(str(tmp_path / "part*.dump"))
    assert dump.steps.tolist() == [0, 5, 10, 100]
    assert [one.values[0, 1] for one in dump] == [0.5, 5.5, 10.5, 100.5]
    assert [one.step for one in open_dump([tmp_path / "part5.dump", tmp_path / "part0.dump"], stream=True)] == [0, 5]
    (tmp_path / "part200.dump").write_text(plain(200)[:-9])
    with pytest.raises(DumpError, match=r"part200\.dump, frame 1: truncated"):
        open_dump(str(tmp_path / "part*.dump"))
    assert len(open_dump(str(tmp_path / "part*.dump"), skip_truncated=True)) == 4
    with pytest.raises(DumpError, match=r"no file matches .*other"):
        open_dump(str(tmp_path / "other*.dump"))


def test_file_that_changed_under_the_reader_is_told(write):
    path = write(plain(0), plain(10))
    dump = TextDump(path)
    write(plain(5), plain(15))
    with pytest.raises(DumpError, match="the file was changed"):
        dump.frame(0)
