"""What box and PC are doing, in a sentence for the operator."""

from __future__ import annotations

from rtec.machine.station import Alarm, StationView
from rtec.requester.pc_node import PcView
from rtec.requester.settings import PcState
from rtec.requester.status import BoxState, Status
from rtec.requester.supervision import HoldReason

ALARM_WORDS = {
    Alarm.FOLLOWING: "the controller stopped the drive: the axis does not follow its command",
    Alarm.ILLEGAL: "the controller stopped the drive: both of its lines changed at once",
}

_SHOWN = 5


def box_words(view: StationView) -> str:
    """Return what the axis and its box are doing.

    Examples
    --------
    >>> from rtec.machine.station import Station, StationSettings
    >>> box_words(Station(StationSettings()).view)
    'not homed: at home it waits for a PC'
    """
    if view.status is Status.SETUP_DIFFERS and view.powered and view.expected is not None:
        options = view.setup.options_that_differ(view.expected)
        return (
            f"the PC on the bus is set up for {view.expected}; this box has {view.setup}: "
            f"start both with the same {options}"
        )
    if not view.powered:
        return "the box has no power: A and B go through as they are, and the machine is held"
    words = view.status.meaning
    if view.status is Status.LINK_LOST:
        words = f"{words}; {refused_words(view)}"
    if view.box_state is BoxState.FATAL:
        words = f"stopped for good, hold contact open: {words}"
    if view.alarm is not Alarm.NONE:
        words = f"{words}; {ALARM_WORDS[view.alarm]}"
    if not view.switch_on and view.status is not Status.DISABLED:
        words = f"{words}; its switch forbids corrections"
    if view.homing and view.box_state is not BoxState.NOT_HOMED:
        words = f"{words}; taken home, where it stays until a PC starts up anew (rtec pc --reset)"
    return words


def refused_words(view: StationView) -> str:
    """Return which frames were heard in place of a valid request, and why the box did not take them."""
    found = [
        f"{times} x {identifier:#05x} ({why})"
        for (identifier, why), times in sorted(view.refused_since_heard.items(), key=lambda item: -item[1])
    ]
    if not found:
        return "nothing was heard"
    more = f", {len(found) - _SHOWN} other kinds" if len(found) > _SHOWN else ""
    return f"heard and not taken: {', '.join(found[:_SHOWN])}{more}"


def pc_words(view: PcView) -> str:
    """Return what the PC is doing about an axis."""
    if view.state is PcState.HOLD:
        return f"the machine is held: {reason_words(view)}"
    if view.state is PcState.ACTIVE:
        words = "active"
        if view.status is not None and view.status is not Status.OK:
            words = f"active; the box says: {view.status.meaning}"
        elif view.outside:
            words = f"active; the predictor does not know what it sees: {view.outside}"
        return words
    return waiting_words(view)


def waiting_words(view: PcView) -> str:
    """Return what the start-up waits for."""
    if not view.connected or view.box_state is None:
        return "waiting: nothing heard from the box"
    if view.box_state is BoxState.FATAL:
        why = "" if view.status is None else f": {view.status.meaning}"
        return f"waiting: the box has stopped for good{why}"
    if view.box_state is BoxState.NOT_HOMED:
        return "waiting: the box is heard; the axis has to stand at home ('home' at the box)"
    return "waiting: the box is homed; it has to report the home position (does another PC run it?)"


def reason_words(view: PcView) -> str:
    """Return why the machine is held, and what to do."""
    if view.reason is HoldReason.PREDICTOR_OUT_OF_RANGE and view.outside:
        return f"the predictor does not know what it sees: {view.outside}; --outside keep or zero goes on without it"
    ours, boxes = view.setup, view.box_setup
    if view.reason is not HoldReason.SETUP_DIFFERS or ours is None or boxes is None:
        return view.reason.meaning
    options = ours.options_that_differ(boxes)
    return f"the box has {boxes}; this PC is set up for {ours}: start both with the same {options}"


def hold_words(view: PcView) -> str:
    """Return the reason's name as in the message, and what it means."""
    return f"{view.reason.name}: {reason_words(view)}"
