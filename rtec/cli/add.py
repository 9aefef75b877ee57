"""``rtec add``: put an effect into a model, refit, and show the error fall."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rtec.cli import _measured
from rtec.cli._console import progress
from rtec.cli._groups import OptionGroup
from rtec.cli._parameters import flag, force, option, whole, whole_number, written
from rtec.cli._words import EFFECTS, completing
from rtec.cli.diagnose import show_diagnosis
from rtec.errors import ArgumentError
from rtec.units import NUMBER

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rtec.dataset.dataset import Dataset
    from rtec.effects import Effect, Shape

_FEWEST_NODES, _MOST_NODES = 2, 1000
_Text = str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapeOptions(OptionGroup):
    """Options that state the shape of an effect, by the names of its fields."""

    PANEL = "Shape of the effect, where a scan shall not find it"

    period: _Text = option("--period", "'6.35 mm'", "Of cyclic, cogging, interpolation, eccentricity.")
    harmonics: int | None = whole("--harmonics", "Of a period.")
    by_direction: bool = flag("--by-direction", "A cyclic error for each direction.")
    step_at: _Text = option("--step-at", "'2 mm'", "Where in its period a cyclic error steps.")
    nodes: _Text = option("--nodes", "N|'0 mm, 5 mm, ...'", "Of a map: their number, or their positions.")
    forward_right: bool = flag("--forward-right", "A reversal map leaves forward approaches right.")
    backward_right: bool = flag("--backward-right", "The same of backward ones.")
    runs: _Text = option("--runs", "'1, 2, 3'", "With a zero of their own, from that of the first.")
    distance: _Text = option("--distance", "'0.5 mm'", "Over which wind-up or friction builds up, a spike fades.")
    carried: bool = flag("--carried", "Wind-up carries over the reversal.")
    settled: bool = flag("--settled", "A log begins wound up by the motion before it.")
    overshoot: _Text = option("--overshoot", "'1 mm'", "From the last reading to the reversal, of wind-up.")
    sensor: _Text = option("--sensor", "COLUMN,...", "Temperature columns, or spindle, that what grows follows.")
    lag: _Text = option(
        "--lag", "'10 min, ...'", "By which what grows lags behind its sensor, or each behind its own."
    )
    elsewhere: bool = flag("--elsewhere", "Growth is fixed elsewhere than at zero.")
    time_constant: _Text = option("--time-constant", "'30 min'", "Of the warm-up.")
    moment: _Text = option("--moment", "'90 s'", "At which counts were lost.")
    over: _Text = option("--over", "'1 s'", "Time that the loss of counts took.")
    step: _Text = option("--step", "'1 um'", "Of the quantisation.")
    speed: _Text = option("--speed", "'10 mm/s'", "Stribeck speed.")
    fade: _Text = option("--fade", "'2 m/s'", "Speed that halves the coefficient of viscous friction.")
    given: list[str] | None = option(
        "--set", "NAME=VALUE", "A parameter of an effect of your own, such as 'place=180 mm'; may be repeated."
    )

    def stated(self) -> dict[str, Any]:
        """Return what the user said."""
        found = {name: said for name, said in asdict(self).items() if said is not None and said is not False}
        for text in found.pop("given", ()):
            name, equals, value = (part.strip() for part in text.partition("="))
            if not (name and equals and value):
                raise ArgumentError("--set", repr(text[:60]), "a parameter and its value, such as 'place=180 mm'")
            found[name] = float(value) if re.fullmatch(NUMBER, value) else value
        return found


def add(
    effect: str = typer.Argument(
        ...,
        help="Name of the effect; 'rtec effects' lists them.",
        show_default=False,
        autocompletion=completing(EFFECTS),
    ),
    data: Path = _measured.DATA,
    output: Path = written("-o --output", "M2.toml", "The model with the effect.", default=...),
    *,
    measured: _measured.MeasuredOptions,
    shape: ShapeOptions,
    force: bool = force("Write over a file that exists."),
    seed: int = _measured.SEED,
    json: bool = _measured.JSON,
) -> None:
    """Add an effect to a model, refit it to a measurement, write it, and show how far the error falls.

    Example: rtec add backlash z_axis.csv --model known.toml -o better.toml
    Example: rtec add cyclic z_axis.csv --period "0.25 inch" --harmonics 2 -o cyclic.toml
    Example: rtec add thermal_shift shift.csv --sensor nut,spindle --lag "0 min, 40 min" -o warm.toml
    """
    from rtec.inference.diagnose import add as added, with_step_before
    from rtec.inference.model_file import write_model

    with progress(f"adding {effect}") as show:
        given = measured.read(data)
        what = given.dataset.library.named(effect)
        wanted = shapes_from_options(what, shape.stated(), given.dataset)
        show(0.2)
        result = added(effect, given.dataset, given.model, heldout=given.heldout, shape=wanted[0], seed=seed)
        for more in wanted[1:]:
            result = with_step_before(
                result, added(effect, given.dataset, result.model, heldout=given.heldout, shape=more, seed=seed)
            )
        write_model(output, result.model)
    show_diagnosis(result, {"model": str(output)}, as_json=json, seed=seed)


def shapes_from_options(effect: Effect, given: Mapping[str, object], dataset: Dataset) -> list[Shape | None]:
    """Return the shapes that options state: one for each sensor, where several are named.

    Raises
    ------
    ArgumentError
        As of `shape_from_options`, or another number of lags than of sensors.
    """
    from rtec.effects._heat import heats_of

    several = {
        key: [part.strip() for part in str(given[key]).split(",")] for key in ("sensor", "lag") if key in given
    }
    count = max((len(parts) for parts in several.values()), default=1)
    if not all(len(parts) in (1, count) for parts in several.values()):
        raise ArgumentError("--lag", given["lag"], f"one lag, or one for each of {len(several['sensor'])} sensors")
    if "sensor" in several:
        known = heats_of(dataset.conditions)
        full = {name: f"temperature_{name}" for name in several["sensor"] if name not in known}
        several["sensor"] = [full[name] if full.get(name) in known else name for name in several["sensor"]]
    each = [{key: parts[k % len(parts)] for key, parts in several.items()} for k in range(count)]
    return [shape_from_options(effect, {**given, **one}, dataset) for one in each]


def shape_from_options(effect: Effect, given: Mapping[str, object], dataset: Dataset) -> Shape | None:
    """Return the shape that options state; None where they state none and a scan has to find it.

    Raises
    ------
    ArgumentError
        An option that is none of the effect, a value that is wrong, or an option without one that it needs.
    """
    from rtec.inference.shape_text import field_keys, read_shape

    known = field_keys(effect.shape_type)
    values = dict(given)
    for key in given:
        if key not in known:
            allowed = ", ".join(map(_dashed, known)) or "it without options of a shape"
            raise ArgumentError(_dashed(key), "", allowed, problem=f"is no option for {effect.name}")
    if isinstance(values.get("runs"), str):
        values["runs"] = [whole_number(part.strip(), name="--runs") for part in str(values["runs"]).split(",")]
    if isinstance(values.get("nodes"), str):
        values["nodes"] = _nodes(str(values["nodes"]), dataset)
    return read_shape(effect, values, dataset.units, name=_dashed)


def _dashed(key: str) -> str:
    return f"--{key.replace('_', '-')}"


def _nodes(text: str, dataset: Dataset) -> list[str]:
    """Return positions of nodes: as they are listed, or so many over the positions of the measurement."""
    if re.fullmatch(NUMBER, text.strip()) is None:
        return [part.strip() for part in text.split(",")]
    number = whole_number(text, name="--nodes")
    if not _FEWEST_NODES <= number <= _MOST_NODES:
        raise ArgumentError("--nodes", number, f"{_FEWEST_NODES} to {_MOST_NODES} nodes, or a list of positions")
    import numpy as np

    from rtec.units import written

    places = dataset.coordinates.places
    spread = np.linspace(places[0], places[-1], number)
    return [written(float(place), dataset.units.position) for place in spread]
