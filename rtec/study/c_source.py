"""What is known of an axis as C99: constants and one function of position and direction.

Nothing is allocated, and the only library function is ``exp()``, so that it runs where a controller has no more than
that. What the tables and networks compute stands in ``rtec/predictors/_kernels.py``; here it is written in the same
order of operations, so that both agree to rounding.
"""

from __future__ import annotations

import itertools
import math
import re
import textwrap
from collections.abc import Iterable, Iterator
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rtec.errors import ArgumentError
from rtec.predictors import AxisTables, Predictor
from rtec.predictors._columns import Floats
from rtec.predictors.binding import CURVE, OF_AXIS
from rtec.predictors.layered import TOUCH_MM, LayeredNetwork, TrainedNetworks
from rtec.predictors.predictor_file import KnownPredictor
from rtec.predictors.tables import Between, ErrorTable
from rtec.study.compensation import Compensation

Range = tuple[float, float]

_TEMPLATE = "c_source.c.j2"
_LONGEST_LONG = 2**31 - 2
"""Turns of the screw that a ``long`` can count wherever C99 runs."""


class Precision(Enum):
    """Floating-point numbers of the C source."""

    DOUBLE = "double"
    SINGLE = "single"

    def number(self, value: float) -> str:
        """Return a constant that gives back the same number.

        Examples
        --------
        >>> Precision.DOUBLE.number(0.1 + 0.2), Precision.SINGLE.number(0.1 + 0.2)
        ('0.30000000000000004', '0.3f')
        """
        return repr(float(value)) if self is Precision.DOUBLE else str(np.float32(value)) + "f"

    def code(self, text: str) -> str:
        """Return code that is written for double precision in this one.

        Examples
        --------
        >>> Precision.SINGLE.code("double y = exp(-x) + 1.0;")
        'float y = expf(-x) + 1.0f;'
        """
        if self is Precision.DOUBLE:
            return text
        text = (
            text.replace("double", "float")
            .replace("exp(", "expf(")
            .replace("tanh(", "tanhf(")
            .replace("tanh(", "tanhf(")
        )
        return re.sub(r"\b\d+\.\d+\b", lambda found: found[0] + "f", text)


def name_in_c(path: str | Path) -> str:
    """Return what the names in a C file begin with: the name of the file, as far as C allows.

    Examples
    --------
    >>> name_in_c("build/corr.c"), name_in_c("3-axis z.c"), name_in_c("_.c")
    ('corr', 'axis_3_axis_z', 'axis')
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", Path(path).stem).strip("_")
    return name if name[:1].isalpha() else f"axis_{name}".rstrip("_")


def predictor_lines(
    known: KnownPredictor, name: str, *, held_mm: Range, precision: Precision = Precision.DOUBLE
) -> Iterator[str]:
    """Yield the lines of a C99 file with ``double NAME_error_mm(double position_mm, int direction)``.

    A predictor that looks at other axes takes ``double position_2_mm`` and so on behind them.

    Parameters
    ----------
    known
        Trained tables, or trained networks.
    name
        What all names in the file begin with.
    held_mm
        Lowest and highest position in mm; beyond, the error of the nearest of both is held. A range wider than the
        predictor's own changes nothing.
    precision
        Of all constants and variables, the arguments included.

    Raises
    ------
    ArgumentError
        A predictor of another kind, or one whose numbers single precision cannot hold.

    Examples
    --------
    >>> from rtec.predictors import UnidirectionalTable
    >>> table = UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.002], backlash_mm=0.003)
    >>> lines = predictor_lines(KnownPredictor(predictor=table, name="table"), "corr", held_mm=(0.0, 10.0))
    >>> next(line for line in lines if line.startswith("double"))
    'double corr_error_mm(double position_mm, int direction);'
    """
    predictor = known.predictor
    if isinstance(predictor, TrainedNetworks):
        _check_networks(predictor, precision)
        held_mm = _within(held_mm, predictor.range_mm)
        body, library = _networks(predictor, held_mm), precision.code("the only library function is exp()")
    elif isinstance(predictor, ErrorTable):
        ways = _ways(predictor)
        own = min(way[0, 0] for way in ways), max(way[0, -1] for way in ways)
        held_mm = _within(held_mm, own)
        body, library = _table(*ways, None if held_mm == own else held_mm), "no library function is called"
    elif isinstance(predictor, AxisTables):
        held_mm = _within(held_mm, predictor.range_mm)
        body, library = _axis_tables(predictor, held_mm), "no library function is called"
    else:
        raise ArgumentError("predictor", type(predictor).__name__, "tables or networks")
    low_mm, high_mm = _within(held_mm, predictor.range_mm)
    sure = f"90 % of readings lie within {1e3 * known.interval_mm:.3g} um of it."
    trained_on = f", trained on {known.source}" if known.source else ""
    head = (
        f"{name}_error_mm: error of an axis, actual minus target, in mm. A compensation is its negative.",
        f"Predictor: {known.name}{trained_on}.",
        sure if math.isfinite(known.interval_mm) else "How far readings lie from it is not known.",
        f"position_mm is the target. Both directions are known from {low_mm:.10g} to {high_mm:.10g} mm; where one",
        "ends, its error there is held. What is no number counts as the lower end.",
        "direction is below 0 in reverse (towards smaller positions), else forward.",
        *_on_others(predictor),
        *_on_precision(held_mm, precision),
        f"Nothing is allocated, and {library}.",
    )
    yield from source_file(_TEMPLATE, name, head, precision, **body)


def compensation_lines(table: Compensation, name: str, *, precision: Precision = Precision.DOUBLE) -> Iterator[str]:
    """Yield the lines of a C99 file with ``double NAME_error_mm(double position_mm, int direction)``.

    Parameters
    ----------
    table
        Nodes, between which straight lines are drawn.
    name
        What all names in the file begin with.
    precision
        Of all constants and variables, the arguments included.
    """
    forward, reverse = (np.stack([table.position_mm, e]) for e in (table.forward_mm, table.reverse_mm))
    head = (
        f"{name}_error_mm: error of an axis, actual less commanded position in mm, by commanded position and",
        "direction of motion (below 0 in reverse, else forward). A compensation is its negative.",
        "Straight lines between the nodes; beyond the ends the error of the nearest end.",
        f"They differ from the model by {1e3 * table.interpolation_mm:.3f} um at most.",
        *([f"Of a machine with {table.warmth}."] if table.warmth else []),
        *_on_precision((table.position_mm[0], table.position_mm[-1]), precision),
        *(f"Left out: {one.effect}, {one.why}." for one in table.left_out),
    )
    yield from source_file(_TEMPLATE, name, head, precision, **_table(forward, reverse, None))


def _within(range_mm: Range, outer_mm: Range) -> Range:
    low, high = (min(max(end, outer_mm[0]), outer_mm[1]) for end in range_mm)
    return low, high


def _on_others(predictor: Predictor) -> Iterator[str]:
    for name, (low, high) in predictor.ranges.items():
        axis = name.removeprefix(OF_AXIS)
        yield f"{name}_mm is where axis {axis} stands; the predictor was made for {low:.10g} to {high:.10g} mm."


def _on_precision(range_mm: Range, precision: Precision) -> tuple[str, ...]:
    if precision is Precision.DOUBLE:
        return ()
    far_mm = max(map(abs, range_mm))
    step_um = 1e3 * float(np.spacing(np.float32(far_mm)))
    return (f"In single precision a position near {far_mm:.6g} mm has steps of {step_um:.2g} um.",)


def source_file(template: str, name: str, head: Iterable[str], precision: Precision, **body: object) -> Iterator[str]:
    """Yield the comment at the top and the code; its template says what it is made of."""
    import jinja2  # noqa: PLC0415 - a tenth of a second, needed only where a source is written

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("rtec.study", "."),
        autoescape=False,  # noqa: S701 - numbers of ours, and names that `name_in_c` allows
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": precision.number, "numbers": partial(_wrapped, precision), "layers": _layers}
    for before, line in zip(itertools.chain(["/* "], itertools.repeat("   ")), head, strict=False):
        yield before + _comment(line)
    yield "*/"
    code = precision.code(environment.get_template(template).render(**body))
    yield from code.replace("@", name).splitlines()


def _comment(text: str) -> str:
    """Return text in which no compiler finds the begin or the end of a comment."""
    plain = "".join(letter if " " <= letter <= "~" and letter != "\\" else "?" for letter in text)
    return plain.replace("*/", "* /").replace("/*", "/ *")


def _wrapped(precision: Precision, values: Floats) -> str:
    text = ", ".join(precision.number(value) for value in values.ravel())
    return textwrap.fill(text, 114, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)


def _ways(table: ErrorTable) -> tuple[Floats, Floats]:
    """Return positions, errors and of cubics the slopes of each direction, as the compiled function has them."""
    numbers, columns = table.numbers, 3 if table.between is Between.CUBIC else 2
    reverse = 1 + columns * int(numbers[0])
    return numbers[1:reverse].reshape(columns, -1), numbers[reverse + 1 :].reshape(columns, -1)


def _table(forward: Floats, reverse: Floats, held_mm: Range | None) -> dict[str, Any]:
    """Return a table whose directions have rows of positions, errors and perhaps slopes."""
    columns = [
        {"name": name, "forward": up, "reverse": down, "alike": np.array_equal(up, down)}
        for name, up, down in zip(("at_mm", "error_mm", "slope"), forward, reverse, strict=False)
    ]
    sizes = forward.shape[1], reverse.shape[1]
    return {"kind": "table", "columns": columns, "sizes": sizes, "held_mm": held_mm}


def _axis_tables(predictor: AxisTables, held_mm: Range) -> dict[str, Any]:
    others = predictor.inputs[len(CURVE) :]
    return {"kind": "sum of tables", "tables": predictor.tables, "others": others, "held_mm": held_mm}


def _networks(predictor: TrainedNetworks, held_mm: Range) -> dict[str, Any]:
    networks = predictor.networks
    turns = max(map(abs, held_mm)) / predictor.pitch_mm if predictor.pitch_mm else 0.0
    return {
        "kind": "networks",
        "networks": networks,
        "others": predictor.inputs[len(CURVE) :],
        "held_mm": held_mm,
        "most": max(n for network in networks for n in (len(network.inputs), *network.hidden)),
        "seen": {name for network in networks for name in network.inputs},
        "pitch_mm": predictor.pitch_mm,
        "touch_mm": TOUCH_MM,
        # floor() by a cast, which goes towards zero
        "whole": "long" if turns < _LONGEST_LONG else "long long",
    }


def _check_networks(predictor: TrainedNetworks, precision: Precision) -> None:
    """Refuse numbers that are zero in single precision and divide."""
    if precision is Precision.DOUBLE:
        return
    for number, network in enumerate(predictor.networks, 1):
        if not (network.half >= np.finfo(np.float32).tiny).all():
            where = f"network {number} with an input of half width {network.half.min():g}"
            raise ArgumentError(
                "--precision single", where, f"half widths from 1e-37 on; use {Precision.DOUBLE.value}"
            )


def _layers(network: LayeredNetwork) -> Iterator[Floats]:
    """Yield the layers, the output's last: of each neuron its bias, then its weights; shape (neurons, 1 + inputs)."""
    at = 0
    for before, after in itertools.pairwise((len(network.inputs), *network.hidden, 1)):
        end = at + before * after
        weights = network.weights[at:end].reshape(before, after)
        yield np.column_stack([network.weights[end : end + after], weights.T])
        at = end + after
