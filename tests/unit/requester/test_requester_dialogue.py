"""The handshake word by word, as the report describes it."""

import pytest
from dialogue import Answer, BoxSide, PcSide

from rtec._jit import new_record
from rtec.errors import ArgumentError
from rtec.link import _kernels as link
from rtec.requester import _box_kernels as box_kernels, _pc_kernels as pc_kernels
from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import Status

MS = 10**9


def running_box(**settings):
    box = BoxSide(HandshakeSettings(**settings))
    assert box.home(count=1000).status is Status.OK
    return box


def words(accepted=0, status=Status.OK, position=0):
    return Answer(position=position, completed=accepted, accepted=accepted, status=status)


def make_pc(limit=127, step=1, **settings):
    return PcSide(HandshakeSettings(**settings), count_mm=0.001, step_counts=step, word_limit=limit)


# ---------------------------------------------------------------------- box


@pytest.mark.parametrize("change", [-3, 0, 3])
def test_a_change_within_the_window_is_accepted(change):
    box = running_box()
    answer = box.read(total=change, count=1007)
    assert (answer.accepted, answer.completed, answer.status) == (change, change, Status.OK)
    assert answer.position == 7  # from home


@pytest.mark.parametrize("change", [-4, 4, 508, -127])
def test_a_larger_one_is_not_carried_out(change):
    box = running_box()
    answer = box.read(total=change, count=1000)
    assert (answer.accepted, answer.completed, answer.status) == (0, 0, Status.I_DONT_BELIEVE_YOU)
    assert box.refused == 1


@pytest.mark.parametrize("back", [0, 2])
@pytest.mark.parametrize("doubted", [1, 2])
def test_back_in_range_within_the_next_two_readings_it_is_accepted(doubted, back):
    box = running_box()
    for _ in range(doubted):
        assert box.read(total=9, count=1000).status is Status.I_DONT_BELIEVE_YOU
    assert box.read(total=back, count=1000).accepted == back
    # and the grace begins anew
    statuses = [box.read(total=99, count=1000).status for _ in range(3)]
    assert statuses == [Status.I_DONT_BELIEVE_YOU] * 2 + [Status.I_STILL_DONT_BELIEVE_YOU]


def test_otherwise_it_stops_for_good():
    box = running_box()
    for _ in range(3):
        answer = box.read(total=9, count=1000)
    assert answer.status is Status.I_STILL_DONT_BELIEVE_YOU
    for total, large in ((0, False), (1, False), (9, True)):
        answer = box.read(total=total, count=1000, large=large)
        assert (answer.accepted, answer.status) == (0, Status.I_STILL_DONT_BELIEVE_YOU)


# ----------------------------------------------------------------------- PC


def test_the_sign_pulls_the_axis_back():
    assert make_pc().turn(words(), deviation_mm=+0.002) == 2
    assert make_pc().turn(words(), deviation_mm=-0.002) == -2
    assert make_pc(step=4).turn(words(), deviation_mm=0.0118) == 3


def test_it_slews_by_the_window_as_the_box_follows():
    pc = make_pc()
    asked = [pc.turn(words(accepted), deviation_mm=0.0104) for accepted in (0, 0, 3, 6, 6, 9, 10)]
    assert asked == [3, 3, 6, 9, 9, 10, 10]


def test_it_does_not_move_before_its_last_request_was_sampled():
    pc = make_pc()
    assert pc.turn(words(0), deviation_mm=0.010) == 3
    # not sampled yet, and the prediction has turned round
    assert pc.turn(words(0), deviation_mm=-0.010) == 3
    assert pc.turn(words(3), deviation_mm=-0.010) == 0
    # a doubt about a word that a glitch spoilt is no reason either
    assert pc.turn(words(3, Status.I_DONT_BELIEVE_YOU), deviation_mm=-0.010) == 0


def test_the_direction_turns_after_the_hysteresis_and_not_before():
    pc = make_pc(reversal_mm=0.0205)
    seen = []
    for position in (0, 50, 40, 30, 29, 49, 29, 20, 45):
        pc.turn(words(position=position), deviation_mm=0.0)
        seen.append(pc.direction)
    assert seen == [1, 1, 1, 1, -1, -1, -1, -1, 1]


def test_rounding_has_a_hysteresis():
    pc = make_pc(rounding_margin=0.1)
    asked = [pc.turn(words(k), deviation_mm=um / 1000) for k, um in ((0, 0.55), (0, 0.61), (1, 0.45), (1, 0.39))]
    assert asked == [0, 1, 1, 0]


# --------------------------------------------------------- Data Valid, link


def record_of_pc(handshake, first_ps=0):
    pc, down, up = new_record(pc_kernels.PC), new_record(link.MAILBOX), new_record(link.MAILBOX)
    handshake.fill_pc(pc, count_mm=0.001, step_counts=1, word_limit=127)
    pc_kernels.pc_reset(pc, first_ps)
    link.mailbox_reset(down)
    link.mailbox_reset(up)
    return pc, down, up


def test_words_are_not_read_while_they_change():
    pc, _, up = record_of_pc(HandshakeSettings(update_ps=20_000_000, retry_ps=100_000_000))
    link.post(up, 0, 0, 0, 0, Status.OK)
    assert not pc_kernels.pc_read(pc, up, 19_999_999)
    assert (pc.next_ps, pc.not_valid) == (119_999_999, 1)
    assert pc_kernels.pc_read(pc, up, 119_999_999)
    assert (pc.next_ps, pc.not_valid) == (10 * MS, 1)


def test_the_large_correction_flag_stays_up_until_the_box_has_read_it():
    pc, down, up = record_of_pc(HandshakeSettings())
    flags, t = [], 0
    for accepted in (0, 0, 0, 50, 50):
        t += 10 * MS
        link.post(up, t - MS, 0, accepted, accepted, Status.OK)
        pc.large_meant = 1 if t == 20 * MS else pc.large_meant
        assert pc_kernels.pc_read(pc, up, t)
        pc_kernels.pc_request(pc, down, t, 0.0 if t == 10 * MS else 0.050)
        link.deliver(down, t)
        flags.append((int(down.word0), int(down.word1) & box_kernels.LARGE_CORRECTION))
    assert flags == [(0, 0), (50, 1), (50, 1), (50, 0), (50, 0)]


def test_after_a_long_wait_it_goes_on_from_now():
    pc, _, up = record_of_pc(HandshakeSettings())
    t = 0
    while t < 35 * MS:
        assert not pc_kernels.pc_read(pc, up, t)
        t = int(pc.next_ps)
    link.post(up, t - MS, 0, 0, 0, Status.OK)
    assert pc_kernels.pc_read(pc, up, t)
    assert pc.next_ps == 40 * MS


def test_a_mailbox_delivers_in_order_after_its_latency():
    box = new_record(link.MAILBOX)
    link.mailbox_reset(box)
    box.latency_ps = 10
    for t in range(5):
        link.post(box, t, t, 10 + t, 20 + t, 30 + t)
    link.deliver(box, 9)
    assert box.delivered == 0
    link.deliver(box, 12)
    assert (box.delivered, box.delivered_ps) == (3, 12)
    assert (box.word0, box.word1, box.word2, box.word3) == (2, 12, 22, 32)
    link.deliver(box, 100)
    assert (box.delivered, box.delivered_ps, box.word0, box.waiting) == (5, 14, 4, 0)


def test_a_mailbox_that_nobody_looks_at_keeps_the_newest():
    box = new_record(link.MAILBOX)
    link.mailbox_reset(box)
    box.latency_ps = 10
    for t in range(0, 10_000, 5):
        link.post(box, t, t, 0, 0, 0)
    link.deliver(box, 20_000)
    assert (box.word0, box.lost) == (9995, 0)


def test_more_messages_under_way_than_there_is_room_for_are_lost_and_counted():
    box = new_record(link.MAILBOX)
    link.mailbox_reset(box)
    box.latency_ps = 1000
    for t in range(20):
        link.post(box, t, t, 0, 0, 0)
    link.deliver(box, 2000)
    assert (box.delivered, box.lost, box.word0) == (16, 4, 15)


# ---------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("window_steps", 0),
        ("grace_readings", -1),
        ("box_period_ps", 0),
        ("update_ps", MS),
        ("latency_ps", 16 * MS),
        ("reversal_mm", -1.0),
        ("rounding_margin", 0.6),
        ("retry_ps", 10**9),
    ],
)
def test_settings_outside_their_range_are_named(name, value):
    with pytest.raises(ArgumentError, match=name):
        HandshakeSettings(**{name: value})
