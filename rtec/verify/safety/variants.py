"""The faults of the safety campaign: every class, once, for a while and for good, at either side."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rtec.errors import ArgumentError, meant
from rtec.injector import Design
from rtec.link._bus_kernels import bits_of
from rtec.link._frame_kernels import CORRECTIONS, POSITION, REQUEST, STATUS
from rtec.machine.fault_kinds import (
    LATCH_STUCK,
    PROCESSOR_HUNG,
    ActivatedBy,
    FaultCategory,
    FaultKind,
    FaultPlace,
    FaultRow,
)
from rtec.machine.faults import PC_NODE, Fault, Trigger
from rtec.units import PS_PER_MS
from rtec.verify.safety.phases import Phase, hyphened

_K = FaultKind
_MANY = 1 << 40
_LATE_PS = 15 * PS_PER_MS
_STOPS_PROCESSOR = (FaultKind.POWER_LOST, FaultKind.BOX_RESTARTED, PROCESSOR_HUNG)
_SHORT: dict[FaultRow, str] = {FaultKind.FRAME_CORRUPTED: "frame corrupted", FaultKind.FRAME_MASQUERADE: "masquerade"}
_WRAPPED_PS = 2_560 * PS_PER_MS
"""256 turns of the PC: the sequence counter has come round."""


class From(enum.Enum):
    """Whose frames a fault trigger, or where it is."""

    PC = "PC to box"
    BOX = "box to PC"
    BUS = "bus"
    AXIS = "box"
    ENCODER = "encoder"
    PROGRAM = "PC"


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """A class of faults with its place and its length."""

    kind: FaultRow
    where: From
    """``kind``, ``where``: class and place."""
    how: str
    """In words: once, for how long, for good."""
    frames: int = 0
    """Frames that it affects; 0 for all while it lasts."""
    lasts_ps: int = 0
    """How long it lasts; 0 for good."""
    delay_ps: int = 0
    """Delay of frames, or jump of the clock."""
    window: int = 0
    """Of a masquerading request: +1 within the box's window, -1 beyond it, 0 either."""

    @property
    def name(self) -> str:
        """Return class, length and place in words.

        Examples
        --------
        >>> VARIANTS[0].name
        'frame lost, once, PC to box'
        """
        words = _SHORT.get(self.kind, self.kind.words)
        place = f", {self.where.value}" if self.where in (From.PC, From.BOX) else ""
        return f"{words}, {self.how}{place}" if self.how else f"{words}{place}"

    @property
    def place(self) -> str:
        """Return where it happens, in a word: ``bus``, ``pc``, ``box``, or ``lines`` for those before the box."""
        at_box = self.kind.place is FaultPlace.AXIS and not self.upstream
        return "box" if at_box else "lines" if self.upstream else self.kind.place.value.lower()

    @property
    def upstream(self) -> bool:
        """Return whether it happens before the box."""
        return self.kind.category is FaultCategory.ENCODER

    def beyond_supervision(self, design: Design) -> str | None:
        """Return where wrong counts begin that neither box nor PC can catch; None: they can catch all that it does.

        A fault of the encoder's lines is the same for box and controller. Lines that pass through a processor are
        lost with it: the controller "must be relied on to fail gracefully with loss of position feedback" (Yee 1992,
        General Considerations).
        """
        if self.upstream:
            return "before the box"
        return "with the processor" if design.in_path and self.kind in _STOPS_PROCESSOR else None

    def fault(self, phase: Phase, moment_ps: int, seed: int, *, axis: int = 1) -> Fault:
        """Return the fault at a moment of a phase."""
        place: int | None = None
        identifier: int | None = None
        if self.kind.place is FaultPlace.AXIS:
            place = axis
        elif self.where is From.PC:
            place = PC_NODE
            identifier = None if self.kind is _K.BUS_OFF else REQUEST + axis
        elif self.where is From.BOX:
            place = axis
            one = self.frames > 0 or self.kind in (_K.REQUEST_STUCK, _K.FRAMES_REORDERED)
            identifier = (STATUS, CORRECTIONS, POSITION)[seed % 3] + axis if one else None
            identifier = None if self.kind is _K.BUS_OFF else identifier
        waits = phase is Phase.INSERTION and self.kind.place is FaultPlace.AXIS and self.kind is not LATCH_STUCK
        return Fault(
            kind=self.kind,
            place=place,
            from_ps=moment_ps,
            until_ps=moment_ps + self.lasts_ps if self.lasts_ps else None,
            identifier=identifier,
            most=self.frames or _MANY,
            delay_ps=self.delay_ps,
            seed=self._bits(seed),
            trigger=Trigger.WHILE_INSERTING if waits else Trigger.AT_ONCE,
        )

    def _bits(self, seed: int) -> int:
        """Return a seed with which a masquerading total changes by 1 or 2 steps, or by more than the window."""
        if self.window == 0:
            return seed
        while (bits_of(seed, 0) % 8 < 2) != (self.window > 0):
            seed += 1000
        return seed


def _both(kind: FaultKind, how: str, **more: int) -> list[Variant]:
    return [Variant(kind=kind, where=where, how=how, **more) for where in (From.PC, From.BOX)]


def _brief(kind: FaultKind, where: From, lasts_ps: int) -> list[Variant]:
    """Return a fault for a while and for good."""
    brief = Variant(kind=kind, where=where, how=f"for {lasts_ps // PS_PER_MS} ms", lasts_ps=lasts_ps)
    return [brief, Variant(kind=kind, where=where, how="for good")]


VARIANTS: tuple[Variant, ...] = (
    *_both(_K.FRAME_LOST, "once", frames=1),
    *_both(_K.FRAME_LOST, "for 30 ms", lasts_ps=30 * PS_PER_MS),
    *_both(_K.FRAME_LOST, "for good"),
    *_both(_K.FRAME_LATE, "by 15 ms once", frames=1, delay_ps=_LATE_PS),
    *_both(_K.FRAME_LATE, "by 15 ms for good", delay_ps=_LATE_PS),
    *_both(_K.FRAME_LATE, "by a turn of the counter", frames=1, delay_ps=_WRAPPED_PS),
    *_both(_K.FRAME_DUPLICATED, "once", frames=1, delay_ps=_LATE_PS),
    *_both(_K.FRAME_DUPLICATED, "for good", delay_ps=_LATE_PS),
    *_both(_K.FRAMES_REORDERED, "once", frames=1),
    *_both(_K.FRAMES_REORDERED, "for good"),
    *_both(_K.FRAME_CORRUPTED, "once", frames=1),
    *_both(_K.FRAME_CORRUPTED, "for good"),
    Variant(kind=_K.FRAME_MASQUERADE, where=From.PC, how="once, in the window", frames=1, window=1),
    Variant(kind=_K.FRAME_MASQUERADE, where=From.PC, how="once, out of it", frames=1, window=-1),
    Variant(kind=_K.FRAME_MASQUERADE, where=From.BOX, how="once", frames=1),
    *_both(_K.FRAME_MASQUERADE, "for good"),
    Variant(kind=_K.TOTAL_BIT_FLIPPED, where=From.PC, how="once", frames=1),
    Variant(kind=_K.TOTAL_BIT_FLIPPED, where=From.PC, how="for good"),
    *_both(_K.REQUEST_STUCK, "for 30 ms", lasts_ps=30 * PS_PER_MS),
    *_both(_K.REQUEST_STUCK, "for good"),
    *_brief(_K.BABBLING_NODE, From.BUS, 20 * PS_PER_MS),
    *_both(_K.BUS_OFF, "for 20 ms", lasts_ps=20 * PS_PER_MS),
    *_both(_K.BUS_OFF, "for good"),
    *_brief(_K.STALE_DATA_VALID, From.AXIS, 20 * PS_PER_MS),
    *_brief(_K.TORN_POSITION, From.AXIS, 200 * PS_PER_MS),
    Variant(kind=_K.PC_KILLED, where=From.PROGRAM, how=""),
    Variant(kind=_K.BOX_RESTARTED, where=From.AXIS, how=""),
    *_brief(_K.POWER_LOST, From.AXIS, 5 * PS_PER_MS),
    Variant(kind=_K.CLOCK_JUMP_FORWARD, where=From.PROGRAM, how="by 20 ms", delay_ps=20 * PS_PER_MS),
    Variant(kind=_K.CLOCK_JUMP_FORWARD, where=From.PROGRAM, how="by 1 s", delay_ps=1000 * PS_PER_MS),
    Variant(kind=_K.CLOCK_JUMP_BACK, where=From.PROGRAM, how="by 20 ms", delay_ps=20 * PS_PER_MS),
    Variant(kind=_K.CLOCK_JUMP_BACK, where=From.PROGRAM, how="by 1 s", delay_ps=1000 * PS_PER_MS),
    *_brief(_K.CABLE_OPEN, From.ENCODER, 50 * PS_PER_MS),
    *_brief(_K.LINES_SWAPPED, From.ENCODER, 50 * PS_PER_MS),
    *_brief(_K.LINE_BROKEN, From.ENCODER, 50 * PS_PER_MS),
    *_brief(_K.GLITCHES, From.ENCODER, 200 * PS_PER_MS),
    *_brief(_K.SWITCH_THROWN, From.AXIS, 30 * PS_PER_MS),
    Variant(kind=_K.PROBE_TRIPPED, where=From.AXIS, how=""),
    Variant(kind=PROCESSOR_HUNG, where=From.AXIS, how=""),
    Variant(kind=LATCH_STUCK, where=From.AXIS, how=""),
)
"""Every class of faults, with its lengths and places."""


def variants_named(text: str) -> tuple[Variant, ...]:
    """Return the faults of a class, or those whose name begins so, with spaces or hyphens.

    Raises
    ------
    ArgumentError
        A name of none.

    Examples
    --------
    >>> [variant.name for variant in variants_named("power-lost")]
    ['power lost, for 5 ms', 'power lost, for good']
    >>> [variant.name for variant in variants_named("frame lost, for good, box to PC")]
    ['frame lost, for good, box to PC']
    """
    word = hyphened(text).rstrip(",")
    names = {hyphened(variant.name): variant for variant in VARIANTS}
    found = tuple(variant for name, variant in names.items() if f"{name},".startswith(f"{word},"))
    if not found or not word:
        classes = dict.fromkeys(name.split(",")[0] for name in names)
        hint = meant(word, [*classes, *names])
        allowed = f"a class ({', '.join(classes)}) or one of it"
        raise ArgumentError("fault", repr(text[:60]), allowed, hint, problem="is not a fault")
    return found


def impossible(variant: Variant, phase: Phase, design: Design | None = None) -> str | None:
    """Return why a fault cannot take effect in a phase, or in a design where one is named; None: it can.

    A fault for good takes effect as soon as there is something to act on, if only in the next phase.
    """
    if variant.kind is LATCH_STUCK and design is not None and design.in_path:
        return f"the lines of {design.title} pass through its processor, without a hold latch"
    still = phase in (Phase.START_UP, Phase.AT_REST, Phase.LARGE)
    if not still or variant.lasts_ps == 0:
        return None
    if variant.kind is _K.LINES_SWAPPED and phase is Phase.START_UP:
        return "at home both lines say the same, swapped or not"
    return _NOTHING_AT_REST.get(variant.kind)


_OLD_WORD = "the old word of an axis that stands still is the right word"
_NOTHING_AT_REST: Mapping[FaultRow, str] = {
    _K.GLITCHES: "a glitch follows an edge, and an axis that stands still has none",
    _K.STALE_DATA_VALID: _OLD_WORD,
    _K.TORN_POSITION: _OLD_WORD,
    _K.LINE_BROKEN: "a broken line of an axis that stands still says what it said before",
}


def unreachable(variant: Variant, phase: Phase, design: Design, state: int, direction: str) -> str | None:
    """Return why a fault's first effect cannot meet axis 1 in a Gray state, 1 to 4, and a direction; None: it can.

    Examples
    --------
    >>> swapped = variants_named("A and B swapped, for good")[0]
    >>> unreachable(swapped, Phase.CUTTING, Design.C, 1, "positive")
    'A and B say the same in states 1 and 3, swapped or not'
    """
    kind = variant.kind
    waits = kind.activated_by in _WAITS_FOR_EDGES and (phase is Phase.LARGE or not variant.lasts_ps)
    later = _LATER.get(phase, ()) if waits else ()
    if phase is Phase.LARGE and kind.activated_by is ActivatedBy.FRAMES:
        later = ("negative",)  # the next frame comes up to 10 ms later, and the axis begins to move
    if direction not in (*_DURING[phase], *later):
        return (
            f"the axis does not move in this direction in the phase {phase.value}"
            if direction != "rest"
            else _NO_REST
        )
    if direction == "rest" and phase is Phase.START_UP and state != 1:
        return "the axis stands at home, in state 1"
    if direction == "rest" and kind.activated_by in (ActivatedBy.WORD, ActivatedBy.GLITCHES, ActivatedBy.EDGES):
        return "an axis at rest makes no edges, and its old word is right"
    if (
        phase is Phase.INSERTION and kind.place is FaultPlace.AXIS and kind is not LATCH_STUCK
    ):  # it begins with an insertion
        return f"{design.title} inserts in state 1 only" if design.one_state and state != 1 else None
    return _LINES[kind](state, direction) if kind in _LINES else None


_NO_REST = "the axis does not rest in this phase"
_WAITS_FOR_EDGES = (ActivatedBy.WORD, ActivatedBy.GLITCHES, ActivatedBy.CABLE, ActivatedBy.EDGES)
_DURING = {
    Phase.START_UP: ("rest",),
    Phase.AT_REST: ("rest",),
    Phase.CUTTING: ("positive",),
    Phase.RAPID: ("positive",),
    Phase.REVERSAL: ("positive", "negative"),
    Phase.INSERTION: ("positive",),
    Phase.PROBING: ("positive",),
    Phase.LARGE: ("rest",),
}
"""How axis 1 moves while faults are injected."""
_LATER = {
    Phase.START_UP: ("positive",),
    Phase.AT_REST: ("positive",),
    Phase.LARGE: ("negative", "positive"),
}
"""How it moves afterwards, where a fault for good that waits for an edge may meet it."""


def _of_broken_line(state: int, direction: str) -> str | None:
    """Return why a resting A is not wrong first in a state: A differs from before behind its own edge."""
    if direction == "rest":
        return "a broken line of an axis that stands still says what it said before"
    behind_edge_of_a = (2, 4) if direction == "positive" else (1, 3)
    return None if state in behind_edge_of_a else "A is wrong first behind an edge of A"


_LINES: Mapping[FaultRow, Callable[[int, str], str | None]] = {
    _K.CABLE_OPEN: lambda state, direction: "in state 3 both lines are high anyway" if state == 3 else None,
    _K.LINES_SWAPPED: lambda state, direction: (
        "A and B say the same in states 1 and 3, swapped or not" if state in (1, 3) else None
    ),
    _K.LINE_BROKEN: _of_broken_line,
}
