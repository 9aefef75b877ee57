"""Both sides of the handshake against plain models; test_machine_rest.py has both together over any latency."""

from dialogue import Answer, BoxSide, PcSide
from handshake_oracle import BoxWords, PcWords
from hypothesis import settings, strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import Status


class BoxIsTheOracle(RuleBasedStateMachine):
    """Any words at all reach the box; its totals and its status are those of the plain model."""

    @initialize(window=st.integers(1, 5), grace=st.integers(0, 3), switch_on=st.booleans())
    def begin(self, window, grace, switch_on):
        handshake = HandshakeSettings(window_steps=window, grace_readings=grace)
        self.box = BoxSide(handshake, switch_on=switch_on)
        self.words = BoxWords(window=window, grace=grace, switch_on=switch_on)

    @rule(count=st.integers(-500, 500))
    def home(self, count):
        self.answer = self.box.home(count=count)
        self.words.command_home(count)
        self.check(count)

    @rule(
        by=st.one_of(st.integers(-5, 5), st.sampled_from([-200, 127, 128, 32767, 40000])),
        large=st.sampled_from([False, False, False, True]),
        probing=st.sampled_from([False, False, False, True]),
        count=st.integers(-500, 500),
    )
    def read(self, by, large, probing, count):
        total, before = self.words.accepted + by, self.words.accepted
        self.answer = self.box.read(total=total, count=count, large=large, probing=probing)
        self.words.read(total, large=large, probing=probing)
        self.words.completed = self.words.accepted
        self.check(count)
        # the law that the window is there for
        assert abs(self.answer.accepted - before) <= self.words.window or large

    @rule(on=st.booleans())
    def switch(self, on):
        self.box.switch(on)
        self.words.switch_on = on

    @rule(count=st.integers(-500, 500))
    def trip(self, count):
        assert self.box.trip(count=count) == count - self.words.home

    def check(self, count):
        assert self.answer.status.name == self.words.status
        assert (self.answer.accepted, self.box.refused) == (self.words.accepted, self.words.refused)
        assert self.answer.position == count - self.words.home


class PcIsTheOracle(RuleBasedStateMachine):
    """Any words at all reach the PC; its requests are those of the plain model."""

    @initialize(
        window=st.integers(1, 5),
        limit=st.sampled_from([2, 9, 127, 32767]),
        step=st.sampled_from([1, 2, 4]),
        margin=st.sampled_from([0.0, 0.03, 0.25]),
    )
    def begin(self, window, limit, step, margin):
        handshake = HandshakeSettings(window_steps=window, rounding_margin=margin, reversal_mm=0.0205)
        self.pc = PcSide(handshake, count_mm=0.001, step_counts=step, word_limit=limit)
        self.words = PcWords(window, limit, 0.001 * step, 0.001, 0.0205, margin)

    @rule(
        position=st.one_of(st.just(0), st.integers(-60, 60)),
        step=st.integers(-4, 4),
        status=st.sampled_from([Status.OK] * 8 + list(Status)[:5]),
        follow=st.integers(0, 3),
        deviation_um=st.integers(-40, 40),
    )
    def turn(self, position, step, status, follow, deviation_um):
        # mostly the box has taken the last request over
        accepted = self.words.sent if follow else self.words.sent + step
        deviation = deviation_um * 0.0013
        words = Answer(position=position, completed=accepted, accepted=accepted, status=status)
        sent = self.pc.turn(words, deviation_mm=deviation)
        self.words.turn(position, accepted, status.name, deviation)
        assert self.pc.state.name == self.words.state
        assert (sent, self.pc.direction) == (self.words.sent, self.words.direction)
        assert self.pc.beyond_word == self.words.beyond

    @rule()
    def allow_large_correction(self):
        self.pc.allow_large_correction()
        self.words.large_meant = True

    @rule(probing=st.booleans())
    def probe(self, probing):
        self.pc.probe(probing)
        self.words.probing = probing

    @precondition(lambda self: self.words.state == "ACTIVE")
    @rule()
    def fatal(self):
        words = Answer(position=0, completed=0, accepted=0, status=Status.I_STILL_DONT_BELIEVE_YOU)
        before = self.words.sent
        assert self.pc.turn(words, deviation_mm=1.0) == before
        self.words.turn(0, 0, "I_STILL_DONT_BELIEVE_YOU", 1.0)
        assert self.pc.state.name == "HOLD"


TestBoxIsTheOracle = BoxIsTheOracle.TestCase
TestPcIsTheOracle = PcIsTheOracle.TestCase
TestBoxIsTheOracle.settings = settings(deadline=None, max_examples=60, stateful_step_count=40)
TestPcIsTheOracle.settings = settings(deadline=None, max_examples=100, stateful_step_count=40)
