"""Draw the README's picture from the run that makes its table: ``python tools/readme_picture.py``."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

from PIL import Image, PngImagePlugin

from rtec.report.appearance import scale_of
from rtec.report.figures_positioning import positioning_figure
from rtec.report.figures_style import figure_style, rendered
from rtec.study import builtin_study, run_study

_PICTURE = Path(__file__).parents[1] / "docs" / "lathe.png"
_COLOURS = 48
"""A palette makes the file half as large, and the eye sees no difference."""


def main() -> None:
    """Write the picture; its titles stand in it as text, too, so that a test can compare them with the table."""
    result = run_study(replace(builtin_study(), repeatability_mm=0.0, feeds_mm_s=()))
    with figure_style():
        figure = positioning_figure(result, scale_of(result.study.unit))
        if figure is None:
            raise SystemExit("the run has no readings")
        drawn = Image.open(io.BytesIO(rendered(figure)[1]))
    text = PngImagePlugin.PngInfo()
    text.add_text("Description", drawn.text["Description"])
    drawn.convert("RGB").quantize(_COLOURS).save(_PICTURE, optimize=True, pnginfo=text)


if __name__ == "__main__":
    main()
