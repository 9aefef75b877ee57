import io
from itertools import pairwise

import numpy as np
from hypothesis import given, settings, strategies as st
from signal_oracle import ILLEGAL, decode_step, joined, read_vcd, text

from rtec.signal import TIMESCALES_PS, EdgeStream, write_vcd

compiles = settings(deadline=None)  # the first example may wait for the compiler

moments = st.integers(-30, 30)
far = st.integers(-(2**61), 2**61)
cuts = st.lists(st.integers(1, 7), min_size=1, max_size=5)


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
@given(edges(), cuts)
def test_cut_and_joined_stream_is_itself(stream, sizes):
    assert EdgeStream.concatenate(cut(stream, sizes)) == stream


@compiles
@given(edges(), moments)
def test_two_windows_join_to_the_whole(stream, t):
    assert EdgeStream.concatenate([stream.window(-100, t), stream.window(t, 100)]) == stream


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
@given(edges(st.integers(1, 50)), edges(st.integers(1, 10**6)), st.sampled_from(list(TIMESCALES_PS)[:10]))
def test_vcd_reads_back(first, second, timescale):
    unit = TIMESCALES_PS[timescale]
    streams = {name: EdgeStream(s.times_ps * unit, s.levels, s.initial) for name, s in (("x", first), ("y", second))}
    file = io.BytesIO()
    write_vcd(file, streams, end_ps=1_000_001 * unit, timescale=timescale)
    waves = read_vcd(file.getvalue())
    for name, stream in streams.items():
        lines = [[(t * unit, value) for t, value in waves.changes[f"{name}.{line}"]] for line in "AB"]
        toggles = [([t for t, _ in line], waves.initial[f"{name}.{a}"]) for a, line in zip("AB", lines, strict=True)]
        assert EdgeStream(*joined(*toggles)) == stream
        for (_, initial), line in zip(toggles, lines, strict=True):
            assert [value for _, value in line] == [(initial + k) % 2 for k in range(1, len(line) + 1)]
    assert (waves.timescale, waves.end) == (timescale, 1_000_001)
    assert waves.times == sorted(set(waves.times))
