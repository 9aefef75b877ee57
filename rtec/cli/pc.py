"""``rtec pc``: the PC's side of axes on a live bus."""

from __future__ import annotations

import secrets
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli._arguments import choice, whole
from rtec.cli._console import announce_compilation, note, print_json
from rtec.cli._live import (
    BUS,
    MACHINE,
    OUTPUT,
    TIMES,
    BusWords,
    OfBitrate,
    OfChannel,
    OfInterface,
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
from rtec.units import PS_PER_S

if TYPE_CHECKING:
    from rtec.predictors import Predictor
    from rtec.requester import PcNode

_FAILS = 1
MARGIN_MM = 1.0
"""Beyond the ends of a predictor: a corrected axis at home stands beside home by as much as it is corrected."""


def pc(
    interface: OfInterface = None,
    channel: OfChannel = None,
    bitrate: OfBitrate = None,
    dbc: Annotated[
        Path | None, option("--dbc", BUS, "FILE.dbc", "A DBC of yours that must describe the same messages.")
    ] = None,
    axis: Annotated[str | None, option("--axis", MACHINE, "1", "Number of the one axis.")] = None,
    axes: Annotated[str | None, option("--axes", MACHINE, "3", "Axes 1 to N.")] = None,
    table: Annotated[
        Path | None, option("--table", MACHINE, "FILE", "Errors by position: .csv, or .comp of LinuxCNC.")
    ] = None,
    table_unit: Annotated[
        str | None, option("--table-unit", MACHINE, "mm|inch", "Unit of a LinuxCNC table; the file does not say it.")
    ] = None,
    models: Annotated[
        list[Path] | None,
        option("--model", MACHINE, "M.toml", "Model or predictor, of 'rtec diagnose' or 'rtec train'; one an axis."),
    ] = None,
    cautious: Annotated[
        bool,
        typer.Option("--cautious", help="Ask for no more than its interval supports.", rich_help_panel=MACHINE),
    ] = False,
    travel: Annotated[str, option("--travel", MACHINE, "1000mm", "From home on, for a --model.")] = "1000mm",
    home: Annotated[
        str | None, option("--home", MACHINE, "1inch", "Where home is in the predictor's positions.")
    ] = None,
    design: Annotated[str, option("--design", MACHINE, "original|a|b|c", "Of the box: counts of a step.")] = "a",
    count: Annotated[str, option("--count", MACHINE, "1um", "Travel of one count of the encoder.")] = "1um",
    large: Annotated[
        bool, typer.Option("--large", help="The first request may exceed the window.", rich_help_panel=MACHINE)
    ] = False,
    probe: Annotated[
        bool, typer.Option("--probe", help="Probing mode: nothing is corrected.", rich_help_panel=MACHINE)
    ] = False,
    reset: Annotated[
        bool,
        typer.Option("--reset", help="Acknowledge a box that has stopped for good.", rich_help_panel=MACHINE),
    ] = False,
    window: Annotated[str, option("--window", TIMES, "STEPS", "Largest change of the request at a time.")] = "3",
    cycle: Annotated[str, option("--cycle", TIMES, "10ms", "Between two requests; the box's, too.")] = "10ms",
    watchdog: Annotated[
        str | None, option("--watchdog", TIMES, "50ms", "Longest silence of the box, 3 to 6 cycles; 5 without it.")
    ] = None,
    deviation_limit: Annotated[str | None, option("--deviation-limit", TIMES, "0.3mm", "Never ask for more.")] = None,
    completion_timeout: Annotated[
        str | None, option("--completion-timeout", TIMES, "2s", "Longest time that an accepted total may take.")
    ] = None,
    start_up: Annotated[
        str, option("--start-up", TIMES, "60s", "Longest wait until the boxes are there and ready.")
    ] = "60s",
    duration: Annotated[str | None, option("--duration", TIMES, "10s", "End by itself after this time.")] = None,
    log: Annotated[Path | None, option("--log", OUTPUT, "FILE", "Frames to a .log, .asc or .blf file.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the log.", rich_help_panel=OUTPUT)] = False,
    plain: Annotated[bool, typer.Option("--plain", help="Lines of events, no view.", rich_help_panel=OUTPUT)] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON document on stdout at the end.", rich_help_panel=OUTPUT)
    ] = False,
) -> None:
    """Correct axes on a live bus by what a predictor says, and hold the machine where it must be held.

    Box and PC must have the same --design, --count and --cycle; they compare them. Exits with 0 where it ended as
    asked, with 1 where the machine is held or no box was ready in time.

    Example: rtec pc --table z.csv --design c
    Example: rtec pc --model best.toml --home 1inch --interface socketcan --channel can0
    Example: rtec pc --axes 3 --reset --start-up 5min
    """
    from rtec.live.events import Events
    from rtec.live.pc_loop import PcLoop
    from rtec.live.pc_run import PcRun, pc_document
    from rtec.live.quiet import quiet_collector
    from rtec.live.shown import pc_screen
    from rtec.live.stopping import StopWish

    bus = BusWords(interface=interface, channel=channel, bitrate=bitrate)
    check_dbc(dbc)
    check_log(log, force=force)
    numbers = axes_of(axis, axes)
    predictors, home_mm = _predictors(
        numbers, table, table_unit, models or [], home, length(travel, "--travel"), cautious
    )
    until_s = None if duration is None else seconds(duration, "--duration")
    limit_s = seconds(start_up, "--start-up")
    words = _NodeWords(
        design=design,
        count=count,
        window=window,
        cycle=cycle,
        watchdog=watchdog,
        completion_timeout=completion_timeout,
        limit=deviation_limit,
    )
    announce_compilation()
    for node in _nodes(predictors, home_mm, words, at_ps=0):
        _warm_up(node)
    events = Events(teller(as_json))
    with ExitStack() as stack:
        begun_s = time.monotonic()
        far = bus.line_of_box(limit_s) if interface is None else None
        waited_s = time.monotonic() - begun_s
        transport = stack.enter_context(logged(bus.open(far), log, force))
        stop = stack.enter_context(StopWish())
        view = stack.enter_context(screen(events, stream_of(as_json), draws=not (plain or as_json)))
        stack.enter_context(quiet_collector())
        nodes = _nodes(predictors, home_mm, words, at_ps=transport.now_ps())
        for node in nodes:
            node.probe(probe)
            if large:
                node.mean_large()
            if reset:
                node.acknowledge()
        loop = PcLoop(nodes, transport)

        def show(at_s: float) -> None:
            if view is not None and view.wants(at_s):
                view.show(at_s, pc_screen(loop, events, count_mm=words.count_mm, title="rtec pc", at_s=at_s))

        run = PcRun(
            loop,
            events=events,
            stop=stop,
            until_s=until_s,
            start_up_s=limit_s,
            waited_s=waited_s,
            acknowledged=reset,
            line_of_box=interface is None,
            turn_s=words.handshake.pc_period_ps / PS_PER_S,
            show=show,
        )
        ending = run.run()
        events.happen(run.at_s, f"ended: {ending.why}")
        if view is not None:
            view.show(
                run.at_s,
                pc_screen(loop, events, count_mm=words.count_mm, title=f"rtec pc, {ending.why}", at_s=run.at_s),
            )
        report = pc_document(loop, events, ending=ending, run_s=run.at_s)
    if as_json:
        print_json(report)
    if not ending.good:
        note(ending.text)
        raise typer.Exit(_FAILS)


def _predictors(
    numbers: list[int],
    table: Path | None,
    table_unit: str | None,
    models: list[Path],
    home: str | None,
    travel_mm: float,
    cautious: bool,
) -> tuple[dict[int, Predictor], float]:
    """Return what the PC knows of each axis' error, and where home lies in its positions, in mm."""
    from rtec.predictors import LatheNetwork, LengthUnit, read_linuxcnc_table, read_table

    if cautious and not models:
        raise ArgumentError("--cautious", "given without --model", "a predictor of rtec train: it has an interval")
    if table is not None and models:
        raise ArgumentError("--model", models[0], "--table or --model", "leave one of them out")
    if table_unit is not None and (table is None or table.suffix.lower() == ".csv"):
        raise ArgumentError("--table-unit", table_unit, "it with a table of LinuxCNC", "a .csv says its units itself")
    home_mm = 0.0 if home is None else length(home, "--home")
    known: Predictor
    if table is not None and table.suffix.lower() != ".csv":
        if table_unit is None:
            raise ArgumentError("--table", table, "it together with --table-unit mm or inch", "or a table in a .csv")
        units = {"mm": LengthUnit.MM, "inch": LengthUnit.INCH}
        known = read_linuxcnc_table(table, unit=units[choice(table_unit, units, name="--table-unit")])
    elif table is not None:
        known = read_table(table)
    elif models:
        return _of_models(numbers, models, home_mm, travel_mm, cautious), home_mm
    else:
        known = LatheNetwork()
        home_mm = known.range_mm[0] if home is None else home_mm
    return dict.fromkeys(numbers, known), home_mm


def _of_models(
    numbers: list[int], models: list[Path], home_mm: float, travel_mm: float, cautious: bool
) -> dict[int, Predictor]:
    """Return the predictor of each axis: a file that names its axis is for that one, one that does not for all."""
    from rtec.inference.predictor_of_file import axis_of_file, predictor_of_file
    from rtec.predictors import NoError
    from rtec.predictors.binding import axis_name

    found: dict[int, Predictor] = {}
    for path in models:
        predictor, left_out = predictor_of_file(path, home_mm, home_mm + travel_mm, cautious=cautious)
        for effect in left_out:
            note(f"warning: {effect.effect} is left out: {effect.why}")
        axis = axis_of_file(path)
        if axis is None and len(models) == 1 and len(predictor.inputs) == 2:
            return dict.fromkeys(numbers, predictor)
        if axis is None:
            allowed = "files with 'axis = 2', as rtec train writes them of measurements that say '# axis: 2'"
            raise ArgumentError("--model", f"{path}, which does not say of which axis it is", allowed)
        if axis not in numbers or axis in found:
            what = "a second file of" if axis in found else "a file of"
            raise ArgumentError("--model", f"{path}, {what} axis {axis}", f"one of axis {_listed(numbers)}")
        found[axis] = predictor
    for predictor in found.values():
        for name in predictor.inputs[2:]:
            if name not in map(axis_name, numbers):
                allowed = f"--axes with the axis of {name}, which the predictor looks at"
                raise ArgumentError("--model", f"axis {_listed(numbers)} alone", allowed)
    idle = [axis for axis in numbers if axis not in found]
    if idle:
        note(f"axis {_listed(idle)}: not corrected, as no --model is of it")
    return {axis: found.get(axis) or NoError() for axis in numbers}


def _listed(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers))


class _NodeWords:
    """The options of a node, read."""

    def __init__(
        self,
        *,
        design: str,
        count: str,
        window: str,
        cycle: str,
        watchdog: str | None,
        completion_timeout: str | None,
        limit: str | None,
    ) -> None:
        from rtec.injector import Design
        from rtec.requester import HandshakeSettings, Setup, SupervisionLimits

        self.design = Design.named(design)
        self.count_mm = length(count, "--count")
        cycle_ps = picoseconds(cycle, "--cycle")
        step_mm = self.design.step_counts * self.count_mm
        try:
            self.handshake = HandshakeSettings(window_steps=whole(window, name="--window"), pc_period_ps=cycle_ps)
            self.supervision = SupervisionLimits(
                cycle_ps=cycle_ps,
                watchdog_ps=watchdog_of(watchdog, cycle_ps),
                completion_timeout_ps=0
                if completion_timeout is None
                else picoseconds(completion_timeout, "--completion-timeout"),
                limit_mm=0.0 if limit is None else length(limit, "--deviation-limit"),
            )
            self.setup = Setup(design=self.design.key, step_mm=step_mm, cycle_ps=cycle_ps)
        except ArgumentError as error:
            names = {
                "window_steps": "--window",
                "cycle_ps": "--cycle",
                "pc_period_ps": "--cycle",
                "watchdog_ps": "--watchdog",
                "completion_timeout_ps": "--completion-timeout",
                "limit_mm": "--deviation-limit",
            }
            raise ArgumentError(names.get(error.name, error.name), error.value, error.allowed, error.hint) from None


def _nodes(predictors: dict[int, Predictor], home_mm: float, words: _NodeWords, *, at_ps: int) -> list[PcNode]:
    from rtec.requester import PcNode

    period_ps = words.handshake.pc_period_ps
    try:
        return [
            PcNode(
                words.handshake,
                words.supervision,
                axis=number,
                predictor=predictor,
                count_mm=words.count_mm,
                step_counts=words.design.step_counts,
                word_limit=words.design.word_limit,
                # one after the other, so that their frames do not queue
                start_ps=at_ps + period_ps + k * period_ps // (4 * len(predictors)),
                # a PC started again must not repeat what it said
                first_sequence=secrets.randbelow(256),
                home_mm=home_mm,
                margin_mm=MARGIN_MM,
                setup=words.setup,
            )
            for k, (number, predictor) in enumerate(predictors.items())
        ]
    except ArgumentError as error:
        name = "--home" if error.name == "home_mm" else error.name
        raise ArgumentError(name, error.value, error.allowed, error.hint) from None


def _warm_up(node: PcNode) -> None:
    """Run what the live loop will run, so that its machine code is loaded before the clock counts."""
    from rtec.link.frame import Frame
    from rtec.requester import HoldReason

    node.receive(Frame(identifier=0x181, data=bytes(8)), at_ps=1)
    node.turn(at_ps=node.due_ps)
    node.hold(HoldReason.OPERATOR, at_ps=node.due_ps)
