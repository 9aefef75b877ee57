"""Both sides of the handshake against plain models, and both together over links with any latency."""

from dialogue import Answer, BoxSide, PcSide
from handshake_oracle import BoxWords, PcWords
from hypothesis import Phase, given, settings, strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from rtec._jit import new_record
from rtec.link import _kernels as link
from rtec.requester import _box_kernels as box_kernels, _pc_kernels as pc_kernels
from rtec.requester.settings import HandshakeSettings
from rtec.requester.status import Status

compiles = settings(deadline=None)
MS = 10**9


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


@st.composite
def handshakes(draw):
    box_period = draw(st.sampled_from([1, 2, 5])) * MS
    pc_period = draw(st.sampled_from([3, 10, 50])) * MS
    latency = draw(st.integers(0, 15 * min(box_period, pc_period)))
    return HandshakeSettings(
        window_steps=draw(st.integers(1, 4)),
        box_period_ps=box_period,
        pc_period_ps=pc_period,
        latency_ps=latency,
        update_ps=draw(st.sampled_from([0, 20 * 10**6])),
        retry_ps=draw(st.sampled_from([50 * 10**6, 300 * 10**6])),
    )


class Pair:
    """Box and PC over two mailboxes, each at its own pace; the injector inserts at once."""

    def __init__(self, handshake, limit, *, box_first_ps, pc_first_ps):
        self.handshake = handshake
        self.box, self.pc = new_record(box_kernels.BOX), new_record(pc_kernels.PC)
        self.down, self.up = new_record(link.MAILBOX), new_record(link.MAILBOX)
        for mailbox in (self.down, self.up):
            link.mailbox_reset(mailbox)
            mailbox.latency_ps = handshake.latency_ps
        handshake.fill_box(self.box)
        handshake.fill_pc(self.pc, count_mm=0.001, step_counts=1, word_limit=limit)
        box_kernels.box_reset(self.box, box_first_ps)
        pc_kernels.pc_reset(self.pc, pc_first_ps)
        self.log = []  # (time, who, what)

    def run(self, until_ps, deviation, orders=None):
        orders = list(orders or [])
        box, pc = self.box, self.pc
        while (t := int(min(box.next_ps, pc.next_ps))) < until_ps:
            while orders and orders[0][0] <= t:
                orders.pop(0)[1](pc)
            if box.next_ps == t:
                before = int(box.accepted)
                large = bool(self.down.word1 & box_kernels.LARGE_CORRECTION)
                box_kernels.box_tick(box, self.down, self.up, t, 0, before)
                large = large or bool(self.down.word1 & box_kernels.LARGE_CORRECTION)
                self.log.append((t, "read", int(self.down.word0), before, int(box.accepted), large))
            else:
                pc_kernels.pc_start(pc, self.down, t)
                if pc_kernels.pc_read(pc, self.up, t):
                    pc_kernels.pc_request(pc, self.down, t, deviation(t))
                    self.log.append((t, "asked", int(pc.sent), int(pc.accepted), int(pc.status), 0))
                assert pc.next_ps > t


@settings(deadline=None, max_examples=40, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(
    handshakes(),
    st.sampled_from([0, 3, 10, 127]),
    st.lists(st.tuples(st.integers(0, 600), st.integers(-30, 30)), min_size=1, max_size=5),
    st.lists(st.integers(0, 600), max_size=2),
    st.integers(0, 3 * 10**9),
)
def test_the_pair_always_gets_there_and_never_doubts(handshake, limit, wishes, large_at, pc_first_ps):
    """Over any latency: no request is doubted, none moves before the last was sampled, the goal is reached."""
    pair = Pair(handshake, limit, box_first_ps=300_000_000, pc_first_ps=pc_first_ps)
    wishes = sorted(wishes)

    def deviation(t):
        past = [um for at, um in wishes if at * MS <= t]
        return (past[-1] if past else 0) * 0.001

    def allow_large_correction(pc):
        pc.large_meant = 1

    last = 600 * MS
    turns = 60 // handshake.window_steps + 10
    slowest = handshake.pc_period_ps + 2 * handshake.latency_ps + 2 * handshake.box_period_ps
    end = last + turns * (slowest // handshake.pc_period_ps + 1) * handshake.pc_period_ps
    pair.run(end, deviation, [(at * MS, allow_large_correction) for at in sorted(large_at)])
    box, pc = pair.box, pair.pc
    assert (int(box.refused), int(box.state), int(pc.state)) == (0, box_kernels.RUNNING, pc_kernels.ACTIVE)
    goal = max(-limit, min(limit, wishes[-1][1]))
    assert int(box.accepted) == int(pc.sent) == goal
    assert int(pc.beyond_word) == abs(wishes[-1][1] - goal)
    assert (int(pair.up.lost), int(pair.down.lost)) == (0, 0)
    sent, read = 0, []
    for t, who, word, accepted, after, large in pair.log:
        if who == "read":
            read.append(word)
            assert abs(after - accepted) <= handshake.window_steps or large
        else:
            assert word == sent or sent in read or sent == 0, t
            if word != sent:
                read = []
            sent = word
            assert abs(word) <= limit


@compiles
@given(st.integers(1, 3), st.integers(-40, 40).filter(lambda um: abs(um) > 4))
def test_a_glitch_of_two_readings_is_forgiven_and_of_three_is_not(length, by):
    box = BoxSide(HandshakeSettings())
    box.home(count=0)
    box.read(total=2, count=0)
    for k in range(length):
        status = box.read(total=2 + by, count=0).status
        assert status is (Status.I_STILL_DONT_BELIEVE_YOU if k == 2 else Status.I_DONT_BELIEVE_YOU)
    answer = box.read(total=3, count=0)
    assert (answer.accepted, answer.status) == (
        (3, Status.OK) if length < 3 else (2, Status.I_STILL_DONT_BELIEVE_YOU)
    )
