"""A test on a workbench as a record of the same columns as a trial of a campaign."""

from __future__ import annotations

import shlex
from collections.abc import Mapping

from rtec.link.simulated import FaultActivation
from rtec.machine.faults import Fault
from rtec.machine.station import Alarm
from rtec.machine.workbench import BenchBox, Workbench
from rtec.requester.status import BoxState
from rtec.units import PS_PER_S
from rtec.verify.campaign.code import code_of
from rtec.verify.campaign.job import FAILED, NOT_ACTIVATED, PASSED, Job, Value

_BENCH = "rtec.machine.workbench:bench_of"


def trial_row(node: str, *, passed: bool, seconds: float, own: Mapping[str, Value] | None = None) -> dict[str, Value]:
    """Return the record of a test.

    Parameters
    ----------
    node
        By which pytest names the test.
    passed, seconds
        How it ended, and how long it took.
    own
        Columns that the test gives, or that replace others.

    Examples
    --------
    >>> row = trial_row("test_mine.py::test_it", passed=True, seconds=0.5, own={"requirement": "SR-12"})
    >>> row["result"], row["requirement"], row["again"]
    ('passed', 'SR-12', 'pytest test_mine.py::test_it')
    """
    version = code_of(_BENCH)
    row: dict[str, Value] = {
        "job": Job("pytest", {"node": node}, 0, 0).address(version), "plan": "pytest", "version": version,
        "requirement": "", "test": node, "seed": 0, "run": 0, "result": PASSED if passed else FAILED, **(own or {}),
    }  # fmt: skip
    if passed and row.get("fired") == 0:
        row["result"] = NOT_ACTIVATED
    return row | {"seconds": seconds, "again": f"pytest {shlex.quote(node)}"}


def bench_columns(bench: Workbench, activations: list[FaultActivation[Fault]]) -> dict[str, Value]:
    """Return what a workbench knows of a trial: its faults, when they took effect, who stopped the machine, counts.

    Of several boxes, the one of axis 1 is told.
    """
    box = bench.boxes[min(bench.boxes)]
    view, held_ps = box.view, box.held_since_ps
    columns: dict[str, Value] = {"design": view_design(box)}
    for prefix, one in zip(("", "second_"), activations, strict=False):
        columns |= {
            prefix.rstrip("_") or "fault": one.fault.kind.words,
            f"{prefix}moment_ps": one.fault.from_ps,
            f"{prefix}activated_ps": one.first_ps,
            f"{prefix}fired": one.times,
        }
    if activations:
        columns["seed"] = activations[0].fault.seed
    first_ps = activations[0].first_ps if activations else None
    return columns | {
        "detected_ps": held_ps,
        "detected_s": None if held_ps is None or first_ps is None else max(0.0, (held_ps - first_ps) / PS_PER_S),
        "stopped_by": _stopper(box),
        "reason": view.status.name.lower().replace("_", " ") if view.held else "",
        "encoder_counts": view.position,
        "controller_counts": view.controller_count,
        "left_counts": view.controller_count - view.position - view.inserted_counts,
    }


def view_design(box: BenchBox) -> str:
    """Return the word of a box's design."""
    return box.settings.injector.design.key


def _stopper(box: BenchBox) -> str:
    view = box.view
    if view.alarm is not Alarm.NONE:
        return "controller"
    if not view.powered or view.box_state is BoxState.FATAL:
        return "box"
    return "pc" if view.held else "nobody"
