"""Streams: written and read again, and which of them an encoder can send."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from rtec.errors import ArgumentError, RtecError
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.streams import Stream, can_be, first_that_cannot_be, why_it_cannot_be
from tests.oracles import axis_oracle

CONTRACT = Contract(step_counts=2)


@st.composite
def streams(draw):
    """Times of all sizes, a picosecond apart at least; an edge and a request may share one."""
    until = draw(st.sampled_from([1_000, 10**7, 10**13, 2**61]))
    at = st.lists(st.integers(1, until - 1), unique=True, max_size=8).map(sorted)
    edges = [(t, draw(st.sampled_from([1, -1]))) for t in draw(at)]
    requests = [(t, draw(st.integers(-(10**6), 10**6))) for t in draw(at)]
    return Stream.of(draw(st.integers(0, 3)), edges, requests, until)


@settings(deadline=None)
@given(streams())
def test_what_is_written_reads_back(stream):
    again = Stream.read(str(stream))
    assert (again.state, again.until_ps) == (stream.state, stream.until_ps)
    for name in ("edges_ps", "moves", "requests_ps", "totals"):
        assert getattr(again, name).tolist() == getattr(stream, name).tolist()
    assert str(again) == str(stream)


@settings(deadline=None)
@given(streams())
def test_levels_walk_gray_code_by_the_moves(stream):
    edges = stream.stimulus().edges
    assert edges.counts().net == int(stream.moves.sum())
    assert edges.counts().illegal == 0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "02 1us:end",
        "00",
        "00 1us:+",
        "00 1us:end 2us:+",
        "00 1us:* 2us:end",
        "00 1:+ 2us:end",
        "00 2us:+ 1us:- 3us:end",
        "00 1us:+ 1us:- 3us:end",
        "00 1us:r1 1us:r2 3us:end",
        "00 0us:+ 3us:end",
        "00 1us:r99999999999 3us:end",
        "00 3us:+ 3us:end",
        "00 1e400us:+ 2us:end",
        "00 99999999s:end",
    ],
)
def test_text_that_is_no_stream(text):
    with pytest.raises(ArgumentError):
        Stream.read(text)


def test_an_encoder_of_a_real_motion_can_send_its_edges():
    rng = np.random.default_rng(5)
    tried = shaken = 0
    while tried < 200:
        events = axis_oracle.edges(rng, CONTRACT, int(rng.integers(1, 8)))
        if events is None:
            continue
        tried += 1
        assert can_be(Stream.of(0, events[:200], [], 2**61), CONTRACT), events
        # each edge a little later or not at all, by less than the jitter that is allowed
        late = [(t + int(rng.integers(0, 50_000)), move) for t, move in events[:200]]
        times = np.array([t for t, _ in late])
        turns = np.diff([move for _, move in late]) != 0
        if np.all(np.diff(times) > 0) and np.all(np.diff(times)[turns] >= CONTRACT.turn_ps):
            shaken += 1
            assert can_be(Stream.of(0, late, [], 2**61), CONTRACT), late
    assert shaken > 100


def test_a_motion_played_at_twice_the_speed_mostly_cannot_be():
    """Four times the acceleration; a turn then shows it, and so does the highest speed."""
    rng = np.random.default_rng(6)
    refused = tried = 0
    fast = Contract(step_counts=2, jitter=0.0, turn_ps=1)
    for _ in range(300):
        events = axis_oracle.edges(rng, fast, 12)
        if events is None or len(events) < 4 or len({move for _, move in events}) == 1:
            continue
        tried += 1
        twice = Stream.of(0, [(max(t // 2, 1), move) for t, move in events], [], 2**61)
        refused += not can_be(twice, fast)
    assert tried > 20, tried
    assert refused > 0.8 * tried, (refused, tried)


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("00 500ns:+ 1us:+ 1.5us:+ 9us:end", 3),
        ("00 500ns:+ 949ns:+ 9us:end", 1),  # 449 ns apart, 450 are possible
        ("00 500ns:+ 950ns:+ 9us:end", 2),
        ("00 1us:+ 1.099us:- 9us:end", 1),  # back within 99 ns
        ("00 1us:+ 1.1us:- 9us:end", 2),
        ("00 500ns:+ 1us:+ 1.2us:- 9us:end", 2),  # a turn at full speed
        ("00 500ns:- 700ns:+ 1.2us:+ 9us:end", 2),  # full speed at once behind a turn
        ("00 90us:+ 90.5us:+ 99us:end", 1),  # full speed at once from rest
    ],
)
def test_which_edge_comes_too_early(text, first):
    stream = Stream.read(text)
    assert first_that_cannot_be(stream, CONTRACT) == first
    assert can_be(stream, CONTRACT) is (first == stream.edges_ps.size)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("00 500ns:+ 1us:+ 9us:end", ""),
        ("00 1us:+ 1.4us:+ 9us:end", "the edge at 1.4us comes 400ns after the one before; at most 500 kHz"),
        ("00 1us:+ 1.05us:- 9us:end", "the edge at 1.05us comes 50ns after the one before, which it takes back"),
        ("00 100us:+ 101us:+ 9ms:end", "the axis would have to gain or lose more than 100 MHz/s"),
    ],
)
def test_a_stream_that_no_encoder_sends_says_which_edge(text, why):
    said = why_it_cannot_be(Stream.read(text), CONTRACT)
    assert why in said
    assert bool(why) is bool(said)


def test_a_stream_of_many_edges_comes_from_a_file(tmp_path):
    text = f"00 {' '.join(f'{k}us:+' for k in range(1, 40_001))} 1s:end"
    (tmp_path / "long").write_text(text)
    assert str(Stream.given(str(tmp_path / "long"))) == str(Stream.given(text))
    for text in ("none.txt", "02 1us:+ " * 100, ""):  # a name may even be too long for a file
        with pytest.raises(ArgumentError, match="or a file with them"):
            Stream.given(text)
    with pytest.raises(RtecError, match="no regular file"):
        Stream.given(str(tmp_path))
