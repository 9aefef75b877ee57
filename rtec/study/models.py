"""The true error of an axis and the PC's model of it, as a study states them, and whether its tables fit together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rtec.axis import Limits
from rtec.effects import LIBRARY, Library
from rtec.errors import ArgumentError, nearest
from rtec.inference.static_predictor import LeftOut, predictor_of_file
from rtec.io import Section
from rtec.machine import Laser
from rtec.metrology import MeasuringPlan
from rtec.predictors import LatheNetwork, NoError, Predictor, read_table
from rtec.predictors.binding import check_curve

LEARNED, LATHE, TRUTH = "learned", "lathe", "axis"
"""Predictors that need no file: from a calibration, the network that the thesis prints, and the true error."""
MAX_READINGS = 200_000
"""Of a measurement: sixteen times the thesis's calibration."""
MAX_CALIBRATION = 50_000
"""Four times the thesis's: the search for effects takes time in proportion."""
MAX_TABLE_POINTS = 1_000_000


def axis_error_of(section: Section, folder: Path) -> Predictor:
    """Return the true error of the axis: the network that the thesis prints, or a table in a file.

    Raises
    ------
    RtecError
        Another word, or a file that cannot be read.
    """
    name = section.text("error")
    if name == LATHE:
        return LatheNetwork()
    if Path(name).suffix.lower() != ".csv":
        raise ArgumentError(section.where("error"), repr(name), "lathe, or a table in a file NAME.csv")
    return read_table(folder / name)


def model_of(
    section: Section, folder: Path, truth: Predictor, plan: MeasuringPlan, library: Library = LIBRARY
) -> tuple[Predictor, tuple[LeftOut, ...]]:
    """Return the PC's model, and which effects of a model file it cannot hold.

    Parameters
    ----------
    section, folder
        The table ``predictor``, and where files are looked for.
    truth
        The true error of the axis.
    plan
        A model file is tabled over its travel.
    library
        With the effects of one's own that a model file names.

    Returns
    -------
    predictor, left out
        That of a perfect axis where it has to be learned first.

    Raises
    ------
    RtecError
        Another word, a file that cannot be read, or a model that predicts no deviation.
    """
    name = section.text("model")
    cautious = section.yes_or_no("cautious")
    if cautious and not name.lower().endswith(".toml"):
        allowed = "a predictor in a file NAME.toml that rtec train wrote: it knows how far it may be off"
        raise ArgumentError(section.where("cautious"), f"true with {name!r}", allowed)
    known: dict[str, Callable[[], Predictor]] = {LEARNED: NoError, LATHE: LatheNetwork, TRUTH: lambda: truth}
    if name in known:
        return known[name](), ()
    file = folder / name
    if file.suffix.lower() == ".csv":
        return read_table(file), ()
    if file.suffix.lower() != ".toml":
        words = ", ".join(known)
        allowed = f"{words}, a table in a file NAME.csv, or a model or trained predictor in a file NAME.toml"
        raise ArgumentError(section.where("model"), repr(name), allowed, nearest(name, known))
    with section.naming(model="model", cautious="cautious"):
        predictor, left_out = predictor_of_file(file, plan.start_mm, plan.end_mm, cautious=cautious, library=library)
        check_curve(predictor, "model", hint="a study has one axis; rtec pc takes predictors of several")
        return predictor, left_out


def check_range(section: Section, plan: MeasuringPlan, what: str, predictor: Predictor) -> None:
    """Refuse targets outside a predictor's range; overshoots may lie outside, there it is held."""
    low, high = predictor.range_mm
    for key, end_mm in (("start", plan.start_mm), ("end", plan.end_mm)):
        if not low - 1e-8 <= end_mm <= high + 1e-8:
            raise section.refused(key, f"{low:g} to {high:g} mm", problem=f"is outside the range of {what}")


def check_feed(program: Section, plan: MeasuringPlan, limits: Limits) -> None:
    """Refuse a feed that the axis cannot reach."""
    if plan.feed_mm_s > limits.max_speed_mm_s * (1.0 + 1e-9):
        allowed = f"at most {limits.max_speed_mm_s:g} mm/s"
        raise program.refused("feed", allowed, problem="is faster than axis.max_speed")


def check_dwells(laser: Section, plan: MeasuringPlan, settings: Laser, whose: str) -> None:
    """Refuse a reading that takes longer than the axis stands in the plan of the table ``whose``."""
    if settings.dwell_s >= plan.dwell_s:
        raise laser.refused("dwell", f"less than {plan.dwell_s:g} s", problem=f"is not less than {whose}.dwell")


def check_calibration(section: Section, plan: MeasuringPlan) -> None:
    """Refuse a calibration that would take too long to be looked through."""
    _check_number(section, "increment", plan.number_of_readings, MAX_CALIBRATION, "readings")


def check_sizes(program: Section, controller: Section, plan: MeasuringPlan, table_interval_mm: float) -> None:
    """Refuse a measurement or a table that would fill the memory."""
    _check_number(program, "increment", plan.number_of_readings, MAX_READINGS, "readings")
    points = (plan.end_mm - plan.start_mm) / table_interval_mm
    _check_number(controller, "table_interval", points, MAX_TABLE_POINTS, "points")


def _check_number(section: Section, key: str, number: float, most: int, what: str) -> None:
    if number > most:
        raise section.refused(key, f"a longer one: at most {most} {what}", problem=f"makes {number:.0f} {what}")
