"""What the functions return: a sentence, a picture, columns, and the document that ``--json`` prints."""

from __future__ import annotations

import html
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rtec.errors import ArgumentError, unknown
from rtec.inference import compare as comparing, results as found
from rtec.python.models import Model
from rtec.report.diagnosis import comparison_document, comparison_sentence, diagnosis_document, verdict_sentence
from rtec.report.diagnosis.quantities import shown_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rtec.dataset.dataset import Dataset

Drawn = Mapping[str, Callable[[], "Figure | None"]]


class Result:
    """What a command found: `to_dict` is the document that ``--json`` prints, ``result["key"]`` a part of it."""

    _document: Mapping[str, Any]
    sentence: str
    """What was found, in words."""

    def to_dict(self) -> dict[str, Any]:
        """Return the document that ``--json`` prints."""
        return dict(self._document)

    def __getitem__(self, key: str) -> Any:
        if key not in self._document:
            raise unknown("key", str(key)[:60], self._document)
        return self._document[key]

    def __repr__(self) -> str:
        """Return what was found, in words."""
        return f"<rtec.{type(self).__name__}: {self.sentence}>"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(self.sentence)}</p>{self._table()}{self._picture()}"

    def plot(self, kind: str = "") -> Figure:
        """Draw it.

        Parameters
        ----------
        kind
            One of `plots`; the first of them without.

        Raises
        ------
        ArgumentError
            A figure that there is none of.
        """
        from rtec.report.figures_style import figure_style

        known = self._figures()
        if kind and kind not in known:
            raise unknown("plot", kind[:60], known)
        with figure_style():
            for name in [kind] if kind else list(known):
                if (figure := known[name]()) is not None:
                    return figure
        raise unknown("plot", kind or "nothing", [name for name in known if name != kind])

    @property
    def plots(self) -> tuple[str, ...]:
        """What `plot` can draw."""
        return tuple(self._figures())

    def _figures(self) -> Drawn:
        return {}

    def _rows(self) -> list[list[str]]:
        """Return a table for people, headings first; nothing where the sentence says all."""
        return []

    def _table(self) -> str:
        rows = self._rows()
        cells = [
            "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row)
            for tag, row in zip(["th", *["td"] * len(rows)], rows, strict=False)
        ]
        return f"<table>{''.join(f'<tr>{row}</tr>' for row in cells)}</table>" if cells else ""

    def _picture(self) -> str:
        if not self.plots:
            return ""
        page = io.StringIO()
        self.plot().savefig(page, format="svg")
        return page.getvalue().partition("<svg")[1] + page.getvalue().partition("<svg")[2]


class _OfReadings(Result):
    """What was found of a measurement."""

    model: Model
    dataset: Dataset

    @property
    def unit(self) -> str:
        """Unit of what is observed, as it is shown."""
        return self.dataset.units.shown[0]

    @property
    def residual(self) -> NDArray[np.float64]:
        """Observed less model, in `unit`, shape (rows,)."""
        return self.columns[f"residual_{_in_headings(self.unit)}"]

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The readings that were used, column by column, as any data frame takes them.

        Conditions are in the units inside; observed, model and residual in `unit`.
        """
        c, units, factor = self.dataset.coordinates, self.dataset.units, self.dataset.units.shown[1]
        model = self.model.inside(units).predict(self.dataset)
        observed, unit = self.dataset.observed, _in_headings(self.unit)
        known: dict[str, Any] = {
            "run": c.run, "direction": c.direction, "time_s": c.time_s, f"position_{units.position}": c.position,
            f"velocity_{units.position}_s": c.velocity, "spindle_rpm": c.spindle_rpm,
            **c.temperatures, **dict(self.dataset.unknown),
            f"{self.dataset.observe}_{unit}": observed * factor, f"model_{unit}": model * factor,
            f"residual_{unit}": (observed - model) * factor,
        }  # fmt: skip
        return {name: np.asarray(values) for name, values in known.items() if values is not None}


def _in_headings(unit: str) -> str:
    return unit.replace("/", "_").replace("*", "").lower()


class Comparison(_OfReadings):
    """What a model leaves of a measurement, and where."""

    def __init__(self, comparison: comparing.Comparison) -> None:
        self.inside = comparison
        self.dataset = comparison.dataset
        self.model = Model.of(comparison.model, comparison.dataset.library)
        self._document = comparison_document(comparison)
        self.sentence = comparison_sentence(comparison)
        self.rms, self.rms_heldout = self._document["rms"], self._document["rms_heldout"]
        self.noise_floor = self._document["noise_floor"]

    def _figures(self) -> Drawn:
        from rtec.report.diagnosis.plates import comparison_plates

        one = self.inside
        return {plate.name: plate.draw for plate in comparison_plates(one.dataset, one.model, one.noise)}

    def _rows(self) -> list[list[str]]:
        where = ([one.quantity, f"{one.share:.0%}"] for one in self.inside.where)
        return [["what is left goes with", "share of its variance"], *where]

    def report(self, folder: str | Path) -> Path:
        """Write the report of ``rtec compare -o`` into a new folder; return its page."""
        from rtec.io import report_folder
        from rtec.report.diagnosis import write_comparison

        with report_folder(Path(folder), "comparison") as place:
            return Path(write_comparison(self.inside, place))


class Diagnosis(_OfReadings):
    """Which effects a measurement shows, with the model that holds them."""

    def __init__(self, diagnosis: found.Diagnosis) -> None:
        self.inside = diagnosis
        self.dataset = diagnosis.dataset
        self.model = Model.of(diagnosis.model, diagnosis.dataset.library)
        self._document = diagnosis_document(diagnosis)
        self.sentence = verdict_sentence(diagnosis)
        self.verdict: str = diagnosis.verdict.value
        self.effects: tuple[str, ...] = diagnosis.effects
        self.probability: dict[str, float] = dict(diagnosis.probability)
        self.steps: list[dict[str, Any]] = self._document["steps"]
        self.rms_before, self.rms_after = self._document["rms_before"], self._document["rms_after"]
        self.rms_heldout, self.noise_floor = self._document["rms_heldout"], self._document["noise_floor"]

    def _figures(self) -> Drawn:
        from rtec.report.diagnosis.plates import diagnosis_plates

        known = {plate.name: plate.draw for plate in diagnosis_plates(self.inside)}
        return {"staircase": known["staircase"], **known}

    def _rows(self) -> list[list[str]]:
        shown = shown_of(self.dataset.units)
        head = ["step", f"left, {shown.symbol}", "held out", "probability"]
        before = ["no effect" if not self.inside.start.names else "start", _of(self.rms_before), "", ""]
        steps = [
            [
                step["effect"],
                _of(step["rms_train"]),
                _of(step["rms_heldout"]),
                _of(self.probability.get(step["effect"])),
            ]
            for step in self.steps
        ]
        return [head, before, *steps]

    def next(self, time: str = "1h", plan: str | Path | None = None) -> Document:
        """Return the best plan for a time at the machine, and what it will show.

        Parameters
        ----------
        time
            At the machine: "1h", "30 min".
        plan
            File NAME.toml to write it to; beside it come NAME.csv and NAME.nc, the same as G-code.

        Raises
        ------
        ArgumentError, OutputError
            No plan for such a measurement or time, or a file that cannot be written.
        """
        from rtec.inference.next_plan import next_plan
        from rtec.report.diagnosis.next_hour import next_plan_document, write_next_plan
        from rtec.units import TIME, parse_quantity

        found = next_plan(self.inside, parse_quantity(time, TIME, name="time"))
        if isinstance(found, str):
            raise ArgumentError(
                "time", time, "another time, or a measurement of targets", problem=f"no plan: {found}"
            )
        units = self.dataset.units
        files = {} if plan is None else write_next_plan(Path(plan), found, units)
        document = next_plan_document(found, units, files)
        return Document(document, document["text"])

    def report(self, folder: str | Path) -> Path:
        """Write the report of ``rtec diagnose -o`` into a new folder; return its page."""
        from rtec.io import report_folder
        from rtec.report.diagnosis import write_diagnosis

        with report_folder(Path(folder), "diagnosis") as place:
            return Path(write_diagnosis(self.inside, place))


class Document(Result):
    """What else a command prints with ``--json``."""

    def __init__(self, document: Mapping[str, Any], sentence: str, figures: Drawn | None = None) -> None:
        self._document, self.sentence = document, sentence
        self._drawn = figures or {}

    def _figures(self) -> Drawn:
        return self._drawn


def _of(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
