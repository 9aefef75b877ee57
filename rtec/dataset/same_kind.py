"""Whether a file to score on is of the same kind as the file of the training."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from rtec.dataset.dataset import Dataset
from rtec.effects.conditions import Conditions
from rtec.errors import FileFormatError

_STATED = ("screw_pitch", "signal_period", "revolution")


def same_kind(data: Dataset, like: Dataset) -> Dataset:
    """Return a data set to score on, with the facts of the axis that only the training file states.

    Parameters
    ----------
    data, like
        The file to score on, and that of the training.

    Raises
    ------
    FileFormatError
        Units or kinds of columns differ, so that a model of one says nothing of the other.
    """
    mine, theirs = data.conditions, like.conditions
    for what, here, there in (
        ("positions", data.units.position, like.units.position),
        (data.observe, data.units.observed, like.units.observed),
    ):
        if here != there:
            problem = f"units mixed between files: {what} in {here} here, in {there} in {like.source}"
            allowed = "columns and facts of the same kind in both files"
            if "count" in (here, there):
                allowed += "; a fact counts_per_rev turns counts into angles"
            raise FileFormatError(data.source, None, problem, allowed)
    if mine.moving != theirs.moving:
        kinds = {True: "a log of a moving axis", False: "readings at rest"}
        problem = f"{kinds[mine.moving]} here, {kinds[theirs.moving]} in {like.source}"
        raise FileFormatError(data.source, None, problem, "two files of the same kind")
    lacking = [name for name in _columns(theirs) if name not in _columns(mine)]
    if lacking:
        problem = f"no {', '.join(lacking)} here, but in {like.source}"
        raise FileFormatError(data.source, None, problem, "the same kinds of columns in both files")
    notes = list(data.notes)
    facts: dict[str, Any] = {name: getattr(theirs, name) for name in _STATED if getattr(mine, name) is None}
    facts["reference_temperature_degc"] = theirs.reference_temperature_degc
    if mine.temperatures and mine.reference_temperature_degc != theirs.reference_temperature_degc:
        notes.append(f"reference temperature as in {like.source}: {theirs.reference_temperature_degc:g} degC")
    units = data.units
    if theirs.time_s is None and mine.time_s is not None:
        facts["time_s"], units = None, like.units
        notes.append(f"time is not used: {like.source} has none, and row order counts as time")
    if theirs.time_s is None and not theirs.moving and mine.run.min() > theirs.run.max():
        facts["first_row"] = like.rows
        notes.append(f"its runs follow those of {like.source}: row order goes on from there")
    return replace(data, conditions=replace(mine, **facts), units=units, notes=tuple(notes))


def _columns(conditions: Conditions) -> list[str]:
    """Return the kinds of columns that effects can depend on."""
    names = {"direction": "direction", "time_s": "time", "velocity": "velocity", "acceleration": "acceleration"}
    have = [word for name, word in names.items() if getattr(conditions, name) is not None]
    return have + list(conditions.temperatures)
