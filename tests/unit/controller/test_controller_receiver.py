"""The controller's input: filter, decoder, policies, counter and latches, by hand."""

import itertools

import numpy as np
import pytest

from rtec.controller import IllegalPolicy, Multiplication, Receiver, ReceiverSettings
from rtec.controller.receiver import IllegalClass, IllegalTransition
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


# ------------------------------------------------------------------- filter


@pytest.mark.parametrize("samples", [1, 2, 3, 10])
@pytest.mark.parametrize("phase_ns", [0, 1, 10, 19])
def test_a_level_is_taken_over_with_its_last_sample(samples, phase_ns):
    # 50 MHz: ticks every 20 ns; a change on a tick is seen by it
    change = 1000 * NS + phase_ns * NS
    seen = 1000 * NS if phase_ns == 0 else 1020 * NS
    taken = seen + (samples - 1) * 20 * NS
    settings = ReceiverSettings(filter_samples=samples)
    if taken > change:
        assert received(settings, [change], [1], at_ps=taken - 1).count == 0
    assert received(settings, [change], [1], at_ps=taken).count == 1
    assert taken - change <= settings.delay_ps


@pytest.mark.parametrize("width_ns", [1, 19, 39, 40, 41, 59, 60, 61, 79])
def test_a_pulse_counts_where_three_ticks_see_it(width_ns):
    for phase_ns in range(0, 20, 3):
        rise, fall = 1000 * NS + phase_ns * NS, 1000 * NS + (phase_ns + width_ns) * NS
        ticks = sum(rise <= tick * 20 * NS < fall for tick in range(40, 70))
        result = received(ReceiverSettings(), [rise, fall], [1, 0], at_ps=10 * US)
        assert result.filtered == (ticks < 3)
        assert result.count == 0
        inside = received(ReceiverSettings(), [rise, fall], [1, 0], at_ps=fall)
        assert inside.count == (ticks >= 3)


@pytest.mark.parametrize("clock_hz", [33_333_000, 12_000_000, 4_999_999])
def test_a_clock_of_no_whole_number_of_picoseconds_does_not_drift(clock_hz):
    settings = ReceiverSettings(filter_samples=2, clock_hz=clock_hz)
    for hours in (0, 1, 1000):
        k = hours * 3600 * clock_hz + 7 * clock_hz // 3  # ticks since time 0
        tick = -(-k * S // clock_hz)  # first whole picosecond at or after tick k
        following = (k + 1) * S // clock_hz  # the picosecond in which tick k + 1 falls
        exact = k * S % clock_hz == 0
        # just at or before tick k it is seen by k and k + 1, a picosecond later by k + 1 and k + 2
        early, late = tick if exact else tick - 1, tick if not exact else tick + 1
        assert received(settings, [early], [1], at_ps=following - 1).count == 0
        assert received(settings, [early], [1], at_ps=following).count == 1
        assert received(settings, [late], [1], at_ps=following).count == 0
        after = (k + 2) * S // clock_hz
        assert received(settings, [late], [1], at_ps=after).count == 1


def test_both_lines_waiting_for_long_with_an_awkward_clock():
    # 4 999 999 ticks a second; the lines change 3 ticks apart and the next event comes after a month
    settings = ReceiverSettings(filter_samples=10, clock_hz=4_999_999)
    result = received(settings, [US, US + 600 * NS], [1, 3], at_ps=30 * 86_400 * S)
    assert (result.count, result.illegal_transitions) == (2, 0)


def test_times_before_zero():
    result = received(ReceiverSettings(clock_hz=33_333_000), [-(10**17), -(10**17) + US], [1, 3], at_ps=0)
    assert (result.count, result.illegal_transitions, result.min_separation_ps) == (2, 0, US)
    assert received(ReceiverSettings(), [-(10**17)], [1], at_ps=0).min_separation_ps is None


def test_far_from_time_zero_the_ticks_of_a_fast_clock_are_exact():
    settings = ReceiverSettings(filter_samples=2, clock_hz=10_000_000_000)
    for base in (-4 * 10**18, 4 * 10**18):
        # ticks every 100 ps
        assert received(settings, [base + 1], [1], at_ps=base + 199).count == 0
        assert received(settings, [base + 1], [1], at_ps=base + 200).count == 1


def test_a_dip_between_two_ticks_does_not_start_the_filter_anew():
    # ticks at 1000, 1020, 1040 ns; the dip lies between two of them
    times = [990 * NS, 1025 * NS, 1035 * NS]
    assert received(ReceiverSettings(), times, [1, 0, 1], at_ps=1040 * NS).count == 1
    # this one is seen by the tick at 1020
    times = [990 * NS, 1015 * NS, 1025 * NS]
    assert received(ReceiverSettings(), times, [1, 0, 1], at_ps=1079 * NS).count == 0
    assert received(ReceiverSettings(), times, [1, 0, 1], at_ps=1080 * NS).count == 1


# ------------------------------------------------------------------ decoder


@pytest.mark.parametrize(("times_four", "multiplication"), [(4, "X4"), (2, "X2"), (1, "X1")])
@pytest.mark.parametrize("direction", [1, -1])
def test_ten_cycles_give_ten_times_the_multiplication(times_four, multiplication, direction):
    settings = ReceiverSettings(multiplication=Multiplication[multiplication])
    times, levels = turns([direction * (k + 1) for k in range(40)])
    assert received(settings, times, levels).count == 10 * times_four * direction


@pytest.mark.parametrize("multiplication", list(Multiplication))
@pytest.mark.parametrize(("start", "turn"), list(itertools.product(range(4), [1, -1])))
def test_dither_over_one_line_never_drifts(multiplication, start, turn):
    settings = ReceiverSettings(multiplication=multiplication)
    times, levels = turns([start + turn * ((k + 1) % 2) for k in range(1000)])
    counts = {received(settings, times[:n], levels[:n], initial=FORWARD[start]).count for n in range(1, 1000, 37)}
    assert received(settings, times, levels, initial=FORWARD[start]).count == 0
    assert counts <= {0, turn}


def test_a_reversal_within_a_cycle_comes_back_to_zero():
    for multiplication in Multiplication:
        for there in range(1, 9):
            states = [*range(1, there + 1), *range(there - 1, -1, -1)]
            times, levels = turns(states)
            settings = ReceiverSettings(multiplication=multiplication)
            assert received(settings, times, levels).count == 0


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


# ------------------------------------------------------ illegal transitions


def test_classes_and_times_of_illegal_transitions():
    # both at once at 1 us; 5 ns apart at 2 us, less than the clock of 20 ns can tell
    times = [1000 * NS, 2001 * NS, 2006 * NS]
    result = received(ReceiverSettings(policy=IllegalPolicy.FAULT), times, [3, 2, 0])
    assert (result.illegal_transitions, result.simultaneous, result.unresolved) == (2, 1, 1)
    assert result.first_illegal == (
        IllegalTransition(time_ps=1040 * NS, kind=IllegalClass.SIMULTANEOUS),
        IllegalTransition(time_ps=2060 * NS, kind=IllegalClass.UNRESOLVED),
    )
    assert result.fault_ps == 1040 * NS
    assert result.count == 0


def test_a_tick_between_them_tells_two_changes_apart():
    # the change on the tick at 2020 is seen by it, the one a picosecond later is not
    result = received(ReceiverSettings(), [2020 * NS, 2020 * NS + 1], [1, 3])
    assert (result.count, result.illegal_transitions) == (2, 0)
    result = received(ReceiverSettings(), [2020 * NS - 1, 2020 * NS], [1, 3])
    assert (result.count, result.illegal_transitions) == (0, 1)


def test_without_a_filter_only_what_is_simultaneous_is_illegal():
    settings = ReceiverSettings(filter_samples=0)
    result = received(settings, [100, 101, 500], [1, 3, 0], at_ps=1000)
    assert (result.count, result.simultaneous, result.unresolved) == (2, 1, 0)
    assert result.first_illegal[0].time_ps == 500


@pytest.mark.parametrize(
    ("multiplication", "whole"), [(Multiplication.X4, 4), (Multiplication.X2, 2), (Multiplication.X1, 1)]
)
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("lost", range(4))
def test_a_guess_is_right_where_the_motion_goes_on(multiplication, whole, direction, lost):
    # one edge in ten cycles is lost, so that its neighbours make a jump
    states = [direction * (k + 1) for k in range(40)]
    del states[8 + lost]
    times, levels = turns(states)
    guess = received(ReceiverSettings(multiplication=multiplication, policy=IllegalPolicy.GUESS), times, levels)
    assert (guess.count, guess.illegal_transitions, guess.fault_ps) == (10 * whole * direction, 1, None)
    ignored = received(ReceiverSettings(multiplication=multiplication), times, levels)
    assert ignored.illegal_transitions == 1
    if multiplication is Multiplication.X4:
        assert ignored.count == 38 * direction


def test_a_guess_before_any_motion_leaves_the_count():
    assert received(ReceiverSettings(policy=IllegalPolicy.GUESS), [US], [3]).count == 0


def test_the_first_sixty_four_are_kept_and_all_are_counted():
    times = [US * (k + 1) for k in range(200)]
    result = received(ReceiverSettings(), times, [3 * ((k + 1) % 2) for k in range(200)])
    assert (result.illegal_transitions, len(result.first_illegal)) == (200, 64)
    assert result.first_illegal[63].time_ps == 64 * US + 40 * NS


# ------------------------------------------------------------------ latches


def test_index_and_probe_latch_the_count_of_their_instant():
    receiver = Receiver(ReceiverSettings())
    times, levels = turns([1, 2, 3, 4, 5, 6])
    receiver.process(EdgeStream(times[:3], levels[:3], initial=0))
    # the third edge, at 3 us, is through the filter with the tick at 3.04 us
    receiver.index(at_ps=times[2] + 40 * NS - 1)
    assert receiver.result(at_ps=times[2] + 40 * NS - 1).index_count == 2
    receiver.probe(at_ps=times[2] + 40 * NS)
    receiver.process(EdgeStream(times[3:], levels[3:], initial=levels[2]))
    result = receiver.result(at_ps=10 * US)
    assert (result.index_count, result.probe_count, result.count) == (2, 3, 6)
    receiver.index(at_ps=10 * US)
    assert receiver.result(at_ps=10 * US).index_count == 6


def test_nothing_latched_nothing_told():
    result = received(ReceiverSettings(), [US], [1])
    assert (result.index_count, result.probe_count, result.fault_ps) == (None, None, None)


# ---------------------------------------------------------------- arguments


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


def test_cutting_a_stream_changes_nothing():
    rng = np.random.default_rng(4)
    times = np.cumsum(rng.integers(1, 90 * NS, 3000)) + US
    levels = np.cumsum(rng.choice([1, 3, 1, 1], 3000)) % 4
    codes = levels ^ (levels >> 1)
    whole = Receiver(ReceiverSettings())
    whole.process(EdgeStream(times, codes, initial=0))
    cut = Receiver(ReceiverSettings())
    stream = EdgeStream(times, codes, initial=0)
    for k in range(0, 3000, 7):
        cut.process(stream.part(k, min(k + 7, 3000)))
    end = int(times[-1]) + US
    assert cut.result(at_ps=end) == whole.result(at_ps=end)
    assert whole.result(at_ps=end).filtered > 100
