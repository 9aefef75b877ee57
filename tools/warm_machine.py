"""Draw the picture of docs/warm-machine.md: ``python -m tools.warm_machine``."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from rtec.heat import Duty, WarmRun, warm_machine
from rtec.report.figures_style import figure_style, guide, new_figure, rendered
from rtec.report.palette import (
    AMBER,
    BLUE,
    BROWN,
    DOTTED,
    GREEN,
    GREY,
    LIGHT,
    LIMIT_LINE,
    PALE,
    PURPLE,
    SKY,
    VERMILION,
    VIOLET,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_PICTURE = Path(__file__).parents[1] / "docs" / "warm-machine.png"
_COLOURS = 128
"""A palette makes the file half as large, and the eye sees no difference."""
_DUTY = Duty.paper(spindle_rpm=4000.0, feed_mm_s=20.0)
_STOP_H = _DUTY.starts_s[1] / 3600.0
_SCREW_MM = 400.0
_THERMOMETERS = (
    ("front_bearing", "front bearing", VERMILION), ("rear_bearing", "rear bearing", AMBER),
    ("motor", "motor", PURPLE), ("housing", "housing", BROWN), ("head_left", "head", GREEN),
    ("coolant", "coolant", SKY), ("screw_nut", "screw nut", VIOLET),
    ("column_front", "column", BLUE), ("room", "room", GREY),
)  # fmt: skip
_CHANNELS = (("x1", BLUE), ("x2", SKY), ("y1", VERMILION), ("y2", AMBER), ("z", GREEN))
_SOURCES = (
    ("front_bearing", "front bearing", VERMILION), ("motor", "motor", PURPLE),
    ("rear_bearing", "rear bearing", AMBER), ("nut", "screw nut", VIOLET),
)  # fmt: skip


def picture(run: WarmRun) -> Figure:
    """Return temperatures, displacements and heat over the time."""
    hours = run.time_s / 3600.0
    figure = new_figure(9.5)
    heat, moved, power = figure.subplots(3, 1, sharex=True, height_ratios=(4, 4, 2.4))
    for name, label, colour in _THERMOMETERS:
        heat.plot(hours, run.thermometers[name], color=colour, label=label, linewidth=1.2)
    heat.set_ylabel("thermometer (°C)")
    for name, colour in _CHANNELS:
        dash = LIMIT_LINE if name.endswith("2") else "-"
        moved.plot(hours, run.displacement_um[name], color=colour, linestyle=dash, label=name.upper())
    grown = 1e3 * (run.screw_shift_mm + _SCREW_MM * run.screw_per_mm)
    moved.plot(hours, grown, color=VIOLET, linestyle=DOTTED, label=f"screw, {_SCREW_MM:.0f} mm")
    moved.set_ylabel("displacement (µm)")
    for name, label, colour in _SOURCES:
        power.plot(hours, run.heat.heat_w[:, run.heat.sources.index(name)], color=colour, label=label)
    power.fill_between(
        hours, 0.0, 1.0, where=run.heat.chiller_runs, transform=power.get_xaxis_transform(), color=LIGHT, linewidth=0,
        label="chiller runs",
    )  # fmt: skip
    power.set_ylabel("heat (W)")
    power.set_xlabel("time (h)")
    _finish((heat, moved, power))
    return figure


def _finish(panels: Sequence[Axes]) -> None:
    for axes in panels:
        guide(axes, x=_STOP_H)
        axes.margins(x=0.005)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    panels[-1].annotate("spindle and feed stop", (_STOP_H + 0.03, 350.0), color=PALE)


if __name__ == "__main__":
    with figure_style():
        made = rendered(picture(warm_machine().run(_DUTY, seed=1)))[1]
    Image.open(io.BytesIO(made)).convert("RGB").quantize(_COLOURS).save(_PICTURE, optimize=True)
