"""``rtec box``: axes with their boxes as nodes of a live bus."""

from __future__ import annotations

import dataclasses
import os
import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli._arguments import what_works, whole
from rtec.cli._console import announce_compilation, note, print_json
from rtec.cli._live import (
    BUS,
    MACHINE,
    OUTPUT,
    TIMES,
    BusWords,
    OfBitrate,
    OfChannel,
    axes_of,
    check_dbc,
    check_log,
    length,
    logged,
    option,
    picoseconds,
    screen,
    seconds,
    stream_of,
    teller,
    watchdog_of,
)
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.live.box_loop import BoxLoop
    from rtec.live.events import Events
    from rtec.live.screen import Screen
    from rtec.live.typed import TypedLines
    from rtec.machine.station import Move, Station, StationSettings

_FAILS = 1
_HOME_REST_S = 1.0
"""On the clock of the bus: ten turns of a PC at the longest cycle that a person would choose."""


def box(
    interface: Annotated[
        str | None, option("--interface", BUS, "NAME", "As python-can names it; without it, a line to 'rtec pc'.")
    ] = None,
    channel: OfChannel = None,
    bitrate: OfBitrate = None,
    dbc: Annotated[
        Path | None, option("--dbc", BUS, "FILE.dbc", "A DBC of yours that must describe the same messages.")
    ] = None,
    axis: Annotated[str | None, option("--axis", MACHINE, "1", "Number of the one axis.")] = None,
    axes: Annotated[str | None, option("--axes", MACHINE, "3", "Axes 1 to N in this process.")] = None,
    design: Annotated[str, option("--design", MACHINE, "original|a|b|c", "Insertion design.")] = "a",
    timing: Annotated[str, option("--timing", MACHINE, "8051|fast|firmware", "What works in the box.")] = "8051",
    count: Annotated[str, option("--count", MACHINE, "1um", "Travel of one count of the encoder.")] = "1um",
    program: Annotated[
        Path | None, option("--program", MACHINE, "FILE", "G-code of a measuring run; a slow shuttle without it.")
    ] = None,
    home: Annotated[str, option("--home", MACHINE, "1inch", "Where home is in the program's positions.")] = "0mm",
    stand: Annotated[
        bool, typer.Option("--stand", help="Stand still until an order comes.", rich_help_panel=MACHINE)
    ] = False,
    speed: Annotated[str, option("--speed", TIMES, "N", "Axes run N times faster than the clock.")] = "1",
    window: Annotated[str, option("--window", TIMES, "STEPS", "Largest change of the request believed.")] = "3",
    cycle: Annotated[
        str, option("--cycle", TIMES, "10ms", "Between the frames of one kind; the PC's, too.")
    ] = "10ms",
    watchdog: Annotated[
        str | None, option("--watchdog", TIMES, "50ms", "Longest silence of the PC, 3 to 6 cycles; 5 without it.")
    ] = None,
    limit: Annotated[str, option("--limit", TIMES, "STEPS", "Totals beyond it are never believed; 0: none.")] = "0",
    duration: Annotated[str | None, option("--duration", TIMES, "10s", "End by itself after this time.")] = None,
    seed: Annotated[
        str | None, option("--seed", MACHINE, "N", "Of the number of the box's first session; new each time without.")
    ] = None,
    log: Annotated[Path | None, option("--log", OUTPUT, "FILE", "Frames to a .log, .asc or .blf file.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the log.", rich_help_panel=OUTPUT)] = False,
    plain: Annotated[bool, typer.Option("--plain", help="Lines of events, no view.", rich_help_panel=OUTPUT)] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON document on stdout at the end.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Run axes with their boxes on a live bus, for any PC software to talk to.

    Orders are typed, or are lines of a script: go 12 mm at 300 mm/min, home, switch off, power off, restart, trip,
    fault cable-open, clear, status, help, quit. Ctrl-C ends it. Exits with 1 where the bus vanishes or an order of a
    script was wrong. With --timing firmware each box runs its design's program on a 12 MHz 8051, behind the node that
    speaks on the bus.

    Example: rtec box --axes 3 --design c
    Example: rtec box --interface socketcan --channel can0 --log run.asc
    Example: rtec box --duration 30s --json
    """
    from rtec.live.box_loop import BoxLoop
    from rtec.live.box_run import BoxRun, box_document
    from rtec.live.events import Events
    from rtec.live.quiet import quiet_collector
    from rtec.live.stopping import StopWish

    bus = BusWords(interface=interface, channel=channel, bitrate=bitrate)
    check_dbc(dbc)
    check_log(log, force=force)
    numbers = axes_of(axis, axes)
    pace = _speed(speed)
    settings = [_settings(number, design, timing, count, window, cycle, watchdog, limit, pace) for number in numbers]
    moves = _moves(program, length(home, "--home"), pace, stand=stand)
    first = _first_session(seed)
    until_s = None if duration is None else seconds(duration, "--duration")
    announce_compilation()
    # compiled before the bus is there: nobody waits for it
    stations = _stations(settings, moves, first)
    _warm_up(settings[0])
    events = Events(teller(as_json))
    with ExitStack() as stack:
        near = None
        if interface is None:
            from rtec.link.pseudo_terminal import Line

            near = stack.enter_context(Line(name=bus.line)).near
        transport = stack.enter_context(logged(bus.open(near), log, force))
        command = _pc_command(bus, axis, axes, design, count, window, cycle)
        for line in bus.ways_in(command):
            note(line)
        stop = stack.enter_context(StopWish())
        view = stack.enter_context(screen(events, stream_of(as_json), draws=not (plain or as_json), prompt=True))
        stack.enter_context(quiet_collector())
        loop = BoxLoop(stations, transport, speed=pace)
        title = f"rtec box, design {design}; the other side: {command}"
        typed, scripted = _typed(view)
        run = BoxRun(
            loop,
            events=events,
            stop=stop,
            typed=typed,
            scripted=scripted,
            until_s=until_s,
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


def _speed(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.1 <= value <= 100.0:
        raise ArgumentError("--speed", repr(text[:40]), "a pure number from 0.1 to 100")
    return value


def _settings(
    axis: int,
    design: str,
    timing: str,
    count: str,
    window: str,
    cycle: str,
    watchdog: str | None,
    limit: str,
    speed: float,
) -> StationSettings:
    """Return an axis; what the PC sees of the box's times does not depend on the speed."""
    from rtec.axis import Encoder
    from rtec.injector import Design, InjectorSettings, RealEdges, Timing
    from rtec.machine.station import StationSettings
    from rtec.requester import HandshakeSettings, SupervisionLimits

    insertion = Design.named(design)
    processor, microcontroller = what_works(timing)
    try:
        handshake = HandshakeSettings(window_steps=whole(window, name="--window"))
        handshake = dataclasses.replace(
            handshake,
            box_period_ps=round(handshake.box_period_ps * speed),
            retry_ps=round(handshake.retry_ps * min(speed, 1.0)),
        )
        cycle_ps = picoseconds(cycle, "--cycle")
        cautions = SupervisionLimits(
            cycle_ps=cycle_ps, watchdog_ps=watchdog_of(watchdog, cycle_ps), limit_steps=whole(limit, name="--limit")
        )
        cautions = dataclasses.replace(
            cautions,
            speed=speed,
            cycle_ps=round(cycle_ps * speed),
            watchdog_ps=round(cautions.watchdog_ps * speed),
            gap_ps=round(cautions.gap_ps * speed),
        )
        return StationSettings(
            axis=axis,
            injector=InjectorSettings(
                design=insertion, timing=Timing.of(insertion, processor), real_edges=RealEdges.HOLD
            ),
            microcontroller=microcontroller,
            encoder=Encoder(count_mm=length(count, "--count")),
            handshake=handshake,
            supervision=cautions,
        )
    except ArgumentError as error:
        raise _as_option(error) from None


_OPTIONS = {
    "window_steps": "--window",
    "handshake": "--window",
    "cycle_ps": "--cycle",
    "watchdog_ps": "--watchdog",
    "limit_steps": "--limit",
    "count_mm": "--count",
}


def _as_option(error: ArgumentError) -> ArgumentError:
    """Name a refused parameter as the option that the user wrote."""
    return ArgumentError(_OPTIONS.get(error.name, error.name), error.value, error.allowed, error.hint)


def _moves(program: Path | None, home_mm: float, speed: float, *, stand: bool) -> list[Move]:
    """Return the moves of a measuring program, or a slow shuttle of 100 mm, or none."""
    from rtec.live.programs import from_home, read_moves, shuttle

    if stand and program is not None:
        raise ArgumentError("--program", program, "--stand or --program", "leave one of them out")
    if stand:
        return []
    moves = shuttle() if program is None else read_moves(program, home_mm=home_mm)
    return from_home(moves, rest_s=_HOME_REST_S * speed)


def _first_session(seed: str | None) -> int:
    """Return the number of the first session: another one each time, so that a PC notices a box started again."""
    import random

    own = random.Random(None if seed is None else whole(seed, name="--seed"))  # noqa: S311 - a number, no secret
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


def _pc_command(
    bus: BusWords, axis: str | None, axes: str | None, design: str, count: str, window: str, cycle: str
) -> str:
    words = ["rtec", "pc", *bus.words()]
    for name, value, default in (
        ("--axis", axis, None),
        ("--axes", axes, None),
        ("--design", design, "a"),
        ("--count", count, "1um"),
        ("--window", window, "3"),
        ("--cycle", cycle, "10ms"),
    ):
        if value not in (None, default):
            words += [name, str(value)]
    return shlex.join(words)
