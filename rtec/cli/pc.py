"""``rtec pc``: the PC's side of axes on a live bus."""

from __future__ import annotations

import secrets
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _live, _measured
from rtec.cli._console import note, print_json
from rtec.cli._live import MACHINE, TIMES
from rtec.cli._parameters import apart, flag, needs, option, quantity, time_ps, word
from rtec.errors import ArgumentError
from rtec.units import LENGTH, PS_PER_S

if TYPE_CHECKING:
    from rtec.effects import Library
    from rtec.injector import Design
    from rtec.predictors import Model
    from rtec.requester.pc_node import PcNode
    from rtec.requester.settings import HandshakeSettings
    from rtec.requester.supervision import SupervisionLimits

_FAILS = 1
MARGIN_MM = 1.0
"""Beyond the ends of a predictor: a corrected axis at home stands beside home by as much as it is corrected."""


def pc(
    interface: str | None = _live.interface("the line of 'rtec box'."),
    channel: str | None = _live.CHANNEL,
    bitrate: int | None = _live.BITRATE,
    dbc: Path | None = _live.DBC,
    axis: int | None = _live.AXIS,
    axes: int | None = _live.AXES,
    table: Path | None = option("--table", "FILE", "Errors by position: .csv, or .comp of LinuxCNC.", panel=MACHINE),
    table_unit: str | None = word(
        "--table-unit", "mm|inch", "Unit of a LinuxCNC table; the file does not say it.", panel=MACHINE
    ),
    models: list[Path] | None = option(
        "--model", "M.toml", "Model or predictor, of 'rtec diagnose' or 'rtec train'; one an axis.", panel=MACHINE
    ),
    effects: Path | None = _measured.EFFECTS,
    heat: Path | None = option(
        "--heat", "HEAT.csv", "Temperatures that a logger goes on writing, for a --model of them.", panel=MACHINE
    ),
    cautious: bool = flag("--cautious", "Ask for no more than its interval supports.", panel=MACHINE),
    travel_mm: float = quantity(
        "--travel", LENGTH, "1000mm", "From home on, for a --model.", panel=MACHINE, default="1000mm"
    ),
    home_mm: float | None = quantity(
        "--home", LENGTH, "1inch", "Where home is in the predictor's positions.", panel=MACHINE
    ),
    design: Design = _live.DESIGN,
    count_mm: float = _live.COUNT,
    large: bool = flag("--large", "The first request may exceed the window.", panel=MACHINE),
    probe: bool = flag("--probe", "Probing mode: nothing is corrected.", panel=MACHINE),
    reset: bool = flag("--reset", "Acknowledge a box that has stopped for good.", panel=MACHINE),
    window_steps: int = _live.WINDOW,
    cycle_ps: int = _live.CYCLE,
    watchdog_ps: int | None = _live.WATCHDOG,
    limit_mm: float = quantity(
        "--deviation-limit", LENGTH, "0.3mm", "Never ask for more.", panel=TIMES, show_default=False, default=0.0
    ),
    completion_timeout_ps: int = time_ps(
        "--completion-timeout",
        "2s",
        "Longest time that an accepted total may take.",
        panel=TIMES,
        show_default=False,
        default=0,
    ),
    outside: str = word(
        "--outside",
        "hold|keep|zero",
        "The correction where the predictor has no answer.",
        panel=TIMES,
        default="hold",
    ),
    start_up_s: float = _live.seconds(
        "--start-up", "60s", "Longest wait until the boxes are there and ready.", default="60s"
    ),
    duration_s: float | None = _live.DURATION,
    log: Path | None = _live.LOG,
    force: bool = _live.FORCE,
    plain: bool = _live.PLAIN,
    as_json: bool = _live.JSON,
) -> None:
    """Correct axes on a live bus by what a predictor says, and hold the machine where it must be held.

    Box and PC must have the same --design, --count and --cycle; they compare them. Exits with 0 where it ended as
    asked, with 1 where the machine is held or no box was ready in time.

    Example: rtec pc --table z.csv --design c
    Example: rtec pc --model best.toml --home 1inch --interface socketcan --channel can0
    Example: rtec pc --axes 3 --reset --start-up 5min
    """
    from rtec.live.events import Events
    from rtec.live.heat_file import HeatFile
    from rtec.live.pc_loop import PcLoop
    from rtec.live.pc_run import PcRun, pc_document
    from rtec.live.quiet import quiet_collector
    from rtec.live.shown import pc_screen
    from rtec.live.stopping import StopWish
    from rtec.requester.settings import HandshakeSettings, Outside
    from rtec.requester.supervision import SupervisionLimits

    bus = _live.BusWords(interface=interface, channel=channel, bitrate=bitrate)
    _live.check_dbc(dbc)
    numbers = _live.axes_of(axis, axes)
    predictors, home_mm = _predictors(numbers, table, table_unit, models or [], home_mm, travel_mm, cautious, effects)
    sensors = None if heat is None else HeatFile(heat)
    _check_heat(predictors, () if sensors is None else sensors.inputs)
    supervision = SupervisionLimits(
        cycle_ps=cycle_ps,
        watchdog_ps=5 * cycle_ps if watchdog_ps is None else watchdog_ps,
        completion_timeout_ps=completion_timeout_ps,
        limit_mm=limit_mm,
    )
    handshake = HandshakeSettings(window_steps=window_steps, pc_period_ps=cycle_ps, outside=Outside(outside))
    nodes_from = partial(_nodes, predictors, design, handshake, supervision, count_mm=count_mm, home_mm=home_mm,
                         heat=() if sensors is None else sensors.inputs)  # fmt: skip
    for each in nodes_from(at_ps=0):
        _warm_up(each)
    events = Events(_live.event_printer(as_json))
    with ExitStack() as stack:
        begun_s = time.monotonic()
        far = bus.line_of_box(start_up_s) if interface is None else None
        waited_s = time.monotonic() - begun_s
        transport = stack.enter_context(_live.logged(bus.open(far), log, force))
        stop = stack.enter_context(StopWish())
        view = stack.enter_context(_live.screen(events, _live.stream_of(as_json), draws=not (plain or as_json)))
        stack.enter_context(quiet_collector())
        nodes = nodes_from(at_ps=transport.now_ps())
        for each in nodes:
            each.probe(probe)
            if large:
                each.allow_large_correction()
            if reset:
                each.acknowledge()
        loop = PcLoop(nodes, transport, sensors)

        def show(at_s: float) -> None:
            if view is not None and view.wants(at_s):
                view.show(at_s, pc_screen(loop, events, count_mm=count_mm, title="rtec pc", at_s=at_s))

        run = PcRun(
            loop,
            events=events,
            stop=stop,
            until_s=duration_s,
            start_up_s=start_up_s,
            waited_s=waited_s,
            acknowledged=reset,
            line_of_box=interface is None,
            turn_s=cycle_ps / PS_PER_S,
            show=show,
        )
        ending = run.run()
        events.happen(run.at_s, f"ended: {ending.why}")
        if view is not None:
            view.show(
                run.at_s, pc_screen(loop, events, count_mm=count_mm, title=f"rtec pc, {ending.why}", at_s=run.at_s)
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
    home_mm: float | None,
    travel_mm: float,
    cautious: bool,
    effects: Path | None = None,
) -> tuple[dict[int, Model], float]:
    from rtec.predictors import LatheNetwork, LengthUnit, read_linuxcnc_table, read_table

    if cautious and not models:
        raise needs("--cautious", "--model", "a predictor of rtec train has an interval")
    if table is not None and models:
        raise apart("--model", "--table")
    if table_unit is not None and (table is None or table.suffix.lower() == ".csv"):
        raise needs("--table-unit", "a table of LinuxCNC", "a .csv says its units itself")
    known: Model
    if table is not None and table.suffix.lower() != ".csv":
        if table_unit is None:
            raise needs("--table", "--table-unit mm or --table-unit inch", "a .csv says its units itself")
        known = read_linuxcnc_table(table, unit=LengthUnit.MM if table_unit == "mm" else LengthUnit.INCH)
    elif table is not None:
        known = read_table(table)
    elif models:
        return _of_models(numbers, models, home_mm or 0.0, travel_mm, cautious, effects), home_mm or 0.0
    else:
        known = LatheNetwork()
        home_mm = known.range_mm[0] if home_mm is None else home_mm
    return dict.fromkeys(numbers, known), home_mm or 0.0


def _of_models(
    numbers: list[int],
    models: list[Path],
    home_mm: float,
    travel_mm: float,
    cautious: bool,
    effects: Path | None,
) -> dict[int, Model]:
    """Return the predictor of each axis: a file that names its axis is for that one, one that does not for all."""
    from rtec.effects.own_file import library_of_file
    from rtec.inference.static_predictor import axis_of_file
    from rtec.predictors import NoError, Predictor
    from rtec.predictors.binding import axis_name

    library = library_of_file(effects)
    found: dict[int, Model] = {}
    for path in models:
        predictor = _model_of(path, (home_mm, home_mm + travel_mm), cautious, library)
        axis = axis_of_file(path)
        of_itself = len(predictor.inputs) == 2 or not isinstance(predictor, Predictor)
        if axis is None and len(models) == 1 and of_itself:
            return dict.fromkeys(numbers, predictor)
        if axis is None:
            allowed = "files with 'axis = 2', as rtec train writes them of measurements that say '# axis: 2'"
            raise ArgumentError("--model", f"{path}, which does not say of which axis it is", allowed)
        if axis not in numbers or axis in found:
            what = "a second file of" if axis in found else "a file of"
            raise ArgumentError("--model", f"{path}, {what} axis {axis}", f"one of axis {_listed(numbers)}")
        found[axis] = predictor
    for predictor in found.values():
        for name in predictor.inputs[2:] if isinstance(predictor, Predictor) else ():
            if name not in map(axis_name, numbers):
                allowed = f"--axes with the axis of {name}, which the predictor looks at"
                raise ArgumentError("--model", f"axis {_listed(numbers)} alone", allowed)
    idle = [axis for axis in numbers if axis not in found]
    if idle:
        note(f"axis {_listed(idle)}: not corrected, as no --model is of it")
    return {axis: found.get(axis) or NoError() for axis in numbers}


def _model_of(path: Path, held_mm: tuple[float, float], cautious: bool, library: Library) -> Model:
    from rtec.inference.static_predictor import predictor_of_file
    from rtec.predictors.motion_file import is_motion_file
    from rtec.predictors.motion_model import model_of_motion
    from rtec.predictors.predictor_file import is_predictor_file, is_warm_file, read_warm_model

    if is_motion_file(path):
        return model_of_motion(path, cautious=cautious)
    if is_predictor_file(path) and is_warm_file(path):
        return read_warm_model(path, cautious=cautious)[1]
    predictor, left_out = predictor_of_file(path, *held_mm, cautious=cautious, library=library)
    for effect in left_out:
        note(f"warning: {effect.effect} is left out: {effect.why}")
    return predictor


def _check_heat(predictors: dict[int, Model], inputs: tuple[str, ...]) -> None:
    from rtec.errors import nearest
    from rtec.predictors.warm.warm_model import WarmModel

    warm = [each for each in predictors.values() if isinstance(each, WarmModel)]
    if inputs and not warm:
        raise needs("--heat", "--model of a warm machine", "others do not look at it")
    for model in warm:
        for name in model.inputs[1:]:
            if name not in inputs:
                hint = nearest(name, inputs) if inputs else "a file that a data logger goes on writing"
                raise ArgumentError(
                    "--heat", None, f"a file with {name}, which the model of {model.observe} follows", hint
                )


def _listed(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers))


def _nodes(
    predictors: dict[int, Model],
    design: Design,
    handshake: HandshakeSettings,
    supervision: SupervisionLimits,
    *,
    count_mm: float,
    home_mm: float,
    heat: tuple[str, ...],
    at_ps: int,
) -> list[PcNode]:
    from rtec.requester.pc_node import PcNode
    from rtec.requester.setup import Setup

    period_ps, step_counts = handshake.pc_period_ps, design.step_counts
    setup = Setup(design=design.key, step_mm=step_counts * count_mm, cycle_ps=period_ps)
    return [
        PcNode(
            handshake,
            supervision,
            axis=number,
            predictor=predictor,
            count_mm=count_mm,
            step_counts=step_counts,
            word_limit=design.word_limit,
            # one after the other, so that their frames do not queue
            start_ps=at_ps + period_ps + k * period_ps // (4 * len(predictors)),
            # a PC started again must not repeat what it said
            first_sequence=secrets.randbelow(256),
            home_mm=home_mm,
            margin_mm=MARGIN_MM,
            setup=setup,
            heat=heat,
        )
        for k, (number, predictor) in enumerate(predictors.items())
    ]


def _warm_up(node: PcNode) -> None:
    """Run what the live loop will run, so that its machine code is loaded before the clock counts."""
    from rtec.link.frame import Frame
    from rtec.requester.supervision import HoldReason

    node.receive(Frame(identifier=0x181, data=bytes(8)), at_ps=1)
    node.turn(at_ps=node.due_ps)
    node.hold(HoldReason.OPERATOR, at_ps=node.due_ps)
