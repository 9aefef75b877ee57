"""The controller's input: filter, decoder, policies, counter and latches, by hand."""

import pytest

from rtec.controller import Receiver, ReceiverSettings
from rtec.errors import ArgumentError
from rtec.signal import EdgeStream

NS, US, S = 1_000, 1_000_000, 10**12
FORWARD = [0, 1, 3, 2]


def received(settings, times, levels, at_ps=None, initial=0):
    receiver = Receiver(settings, initial=initial)
    receiver.process(EdgeStream(times, levels, initial=initial))
    return receiver.result(at_ps=times[-1] + S if at_ps is None else at_ps)


def turns(states, start_ps=US, apart_ps=US):
    """Return times and level codes of a walk through angle states."""
    return [start_ps + k * apart_ps for k in range(len(states))], [FORWARD[s % 4] for s in states]


@pytest.mark.parametrize(("line", "count"), [(1, 1), (2, -1)])
def test_a_dip_that_no_tick_sees_is_none(line, count):
    # ticks of 50 MHz come at 1000, 1020, 1040 ns
    settings = ReceiverSettings(filter_samples=3)
    times, levels = [1000 * NS, 1021 * NS, 1025 * NS], [line, 0, line]
    assert received(settings, times, levels, at_ps=1040 * NS - 1).count == 0
    assert received(settings, times, levels, at_ps=1040 * NS).count == count


def test_two_edges_a_picosecond_closer_than_a_tick_may_fall_between_two():
    assert received(ReceiverSettings(), [US, US + 20 * NS - 1], [1, 3]).count == 2  # the tick at 1 us sees A alone
    both = received(ReceiverSettings(), [US + 1, US + 20 * NS], [1, 3])
    assert (both.count, both.unresolved) == (0, 1)


def test_far_from_time_zero_the_ticks_of_a_fast_clock_are_exact():
    settings = ReceiverSettings(filter_samples=2, clock_hz=10_000_000_000)
    for base in (-4 * 10**18, 4 * 10**18):
        # ticks every 100 ps
        assert received(settings, [base + 1], [1], at_ps=base + 199).count == 0
        assert received(settings, [base + 1], [1], at_ps=base + 200).count == 1


@pytest.mark.parametrize(("bits", "there"), [(8, 127), (8, 128), (12, 2047), (12, 2048)])
@pytest.mark.parametrize("direction", [1, -1])
def test_the_counter_wraps_and_comes_back(bits, there, direction):
    settings = ReceiverSettings(counter_bits=bits)
    states = [direction * k for k in [*range(1, there + 1), *range(there - 1, -1, -1)]]
    times, levels = turns(states)
    receiver = Receiver(settings)
    shown, level = [], 0
    for k in range(0, len(times), 8):
        receiver.process(EdgeStream(times[k : k + 8], levels[k : k + 8], initial=level))
        level = levels[min(k + 8, len(levels)) - 1]
        at = min(k + 8, len(times)) - 1
        shown.append((states[at], settings.wrapped(receiver.result(at_ps=times[at] + 500 * NS).count)))
    half = 1 << (bits - 1)
    assert all(seen == (state + half) % (2 * half) - half for state, seen in shown)
    assert shown[-1] == (0, 0)
    top = received(settings, times[:there], levels[:there])
    assert settings.wrapped(top.count) == (-half if direction * there == half else direction * there)


def test_a_counter_without_width_never_wraps():
    assert ReceiverSettings(counter_bits=0).wrapped(10**15) == 10**15


def test_the_first_sixty_four_are_kept_and_all_are_counted():
    times = [US * (k + 1) for k in range(200)]
    result = received(ReceiverSettings(), times, [3 * ((k + 1) % 2) for k in range(200)])
    assert (result.illegal_transitions, len(result.first_illegal)) == (200, 64)
    assert result.first_illegal[63].time_ps == 64 * US + 40 * NS


def test_index_and_probe_latch_the_count_of_their_instant():
    receiver = Receiver(ReceiverSettings())
    times, levels = turns([1, 2, 3, 4, 5, 6])
    receiver.process(EdgeStream(times[:3], levels[:3], initial=0))
    # the third edge, at 3 us, is through the filter with the tick at 3.04 us
    receiver.index(at_ps=times[2] + 40 * NS - 1)
    assert receiver.result(at_ps=times[2] + 40 * NS - 1).index_count == 2
    receiver.probe(at_ps=times[2] + 40 * NS)
    receiver.process(EdgeStream(times[3:], levels[3:], initial=levels[2]))
    receiver.index(at_ps=10 * US)  # nothing has asked for the count since the last edge
    result = receiver.result(at_ps=10 * US)
    assert (result.index_count, result.probe_count, result.count) == (6, 3, 6)


def test_nothing_latched_nothing_told():
    result = received(ReceiverSettings(), [US], [1])
    assert (result.index_count, result.probe_count, result.fault_ps) == (None, None, None)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("filter_samples", -1),
        ("filter_samples", 2.5),
        ("clock_hz", 999),
        ("clock_hz", 9_999_999_967),  # a prime: its period needs too large a denominator
        ("counter_bits", 1),
        ("counter_bits", 63),
    ],
)
def test_settings_outside_their_range_are_named(name, value):
    with pytest.raises(ArgumentError, match=name):
        ReceiverSettings(**{name: value})


def test_the_face_refuses_what_it_cannot_take():
    receiver = Receiver(ReceiverSettings())
    receiver.process(EdgeStream([US], [1], initial=0))
    with pytest.raises(ArgumentError, match="where the last stream ended"):
        receiver.process(EdgeStream([2 * US], [1], initial=0))
    with pytest.raises(ArgumentError, match="time never runs back"):
        receiver.result(at_ps=US - 1)
    with pytest.raises(ArgumentError, match="time never runs back"):
        receiver.process(EdgeStream([US - 1], [3], initial=1))
    with pytest.raises(ArgumentError, match="initial"):
        Receiver(ReceiverSettings(), initial=-1)
