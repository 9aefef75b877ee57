"""The box apart from its tables: gate, rest, atomic insertions, loss of power, holding real edges back."""

import itertools

import pytest
from injector_oracle import decoded

from rtec.errors import ArgumentError
from rtec.injector import Design, Injector, InjectorSettings, Processor, RealEdges, Timing
from rtec.injector.box import PowerLoss
from rtec.signal import EdgeStream

US = 1_000_000
FORWARD = ["00", "10", "11", "01"]
CODE = {"00": 0, "10": 1, "11": 3, "01": 2}
TEXT = {code: text for text, code in CODE.items()}
STEP = {Design.ORIGINAL: 4, Design.A: 4, Design.B: 1, Design.C: 2}
CHANGES = STEP


def box_of(design, *, initial="00", timing=None, **choices):
    timing = timing or Timing.of(design, Processor.MCS51)
    return Injector(InjectorSettings(design=design, timing=timing, **choices), initial=CODE[initial])


def quiet(box, until_us, levels="00"):
    return box.process(EdgeStream([], [], initial=CODE[levels]), until_ps=round(until_us * US))


def texts(*streams):
    return [TEXT[int(ab)] for stream in streams for ab in stream.levels]


# ------------------------------------------------------------------ at rest


@pytest.mark.parametrize("design", list(Design))
def test_rest_begins_one_millisecond_after_the_last_edge(design):
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US, recover_ps=2 * US, latency_ps=5 * US)
    box = box_of(design, initial="01", timing=timing)
    edge = 50 * US
    head = box.process(EdgeStream([edge], [0], initial=2), until_ps=edge + 100 * US)
    box.request(1, at_ps=edge + 100 * US)  # the edge is long past
    out = box.process(EdgeStream([], [], initial=0), until_ps=edge + 1100 * US)
    assert len(head) == 1
    assert out.times_ps[0] == edge + 1004 * US
    assert decoded(texts(head, out))[0] == STEP[design]


@pytest.mark.parametrize("design", list(Design))
def test_after_rest_it_starts_with_the_request(design):
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US, recover_ps=2 * US)
    box = box_of(design, timing=timing)
    box.request(-1, at_ps=7 * US)
    out = quiet(box, 100)
    assert out.times_ps.tolist() == [(11 + k) * US for k in range(CHANGES[design])]


@pytest.mark.parametrize("design", list(Design))
def test_requested_totals_are_reached_and_no_more(design):
    box = box_of(design)
    box.request(7, at_ps=0)
    up = quiet(box, 1000)
    box.request(-2, at_ps=1000 * US)
    down = quiet(box, 3000)
    assert decoded(["00", *texts(up)]) == (7 * STEP[design], 0)
    assert decoded(["00", *texts(up, down)]) == (-2 * STEP[design], 0)
    assert box.insertions.inserted == 16


# --------------------------------------------------------------------- gate


@pytest.mark.parametrize(("design", "processor"), list(itertools.product(Design, (Processor.MCS51, Processor.FAST))))
def test_gate_lets_through_what_is_slower_than_its_interval(design, processor):
    timing = Timing.of(design, processor)
    for quarter, passes in ((timing.worst_ps(design) * 115 // 100 + 2, True), (timing.worst_ps(design), False)):
        levels = [CODE[FORWARD[(k + 1) % 4]] for k in range(40)]
        times = [quarter * (k + 1) for k in range(40)]
        box = box_of(design, timing=timing)
        head = box.process(EdgeStream(times[:20], levels[:20], initial=0), until_ps=times[20])
        box.request(1, at_ps=times[20])
        tail = box.process(EdgeStream(times[20:], levels[20:], initial=0), until_ps=times[39] + 30 * US)
        saw = box.insertions
        assert saw.inserted == passes
        assert decoded(["00", *texts(head, tail)]) == (40 + STEP[design] * passes, 0)
        if passes:
            assert saw.refused == 0
        else:
            # the Original once a cycle, the others at every transition that they see
            assert saw.refused == (5 if design is Design.ORIGINAL else 20)


@pytest.mark.parametrize("design", list(Design))
def test_before_anything_is_timed_the_gate_refuses(design):
    # 100 kHz from the first edge on: no interval is known, and none is slow enough
    levels = [CODE[FORWARD[(k + 1) % 4]] for k in range(40)]
    stream = EdgeStream([2_500_000 * (k + 1) for k in range(40)], levels, initial=0)
    box = box_of(design)
    head = box.process(stream.part(0, 1), until_ps=2_600_000)
    box.request(1, at_ps=2_600_000)
    box.process(stream.part(1, 40), until_ps=150 * US)
    assert len(head) in (0, 1)
    assert box.insertions.inserted == 0
    if design is not Design.B:  # which cannot even copy so fast
        assert box.insertions.refused == (10 if design is Design.ORIGINAL else 39)
        assert (box.insertions.ahead_counts, box.insertions.illegal) == (0, 0)


def test_without_a_gate_design_b_is_too_slow_for_100_khz_and_the_monitor_says_so():
    levels = [CODE[FORWARD[(k + 1) % 4]] for k in range(400)]
    stream = EdgeStream([2_500_000 * (k + 1) for k in range(400)], levels, initial=0)
    box = box_of(Design.B)
    out = box.process(stream, until_ps=1100 * US)
    net, illegal = decoded(["00", *texts(out)])
    assert illegal > 0 or net != 400
    assert illegal == box.insertions.illegal


# ---------------------------------------------------------------- atomicity


@pytest.mark.parametrize("design", list(Design))
def test_disabling_waits_for_the_end_at_every_step(design):
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US, recover_ps=2 * US)
    last = 4 * US + (CHANGES[design] - 1) * US
    for at in [*range(1, last + 2 * US, US // 4), *(last + d for d in (-1, 0, 1))]:
        box = box_of(design, timing=timing)
        box.request(2, at_ps=0)
        early = box.process(EdgeStream([], [], initial=0), until_ps=at)
        box.enable(False, at_ps=at)
        late = quiet(box, 500)
        # the insertion recognised at 0 goes to its end, the second is not begun
        assert decoded(["00", *texts(early, late)]) == (STEP[design], 0), at
        assert box.insertions.completed == 1
        box.enable(True, at_ps=500 * US)
        quiet(box, 600)
        assert box.insertions.completed == 2


@pytest.mark.parametrize("design", list(Design))
def test_what_lies_before_a_switch_has_happened_even_where_nobody_looked(design):
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US, recover_ps=2 * US)
    box = box_of(design, timing=timing)
    box.request(1, at_ps=0)
    box.request(2, at_ps=100 * US)
    box.enable(False, at_ps=200 * US)
    box.power(False, at_ps=300 * US)
    out = quiet(box, 400)
    starts = [4 * US, 104 * US]
    assert out.times_ps[:: CHANGES[design]][:2].tolist() == starts
    assert decoded(["00", *texts(out)][: 1 + 2 * CHANGES[design]]) == (2 * STEP[design], 0)
    # only Design B shows that the power goes, from the state two ahead
    assert out.times_ps[2 * CHANGES[design] :].tolist() == ([300 * US] if design is Design.B else [])


@pytest.mark.parametrize("design", list(Design))
def test_disabled_before_the_look_nothing_happens(design):
    box = box_of(design, timing=Timing(poll_ps=8 * US, poll_offset_ps=5 * US))
    box.request(1, at_ps=0)
    box.enable(False, at_ps=5 * US)  # the look would come now
    assert len(quiet(box, 100)) == 0
    box.enable(True, at_ps=100 * US)
    assert len(quiet(box, 200)) == CHANGES[design]


@pytest.mark.parametrize("design", list(Design))
def test_a_request_taken_back_before_the_first_change_leaves_no_trace(design):
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US)
    box = box_of(design, timing=timing)
    box.request(1, at_ps=0)
    box.request(0, at_ps=3 * US)
    assert len(quiet(box, 100)) == 0
    box.request(1, at_ps=100 * US)
    box.request(-1, at_ps=102 * US)  # the sign is that of the first change
    assert decoded(["00", *texts(quiet(box, 200))]) == (-STEP[design], 0)


@pytest.mark.parametrize("design", list(Design))
def test_a_plan_does_not_outlive_its_request(design):
    """Asked, taken back, moved on, asked again: nothing may start from the state before."""
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US)
    box = box_of(design, initial="01", timing=timing)
    # an edge into state 1 and a request that has to wait for rest
    parts = [box.process(EdgeStream([10 * US], [0], initial=2), until_ps=20 * US)]
    box.request(1, at_ps=20 * US)
    box.request(0, at_ps=30 * US)
    parts.append(box.process(EdgeStream([40 * US], [1], initial=0), until_ps=50 * US))
    box.request(1, at_ps=50 * US)
    parts.append(box.process(EdgeStream([], [], initial=1), until_ps=3000 * US))
    done = 0 if design is Design.ORIGINAL else 1
    assert decoded(["01", *texts(*parts)]) == (2 + done * STEP[design], 0)
    assert box.insertions.completed == done


def test_design_b_catches_up_after_giving_an_insertion_up():
    timing = Timing(poll_ps=0, decide_ps=10 * US, latency_ps=US)
    box = box_of(Design.B, timing=timing)
    box.request(1, at_ps=0)
    parts = [box.process(EdgeStream([3 * US], [1], initial=0), until_ps=5 * US)]
    box.request(0, at_ps=5 * US)
    parts.append(box.process(EdgeStream([], [], initial=1), until_ps=50 * US))
    assert texts(*parts) == ["10"]
    assert parts[1].times_ps.tolist() == [11 * US]


# -------------------------------------------------------------------- power


def cut_during_insertion(design, changes_made, sign=+1, **choices):
    """Cut the power half a step after so many changes of an insertion from state 1."""
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US, recover_ps=2 * US)
    box = box_of(design, timing=timing, **choices)
    box.request(sign, at_ps=0)
    at = 3 * US + changes_made * US + US // 2
    before = box.process(EdgeStream([], [], initial=0), until_ps=at)
    box.power(False, at_ps=at)
    after = box.process(EdgeStream([], [], initial=0), until_ps=at + 50 * US)
    return box, before, after, at


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A])
@pytest.mark.parametrize(
    ("made", "net", "illegal"),
    # A up and down again; both down at once; B goes down last, as the fourth change would have had it
    [(1, 0, 0), (2, 2, 1), (3, 4, 0)],
)
def test_without_power_the_pulses_end_at_once(design, made, net, illegal):
    box, before, after, at = cut_during_insertion(design, made)
    assert texts(before) == ["10", "11", "01"][:made]
    assert (after.times_ps.tolist(), texts(after)) == ([at], ["00"])
    assert decoded(["00", *texts(before, after)]) == (net, illegal)
    saw = box.insertions
    assert (saw.ahead_counts, saw.illegal, saw.completed) == (net, illegal, 0)
    # A and B pass from then on
    moving = EdgeStream([at + 60 * US, at + 70 * US], [1, 3], initial=0)
    assert box.process(moving, until_ps=at + 80 * US) == moving


def test_without_power_design_c_keeps_its_inverters():
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US)
    box = box_of(Design.C, timing=timing)
    box.request(1, at_ps=0)
    quiet(box, 20)
    box.power(False, at_ps=20 * US)
    assert len(quiet(box, 30)) == 0
    out = box.process(EdgeStream([40 * US, 50 * US], [1, 3], initial=0), until_ps=60 * US)
    assert texts(out) == ["01", "00"]
    assert (box.insertions.ahead_counts, box.insertions.illegal) == (2, 0)


@pytest.mark.parametrize(("total", "illegal"), [(1, 1), (2, 0), (3, 1), (-1, 1), (-4, 0)])
def test_released_inverters_flip_both_lines_where_the_total_is_odd(total, illegal):
    box = box_of(Design.C, power_loss=PowerLoss.RELEASE)
    box.request(total, at_ps=0)
    before = quiet(box, 500)
    box.power(False, at_ps=500 * US)
    after = quiet(box, 600)
    assert texts(after) == (["00"] if illegal else [])
    assert after.times_ps.tolist() == [500 * US] * illegal
    assert decoded([*texts(before), *texts(after)])[1] == illegal == box.insertions.illegal


def test_without_power_design_b_is_dead():
    box = box_of(Design.B, initial="10")
    quiet(box, 10, "10")
    box.power(False, at_ps=10 * US)
    out = box.process(EdgeStream([20 * US, 30 * US], [3, 2], initial=1), until_ps=40 * US)
    assert (out.times_ps.tolist(), texts(out)) == ([10 * US], ["00"])
    box.power(True, at_ps=40 * US)
    out = box.process(EdgeStream([100 * US], [0], initial=2), until_ps=200 * US)
    assert texts(out) == ["01", "00"]
    assert out.times_ps[0] == 40 * US


@pytest.mark.parametrize("design", list(Design))
def test_with_power_back_it_starts_empty_and_takes_its_time(design):
    timing = Timing(poll_ps=0, decide_ps=4 * US, step_ps=US)
    box = box_of(design, timing=timing)
    box.request(1, at_ps=0)
    quiet(box, 2)
    box.power(False, at_ps=2 * US)
    box.request(3, at_ps=3 * US)
    quiet(box, 5000)
    box.power(True, at_ps=5000 * US)
    quiet(box, 5100)
    assert (box.insertions.requested, box.insertions.completed, box.insertions.inserted) == (0, 0, 0)
    box.request(1, at_ps=5100 * US)
    # it cannot know that the axis rests before it has watched it for a millisecond
    out = quiet(box, 9000)
    assert out.times_ps[0] == 6004 * US
    assert len(out) == CHANGES[design]


# --------------------------------------------------------------------- hold

HELD = Timing(poll_ps=0, decide_ps=4 * US, step_ps=2 * US, recover_ps=US)


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
@pytest.mark.parametrize(("turn", "sign"), list(itertools.product([+1, -1], [+1, -1])))
def test_a_held_edge_comes_after_the_insertion(design, turn, sign):
    last = 4 * US + 2 * US * (CHANGES[design] - 1)
    for edge in range(US // 2, last + 2 * US, US // 2):
        box = box_of(design, timing=HELD, real_edges=RealEdges.HOLD)
        box.request(sign, at_ps=0)
        moving = EdgeStream([edge], [CODE[FORWARD[turn % 4]]], initial=0)
        out = box.process(moving, until_ps=100 * US)
        assert decoded(["00", *texts(out)]) == (turn + sign * STEP[design], 0), edge
        assert out.times_ps[-1] == last + 2 * US
        assert (box.insertions.ahead_counts, box.insertions.illegal) == (sign * STEP[design], 0)
        assert box.insertions.real_inside == (edge < last)


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A])
def test_merging_the_same_edge_loses_counts_where_holding_does_not(design):
    # moving forward and adding, A rises while B's pulse is still up
    results = {}
    for choice in RealEdges:
        box = box_of(design, timing=HELD, real_edges=choice)
        box.request(1, at_ps=0)
        out = box.process(EdgeStream([9 * US], [1], initial=0), until_ps=100 * US)
        results[choice] = decoded(["00", *texts(out)])
    assert results == {RealEdges.HOLD: (5, 0), RealEdges.MERGE: (1, 0)}


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
def test_two_held_edges_come_as_a_visible_jump(design):
    box = box_of(design, timing=HELD, real_edges=RealEdges.HOLD)
    box.request(1, at_ps=0)
    out = box.process(EdgeStream([3 * US, 5 * US], [1, 3], initial=0), until_ps=100 * US)
    assert decoded(["00", *texts(out)])[1] == 1
    assert (box.insertions.illegal, box.insertions.real_inside) == (1, 2)


# ---------------------------------------------------------------- arguments


def test_the_face_refuses_what_it_cannot_take():
    box = box_of(Design.C)
    quiet(box, 10)
    with pytest.raises(ArgumentError, match="time never runs back"):
        box.request(1, at_ps=9 * US)
    with pytest.raises(ArgumentError, match="where the last stream ended"):
        box.process(EdgeStream([], [], initial=1), until_ps=20 * US)
    with pytest.raises(ArgumentError, match="times from 10000000 ps to before 20000000 ps"):
        box.process(EdgeStream([20 * US], [1], initial=0), until_ps=20 * US)
    with pytest.raises(ArgumentError, match="until_ps: '5' is not valid"):
        box.process(EdgeStream([], [], initial=0), until_ps="5")
    with pytest.raises(ArgumentError, match="total"):
        box.request(2**40, at_ps=10 * US)
    with pytest.raises(ArgumentError, match="initial"):
        Injector(box.settings, initial=4)


def test_a_huge_request_takes_no_room_before_its_time():
    box = box_of(Design.C)
    box.request(2**31, at_ps=0)
    assert 20 < len(quiet(box, 100)) < 40


@pytest.mark.parametrize("cuts", [1, 3, 7])
def test_pieces_give_what_the_whole_gives(cuts):
    quarter = 40 * US
    times = [quarter * (k + 1) for k in range(40)]
    codes = [CODE[FORWARD[(k + 1) % 4]] for k in range(40)]
    whole = box_of(Design.A)
    whole.request(5, at_ps=0)
    expected = whole.process(EdgeStream(times, codes, initial=0), until_ps=times[-1] + quarter)
    box = box_of(Design.A)
    box.request(5, at_ps=0)
    parts, level = [], 0
    for k in range(0, 40, cuts):
        part = EdgeStream(times[k : k + cuts], codes[k : k + cuts], initial=level)
        parts.append(box.process(part, until_ps=times[min(k + cuts, 40) - 1] + quarter))
        level = part.final
    assert [t for part in parts for t in part.times_ps] == expected.times_ps.tolist()
    assert [int(ab) for part in parts for ab in part.levels] == expected.levels.tolist()
    assert box.insertions == whole.insertions


@pytest.mark.parametrize("design", [Design.ORIGINAL, Design.A, Design.C])
@pytest.mark.parametrize("late_us", [4, 6, 7, 8])
def test_power_loss_does_not_wait_for_the_end_of_an_insertion(design, late_us):
    """An insertion on the 8051, planned at rest, is under way from 4 us after the request on."""
    box = Injector(InjectorSettings(design=design, timing=Timing.of(design, Processor.MCS51)), initial=0)
    box.process(EdgeStream([], [], initial=0), until_ps=2_000_000_000)
    box.request(1, at_ps=2_000_000_000)
    begun = box.process(EdgeStream([], [], initial=0), until_ps=2_000_000_000 + late_us * 1_000_000 + 1)
    box.power(False, at_ps=2_000_000_000 + late_us * 1_000_000 + 1)
    box.request(5, at_ps=2_000_000_000 + late_us * 1_000_000 + 1)
    rest = box.process(EdgeStream([], [], initial=0), until_ps=3_000_000_000)
    net = begun.counts().net + rest.counts().net
    whole = len(begun.times_ps) == design.step_counts
    assert box.insertions.completed == whole
    assert not whole or net == design.step_counts
