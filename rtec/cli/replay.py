"""``rtec replay``: a bus log played into a live node, its answers held to the log."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._console import note, print_json, progress
from rtec.cli._live import BITRATE, BUS, CHANNEL, OUTPUT, TIMES, BusWords, interface, seconds
from rtec.cli._parameters import flag, member, pure, time_ps

if TYPE_CHECKING:
    from rtec.live.compared import Difference
    from rtec.live.played import Role
    from rtec.live.replay_run import ReplayRun

_FAILS = 1
_SHOWN = 20


def replay(
    log: Path = typer.Argument(..., metavar="LOG", help="A .log (candump), .asc or .blf file.", show_default=False),
    role: Role = member(
        "--as",
        "rtec.live.played:Role",
        "pc|box",
        "Whose frames are played: those of the PC to a box, or of the box to a PC.",
        panel=BUS,
        default="pc",
    ),
    interface: str | None = interface("the line of 'rtec box'."),
    channel: str | None = CHANNEL,
    bitrate: int | None = BITRATE,
    speed: float = pure(
        "--speed", "N", "Play N times as fast as it was recorded.", low=0.1, high=10.0, panel=TIMES, default="1"
    ),
    tolerance_ps: int | None = time_ps(
        "--tolerance", "50ms", "Answers may come so much sooner or later; 5 cycles without.", panel=TIMES
    ),
    start_up_s: float = seconds("--start-up", "60s", "Longest wait for the node.", default="60s"),
    as_json: bool = flag("--json", "One JSON document on stdout.", panel=OUTPUT),
) -> None:
    """Play a bus log into a live node, at the log's own times, and compare its answers with those of the log.

    Only one side's frames are sent, never those of the node under test. Exits with 1 where it answers differently.

    Example: rtec replay run.log

    Example: rtec replay trace.asc --as box --interface socketcan --channel can0

    Example: rtec replay night.blf --speed 2 --tolerance 100ms --json
    """
    from rtec.live.played import Role, survey
    from rtec.live.quiet import quiet_collector
    from rtec.live.replay_run import ReplayRun, replay_document, tolerance_of

    bus = BusWords(interface=interface, channel=channel, bitrate=bitrate)
    found = survey(log, role)
    tolerance_ps = tolerance_of(found) if tolerance_ps is None else tolerance_ps
    if found.cut_off is not None:
        note(f"warning: {found.cut_off}")
    with ExitStack() as stack:
        end = None
        if interface is None and role is Role.PC:
            end = bus.line_of_box(start_up_s)
        elif interface is None:
            from rtec.link.pseudo_terminal import SLCAN_OPENS, Line

            end = stack.enter_context(Line(name=bus.line, opened_by=SLCAN_OPENS)).near
        transport = stack.enter_context(bus.open(end))
        if role is Role.BOX:
            for line in bus.ways_in(" ".join(["rtec", "pc", *bus.words()])):
                note(line)
        note(f"waiting up to {start_up_s:g} s for the {role.other.words}")
        stack.enter_context(quiet_collector())
        show = stack.enter_context(progress(f"playing {log.name}"))
        run = ReplayRun(
            log, transport, found, speed=speed, tolerance_ps=tolerance_ps, start_up_s=start_up_s, show=show
        )
        run.run()
    if as_json:
        print_json({"log": str(log)} | replay_document(run))
    else:
        _tell(run)
    for words in run.notes:
        note(words)
    if not run.passed:
        raise typer.Exit(_FAILS)


def _tell(run: ReplayRun) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    node, played, compared = run.found.role.other.words, run.found.role.words, run.comparison
    if not run.met:
        console.print(f"nothing was played: no {node} answered", style="bold red")
        return
    if run.stale:
        console.print(f"nothing was played: the {node} is not as that of the log", style="bold red")
        return
    console.print(
        f"{len(run.late_ps)} frames of the {played} played in {run.run_s:.1f} s; "
        f"the {node} said {compared.said} frames where the log holds {compared.logged}",
        soft_wrap=True,
    )
    if compared.garbled:
        console.print(f"{compared.garbled} of the {node}'s frames have a wrong checksum", style="bold red")
    if run.rivals:
        console.print(f"another {played} speaks on this bus: {run.rivals} frames", style="bold red")
    within = f"{run.tolerance_ps / 1e9:g} ms"
    if run.passed:
        console.print(f"the same answers as in the log, within {within}", style="green")
    if not compared.differences:
        return
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for heading in ("from s", "to s", "axis", "message", "field", "log", node, "frames"):
        table.add_column(heading, justify="left" if heading in ("message", "field") else "right", no_wrap=True)
    for each in compared.differences[:_SHOWN]:
        table.add_row(*_row(each))
    console.print(table)
    number = len(compared.differences) + compared.more
    more = f", the first {_SHOWN} of them above" if number > _SHOWN else ""
    console.print(f"{number} difference{'s' * (number != 1)} beyond {within}{more}", style="bold red")


def _row(each: Difference) -> list[str]:
    values = ["nothing" if value is None else str(value) for value in (each.logged, each.said)]
    return [
        f"{each.from_s:.3f}",
        f"{each.to_s:.3f}",
        str(each.axis),
        each.message,
        each.field,
        *values,
        str(each.frames),
    ]
