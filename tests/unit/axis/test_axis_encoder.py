"""The encoder: its lines, reversals, jitter, glitches, index, and the steady motion that never drifts."""

import math
from fractions import Fraction

import numpy as np
import pytest
from encoder_oracle import steady_crossings
from steady_edges import steady_edges

from rtec._jit import new_record
from rtec.axis import Encoder, Imperfections, MotionSegments, _kernels
from rtec.errors import ArgumentError

S = 10**12


def motion(*pieces):
    """Return the motion of pieces (seconds, counts, counts/s, counts/s^2) for an encoder of 1 mm a count."""
    durations = np.array([round(s * S) for s, *_ in pieces], dtype=np.int64)
    starts = np.concatenate(([0], np.cumsum(durations)[:-1])).astype(np.int64)
    s, x, v, a = (np.array(column, dtype=np.float64) for column in zip(*pieces, strict=True))
    return MotionSegments(
        start_ps=starts,
        duration_ps=durations,
        x0_mm=x,
        v0_mm_s=v,
        a0_mm_s2=a,
        j0_mm_s3=np.zeros_like(x),
        block=np.zeros(x.size, dtype=np.int64),
        block_end_ps=np.array([durations.sum()]),
        end_mm=float(x[-1] + v[-1] * s[-1] + a[-1] * s[-1] ** 2 / 2),
    )


def edges(encoder, *pieces):
    return encoder.edges(motion(*pieces))


def steady(encoder, frequency_hz, direction, count, chunk=1 << 16):
    """Return times and levels of so many edges at constant speed."""
    state = new_record(_kernels.ENCODER)
    encoder.fill_steady(state, frequency_hz, direction)
    _kernels.reset_at(state, 0.0)
    times, levels = [], []
    while (left := count - sum(part.size for part in times)) > 0:
        t, ab = np.empty(min(chunk, left + 2), np.int64), np.empty(min(chunk, left + 2), np.uint8)
        n = steady_edges(state, t, ab)
        times.append(t[:n])
        levels.append(ab[:n])
    return np.concatenate(times)[:count], np.concatenate(levels)[:count], state


MM = Encoder(count_mm=1.0)


@pytest.mark.parametrize("beyond", [1e-9, 1e-6, 1e-3])
def test_even_the_slightest_crossing_at_a_turn_gives_both_edges(beyond):
    # x = 0.5 + beyond - (t - 1)^2
    top = 0.5 + beyond
    stream = edges(MM, (2.0, top - 1, 2.0, -2.0))
    near = [t for t in stream.times_ps.tolist() if abs(t - S) < S // 10]
    assert len(near) == 2
    assert near[1] - near[0] == pytest.approx(2 * math.sqrt(beyond) * S, rel=1e-4)
    assert stream.counts().net == 0


def test_just_short_of_a_line_there_is_no_edge():
    assert edges(MM, (2.0, 0.5 - 1e-9 - 1, 2.0, -2.0)).counts() == (0, 0)
    times = edges(MM, (2.0, 0.5 - 1e-9 - 1, 2.0, -2.0)).times_ps
    assert not ((times > 0.9 * S) & (times < 1.1 * S)).any()


def test_chunks_join_to_the_whole():
    there_and_back = [(1.0, 0.0, 1e6, 0.0), (1.0, 1e6, -1e6, 0.0)]
    chunks = list(MM.edge_chunks(motion(*there_and_back)))
    assert len(chunks) == 2
    whole = edges(MM, *there_and_back)
    assert [t for chunk in chunks for t in chunk.times_ps[:3]] == [
        *whole.times_ps[:3],
        *whole.times_ps[1_000_000:1_000_003],
    ]
    assert chunks[1].initial == chunks[0].final
    assert whole.counts() == (0, 0)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(
    "flaws",
    [
        Imperfections(),
        Imperfections(phase_error_deg=-23.0, duty_error_a=0.07, duty_error_b=-0.03),
        Imperfections(phase_error_deg=8.0, eccentricity_counts=2.0),
    ],
)
def test_steady_speed_is_a_cruise_to_a_picosecond(flaws, direction):
    frequency = 333_333.0
    encoder = Encoder(count_mm=1.0, counts_per_rev=4000, imperfections=flaws)
    moved = edges(encoder, (0.03, 0.0, 4 * frequency * direction, 0.0))
    times, levels, _ = steady(encoder, frequency, direction, len(moved))
    assert levels.tolist() == moved.levels.tolist()
    assert np.abs(times - moved.times_ps).max() <= 1


@pytest.mark.parametrize("frequency_hz", [333_333.0, 333.333e3, 499_999.7])
def test_nothing_drifts_over_ten_million_edges(frequency_hz):
    state = new_record(_kernels.ENCODER)
    MM.fill_steady(state, frequency_hz, 1)
    _kernels.reset_at(state, 0.0)
    t, ab = np.empty(100_002, np.int64), np.empty(100_002, np.uint8)
    made = 0
    while made < 10_000_000:
        n = steady_edges(state, t, ab)
        numbers = (0, 1, n // 2, n - 1)
        exact = steady_crossings(frequency_hz, [made + i for i in numbers])
        for i, goal in zip(numbers, exact, strict=True):
            assert abs(Fraction(int(t[i])) - goal) <= 1, (made + i, t[i], float(goal))
        made += n


def test_jitter_is_bounded_triangular_and_independent():
    bound, n = 50_000, 200_000
    flawed = Encoder(imperfections=Imperfections(jitter_ps=bound), seed=20)
    ideal, _, _ = steady(Encoder(), 500e3, 1, n)
    times, _, _ = steady(flawed, 500e3, 1, n)
    off = (times - ideal) / bound
    assert np.abs(off).max() <= 1
    assert np.abs(off).max() > 0.99
    # a triangle on -1..1: variance 1/6, fourth moment 1/15; five standard deviations of each estimate
    assert abs(off.mean()) < 5 * math.sqrt(1 / 6 / n)
    assert abs((off**2).mean() - 1 / 6) < 5 * math.sqrt((1 / 15 - 1 / 36) / n)
    assert abs((off**4).mean() - 1 / 15) < 5 * math.sqrt((1 / 45 - 1 / 225) / n)
    ordered = np.sort(off)
    triangle = np.where(ordered < 0, (1 + ordered) ** 2 / 2, 1 - (1 - ordered) ** 2 / 2)
    assert np.abs(triangle - (np.arange(n) + 0.5) / n).max() < 1.95 / math.sqrt(n)  # Kolmogorov, 0.1 %
    for lag in (1, 2, 3, 4, 8, 64):
        assert abs((off[lag:] * off[:-lag]).mean()) < 5 / 6 / math.sqrt(n)


def test_glitches_come_as_often_as_asked_and_change_no_count():
    flaws = Imperfections(glitch_probability=0.1, glitch_ps=20_000)
    n = 50_000
    times, levels, state = steady(Encoder(imperfections=flaws, seed=5), 100e3, 1, n)
    clean = n - 2 * int(state.glitches)
    assert abs(int(state.glitches) - 0.1 * clean) < 5 * math.sqrt(0.09 * clean) + 1
    assert (np.diff(times) > 0).all()
    before = np.concatenate(([0], levels[:-1]))
    changed = before ^ levels
    assert set(changed.tolist()) == {1, 2}
    # a glitch is there and back on one line, 20 ns apart unless a real edge comes between
    short = np.flatnonzero(np.diff(times) == 20_000)
    assert short.size > 0.9 * int(state.glitches)
    assert (changed[short] == changed[short + 1]).all()
    assert 0.4 < (changed[short] == 1).mean() < 0.6
    angle = (levels[-1] ^ (levels[-1] >> 1)) & 3
    deltas = np.array([0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0])[before * 4 + levels]
    assert int(deltas.sum()) in (clean, clean + 1, clean - 1)
    assert angle == int(deltas.sum()) % 4


def test_a_glitch_at_the_end_of_a_motion_is_ended():
    flaws = Imperfections(glitch_probability=0.5, glitch_ps=10**9)
    ends = set()
    for seed in range(40):
        encoder = Encoder(count_mm=1.0, imperfections=flaws, seed=seed)
        stream = edges(encoder, (0.01, 0.0, 800.0, 0.0))
        assert stream.final == 0  # eight counts on
        ends.add(stream.times_ps[-1] > 0.01 * S)
    assert ends == {True, False}


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Imperfections(phase_error_deg=90.0), "phase_error_deg"),
        (lambda: Imperfections(duty_error_a=math.nan), "duty_error_a"),
        (lambda: Imperfections(phase_error_deg=80.0, duty_error_a=0.2), "phase_error_deg"),
        (lambda: Imperfections(jitter_ps=-1), "jitter_ps"),
        (lambda: Imperfections(glitch_ps=0), "glitch_ps"),
        (lambda: Imperfections(glitch_probability=1.5), "glitch_probability"),
        (lambda: Encoder(count_mm=0.0), "count_mm"),
        (lambda: Encoder(counts_per_rev=10), "counts_per_rev"),
        (lambda: Encoder(index_counts=-1), "index_counts"),
        (lambda: Encoder(home_state=4), "home_state"),
        (lambda: Encoder(seed=-1), "seed"),
        (lambda: Encoder(imperfections=Imperfections(eccentricity_counts=1.0)), "eccentricity_counts"),
        (lambda: Encoder(counts_per_rev=4, imperfections=Imperfections(eccentricity_counts=1.0)), "eccentricity"),
    ],
)
def test_what_an_encoder_cannot_be_is_named(make, named):
    with pytest.raises(ArgumentError, match=named):
        make()


@pytest.mark.parametrize(("frequency", "named"), [(0.0, "frequency"), (math.inf, "frequency"), (1e9, "frequency")])
def test_frequencies_are_bounded(frequency, named):
    with pytest.raises(ArgumentError, match=named):
        MM.fill_steady(new_record(_kernels.ENCODER), frequency, 1)


def test_jitter_that_would_change_the_order_of_edges_is_refused():
    encoder = Encoder(imperfections=Imperfections(phase_error_deg=45.0, jitter_ps=130_000))
    encoder.fill_steady(new_record(_kernels.ENCODER), 480e3, 1)
    with pytest.raises(ArgumentError, match="less than 125000 ps"):  # half a quarter, half a quarter of 500 ns
        encoder.fill_steady(new_record(_kernels.ENCODER), 500e3, 1)


def test_room_is_made_for_the_lines_that_eccentricity_crowds():
    # Line k lies at k - 1/2 + e sin(2 pi k / n). With e = 0.94 n / 2 pi the lines about half a turn are 0.06 counts
    # apart: the stretch of 200 000 counts there holds many times the edges of a perfect disc.
    n = 40_000_000
    amplitude = 0.94 * n / (2 * math.pi)
    disc = Encoder(count_mm=1.0, counts_per_rev=n, imperfections=Imperfections(eccentricity_counts=amplitude))
    low, high = n / 2 - 1e5, n / 2 + 1e5

    def line_below(x):
        below, above = 0.0, float(n)
        while above - below > 1e-6:
            k = (below + above) / 2
            below, above = (k, above) if k - 0.5 + amplitude * math.sin(2 * math.pi * k / n) < x else (below, k)
        return below

    stream = edges(disc, (1.0, low, high - low, 0.0))
    assert stream.counts().net == len(stream) == pytest.approx(line_below(high) - line_below(low), abs=2)
    assert len(stream) > 2_900_000
