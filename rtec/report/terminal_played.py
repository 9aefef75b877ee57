"""How ``rtec simulate --algorithm`` tells its result on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from rtec.readable import printable, time_text
from rtec.report.terminal_simulate import grouped
from rtec.units import PS_PER_S
from rtec.verify.contract.open_play import PlayedPath


def show_played(played: PlayedPath, note: str) -> None:
    """Print what an algorithm in the box has made of a path, and the verdict in words."""
    received, response = played.received, played.response
    rows = [
        ("motion", "steady" if played.path.motion is None else played.path.motion.kind.value),
        ("real edges", grouped(int(played.stream.edges_ps.size))),
        ("encoder counts", grouped(played.encoder_counts)),
        ("controller counts", grouped(played.controller_counts)),
        ("corrections asked for", f"{grouped(played.requested)} steps of {played.step_counts} counts"),
        ("corrections inserted", f"{grouped(played.completed)} steps"),
        ("corrections left over", f"{grouped(played.pending)} steps"),
        ("refusals", grouped(len(response.refusals))),
        ("illegal transitions", grouped(received.illegal_transitions)),
        ("shortest time between edges", time_text(received.min_separation_ps)),
        ("changes swallowed by the filter", grouped(received.filtered)),
        ("servo fault", "none" if received.fault_ps is None else f"at {time_text(received.fault_ps)}"),
        ("simulated", f"{played.stream.until_ps / PS_PER_S:.6g} s in {played.wall_s:.3g} s"),
    ]
    table = Table(title=printable(played.algorithm), show_header=False)
    table.add_column()
    table.add_column(justify="right")
    for row in rows:
        table.add_row(*row)
    console = Console(highlight=False, soft_wrap=False)
    console.print(table)
    console.print(_played_verdict(played), style="green" if played.good else "bold red", soft_wrap=True, markup=False)
    if note:
        console.print(note, soft_wrap=True, markup=False)


def _played_verdict(played: PlayedPath) -> str:
    if played.good:
        added = played.completed * played.step_counts
        return f"good: all corrections inserted ({added:+d} counts), every count right, no illegal transition"
    reasons = []
    if played.response.broken is not None:
        reasons.append(f"it ended early: {printable(played.response.broken.reason)}")
    if played.pending:
        why = f" (refused: {printable(played.response.refusals[-1][1])})" if played.response.refusals else ""
        reasons.append(f"{grouped(abs(played.pending))} corrections are left over{why}")
    if illegal := played.received.illegal_transitions:
        reasons.append(f"{grouped(illegal)} illegal transitions at the controller")
    if not played.audit:
        reasons.append("the controller's count is not the encoder's and the completed steps")
    return "fails: " + "; ".join(reasons)
