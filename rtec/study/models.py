"""The true error of an axis and the PC's model of it, as a study states them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rtec.errors import ArgumentError, nearest
from rtec.inference.static_predictor import LeftOut, predictor_of_file
from rtec.io import Section
from rtec.metrology import MeasuringPlan
from rtec.predictors import LatheNetwork, NoError, Predictor, read_table
from rtec.predictors.binding import check_curve

LEARNED, LATHE, TRUTH = "learned", "lathe", "axis"
"""Predictors that need no file: from a calibration, the network that the thesis prints, and the true error."""


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
    section: Section, folder: Path, truth: Predictor, plan: MeasuringPlan
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
        predictor, left_out = predictor_of_file(file, plan.start_mm, plan.end_mm, cautious=cautious)
        check_curve(predictor, "model", hint="a study has one axis; rtec pc takes predictors of several")
        return predictor, left_out
