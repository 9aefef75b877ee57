import io
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from signal_oracle import ILLEGAL, decode_step, level_at, merged, read_vcd, text

from rtec.signal import (
    TIMESCALES_PS,
    Detail,
    EdgeStream,
    Gate,
    LevelStream,
    merge_chunks,
    merge_lines,
    write_vcd,
)

compiles = settings(deadline=None)  # the first example may wait for the compiler

moments = st.integers(-30, 30)
crowded = st.integers(0, 12)
far = st.integers(-(2**61), 2**61)
cuts = st.lists(st.integers(1, 7), min_size=1, max_size=5)


@st.composite
def lines(draw, times=moments):
    toggles = draw(st.lists(times, unique=True, max_size=25))
    return LevelStream(np.array(sorted(toggles), dtype=np.int64), draw(st.integers(0, 1)))


@st.composite
def edges(draw, times=moments):
    moments_ps = sorted(draw(st.lists(times, unique=True, max_size=25)))
    initial = draw(st.integers(0, 3))
    turns = draw(st.lists(st.integers(1, 3), min_size=len(moments_ps), max_size=len(moments_ps)))
    return EdgeStream(moments_ps, (initial + np.cumsum(turns, dtype=np.int64)) % 4, initial)


def cut(stream, sizes):
    """Cut a stream into pieces of the given sizes, over and over; with empty ones between."""
    first, k = 0, 0
    while first < len(stream) or not k:
        size = sizes[k % len(sizes)]
        yield stream.part(first, first + size)
        first, k = first + size, k + 1
        if k % 3 == 0:
            yield stream.part(min(first, len(stream)), first)


@compiles
@given(st.lists(st.integers(0, 1), min_size=4, max_size=4), lines(), lines())
def test_merging_is_the_oracle_at_every_time(table, a, b):
    toggles, initial = merged(table, (a.times_ps.tolist(), a.initial), (b.times_ps.tolist(), b.initial))
    assert merge_lines(table, a, b) == LevelStream(np.array(toggles, dtype=np.int64), initial)


@pytest.mark.parametrize(
    ("gate", "rule"), [(Gate.OR, lambda x, y: x | y), (Gate.AND, lambda x, y: x & y), (Gate.XOR, lambda x, y: x ^ y)]
)
@compiles
@given(a=lines(far), b=lines(far))
def test_named_gates_are_their_rules(gate, rule, a, b):
    toggles, initial = merged(rule, (a.times_ps.tolist(), a.initial), (b.times_ps.tolist(), b.initial))
    assert merge_lines(gate, a, b) == LevelStream(np.array(toggles, dtype=np.int64), initial)


@compiles
@given(st.sampled_from(Gate), lines(crowded), lines(crowded), cuts, cuts)
def test_merging_in_pieces_is_merging_the_whole(gate, a, b, cuts_a, cuts_b):
    pieces = list(merge_chunks(gate, cut(a, cuts_a), cut(b, cuts_b)))
    assert LevelStream.concatenate(pieces) == merge_lines(gate, a, b)
    assert all(len(piece) <= max(cuts_a) + max(cuts_b) for piece in pieces)


@compiles
@given(edges(), cuts)
def test_cut_and_joined_stream_is_itself(stream, sizes):
    assert EdgeStream.concatenate(cut(stream, sizes)) == stream
    assert EdgeStream.concatenate(stream.chunks(sizes[0])) == stream


@compiles
@given(edges(), moments)
def test_two_windows_join_to_the_whole(stream, t):
    assert EdgeStream.concatenate([stream.window(-100, t), stream.window(t, 100)]) == stream


@compiles
@given(edges(far))
def test_lines_and_edges_are_the_same_thing(stream):
    a, b = stream.lines()
    assert EdgeStream.from_lines(a, b) == stream
    assert (a.final, b.final) == (stream.final & 1, stream.final >> 1)


@compiles
@given(lines(), lines())
def test_joined_lines_split_again(a, b):
    joined = EdgeStream.from_lines(a, b)
    assert joined.lines() == (a, b)
    for t in range(-31, 32):
        expected = level_at(a.times_ps.tolist(), a.initial, t) + 2 * level_at(b.times_ps.tolist(), b.initial, t)
        assert joined.level_at(t) == expected


@compiles
@given(edges())
def test_counts_are_the_decoders(stream):
    levels = [text(level) for level in [stream.initial, *stream.levels.tolist()]]
    steps = [decode_step(before, after) for before, after in pairwise(levels)]
    net, illegal = stream.counts()
    assert illegal == steps.count(ILLEGAL)
    assert net == sum(step for step in steps if step != ILLEGAL)


@compiles
@given(edges(far), st.integers(-(2**60), 2**60))
def test_shifting_back_gives_the_stream(stream, delay):
    assert stream.shift(delay).shift(-delay) == stream


@compiles
@given(
    edges(st.integers(1, 50)),
    edges(st.integers(1, 10**6)),
    lines(st.integers(1, 50)),
    st.sampled_from(list(TIMESCALES_PS)[:10]),
    cuts,
)
def test_vcd_reads_back(first, second, line, timescale, sizes):
    unit = TIMESCALES_PS[timescale]
    first, second = (EdgeStream(s.times_ps * unit, s.levels, s.initial) for s in (first, second))
    line = LevelStream(line.times_ps * unit, line.initial)
    file = io.BytesIO()
    waveforms = {"x": cut(first, sizes), "y": second, "x.P": cut(line, sizes)}
    write_vcd(file, waveforms, end_ps=1_000_001 * unit, timescale=timescale, detail=Detail.LINES_AND_STATE)
    waves = read_vcd(file.getvalue())

    def read_line(name):
        times = np.array([t for t, _ in waves.changes[name]], dtype=np.int64) * unit
        back = LevelStream(times, waves.initial[name])
        assert back.levels.tolist() == [value for _, value in waves.changes[name]]
        return back

    assert EdgeStream.from_lines(read_line("x.A"), read_line("x.B")) == first
    assert EdgeStream.from_lines(read_line("y.A"), read_line("y.B")) == second
    assert read_line("x.P") == line
    numbers = {"00": 1, "10": 2, "11": 3, "01": 4}
    assert [value for _, value in waves.changes["y.state"]] == [numbers[text(v)] for v in second.levels.tolist()]
    assert (waves.timescale, waves.end) == (timescale, 1_000_001)
    assert waves.times == sorted(set(waves.times))
