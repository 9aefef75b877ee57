"""``rtec iso230``: the positioning figures of measurements, as a table, a document, or a report with the plot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import note, print_json, warn
from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import flag, folder, force, option
from rtec.cli._several import names_of
from rtec.errors import ArgumentError, RtecError
from rtec.io import check_folder

if TYPE_CHECKING:
    from rtec.metrology import (
        ColumnChoices,
        Coordinate,
        JudgedTest,
        Measurement,
        Readings,
        RotaryReadings,
        UncertaintyInputs,
    )
    from rtec.report.iso230.sheet import Sheet


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known(OptionGroup):
    """Options that state what is known of the measurement, by the names of `UncertaintyInputs`."""

    PANEL = "What is known of the measurement, for its uncertainty; a file may state it in '# eve: 1.2 um' lines"

    device_uncertainty: str | None = option(
        "--device-uncertainty", "'0.5 um/m'", "Of the laser or scale, k = 2, from its certificate; rotary: an angle."
    )
    misalignment: str | None = option(
        "--misalignment", "'1 mm'", "Sideways distance of beam and axis over the travel."
    )
    temperature_uncertainty: str | None = option(
        "--temperature-uncertainty", "'0.5 K'", "Limits ± of the machine's measured temperature."
    )
    expansion: str | None = option("--expansion", "'11.7 um/m/K'", "Coefficient that readings were compensated with.")
    expansion_uncertainty: str | None = option(
        "--expansion-uncertainty", "'2 um/m/K'", "Limits ± of that coefficient."
    )
    off_reference: str | None = option(
        "--off-reference", "'3 K'", "Largest difference of the machine from 20 degC in the test."
    )
    eve: str | None = option(
        "--eve", "'1.2 um'", "Range of the readings of the axis at rest, over as long as the test took."
    )


def iso230(
    data: list[Path] = _measured.DATA_FILES,
    *,
    output: Path | None = folder("-o --output", "Folder of a report: plot, page, PDF."),
    period: str | None = option(
        "--period", "'0.25 inch'", "Period of the cyclic error; else the file's screw_pitch."
    ),
    unit: str | None = option(
        "--unit", "UNIT", "um (default), mm, nm, inch; for a rotary axis arcsec (default), deg, urad."
    ),
    strict: bool = flag("--strict", "Exit with 2, and no figures, where there is a warning."),
    known: _Known,
    columns: _measured.ColumnOptions,
    force: bool = force("Write into a folder that is not empty."),
    json: bool = _measured.JSON,
) -> None:
    """Judge positioning tests: figures of ISO 230-2 and VDI/DGQ 3441, their uncertainty, what speaks against them.

    Example: rtec iso230 before.csv after.csv -o report
    Example: rtec iso230 z_axis.csv --period "0.25 inch"
    Example: rtec iso230 messung.csv --map "Soll=target_mm" --json
    """
    from rtec.report.iso230.sheet import sheet_of
    from rtec.report.iso230.terminal import show

    given = {name: text for name, text in asdict(known).items() if text is not None}
    choices = columns.choices(several=len(data) > 1)
    names = names_of(data)
    tests = [_judged(path, name, period, given, choices) for path, name in zip(data, names, strict=True)]
    _check_alike(tests)
    of_tests = sheet_of(tests, unit)
    if strict:
        _refuse_warnings(tests)
    written = {}
    if output is not None:
        check_folder("-o", output, force=force)  # somebody may have written there in the meantime
        written["report"] = str(_report(of_tests, output))
    if json:
        print_json({**of_tests.document, **written})
        return
    _say(tests, "warning", with_unused=True)
    show(of_tests)
    if written:
        page = Path(written["report"])
        typer.echo(f"Report: {page}; to print: {page.with_suffix('.pdf')}")


def _judged(
    path: Path, name: str, period: str | None, given: Mapping[str, str], choices: ColumnChoices
) -> JudgedTest:
    """Return a file's figures, their uncertainty, and what speaks against them."""
    from rtec.dataset.load import measurement_of, positioning_warnings
    from rtec.metrology import JudgedTest, positioning_figures, positioning_uncertainty, vdi_figures

    measurement = measurement_of(path, choices)
    readings = measurement.to_readings()
    length = _period(measurement, readings, period)
    figures = positioning_figures(readings, period=length, called=measurement.called("target"))
    facts = {} if period is None else {"screw_pitch": period}
    return JudgedTest(
        name=name,
        facts=measurement.facts,
        figures=figures,
        vdi=vdi_figures(figures),
        uncertainty=positioning_uncertainty(figures, _inputs(measurement, figures.coordinate, given)),
        warnings=(*figures.warnings, *positioning_warnings(measurement, facts)),
        unknown=tuple(measurement.unknown),
        notes=measurement.notes,
    )


def _period(measurement: Measurement, readings: Readings | RotaryReadings, given: str | None) -> float | None:
    """Return the period of the cyclic error: as given, else the screw pitch of a linear axis; None without either."""
    from rtec.metrology import AxisFacts, Readings

    linear = isinstance(readings, Readings)
    said = {} if given is None else {"screw_pitch": given}
    axis = AxisFacts(source=measurement.source, said=measurement.facts if linear else {}, given=said)
    try:
        return axis.period("screw_pitch", "mm" if linear else "deg")
    except ArgumentError as error:
        raise error.of("--period") from None


def _inputs(measurement: Measurement, coordinate: Coordinate, given: Mapping[str, str]) -> UncertaintyInputs:
    """Return what options and the file say of the measurement; an error names the one that said it."""
    from rtec.metrology import UncertaintyInputs

    stated = {name: text for name, text in measurement.facts.items() if name in UncertaintyInputs.names(coordinate)}
    try:
        return UncertaintyInputs.read({**stated, **given}, coordinate)
    except ArgumentError as error:
        raise error if error.name in given else error.of(f"{measurement.source}: {error.name}") from error


def _check_alike(tests: Sequence[JudgedTest]) -> None:
    first = tests[0]
    for test in tests[1:]:
        if test.figures.coordinate is not first.figures.coordinate:
            kinds = f"{first.name} of a {_kind(first)} axis and {test.name} of a {_kind(test)} one"
            raise ArgumentError("DATA", kinds, "files of one kind of axis")


def _kind(test: JudgedTest) -> str:
    return {"mm": "linear", "deg": "rotary"}[test.figures.coordinate.value]


def _report(of_tests: Sheet, output: Path) -> Path:
    from rtec.io import report_folder
    from rtec.report.iso230.folder import write_positioning

    with report_folder(output, "iso230") as folder:
        return write_positioning(of_tests, folder)


def _refuse_warnings(tests: Sequence[JudgedTest]) -> None:
    count = sum(len(test.warnings) for test in tests)
    if count:
        _say(tests, "error", with_unused=False)
        names = ", ".join(test.name for test in tests if test.warnings)
        what = "1 warning is an error" if count == 1 else f"{count} warnings are errors"
        raise RtecError(f"{names}: {what} with --strict; without it the figures are shown beside them")


def _say(tests: Sequence[JudgedTest], what: str, *, with_unused: bool) -> None:
    """Write a line on stderr for what was guessed of each file, and for each warning."""
    for test in tests:
        for sentence in test.notes:
            note(sentence if len(tests) == 1 else f"{test.name}: {sentence}")
        unused = [f"columns not used: {', '.join(test.unknown)}"] if with_unused and test.unknown else []
        warn((*test.warnings, *unused), f"{test.name}: " if len(tests) > 1 else "", what)
