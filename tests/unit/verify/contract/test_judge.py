"""The judge against an oracle written from the contract's words; wrong algorithms that it must not let through."""

import pytest
from hypothesis import given, settings, strategies as st

from rtec.injector import Break, Response, Stimulus, Totals
from rtec.signal import EdgeStream
from rtec.verify.contract.contract import Contract
from rtec.verify.contract.judge import Fault, judge
from rtec.verify.contract.streams import Stream
from tests.oracles import judge_oracle

TIGHT = Contract(step_counts=2, separation_ps=6, delay_ps=25)
UP, DOWN = (1, 3, 0, 2), (2, 0, 3, 1)


def times(most):
    return st.lists(st.integers(1, 99), unique=True, max_size=most).map(sorted)


@st.composite
def edges(draw, most=10, odd=False):
    """Levels that change one line at a time, now and then both."""
    level = initial = draw(st.integers(0, 3))
    at, levels = draw(times(most)), []
    for _ in at:
        ways = [UP[level], DOWN[level]] + ([level ^ 3] if odd and draw(st.integers(0, 19)) == 0 else [])
        level = draw(st.sampled_from(ways))
        levels.append(level)
    return EdgeStream(at, levels, initial=initial)


@st.composite
def totals(draw, most=4):
    at = draw(times(most))
    return Totals(at, draw(st.lists(st.integers(-2, 2), min_size=len(at), max_size=len(at))))


@st.composite
def runs(draw):
    """A run; half of them follow the encoder, so that later points of the contract are reached."""
    sent = draw(edges())
    stimulus = Stimulus(edges=sent, requests=draw(totals()), until_ps=draw(st.integers(100, 130)))
    if draw(st.booleans()):
        response = Response(edges=draw(edges(odd=True)), completed=draw(totals()))
    else:
        response = Response(edges=late(draw, sent), completed=draw(st.sampled_from([Totals(), stimulus.requests])))
    if draw(st.integers(0, 3)) == 0:
        refusals = tuple((t, "no") for t in draw(times(2)))
        response = Response(edges=response.edges, completed=response.completed, refusals=refusals)
    return stimulus, response


def late(draw, sent):
    """The encoder's edges, later, with a pulse of one line somewhere."""
    shift = draw(st.integers(0, 30))
    out = dict(zip((sent.times_ps + shift).tolist(), sent.levels.tolist(), strict=True))
    if draw(st.booleans()):
        begin = draw(st.integers(1, 80))
        level = sent.initial
        if not any(begin <= t <= begin + 5 for t in out):
            level = next((out[t] for t in sorted(out, reverse=True) if t < begin), level)
            out |= {begin: level ^ 1, begin + 5: level}
    return EdgeStream(sorted(out), [out[t] for t in sorted(out)], initial=sent.initial)


@settings(max_examples=400, deadline=None)
@given(runs(), st.booleans(), st.booleans())
def test_it_says_what_the_oracle_says(run, must_finish, may_refuse):
    stimulus, response = run
    ours = judge(stimulus, response, TIGHT, must_finish=must_finish, may_refuse=may_refuse)
    theirs = judge_oracle.seen(stimulus, response, TIGHT, must_finish=must_finish, may_refuse=may_refuse)
    assert (ours.violation.fault if ours.violation else None) is theirs.fault
    assert (ours.separation_ps, ours.pulse_ps, ours.delay_ps) == (
        theirs.separation_ps,
        theirs.pulse_ps,
        theirs.delay_ps,
    )


def test_random_runs_reach_every_fault():
    found = set()

    @settings(max_examples=600, deadline=None, database=None, derandomize=True)
    @given(runs())
    def collect(run):
        found.add(judge_oracle.seen(*run, TIGHT).fault)

    collect()
    assert found >= {None, *Fault} - {Fault.BROKEN}


# --- one run of each kind ---
CONTRACT = Contract(step_counts=2)


def played(text, out, *, done=(), initial=None, refusals=(), **options):
    """Judge levels ``out`` as (time in ns, level) and completed totals as (time in ns, total)."""
    stimulus = Stream.read(text).stimulus()
    begin = stimulus.edges.initial if initial is None else initial
    response = Response(
        edges=EdgeStream([t * 1000 for t, _ in out], [level for _, level in out], initial=begin),
        completed=Totals([t * 1000 for t, _ in done], [total for _, total in done]),
        refusals=refusals,
    )
    return judge(stimulus, response, CONTRACT, **options).violation


@pytest.mark.parametrize(
    ("fault", "at_ns", "out", "done"),
    [
        (Fault.ILLEGAL, 2000, [(2000, 3)], [(2000, 1)]),
        (Fault.SEPARATION, 2050, [(2000, 1), (2050, 3)], [(2050, 1)]),
        (Fault.COUNT, 2000, [(2000, 1)], []),
        (Fault.COUNT, 2000, [(2000, 1)], [(2100, 1)]),
        (Fault.UNFINISHED, 1000, [], []),
        (Fault.UNASKED, 2200, [(2000, 1), (2200, 3), (2400, 2), (2600, 0)], [(2200, 2)]),
    ],
)
def test_each_fault_and_its_moment(fault, at_ns, out, done):
    violation = played("00 1us:r1 9us:end", out, done=done)
    assert (violation.fault, violation.time_ps) == (fault, at_ns * 1000)


def test_a_total_that_does_not_fit_the_counts_is_told_as_such():
    out = [(2000, 1), (2200, 3)]
    assert played("00 1us:r1 9us:end", out, done=[(2200, 2)]).reason == (
        "+2 steps said to be completed where +1 were inserted (controller +2, encoder +0)"
    )
    assert played("00 1us:r1 9us:end", out).reason.startswith("0 steps said to be completed where +1 were inserted")
    # half a step, or a step that was booked as it was asked for and is not there: the counts are what is wrong
    assert played("00 1us:r1 9us:end", [(2000, 1)], done=[(2200, 1)]).reason.startswith("the controller counts +1")
    assert played("00 1us:r1 9us:end", [], done=[(2200, 1)]).reason.startswith("the controller counts +0")


def test_what_an_algorithm_says_brings_no_escape_sequence():
    stimulus = Stream.read("00 9us:end").stimulus()
    broken = Break(time_ps=5, reason="step raised \x1b[2J\x07")
    seen = judge(stimulus, Response(edges=EdgeStream([], [], initial=0), completed=Totals(), broken=broken), CONTRACT)
    assert seen.violation.reason == "step raised \ufffd[2J\ufffd"
    violation = played("00 1us:r1 9us:end", [], refusals=((1_500_000, "\x1b[31mno"),), may_refuse=False)
    assert "refused: \ufffd[31mno" in str(violation)


def test_pulses_that_cancel_at_rest_are_movement_that_nobody_asked_for():
    violation = played("00 9us:end", [(2000, 1), (2200, 0)])
    assert (violation.fault, violation.time_ps) == (Fault.UNASKED, 2_000_000)
    assert "+1 beyond" in str(violation)


def test_a_count_that_is_wrong_in_mid_run_and_right_at_the_end():
    # a lost edge comes back 60 us later, on another one's back
    violation = played("00 1us:+ 61us:- 90us:end", [])
    assert (violation.fault, violation.time_ps) == (Fault.DELAY, 1_000_000)
    assert played("00 1us:+ 41us:- 90us:end", []) is None


def test_a_request_refused_with_a_reason_is_answered_except_where_it_must_be_completed():
    refusals = ((1_500_000, "no"),)
    assert played("00 1us:r1 9us:end", [], refusals=refusals) is None
    violation = played("00 1us:r1 9us:end", [], refusals=refusals, may_refuse=False)
    assert violation.fault is Fault.UNFINISHED
    assert "refused: no" in str(violation)


def test_a_break_comes_before_all_else():
    stimulus = Stream.read("00 1us:r1 9us:end").stimulus()
    broken = Break(time_ps=5, reason="it raised")
    seen = judge(stimulus, Response(edges=EdgeStream([], [], initial=3), completed=Totals(), broken=broken), CONTRACT)
    assert (seen.violation.fault, str(seen.violation)) == (Fault.BROKEN, "it raised, at 5 ps")


def test_a_short_pulse_of_one_line_is_told_and_allowed():
    stimulus = Stream.read("00 1us:+ 1.1us:- 9us:end").stimulus()
    seen = judge(stimulus, Response(edges=stimulus.edges, completed=Totals()), CONTRACT)
    assert (seen.right, seen.separation_ps, seen.pulse_ps) == (True, None, 100_000)
