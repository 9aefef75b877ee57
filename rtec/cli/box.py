"""``rtec box``: axes with their boxes as nodes of a live bus."""

from __future__ import annotations

import dataclasses
import os
import shlex
from contextlib import ExitStack, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _live
from rtec.cli._console import note, print_json
from rtec.cli._live import MACHINE, TIMES
from rtec.cli._own_box import algorithm, load
from rtec.cli._parameters import Works, apart, flag, option, pure, quantity, whole, works
from rtec.cli._verb import said
from rtec.errors import ArgumentError
from rtec.units import LENGTH

if TYPE_CHECKING:
    from rtec.axis.command import Move
    from rtec.injector import Design
    from rtec.live.box_loop import BoxLoop
    from rtec.live.events import Events
    from rtec.live.screen import Screen
    from rtec.live.typed import TypedLines
    from rtec.machine.station import Station, StationSettings
    from rtec.requester.settings import HandshakeSettings
    from rtec.requester.supervision import SupervisionLimits

_FAILS = 1
_HOME_REST_S = 1.0
"""On the clock of the bus: ten turns of a PC at the longest cycle that a person would choose."""


def box(
    context: typer.Context,
    interface: str | None = _live.interface("a line to 'rtec pc'."),
    channel: str | None = _live.CHANNEL,
    bitrate: int | None = _live.BITRATE,
    dbc: Path | None = _live.DBC,
    axis: int | None = _live.AXIS,
    axes: int | None = _live.AXES,
    design: Design = _live.DESIGN,
    timing: Works = works("What works in the box.", panel=MACHINE, default="8051"),
    algorithm: str | None = algorithm("file.py:Name or image.ihx works in the box.", panel=MACHINE),
    count_mm: float = _live.COUNT,
    program: Path | None = option(
        "--program", "FILE", "G-code of a measuring run; a slow shuttle without it.", panel=MACHINE
    ),
    home_mm: float = quantity(
        "--home", LENGTH, "1inch", "Where home is in the program's positions.", panel=MACHINE, default="0mm"
    ),
    stand: bool = flag("--stand", "Stand still until an order comes.", panel=MACHINE),
    speed: float = pure(
        "--speed", "N", "Axes run N times faster than the clock.", low=0.1, high=100.0, panel=TIMES, default="1"
    ),
    window_steps: int = _live.WINDOW,
    cycle_ps: int = _live.CYCLE,
    watchdog_ps: int | None = _live.WATCHDOG,
    limit_steps: int = whole(
        "--limit", "Totals beyond it are never accepted; 0: none.", metavar="STEPS", panel=TIMES, default=0
    ),
    duration_s: float | None = _live.DURATION,
    seed: int | None = whole(
        "--seed", "Of the number of the box's first session; new each time without.", panel=MACHINE
    ),
    log: Path | None = _live.LOG,
    force: bool = _live.FORCE,
    plain: bool = _live.PLAIN,
    as_json: bool = _live.JSON,
) -> None:
    """Run axes with their boxes on a live bus, for any PC software to talk to.

    Orders are typed, or are lines of a script: go 12 mm at 300 mm/min, home, switch off, power off, restart, trip,
    fault cable-open, clear, status, help, quit. Ctrl-C ends it. Exits with 1 where the bus vanishes or an order of a
    script was wrong. With --timing firmware each box runs its design's program on a 12 MHz 8051, behind the node that
    speaks on the bus; with --algorithm your own class or program does.

    Example: rtec box --axes 3 --design c --algorithm mine.py:Mine
    Example: rtec box --interface socketcan --channel can0 --log run.asc
    Example: rtec box --duration 30s --json
    """
    from rtec.axis import Encoder
    from rtec.injector import InjectorSettings, RealEdges, Timing
    from rtec.live.box_loop import BoxLoop
    from rtec.live.box_run import BoxRun, box_document
    from rtec.live.events import Events
    from rtec.live.quiet import quiet_collector
    from rtec.live.stopping import StopWish
    from rtec.machine.station import StationSettings
    from rtec.requester.settings import HandshakeSettings
    from rtec.requester.supervision import SupervisionLimits

    bus = _live.BusWords(interface=interface, channel=channel, bitrate=bitrate)
    _live.check_dbc(dbc)
    numbers = _live.axes_of(axis, axes)
    handshake = HandshakeSettings(window_steps=window_steps)
    cautions = SupervisionLimits(
        cycle_ps=cycle_ps, watchdog_ps=5 * cycle_ps if watchdog_ps is None else watchdog_ps, limit_steps=limit_steps
    )
    settings = [
        StationSettings(
            axis=number,
            injector=InjectorSettings(
                design=design, timing=Timing.of(design, timing.processor), real_edges=RealEdges.HOLD
            ),
            microcontroller=timing.microcontroller,
            encoder=Encoder(count_mm=count_mm),
            handshake=_quicker(handshake, speed),
            supervision=_faster(cautions, speed),
        )
        for number in numbers
    ]
    moves = _moves(program, home_mm, speed, stand=stand)
    if algorithm is not None:
        settings = _inserting_by(algorithm, settings, said(context, "design", "timing"))
    first = _first_session(seed)
    events = Events(_live.event_printer(as_json))
    with ExitStack() as stack:
        stack.enter_context(redirect_stdout(_live.stream_of(as_json)))  # for what a class of the user's prints
        # compiled before the bus is there: nobody waits for it
        stations = _stations(settings, moves, first)
        _warm_up(settings[0])
        near = None
        if interface is None:
            from rtec.link.pseudo_terminal import SLCAN_OPENS, Line

            near = stack.enter_context(Line(name=bus.line, opened_by=SLCAN_OPENS)).near
        transport = stack.enter_context(_live.logged(bus.open(near), log, force))
        alike = said(context, "axis", "axes", "design", "count_mm", "window_steps", "cycle_ps")
        command = shlex.join(["rtec", "pc", *bus.words(), *alike])
        for line in bus.ways_in(command):
            note(line)
        stop = stack.enter_context(StopWish())
        view = stack.enter_context(
            _live.screen(events, _live.stream_of(as_json), draws=not (plain or as_json), prompt=True)
        )
        stack.enter_context(quiet_collector())
        loop = BoxLoop(stations, transport, speed=speed)
        title = f"rtec box, {_works(algorithm, design)}; the other side: {command}"
        typed, scripted = _typed(view)
        run = BoxRun(
            loop,
            events=events,
            stop=stop,
            typed=typed,
            scripted=scripted,
            until_s=duration_s,
            show=lambda at_s: _draw(view, loop, events, title, at_s),
        )
        ended = run.run()
        events.happen(run.at_s, f"ended: {ended}")
        _draw(view, loop, events, f"rtec box, {ended}", run.at_s, last=True)
        report = box_document(loop, events, ended=ended, run_s=run.at_s, refused=run.refused)
    if as_json:
        print_json(report)
    for words in [str(loop.lost)] * (ended == "bus lost") + [str(order) for order in run.refused]:
        note(words)
    if ended == "bus lost" or run.refused:
        raise typer.Exit(_FAILS)


def _inserting_by(algorithm: str, settings: list[StationSettings], words: list[str]) -> list[StationSettings]:
    """Return the axes with an algorithm of the user's in their boxes."""
    if "--timing" in words:
        raise apart("--timing", "--algorithm", "it is of the box of a design")
    if "--design" not in words:
        raise ArgumentError("--algorithm", algorithm, "--design beside it: the one whose step and states it has")
    works_in_it = load(algorithm)
    if why := getattr(works_in_it, "note", ""):
        note(f"{algorithm} runs as plain Python, slower: {why}")
    return [each.inserting_by(works_in_it) for each in settings]


def _works(algorithm: str | None, design: Design) -> str:
    return f"design {design.value}" if algorithm is None else f"{algorithm} as design {design.value}"


def _typed(view: Screen | None) -> tuple[TypedLines | None, bool]:
    """Return where orders come from, and whether they are those of a script."""
    from rtec.live.typed import TypedLines, standard_input

    if view is not None and view.has_prompt:
        return TypedLines(view.typed_from), False
    given = standard_input()
    return (None, False) if given is None else (TypedLines(given), not os.isatty(given))


def _draw(view: Screen | None, loop: BoxLoop, events: Events, title: str, at_s: float, *, last: bool = False) -> None:
    """Show the boxes where there is a view and it is time; above a prompt, events pass by themselves."""
    from rtec.live.shown import box_screen

    if view is None:
        return
    if view.draws and (last or view.wants(at_s)):
        view.show(at_s, box_screen(loop, None if view.has_prompt else events, title=title, at_s=at_s))
    view.catch_up()


def _stations(settings: list[StationSettings], moves: list[Move], first_session: int) -> list[Station]:
    """Return the axes; each keeps the lines of its last insertion for the view."""
    from rtec.machine.station import Station

    stations = [Station(each, moves, session=(first_session + k) & 0xFF) for k, each in enumerate(settings)]
    for station in stations:
        station.keep_insertions()
    return stations


def _quicker(handshake: HandshakeSettings, speed: float) -> HandshakeSettings:
    """Return the words of a box whose axes run faster: what the PC sees of its times does not depend on the speed."""
    return dataclasses.replace(
        handshake,
        box_period_ps=round(handshake.box_period_ps * speed),
        retry_ps=round(handshake.retry_ps * min(speed, 1.0)),
    )


def _faster(cautions: SupervisionLimits, speed: float) -> SupervisionLimits:
    return dataclasses.replace(
        cautions,
        speed=speed,
        cycle_ps=round(cautions.cycle_ps * speed),
        watchdog_ps=round(cautions.watchdog_ps * speed),
        gap_ps=round(cautions.gap_ps * speed),
    )


def _moves(program: Path | None, home_mm: float, speed: float, *, stand: bool) -> list[Move]:
    """Return the moves of a measuring program, or a slow shuttle of 100 mm, or none."""
    from rtec.live.programs import from_home, read_moves, shuttle

    if stand and program is not None:
        raise apart("--program", "--stand")
    if stand:
        return []
    moves = shuttle() if program is None else read_moves(program, home_mm=home_mm)
    return from_home(moves, rest_s=_HOME_REST_S * speed)


def _first_session(seed: int | None) -> int:
    import random

    own = random.Random(seed)  # noqa: S311 - a number, no secret
    return own.randrange(256)


def _warm_up(settings: StationSettings) -> None:
    """Run what the live loop will run, so that its machine code is loaded before the clock counts."""
    from rtec.link.frame import Frame
    from rtec.machine.faults import FaultKind
    from rtec.machine.station import Station

    station = Station(settings)
    station.keep_insertions()
    station.last_insertion()
    station.advance(until_ps=3 * settings.supervision.cycle_ps)
    station.receive(Frame(identifier=0x200 + settings.axis, data=bytes(8)))
    for fault in (FaultKind.CABLE_OPEN, FaultKind.SWITCH_THROWN):
        station.begin(fault)
        station.end(fault)
    station.go_home()
    station.advance(until_ps=station.now_ps + settings.supervision.cycle_ps)
