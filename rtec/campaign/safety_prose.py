"""The words of the safety case that no run changes: what is tried, what is said of a run, what remains."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from rtec.campaign.safety_matrix import LATE_S

_WIDTH = 118

QUOTE = (
    '"Every precaution must be taken to avoid mistakes. The errors that can be introduced into the machining process '
    'are enormous, while the errors that can be compensated are small!" (Yee 1992, General Considerations). This '
    "page is what the emulator says to that. It is made by"
)

REFERENCE = (
    "Box, PC and bus are the two state machines of the package in simulated time, with all their frames; the axis is "
    "a servo that follows a program, with counts of 1 um. The PC corrects by a table that changes by up to 20 um a "
    "millimetre and has a backlash of 10 um. Every millisecond the count at the controller is held against a "
    "**reference that knows nothing of box, link and PC**: the true count of the encoder, before its cable, and the "
    "deviation that the healthy table has where the axis truly is, in the direction in which it truly moves. A run "
    "without the fault, the same in everything else, is its twin."
)

WORDS = (
    (
        "**tolerated**",
        "nobody stops the machine; in the end, at rest, the controller has exactly the encoder's counts and those of "
        "the steps that the box says are completed; the total is the one to be wanted there, to within rounding; and "
        "it was never off by more than one count beyond its twin, nor for more than 5 ms longer",
    ),
    (
        "**delayed**",
        "as tolerated in the end, but meanwhile it was off by more, or for longer; never for more than "
        f"{LATE_S:.2f} s beyond its twin",
    ),
    (
        "**safe stop**",
        "somebody says so and the feed stops: the PC (HOLD on the bus, feed hold), the box (its hold contact opens; "
        "without power it is open), the controller (an illegal transition at its input, or the axis does not follow "
        "by 1 mm); or the axis is not let go, because box and PC do not agree that it is at home",
    ),
    ("**undetected**", "anything else: wrong counts, and nobody says so"),
    ("–", "the fault cannot take effect there ([why](#what-is-not-applicable))"),
)

ALLOWED = (
    '"Off" takes the age of a position into account: 60 ms of motion, for two cycles of the box, a turn of the PC, a '
    "frame lost and an insertion. Steps that the speed gate still refuses are delayed, not wrong: box and PC know of "
    'them. A fault "for good" lasts to the end of the run; where there is nothing to act on in its phase, it takes '
    'effect in the next one. "Corrupted" means that one to three bits are wrong, "masquerade" that a bit is wrong '
    "under a checksum that is right: in a request one of the lower eight of the total, which says the same in its "
    "inverse."
)

PHASES = (
    ("start-up", "homing: the boxes take their homes, the PC waits for them"),
    ("at rest", "in position for two seconds, then on"),
    ("cutting", "2 mm/s, with a correction every 0.1 to 0.3 s"),
    ("rapid", "7 m/min: the gates of Original, A and C refuse on the report's 8051"),
    ("reversal", "the 30 ms around the turn, in which the backlash is corrected"),
    (
        "insertion",
        "box and encoder: while the pulses of a correction go out; bus and PC: the request that asks for it",
    ),
    ("probing", "announced by the PC: nothing is corrected"),
    ("large correction", "the table of a hot machine, 60 um away, comes at once under the flag Large Correction"),
)

DESIGN_B = (
    'The processor stands in the lines: where it fails, so do they, and only the controller can notice ("the machine '
    'tool controller must be relied on to fail gracefully with loss of position feedback"). Here it is fast logic; '
    "on the 8051 Design B loses its lines at the rapid traverse, without any fault ([envelope](envelope.md))."
)

DETECTION = (
    "All designs and phases together. The time goes from the fault's first effect to the moment at which the first "
    "axis is stopped; the feed then takes 50 ms to come down. The last column is the largest number of counts that a "
    "controller was off until then, more than in the fault-free run; a fault before the box is in it with what the "
    "encoder lost. Long times are those in which the fault had nothing to act on: before an axis is homed, while it "
    "is probing, or where nothing was asked for."
)

UPSTREAM = (
    "**The encoder's lines before the box.** Box and controller see the same wrong lines, so no comparison between "
    "them can tell: a line that freezes for a while, a pair of glitches that counts. What is lost is lost for good, "
    "until an index or another home. The controller's own check, 1 mm beyond the lag of the feed, is too wide for "
    '50 ms at 2 mm/s (100 counts). The column "a speed check" is by how much more than without the fault the axis '
    "seemed to be off its command (median): a check narrower than that would have caught it."
)

WITHOUT_POWER = (
    "**Design B without power.** Its outputs are dead: the controller sees an axis that does not move. The box's "
    "hold contact, which is open without power, stops the machine, but the counts of the way to the stop are lost, "
    "and without that contact wired only the controller's check of the following error is left. The report says "
    "as much."
)

LARGE = (
    "**A masquerading request while Large Correction is meant.** The flag opens the window, so whatever total "
    "arrives with it under a right checksum is begun, until the PC reads what the box has accepted (the "
    "counts stand above, and `limit_steps` bounds them). The paper's window is of no help there; sequence, session, "
    "checksum and inverted total are."
)

RUNAWAY = (
    "**A PC that runs away within every window.** Its prediction drifts by 60 um a second: a step or so with every "
    "request, each of them right in form and within the window. No handshake can tell that from a machine that grows "
    "warm. What helps is a limit of the plausible, an option at either side: `limit_steps` in the box, `limit_mm` in "
    "the PC."
)

BEYOND = (
    "**What nothing here supervises**: a home switch that is wrong, a table that is wrong from the beginning, an "
    "axis pushed while everything is off. They are the same for every corrector."
)


def filled(text: str) -> str:
    """Return a paragraph in lines of at most 118 characters.

    Examples
    --------
    >>> filled("a b")
    'a b'
    """
    return textwrap.fill(" ".join(text.split()), _WIDTH, break_long_words=False, break_on_hyphens=False)


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table in Markdown.

    Examples
    --------
    >>> print(table(["a", "b"], [[1, 2]]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = [headings, ["---"] * len(headings), *rows]
    shown = ["| " + " | ".join(str(cell) for cell in line) + " |" for line in lines]
    shown[1] = "|" + "---|" * len(headings)
    return "\n".join(shown)
