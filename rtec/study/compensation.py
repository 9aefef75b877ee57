"""A model or a predictor as the compensation table of another program: nodes, and straight lines between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rtec.effects import Floats
from rtec.errors import ArgumentError
from rtec.inference.model import Model, Term
from rtec.inference.static_predictor import MOST_POINTS, LeftOut, predictor_of_model, static_part
from rtec.inference.warmth import Warmth
from rtec.predictors import FORWARD, REVERSE, Predictor
from rtec.predictors.binding import check_curve
from rtec.predictors.layered import TOUCH_MM, TrainedNetworks
from rtec.predictors.tables import ErrorTable

LINUXCNC_TRIPLETS = 256
"""Most nodes that LinuxCNC reads for a joint."""
MOST_NODES = 5_000
POINTS_A_TURN = 200
"""At which a network that sees the place in the turn is drawn."""
FEWEST = 20_000
"""Points at which any predictor is drawn."""
_GRID_MM = 1e-6
"""Steps of the numbers that are written: a nanometre."""
_BESIDE_MM = 1e-6
"""Of a step, where a table has its nodes before and behind it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compensation:
    """Errors of an axis at nodes."""

    position_mm: Floats
    forward_mm: Floats
    reverse_mm: Floats
    """``position_mm``, ``forward_mm``, ``reverse_mm``: node, and the error (actual less commanded position) there in
    each direction, shape (nodes,), in mm."""
    interpolation_mm: float
    """Largest difference between the model and straight lines from node to node, in mm."""
    left_out: tuple[LeftOut, ...]
    """Effects of the model that no table of positions holds."""
    warmth: str = ""
    """How warm the machine is, in words; empty where the errors do not depend on it."""


def compensation_of(
    known: Model | Predictor,
    low_mm: float,
    high_mm: float,
    *,
    within_mm: float,
    most: int,
    warmth: Warmth | None = None,
) -> Compensation:
    """Return the nodes that draw what is known of an axis within a tolerance, or as well as so many of them can.

    Parameters
    ----------
    known
        A model of a deviation in mm over positions in mm, every effect fitted; or a predictor.
    low_mm, high_mm
        Range of the table.
    within_mm
        Largest difference that straight lines between the nodes may leave, in mm.
    most
        Nodes at most.
    warmth
        Of the machine; a model with effects of heat needs it.

    Raises
    ------
    ArgumentError
        A model of something else, an effect without numbers, or one of heat without the warmth; more turns of the
        screw than a table can follow.

    Notes
    -----
    A node is put where the lines are farthest off, one after the other, for both directions at once. What is written
    is rounded to a nanometre.

    Examples
    --------
    >>> from rtec.effects import Shape, Units, effect_named
    >>> from rtec.inference.model import Term
    >>> scale = Term(effect=effect_named("scale"), shape=Shape(), amplitudes=(2e-5,))
    >>> model = Model(observe="deviation", units=Units("mm", "mm", "s"), terms=(scale,))
    >>> table = compensation_of(model, 0.0, 100.0, within_mm=1e-4, most=256)
    >>> table.position_mm.tolist(), table.forward_mm.tolist()
    ([0.0, 100.0], [0.0, 0.002])
    """
    fine, true, left_out = drawn(known, low_mm, high_mm, warmth)
    nodes = _nodes(fine, true, within_mm, most)
    position = np.round(fine[nodes] / _GRID_MM) * _GRID_MM
    errors = np.round(true[:, nodes] / _GRID_MM) * _GRID_MM
    lines = np.stack([np.interp(fine, position, curve) for curve in errors])
    return Compensation(
        position_mm=np.round(position, 6),
        forward_mm=np.round(errors[0], 6),
        reverse_mm=np.round(errors[1], 6),
        interpolation_mm=float(np.abs(lines - true).max()),
        left_out=left_out,
        warmth="" if warmth is None else str(warmth),
    )


Drawn = tuple[Floats, Floats, tuple[LeftOut, ...]]
"""Positions close enough for all that bends or steps, shape (n,); the errors of both directions there, shape (2, n);
and what is not in them."""


def drawn(known: Model | Predictor, low_mm: float, high_mm: float, warmth: Warmth | None = None) -> Drawn:
    """Return the errors of a model or a predictor, as of `compensation_of`, so closely that lines between them do."""
    if isinstance(known, Model):
        return _model_drawn(known, low_mm, high_mm, warmth)
    return _predictor_drawn(known, low_mm, high_mm)


def _model_drawn(model: Model, low_mm: float, high_mm: float, warmth: Warmth | None) -> Drawn:
    table, left_out = predictor_of_model(model, low_mm, high_mm, warmth)
    grid = table.forward_positions_mm
    kept = model.with_terms(t for t in model.terms if t.name not in {one.effect for one in left_out})
    finer = [np.linspace(low_mm, high_mm, 4 * grid.size)] if grid.size < MOST_NODES else []
    fine = np.unique(np.concatenate([grid, *finer, *(_beside_steps(term, low_mm, high_mm) for term in kept.terms)]))
    return fine, np.stack([static_part(kept, fine, way, warmth)[0] for way in (FORWARD, REVERSE)]), left_out


def _predictor_drawn(predictor: Predictor, low_mm: float, high_mm: float) -> Drawn:
    """Draw a predictor at its own points, on both sides of its steps, and between.

    A network that sees the place in the turn steps at the end of the turn; see ``within_turn``.
    """
    check_curve(predictor, "model", hint="--c holds a predictor of several axes, a table does not")
    points, special = FEWEST, [np.array([low_mm, high_mm, *predictor.range_mm])]
    if isinstance(predictor, ErrorTable):
        special += [positions for positions, _ in predictor.ways]
    elif isinstance(predictor, TrainedNetworks) and any("turn" in one.inputs for one in predictor.networks):
        turns = (high_mm - low_mm) / predictor.pitch_mm
        if turns * POINTS_A_TURN > MOST_POINTS:
            raise ArgumentError(
                "--from, --to", f"{turns:.4g} turns of the screw", f"{MOST_POINTS // POINTS_A_TURN} for a table"
            )
        points = max(points, round(turns * POINTS_A_TURN))
        special.append(_beside(-TOUCH_MM, predictor.pitch_mm, low_mm, high_mm))
    places = np.concatenate([np.linspace(low_mm, high_mm, points + 1), *special])
    fine = np.unique(np.round(np.clip(places, low_mm, high_mm) / _GRID_MM) * _GRID_MM)
    return fine, np.stack([predictor.error_mm(fine, way) for way in (FORWARD, REVERSE)]), ()


def _beside_steps(term: Term, low_mm: float, high_mm: float) -> Floats:
    """Return the places just before and just behind each step of an effect: a table steps between two nodes there."""
    at, period = getattr(term.shape, "step_at", 0.0), getattr(term.shape, "period", 0.0)
    return np.empty(0) if at == 0.0 else _beside(at, period, low_mm, high_mm)


def _beside(at: float, period: float, low_mm: float, high_mm: float) -> Floats:
    """Return the places just before and just behind ``at`` and every period from there, within a range."""
    steps = at + period * np.arange(np.ceil((low_mm - at) / period), np.floor((high_mm - at) / period) + 1.0)
    found: Floats = np.clip(np.concatenate([steps - _BESIDE_MM, steps + _BESIDE_MM]), low_mm, high_mm)
    return found


def _nodes(position: Floats, curves: Floats, within: float, most: int) -> list[int]:
    """Return the indices of the nodes, ascending; ``curves`` has shape (curves, positions)."""
    last = position.size - 1
    found = [0, last]

    def farthest(begin: int, end: int) -> tuple[float, int]:
        inside = slice(begin, end + 1)
        share = (position[inside] - position[begin]) / (position[end] - position[begin])
        lines = curves[:, [begin]] * (1.0 - share) + curves[:, [end]] * share
        off = np.abs(curves[:, inside] - lines).max(axis=0)
        k = int(off.argmax())
        return float(off[k]), begin + k

    pieces = {(0, last): farthest(0, last)}
    while len(found) < most:
        piece = max(pieces, key=lambda p: pieces[p][0])
        off, node = pieces.pop(piece)
        if off <= within or node in piece:
            break
        found.append(node)
        pieces |= {(piece[0], node): farthest(piece[0], node), (node, piece[1]): farthest(node, piece[1])}
    return sorted(found)


def linuxcnc_lines(table: Compensation, *, per_unit_mm: float = 1.0) -> Iterator[str]:
    """Yield the lines of a LinuxCNC compensation file of type 0: nominal, actual forward, actual reverse.

    Parameters
    ----------
    table
        With 256 nodes at most.
    per_unit_mm
        Millimetres of a machine unit: 25.4 where these are inches.

    References
    ----------
    LinuxCNC, INI configuration, section of a joint: COMP_FILE and COMP_FILE_TYPE.

    Examples
    --------
    >>> ends, bent = np.array([0.0, 10.0]), np.array([0.002, 0.004])
    >>> table = Compensation(position_mm=ends, forward_mm=bent, reverse_mm=-bent, interpolation_mm=0.0, left_out=())
    >>> list(linuxcnc_lines(table))
    ['0.000000 0.002000 -0.002000', '10.000000 10.004000 9.996000']
    """
    digits = 6 if per_unit_mm == 1.0 else 8
    for x, up, down in zip(table.position_mm, table.forward_mm, table.reverse_mm, strict=True):
        yield " ".join(f"{value / per_unit_mm:.{digits}f}" for value in (x, x + up, x + down))


def csv_lines(table: Compensation) -> Iterator[str]:
    """Yield the lines of a table for a spreadsheet: position in mm, error in um in each direction."""
    yield f"# interpolation_error: {1e3 * table.interpolation_mm:.3f} um"
    if table.warmth:
        yield f"# warmth: {table.warmth}"
    for one in table.left_out:
        yield f"# left_out: {one.effect}, {one.why}"
    yield "position_mm,forward_um,reverse_um"
    for x, up, down in zip(table.position_mm, table.forward_mm, table.reverse_mm, strict=True):
        yield f"{x:.6f},{1e3 * up:.3f},{1e3 * down:.3f}"
