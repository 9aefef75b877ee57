"""How ``rtec simulate`` tells its result on the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from rtec.axis.motion import MotionKind
from rtec.injector import RealEdges, Timing
from rtec.machine import OpenPath, OpenPathResult
from rtec.machine.open_fault_outcome import DETECTED, MASKED, FaultOutcome
from rtec.readable import hertz_text, time_text

EDGES = {RealEdges.HOLD: "held back", RealEdges.MERGE: "merged"}
"""What becomes of them, in words."""


def show(path: OpenPath, result: OpenPathResult) -> None:
    """Print the result as a table, and the verdict in words."""
    timing, design = path.injector.timing, path.injector.design
    insertions, received = result.insertions, result.received
    inside = [("real edges inside insertions", EDGES[path.injector.real_edges])]
    if insertions.longest_ps is not None and insertions.real_inside is not None:
        inside = [
            ("last change after its edge, at most", time_text(insertions.longest_ps)),
            (
                "real edges inside insertions",
                f"{grouped(insertions.real_inside)}, {EDGES[path.injector.real_edges]}",
            ),
        ]
    rows = [
        *_motion_rows(path, result),
        ("encoder counts", grouped(result.encoder_counts)),
        ("controller counts", grouped(result.controller_counts)),
        ("corrections asked for", f"{grouped(result.insertions.requested)} steps of {result.step_counts} counts"),
        ("corrections inserted", f"{grouped(result.insertions.completed)} steps"),
        ("corrections left over", f"{grouped(result.pending)} steps"),
        ("refused by the speed gate", f"{grouped(insertions.refused)} times"),
        *inside,
        ("illegal transitions", grouped(received.illegal_transitions)),
        ("shortest time between edges", time_text(received.min_separation_ps)),
        ("changes swallowed by the filter", grouped(received.filtered)),
        ("glitches", grouped(result.glitches)),
        ("servo fault", "none" if received.fault_ps is None else f"at {time_text(received.fault_ps)}"),
        ("simulated", f"{result.simulated_s:.6g} s in {result.wall_s:.3g} s"),
    ]
    processor = path.microcontroller
    box = (
        f"worst insertion {time_text(timing.worst_ps(design))}"
        if processor is None
        else f"firmware on {processor.name}"
    )
    table = Table(title=f"design {design.key}, {box}", show_header=False)
    table.add_column()
    table.add_column(justify="right")
    for row in rows:
        table.add_row(*row)
    console = Console(highlight=False, soft_wrap=False)
    console.print(table)
    console.print(verdict(path, result), style="green" if result.good else "bold red", soft_wrap=True)


def show_outcome(outcome: FaultOutcome) -> None:
    """Print what the faults of a run have done, whether anybody noticed, and the class of the outcome."""
    table = Table("fault", "from", "took effect", "changes", title="faults")
    for effect in outcome.effects:
        row = effect.to_dict()
        end = "" if effect.fault.until_ps is None else f" to {time_text(effect.fault.until_ps)}"
        took = "not activated" if effect.activated_ps is None else f"at {time_text(effect.activated_ps)}"
        table.add_row(str(row["fault"]), f"{time_text(effect.fault.from_ps)}{end}", took, grouped(effect.changes))
    console = Console(highlight=False, soft_wrap=False)
    console.print(table)
    by = ", ".join(outcome.noticed) or "nobody"
    said = f"{outcome.word}: the controller is off by {outcome.off_counts:+d} counts, noticed by {by}"
    if not outcome.activated:
        said = f"{outcome.word}: the run proves nothing about a fault that took no effect"
    style = {MASKED: "green", DETECTED: "yellow"}.get(outcome.word, "bold red")
    console.print(said, style=style, soft_wrap=True)
    if not outcome.good_without:
        console.print("Without the faults the run fails, too.", soft_wrap=True)


def _motion_rows(path: OpenPath, result: OpenPathResult) -> list[tuple[str, str]]:
    forward = "+" if path.direction > 0 else "-"
    if path.motion is None:
        edges = f"{grouped(result.edges)} in {forward} direction"
        return [("encoder frequency", hertz_text(path.frequency_hz)), ("real edges", edges)]
    if path.motion.kind is MotionKind.CAPTURE:
        return [
            ("highest frequency in the capture", hertz_text(result.top_hz)),
            ("real edges", f"{grouped(result.edges)}, captured"),
        ]
    return [
        ("motion", path.motion.kind.value),
        ("highest encoder frequency", hertz_text(result.top_hz)),
        ("acceleration, at most", f"{hertz_text(path.motion.acceleration_hz_s)}/s"),
        ("real edges", f"{grouped(result.edges)} there and back"),
    ]


def verdict(path: OpenPath, result: OpenPathResult) -> str:
    """Return in words whether all was inserted and every count is right."""
    if result.good:
        added = result.insertions.completed * result.step_counts
        return f"good: all corrections inserted ({added:+d} counts), every count right, no illegal transition"
    reasons = []
    if result.pending:
        reasons.append(f"{grouped(abs(result.pending))} corrections are left over{_gate_reason(path, result)}")
    illegal = result.received.illegal_transitions
    if illegal:
        plural = "s" if illegal > 1 else ""
        reasons.append(f"{grouped(illegal)} illegal transition{plural} at the controller")
    if not result.audit:
        reasons.append(_audit_reason(path, result))
    return "fails: " + "; ".join(reasons)


def _gate_reason(path: OpenPath, result: OpenPathResult) -> str:
    timing: Timing = path.injector.timing
    if path.microcontroller is not None:
        return " (refused by the program's speed gate, or asked for since its last reading)"
    if not result.insertions.refused or timing.gate_margin is None:
        return ""
    limit_hz = timing.limit_hz(path.injector.design) / (1.0 + timing.gate_margin)
    return f" (the speed gate lets through up to {hertz_text(limit_hz)})"


def _audit_reason(path: OpenPath, result: OpenPathResult) -> str:
    added = result.insertions.completed * result.step_counts
    if path.receiver.multiplication.value == 4:
        wrong = path.receiver.wrapped(result.controller_counts - result.encoder_counts - added)
        if wrong:
            return f"the controller's count is wrong by {wrong:+d}"
    elsewhere = result.insertions.ahead_counts - added
    return (
        f"the gates put in {elsewhere:+d} counts more than the box believes" if elsewhere else "the counts disagree"
    )


def grouped(number: int) -> str:
    """Return a whole number with its digits in threes, as in 4 000."""
    return f"{number:,}".replace(",", " ")
