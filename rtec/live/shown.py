"""What the view shows of boxes and PC, as plain documents."""

from __future__ import annotations

from rtec.live.box_loop import BoxLoop
from rtec.live.events import Events
from rtec.live.figures import spread_ms
from rtec.live.pc_loop import PcLoop
from rtec.live.words import box_words, pc_words
from rtec.machine.station import Station
from rtec.requester.pc_node import PcNode
from rtec.requester.settings import PcState
from rtec.units import PS_PER_MS

LAST_TURNS = 500


def box_screen(loop: BoxLoop, events: Events | None, *, title: str, at_s: float) -> dict[str, object]:
    """Return what there is to see of the boxes, with the last events, or without."""
    return {
        "title": f"{title}   {at_s:.1f} s",
        "axes": [_box_axis(station) for station in loop.stations],
        "events": [] if events is None else [str(event) for event in events.latest(8)],
    }


def _box_axis(station: Station) -> dict[str, object]:
    view = station.view
    refused = view.counters
    return {
        "axis": station.settings.axis,
        "held": view.held,
        "words": box_words(view) + ("; the machine is held" if view.held else ""),
        "cells": {
            "position": f"{view.position_mm:+.4f} mm",
            "speed": f"{view.speed_mm_s * 60:+.0f} mm/min",
            "requested": f"{view.requested:+d} steps",
            "completed": f"{view.completed:+d} steps, {view.inserted_counts:+d} counts",
            "state": view.box_state.name,
            "status": view.status.name,
            "refused": f"{refused.requests_refused} requests, {sum(refused.frames_refused.values())} frames",
        },
        "insertion": [(change.time_ps, change.lines, change.lines_out) for change in station.last_insertion()],
    }


def pc_screen(loop: PcLoop, events: Events, *, count_mm: float, title: str, at_s: float) -> dict[str, object]:
    """Return what there is to see of the PC."""
    late = spread_ms(loop.late_ps[-LAST_TURNS:], per_ms=PS_PER_MS)
    return {
        "title": f"{title}   {at_s:.1f} s   turns late by {_ms(late['median_ms'])}, 99 %: {_ms(late['p99_ms'])}",
        "axes": [_pc_axis(node, count_mm) for node in loop.nodes],
        "events": [str(event) for event in events.latest(8)],
    }


def _pc_axis(node: PcNode, count_mm: float) -> dict[str, object]:
    view = node.view
    return {
        "axis": node.axis,
        "held": view.state is PcState.HOLD,
        "words": pc_words(view),
        "cells": {
            "position": f"{view.position * count_mm:+.4f} mm, {'up' if view.direction > 0 else 'down'}",
            "wanted": f"{view.target:+d} steps",
            "requested": f"{view.requested:+d} steps",
            "completed": f"{view.completed:+d} steps",
            "handshake": _ms(view.answer_s * 1000) if view.counters.answered else "-",
            "state": view.state.name,
            "box": "-" if view.box_state is None else view.box_state.name,
            "status": "-" if view.status is None else view.status.name,
            "refused": f"{view.counters.frames_refused} frames",
        },
    }


def _ms(value: float | int | None) -> str:
    return "-" if value is None else f"{value:.2f} ms"
