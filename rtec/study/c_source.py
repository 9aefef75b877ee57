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
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum
from pathlib import Path

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
        text = text.replace("double", "float").replace("exp(", "expf(")
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
    >>> table = UnidirectionalTable(positions_mm=[0, 10], errors_mm=[0, 0.002], backlash_mm=0.003)
    >>> lines = predictor_lines(KnownPredictor(predictor=table, name="table"), "corr", held_mm=(0.0, 10.0))
    >>> next(line for line in lines if line.startswith("double"))
    'double corr_error_mm(double position_mm, int direction);'
    """
    predictor = known.predictor
    if isinstance(predictor, TrainedNetworks):
        _check_networks(predictor, precision)
        held_mm = _within(held_mm, predictor.range_mm)
        body, library = _networks(predictor, held_mm, precision), precision.code("the only library function is exp()")
    elif isinstance(predictor, ErrorTable):
        ways = _ways(predictor)
        own = min(way[0, 0] for way in ways), max(way[0, -1] for way in ways)
        held_mm = _within(held_mm, own)
        body, library = _table(*ways, precision, None if held_mm == own else held_mm), "no library function is called"
    elif isinstance(predictor, AxisTables):
        held_mm = _within(held_mm, predictor.range_mm)
        body, library = _axis_tables(predictor, held_mm, precision), "no library function is called"
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
    yield from _file(name, head, body, precision)


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
        *_on_precision((table.position_mm[0], table.position_mm[-1]), precision),
        *(f"Left out: {one.effect}, {one.why}." for one in table.left_out),
    )
    yield from _file(name, head, _table(forward, reverse, precision, None), precision)


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


def _file(name: str, head: Iterable[str], body: Iterable[str], precision: Precision) -> Iterator[str]:
    """Yield the comment at the top and the code, where @ stands for the name and variables are double."""
    for before, line in zip(itertools.chain(["/* "], itertools.repeat("   ")), head, strict=False):
        yield before + _comment(line)
    yield "*/"
    for line in body:
        yield precision.code(line).replace("@", name)


def _comment(text: str) -> str:
    """Return text in which no compiler finds the begin or the end of a comment."""
    plain = "".join(letter if " " <= letter <= "~" and letter != "\\" else "?" for letter in text)
    return plain.replace("*/", "* /").replace("/*", "/ *")


def _constants(name: str, values: Floats, precision: Precision) -> Iterator[str]:
    yield f"static const double @_{name}[{values.size}] = {{"
    text = ", ".join(precision.number(value) for value in values.ravel())
    yield from textwrap.wrap(text, 114, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)
    yield "};"


def _hold(range_mm: Range, precision: Precision) -> Iterator[str]:
    low, high = map(precision.number, range_mm)
    yield f"    if (!(position_mm > {low})) position_mm = {low};"
    yield f"    if (position_mm > {high}) position_mm = {high};"


# Tables


def _ways(table: ErrorTable) -> tuple[Floats, Floats]:
    """Return positions, errors and of cubics the slopes of each direction, as the compiled function has them."""
    numbers, columns = table.numbers, 3 if table.between is Between.CUBIC else 2
    reverse = 1 + columns * int(numbers[0])
    return numbers[1:reverse].reshape(columns, -1), numbers[reverse + 1 :].reshape(columns, -1)


def _table(forward: Floats, reverse: Floats, precision: Precision, held_mm: Range | None) -> Iterator[str]:
    """Yield a table whose directions have rows of positions, errors and perhaps slopes."""
    columns = ("at_mm", "error_mm", "slope")[: forward.shape[0]]
    chosen = []
    for column, up, down in zip(columns, forward, reverse, strict=True):
        yield from _constants(f"forward_{column}", up, precision)
        if np.array_equal(up, down):
            chosen.append(f"    const double *{column} = @_forward_{column};")
            continue
        yield from _constants(f"reverse_{column}", down, precision)
        chosen.append(f"    const double *{column} = direction < 0 ? @_reverse_{column} : @_forward_{column};")
    sizes = f"{forward.shape[1]}"
    if forward.shape[1] != reverse.shape[1]:
        sizes = f"(direction < 0 ? {reverse.shape[1]} : {forward.shape[1]})"
    yield from _begin(())
    yield from chosen
    yield f"    int low = 0, high = {sizes} - 1, middle;"
    yield from _hold(held_mm, precision) if held_mm is not None else ()
    yield from (_TABLE + (_CUBIC if len(columns) == 3 else _LINES)).splitlines()


def _begin(others: Sequence[str]) -> Iterator[str]:
    """Yield the head of the function, which takes the places of other axes, too."""
    head = ", ".join(
        ["double @_error_mm(double position_mm, int direction", *(f"double {name}_mm" for name in others)]
    )
    yield from ("", f"{head});", "", f"{head})", "{")


_TABLE = """\
    double width, t;
    if (!(position_mm > at_mm[0])) return error_mm[0];
    if (position_mm >= at_mm[high]) return error_mm[high];
    while (high - low > 1) {
        middle = (low + high) / 2;
        if (at_mm[middle] <= position_mm) low = middle; else high = middle;
    }
    width = at_mm[high] - at_mm[low];
    t = (position_mm - at_mm[low]) / width;
"""

_LINES = """\
    return (1.0 - t) * error_mm[low] + t * error_mm[high];
}
"""

_CUBIC = """\
    /* the cubic that has the errors and the slopes of both points */
    const double rise = error_mm[high] - error_mm[low], here = slope[low] * width, there = slope[high] * width;
    return error_mm[low] + t * (here + t * (3.0 * rise - 2.0 * here - there + t * (here + there - 2.0 * rise)));
}
"""


_INTERPOLATED = """
/* straight lines between points, the ends held */
static double @_table(const double *at, const double *value, int points, double x)
{
    int low = 0, high = points - 1, middle;
    double t;
    if (!(x > at[0])) return value[0];
    if (x >= at[high]) return value[high];
    while (high - low > 1) {
        middle = (low + high) / 2;
        if (at[middle] <= x) low = middle; else high = middle;
    }
    t = (x - at[low]) / (at[high] - at[low]);
    return (1.0 - t) * value[low] + t * value[high];
}
"""

_HELD = """
/* x within its ends; what is no number counts as the lower one */
static double @_held(double x, double low, double high)
{
    if (!(x > low)) return low;
    return x > high ? high : x;
}
"""


def _held(place: str, ends: Range, precision: Precision) -> str:
    low, high = map(precision.number, ends)
    return f"@_held({place}, {low}, {high})"


# Sums of tables


def _axis_tables(predictor: AxisTables, held_mm: Range, precision: Precision) -> Iterator[str]:
    for number, table in enumerate(predictor.tables, 1):
        yield from _constants(f"at{number}", table.positions_mm, precision)
        yield from _constants(f"value{number}", table.values, precision)
    yield from _INTERPOLATED.splitlines()
    yield from _HELD.splitlines() if any(table.arm for table in predictor.tables) else ()
    yield from _begin(predictor.inputs[len(CURVE) :])
    yield "    double error_mm = 0.0;"
    yield from _hold(held_mm, precision)
    if not any(table.direction for table in predictor.tables):
        yield "    (void)direction;"
    for number, table in enumerate(predictor.tables, 1):
        value = f"@_table(@_at{number}, @_value{number}, {table.positions_mm.size}, {table.of}_mm)"
        if table.arm is not None:
            middle = 0.5 * (table.arm_mm[0] + table.arm_mm[1])
            value += f" * ({_held(f'{table.arm}_mm', table.arm_mm, precision)} - ({precision.number(middle)}))"
        way = {0: "", 1: "if (direction >= 0) ", -1: "if (direction < 0) "}[table.direction]
        yield f"    {way}error_mm += {value};"
    yield "    return error_mm;"
    yield "}"


# Networks


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


def _networks(predictor: TrainedNetworks, held_mm: Range, precision: Precision) -> Iterator[str]:
    yield "#include <math.h>"
    yield ""
    for number, network in enumerate(predictor.networks, 1):
        for layer, rows in enumerate(_layers(network), 1):
            yield from _constants(f"network{number}_layer{layer}", rows, precision)
    yield from _LAYER.splitlines()
    others = predictor.inputs[len(CURVE) :]
    yield from _HELD.splitlines() if others else ()
    yield from _begin(others)
    most = max(n for network in predictor.networks for n in (len(network.inputs), *network.hidden))
    yield f"    double seen[{most}], given[{most}], error_mm = 0.0;"
    seen = {name for network in predictor.networks for name in network.inputs}
    yield "    const double reverse = direction < 0 ? 1.0 : 0.0;" if "direction" in seen else "    (void)direction;"
    yield from _hold(held_mm, precision)
    if "turn" in seen:
        yield from _turn(predictor, held_mm, precision)
    for number, network in enumerate(predictor.networks, 1):
        yield from _network(number, network, precision)
    yield "    return error_mm;"
    yield "}"


def _layers(network: LayeredNetwork) -> Iterator[Floats]:
    """Yield the layers, the output's last: of each neuron its bias, then its weights; shape (neurons, 1 + inputs)."""
    at = 0
    for before, after in itertools.pairwise((len(network.inputs), *network.hidden, 1)):
        end = at + before * after
        weights = network.weights[at:end].reshape(before, after)
        yield np.column_stack([network.weights[end : end + after], weights.T])
        at = end + after


def _turn(predictor: TrainedNetworks, held_mm: Range, precision: Precision) -> Iterator[str]:
    """Yield the place in the turn of the screw; floor() by a cast, which goes towards zero."""
    most = max(map(abs, held_mm)) / predictor.pitch_mm
    whole = "long" if most < _LONGEST_LONG else "long long"
    pitch, touch = precision.number(predictor.pitch_mm), precision.number(TOUCH_MM)
    yield f"    const double turns = position_mm / {pitch};"
    yield f"    double whole = (double)({whole})turns, turn_mm;"
    yield "    if (whole > turns) whole -= 1.0;"
    yield f"    turn_mm = position_mm - {pitch} * whole;"
    yield f"    if ({pitch} - turn_mm <= {touch} || turn_mm < 0.0) turn_mm = 0.0; /* at a whole turn, to rounding */"


def _network(number: int, network: LayeredNetwork, precision: Precision) -> Iterator[str]:
    names = {"position": "position_mm", "direction": "reverse", "turn": "turn_mm"}
    for i, (name, middle, half) in enumerate(zip(network.inputs, network.middle, network.half, strict=True)):
        less = f"+ {precision.number(-middle)}" if middle < 0.0 else f"- {precision.number(middle)}"
        place = names.get(name) or _held(f"{name}_mm", (middle - half, middle + half), precision)
        yield f"    seen[{i}] = ({place} {less}) / {precision.number(half)};"
    here, there = "seen", "given"
    widths = (len(network.inputs), *network.hidden)
    for layer, (before, after) in enumerate(itertools.pairwise(widths), 1):
        yield f"    @_layer(@_network{number}_layer{layer}, {before}, {after}, {here}, {there});"
        here, there = there, here
    bias, factor = precision.number(network.bias_mm), precision.number(network.factor_mm)
    output = f"@_sum(@_network{number}_layer{len(widths)}, {widths[-1]}, {here})"
    yield f"    error_mm += {bias} + {factor} * {output};"


_LAYER = """
/* bias and weighted inputs of a neuron */
static double @_sum(const double *row, int inputs, const double *in)
{
    double sum = row[0];
    int i;
    for (i = 0; i < inputs; ++i) sum += in[i] * row[i + 1];
    return sum;
}

/* 1 / (1 + exp(-x)) without an overflow on either side */
static double @_logistic(double x)
{
    const double tail = exp(x < 0.0 ? x : -x);
    return x < 0.0 ? tail / (1.0 + tail) : 1.0 / (1.0 + tail);
}

static void @_layer(const double *rows, int inputs, int neurons, const double *in, double *out)
{
    int j;
    for (j = 0; j < neurons; ++j) out[j] = @_logistic(@_sum(rows + j * (inputs + 1), inputs, in));
}
"""
