"""Figures that are ready for the page and for files."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rtec.report.figures_style import figure_style, rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, kw_only=True)
class Illustration:
    """A figure that is ready for the page and for files."""

    name: str
    """File name without ending; also the anchor on the page."""
    title: str
    caption: str
    """For the reader."""
    svg: bytes
    png: bytes
    """The figure."""


class Plate(NamedTuple):
    """A figure to be drawn, with its words as in `Illustration`."""

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure | None]
    """None where there is nothing to show."""


def drawn(plates: Iterable[Plate]) -> list[Illustration]:
    """Draw the figures for which there is something to show."""
    found = []
    with figure_style():
        for plate in plates:
            if (figure := plate.draw()) is not None:
                svg, png = rendered(figure)
                found.append(
                    Illustration(name=plate.name, title=plate.title, caption=plate.caption, svg=svg, png=png)
                )
    return found
