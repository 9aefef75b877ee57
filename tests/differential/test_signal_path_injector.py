"""The injector's kernel against an oracle that lives through every picosecond."""

import numba
import pytest
from hypothesis import given, settings, strategies as st
from injector_oracle import BoxOracle, live

from rtec.injector import Design, Injector, InjectorSettings, RealEdges, Timing
from rtec.injector.box import PowerLoss
from rtec.signal import EdgeStream

# uncompiled (test_signal_path_modes.py) each takes thirty times as long
compiles = settings(deadline=None, max_examples=25 if numba.config.DISABLE_JIT else 100)
FIRST, UNTIL = -20, 420


def text(code):
    return f"{code & 1}{code >> 1}"


@st.composite
def timings(draw, gated):
    poll = draw(st.integers(0, 7))
    return Timing(
        poll_ps=poll,
        poll_offset_ps=draw(st.integers(0, max(poll - 1, 0))),
        decide_ps=draw(st.integers(1, 9)),
        step_ps=draw(st.integers(1, 5)),
        recover_ps=draw(st.integers(0, 6)),
        latency_ps=draw(st.integers(1, 7)),
        rest_ps=draw(st.sampled_from([1, 3, 25, 60, 1000])),
        gate_margin=draw(st.sampled_from([None, 0.0, 0.15])) if gated else None,
    )


@st.composite
def motions(draw, jumps=False):
    """Edges with gaps from too fast to at rest, with reversals, glitches, and (if so) changes of both lines."""
    t, state, edges = draw(st.integers(FIRST, 30)), draw(st.integers(0, 3)), []
    initial = state
    pace = draw(st.sampled_from([3, 12, 40]))
    for _ in range(draw(st.integers(0, 45))):
        t += draw(st.one_of(st.integers(1, pace), st.just(pace), st.integers(1, 3 * pace)))
        if t >= UNTIL - 40:
            break
        turn = draw(st.sampled_from([1, 1, 1, 1, -1, -1] + ([2] if jumps else [])))
        state = (state + turn) % 4
        edges.append((t, state ^ (state >> 1)))
    return initial ^ (initial >> 1), edges


@st.composite
def all_orders(draw, power):
    kinds = ["ask", "ask", "ask", "switch"] + (["power"] if power else [])
    orders = []
    t = FIRST
    for _ in range(draw(st.integers(1, 8))):
        t += draw(st.integers(0, 60))
        what = draw(st.sampled_from(kinds))
        value = draw(st.integers(-3, 3)) if what == "ask" else draw(st.integers(0, 1))
        orders.append((min(t, UNTIL - 1), what, value))
    return orders


def run_face(box, initial, edges, orders):
    """Hand the face edges and orders in the order of their times; return all that came out."""
    made, level, done = [], initial, 0

    def pass_on(until):
        nonlocal level, done
        part = [edge for edge in edges[done:] if edge[0] < until]
        done += len(part)
        stream = EdgeStream([t for t, _ in part], [ab for _, ab in part], initial=level)
        out = box.process(stream, until_ps=until)
        made.extend(zip(out.times_ps.tolist(), map(text, out.levels.tolist()), strict=True))
        level = stream.final

    pass_on(FIRST)
    for t, what, value in orders:
        pass_on(t)
        if what == "ask":
            box.request(value, at_ps=t)
        elif what == "switch":
            box.enable(bool(value), at_ps=t)
        else:
            box.power(bool(value), at_ps=t)
    pass_on(UNTIL)
    return made


def compare(design, timing, motion, orders, hold, release, legal):
    settings_ = InjectorSettings(
        design=design,
        timing=timing,
        real_edges=RealEdges.HOLD if hold else RealEdges.MERGE,
        power_loss=PowerLoss.RELEASE if release else PowerLoss.KEEP,
    )
    initial, edges = motion
    box = Injector(settings_, initial=initial)
    made = run_face(box, initial, edges, orders)
    # the gate's figure from its definition: four or two quarters of the worst insertion, with the margin
    copying = timing.latency_ps if design is Design.B else 0
    worst = timing.poll_ps + copying + timing.decide_ps + (design.step_counts - 1) * timing.step_ps
    quarters = 4 if design is Design.ORIGINAL else 2
    gate = 0 if timing.gate_margin is None else round(quarters * worst * (1 + timing.gate_margin))
    oracle = BoxOracle(
        design=design.value,
        poll=timing.poll_ps,
        offset=timing.poll_offset_ps,
        decide=timing.decide_ps,
        step=timing.step_ps,
        recover=timing.recover_ps,
        latency=timing.latency_ps,
        rest=timing.rest_ps,
        gate=gate,
        hold=hold,
        release_inverters=release,
        lines=text(initial),
    )
    lived = live(oracle, [(t, text(ab)) for t, ab in edges], orders, FIRST, UNTIL)
    assert made == lived.edges
    saw = box.insertions
    assert (saw.requested, saw.completed, saw.inserted) == (oracle.requested, oracle.completed, oracle.inserted)
    assert (saw.refused, saw.real_inside, saw.longest_ps) == (oracle.refused, oracle.inside, oracle.longest)
    if legal:
        assert (saw.ahead_counts, saw.illegal) == (lived.ahead, lived.illegal)


@pytest.mark.parametrize("design", list(Design))
@compiles
@given(st.data(), st.booleans(), st.booleans())
def test_box_gives_the_edges_and_totals_of_the_oracle(design, data, hold, release):
    timing = data.draw(timings(gated=True))
    compare(design, timing, data.draw(motions()), data.draw(all_orders(power=False)), hold, release, legal=True)


@pytest.mark.parametrize("design", list(Design))
@compiles
@given(st.data(), st.booleans(), st.booleans())
def test_box_with_power_coming_and_going_is_the_oracles(design, data, hold, release):
    timing = data.draw(timings(gated=False))
    compare(design, timing, data.draw(motions()), data.draw(all_orders(power=True)), hold, release, legal=True)


@pytest.mark.parametrize("design", list(Design))
@compiles
@given(st.data(), st.booleans())
def test_box_passes_jumps_of_the_encoder_as_the_oracle_does(design, data, hold):
    timing = data.draw(timings(gated=True))
    motion = data.draw(motions(jumps=True))
    compare(design, timing, motion, data.draw(all_orders(power=True)), hold, False, legal=False)
