"""The receiver's kernel against an oracle that samples at every tick of the filter's clock."""

import itertools
from fractions import Fraction

import pytest
from hypothesis import Phase, example, given, settings, strategies as st
from receiver_oracle import ReceiverOracle

from rtec.controller import IllegalPolicy, Multiplication, Receiver, ReceiverSettings
from rtec.signal import EdgeStream

# what fails is told as it was found: these examples take long to make smaller
PHASES = [Phase.explicit, Phase.reuse, Phase.generate]
compiles = settings(deadline=None, max_examples=120, phases=PHASES)
CLOCKS_HZ = [10_000_000_000, 3_333_000_000, 33_333_000, 12_000_000, 50_000_000, 4_999_999, 1_000]


def text(code):
    return f"{code & 1}{code >> 1}"


@st.composite
def raw_edges(draw, clock_hz):
    """Edges from far below a tick apart to far beyond the filter, glitches and jumps; now and then a long wait."""
    tick = 10**12 / clock_hz
    t = draw(st.sampled_from([0, -7 * 10**12, 5 * 10**12 + 1, 123_456_789 * 10**6]))
    # some times fall on a tick exactly, where there is a whole picosecond for it
    level = initial = draw(st.integers(0, 3))
    edges = []
    for _ in range(draw(st.integers(0, 40))):
        ticks = draw(st.sampled_from([0.05, 0.3, 0.8, 1.0, 1.7, 2.0, 3.1, 5.0, 20.0]))
        t += max(1, round(ticks * tick * draw(st.floats(0.5, 1.5))))
        if draw(st.integers(0, 9)) == 0:
            k = -(-t * clock_hz // 10**12)
            t = max(t, int(Fraction(k * 10**12, clock_hz)))
        if draw(st.integers(0, 30)) == 0:
            t += draw(st.sampled_from([10**12 - 1, 3 * 10**12, 400 * 10**12]))
        level ^= draw(st.sampled_from([1, 2, 1, 2, 1, 2, 3]))
        edges.append((t, level))
    return initial, edges


def run_face(settings_, initial, edges, moments):
    receiver = Receiver(settings_, initial=initial)
    readings, level, done = [], initial, 0
    for moment in [*moments, None]:
        part = [edge for edge in edges[done:] if moment is None or edge[0] <= moment]
        done += len(part)
        receiver.process(EdgeStream([t for t, _ in part], [ab for _, ab in part], initial=level))
        level = part[-1][1] if part else level
        if moment is not None:
            readings.append(receiver.result(at_ps=moment).count)
    return receiver, readings


@compiles
@given(st.data(), st.sampled_from(CLOCKS_HZ), st.integers(0, 6))
@pytest.mark.parametrize("policy", list(IllegalPolicy))
@pytest.mark.parametrize("multiplication", list(Multiplication))
def test_receiver_is_the_oracle(multiplication, policy, data, clock_hz, samples):
    initial, edges = data.draw(raw_edges(clock_hz))
    settings_ = ReceiverSettings(
        filter_samples=samples, clock_hz=clock_hz, multiplication=multiplication, policy=policy
    )
    at = [t for t, _ in edges] or [0]
    end = at[-1] + (samples + 3) * 10**12 // clock_hz + 2
    picked = data.draw(st.lists(st.integers(0, max(len(at) - 1, 0)), max_size=4))
    between = [(at[i] + (at[i + 1] if i + 1 < len(at) else end)) // 2 for i in sorted(set(picked))]
    moments = [*sorted({m for m in between if m not in at}), end]
    receiver, readings = run_face(settings_, initial, edges, moments)
    result = receiver.result(at_ps=end)
    oracle = ReceiverOracle(samples, clock_hz, multiplication.value, policy.value, text(initial))
    oracle.run([(t, text(ab)) for t, ab in edges], moments)
    assert readings == oracle.readings
    found = [(one.time_ps, one.kind.value) for one in result.first_illegal]
    assert found == oracle.illegal[:64]
    assert result.illegal_transitions == len(oracle.illegal) == result.simultaneous + result.unresolved
    assert (result.filtered, result.fault_ps) == (oracle.filtered, oracle.fault_ps)
    gaps = [b - a for a, b in itertools.pairwise(at)]
    assert result.min_separation_ps == (min(gaps) if gaps else None)


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 7), st.integers(1, 4), st.integers(0, 400))
@example(initial=0, samples=3, dip=150)
def test_a_dip_between_two_ticks_is_not_there(initial, samples, dip):
    # ticks every 1000 ps; the line rises at 500 and dips for 100 ps somewhere in the next ticks
    initial &= 3
    start = 500 + dip * 10
    edges = [(500, initial ^ 1)]
    if start > 500:
        edges += [(start, initial), (start + 100, initial ^ 1)]
    settings_ = ReceiverSettings(filter_samples=samples, clock_hz=1_000_000_000)
    receiver, _ = run_face(settings_, initial, edges, [])
    oracle = ReceiverOracle(samples, 1_000_000_000, 4, "ignore", text(initial))
    moments = [1000 * k for k in range(6, 12)]
    oracle.run([(t, text(ab)) for t, ab in edges], moments)
    assert [receiver.result(at_ps=m).count for m in moments] == oracle.readings
