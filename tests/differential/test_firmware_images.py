"""The box's firmware: what is committed is what assembles, and on ucsim it does what the report says."""

import importlib.util
import itertools
import shutil

import pytest
from firmware_bench import GO_HOME, IMAGES, STATES, Session, absent, count_of, output, symbols

DESIGNS = ("original", "a", "b", "c")
STEP_COUNTS = {"original": 4, "a": 4, "b": 1, "c": 2}
OK, NOT_HOMED, IN_PROBING, DISABLED, DONT_BELIEVE, STILL_DONT_BELIEVE = range(6)
# 12 MHz cycles from the one in which the lines are looked at to the one that changes the first pin
FIRST_CHANGE = {"original": 6, "a": 8, "c": 6}
CHANGES = {"original": 4, "a": 4, "c": 2}

# what A and C say to the PC is the same source as what the Original says
TALKING = [pytest.param(name, marks=pytest.mark.sweep) if name in "ac" else name for name in DESIGNS]
needs_sdcc = pytest.mark.skipif(shutil.which("sdas8051") is None, reason="SDCC (sdas8051, sdld) is not installed")
needs_s51 = pytest.mark.skipif(absent(), reason="ucsim (s51) is not installed")


@pytest.fixture(scope="module")
def build():
    spec = importlib.util.spec_from_file_location("firmware_build", IMAGES / "build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# assembling


@needs_sdcc
def test_the_committed_outputs_are_what_the_sources_assemble_to(build, capsys):
    assert build.main(["--check"]) == 0, capsys.readouterr().err


@needs_sdcc
def test_check_finds_an_output_that_is_not_of_its_source(build, tmp_path, capsys):
    for name in ("original.asm", "original.ihx", "original.lst", "original.sym"):
        shutil.copyfile(IMAGES / name, tmp_path / name)
    source = tmp_path / "original.asm"
    assert build.main(["--check", str(source)]) == 0
    text = source.read_text(encoding="utf-8").replace("= GATE_ORIGINAL", "= GATE_ORIGINAL + 1")
    source.write_text(text, encoding="utf-8")
    assert build.main(["--check", str(source)]) == 1
    assert "original.ihx: differs" in capsys.readouterr().err


def test_a_source_that_is_not_there_is_an_error(build, tmp_path, capsys):
    assert build.main([str(tmp_path / "none.asm")]) == 2
    assert "none.asm: no such source" in capsys.readouterr().err


# the handshake


@needs_s51
@pytest.mark.parametrize("name", TALKING)
def test_it_starts_reports_home_and_stays_in_its_main_loop(name):
    session = Session(name)
    session.skip(1500)
    session.words()
    session.ask(5, GO_HOME)  # home is taken with a request of zero alone
    session.skip(1500)
    session.words()
    session.ask(0, GO_HOME)
    session.set_count(0)
    session.skip(1500)
    session.words()
    session.ask(0)
    session.trace(3000)
    session.words()
    looks, (before, nonzero, home, later) = session.play()
    assert [w.message for w in (before, nonzero, home, later)] == [NOT_HOMED, NOT_HOMED, OK, OK]
    assert (home.position, home.completed, home.accepted) == (0, 0, 0)
    place = symbols(name)
    ticks = [look.cycle for look in looks if look.pc == place["tick"]]
    assert len(ticks) >= 4
    assert all(990 <= later - sooner <= 1010 for sooner, later in itertools.pairwise(ticks))
    assert max(look.pc for look in looks) < 0x400
    drives = {look.p1 & 0x8F for look in looks}
    assert drives == {0x8F}, "nothing is driven without a correction"


# insertions


def written(name, total, *, quarter, edges, direction=1, lead=40):
    """A session in which the axis moves and ``total`` is asked for, not yet played."""
    session = Session(name)
    session.home()
    session.ask(total)
    session.trace(lead)
    for _ in range(edges):
        session.move(direction)
        session.trace(quarter)
    session.trace(80)
    session.words()
    return session


def moving(name, total, *, quarter, edges):
    """Such a session, its looks and last words on ucsim."""
    session = written(name, total, quarter=quarter, edges=edges)
    looks, (words,) = session.play()
    return session, looks, words


def insertions(name, looks):
    """Levels before an insertion, after each of its changes, cycles of the changes, and the look before them."""
    found = []
    changed = [k for k in range(1, len(looks)) if (looks[k].p1 ^ looks[k - 1].p1) & 0x0F]
    size = CHANGES[name]
    for begin in range(0, len(changed), size):
        at = changed[begin : begin + size]
        levels = [output(name, looks[k]) for k in (at[0] - 1, *at)]
        edge = max(k for k in range(1, at[0]) if looks[k].lines != looks[k - 1].lines)
        found.append((levels, [looks[k].cycle for k in at], looks[edge - 1].cycle, looks[edge].cycle))
    return found


@pytest.mark.one_in(5)
@needs_s51
@pytest.mark.parametrize("total", [3, -3])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", ["original", "a", "c"])
def test_pins_change_in_the_right_order_and_time(name, direction, total):
    session = written(name, total, quarter=60, edges=60, direction=direction)
    looks, (words,) = session.play()
    found = insertions(name, looks)
    sign = 1 if total > 0 else -1
    assert words.completed == total
    assert len(found) == 3
    for levels, cycles, before_edge, after_look in found:
        start = STATES.index(levels[0])
        assert levels[1:] == [STATES[(start + sign * k) % 4] for k in range(1, len(levels))]
        if name == "original":
            assert levels[0] == (0, 0)
        assert [later - sooner for sooner, later in itertools.pairwise(cycles)] == [1] * (len(cycles) - 1)
        # JB or JNB, two cycles long, is the first instruction after the edge; its first cycle looks
        assert after_look - before_edge == 2
        first_cycle_of_change = cycles[0] - 1
        assert first_cycle_of_change - before_edge == FIRST_CHANGE[name]


@pytest.mark.one_in(3)
@needs_s51
@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("total", [3, -3])
@pytest.mark.parametrize("quarter", [9, *(pytest.param(n, marks=pytest.mark.sweep) for n in (11, 12, 13)), 20])
def test_every_count_arrives(name, total, quarter):
    """Over many phases between edges and program: what is reported is in the lines, and nothing else is."""
    if name == "b":
        quarter = 3 * quarter + 6  # its limit is at about 36 us between edges
    session, looks, words = moving(name, total, quarter=quarter, edges=2000 // quarter)
    counts, illegal = count_of([output(name, look) for look in looks])
    assert illegal == 0
    assert counts == session.count + STEP_COUNTS[name] * words.completed
    if quarter >= 12:  # 20 us and more from edge to edge: no gate is in the way
        assert words.completed == total


@pytest.mark.one_in(2)
@needs_s51
@pytest.mark.parametrize("name", ["original", "a", "c"])
@pytest.mark.parametrize("quarter", [3, 4, 5])
def test_too_fast_is_refused(name, quarter):
    """8 us from edge to edge or less: no insertion of the Original or A fits, none of C with its reserve."""
    _session, looks, words = moving(name, 3, quarter=quarter, edges=2600 // quarter)
    assert words.completed == 0
    assert {look.p1 & 0x0F for look in looks} == {0x0F}
    if quarter == 5:  # faster than that the decoder alone tells, and no search begins
        assert words.refused > 10


@pytest.mark.one_in(3)
@needs_s51
@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("state", range(4))
def test_at_rest_it_just_starts(name, state):
    """The Original in state 1 only, the others in any."""
    session = Session(name)
    session.home()
    for _ in range(state):
        session.move(1)
        session.skip(200)
    session.skip(1300)
    session.ask(-2)
    session.trace(1500)
    session.words()
    looks, (words,) = session.play()
    made = 0 if name == "original" and state != 0 else -2
    assert words.completed == made
    assert count_of([output(name, look) for look in looks]) == (STEP_COUNTS[name] * made, 0)


@needs_s51
def test_design_b_copies_within_its_limit():
    """Without a correction the lines come out as they went in, 8 cycles after the look that sees them."""
    _, looks, _ = moving("b", 0, quarter=40, edges=60)
    out = [output("b", look) for look in looks]
    assert count_of(out) == (60, 0)
    delays, waiting = [], None
    for k in range(1, len(looks)):
        if looks[k].lines != looks[k - 1].lines:
            waiting = looks[k - 1].cycle
        if out[k] != out[k - 1]:
            delays.append(looks[k].cycle - 1 - waiting)
    assert len(delays) == 60
    assert 8 <= min(delays)
    assert max(delays) <= 44
