"""The rows of a comparison on terminals of any width, and what is said of them."""

import io

import numpy as np
import pytest
from rich.console import Console

from rtec.predictors.fitting.samples import Samples
from rtec.report.training import training_sentence, training_table
from rtec.training.parts import Parts
from rtec.training.results import Kind, PredictorComparison, Row

COLUMNS = ("fitted", "out", "worst", "±", "held", "numbers", "fit", "ns")
TOO_FEW = "readings: 12 averages; use 161 or more, one for each weight"


def row(name, kind, heldout_mm, parameters=1342, **other):
    figures = {"rms_train_mm": 0.00123, "worst_heldout_mm": 0.0456, "train_s": 21.4, "eval_ns": 1456.0}
    known = {"interval_mm": 0.00789, "coverage": 0.914, "parameters": parameters, "rms_heldout_mm": heldout_mm}
    return Row(name=name, kind=Kind(kind), **figures, **known, **other)


def comparison(*rows):
    part = Samples(position_mm=np.arange(8.0), direction=np.ones(8), error_mm=np.zeros(8))
    parts = Parts(train=part, choose=part, sure=part, heldout=part, rows=np.ones(8, dtype=bool), heldout_by="places")
    return PredictorComparison(
        source="z.csv", parts=parts, rows=rows, pitch_mm=None, noise_mm=None, notes=(), interrupted=False
    )


RESULT = comparison(
    row("none", "none", 0.085),
    row("table uni-directional linear", "table", 0.00977),
    row("network 40 lm", "network", 0.00234, 201),
    Row(name="network 30-10 lm", kind=Kind.NETWORK, reason=TOO_FEW),
)


def shown(result, width):
    out = io.StringIO()
    Console(file=out, width=1000 if width is None else width, highlight=False).print(training_table(result, width))
    return out.getvalue().splitlines()


@pytest.mark.parametrize(
    ("width", "left_out"),
    [
        (None, ()),
        (120, ()),
        (79, ()),
        (78, ("ns",)),
        (73, ("ns", "fit")),
        (66, ("ns", "fit", "numbers")),
        (58, ("ns", "fit", "numbers", "fitted")),
        (51, ("ns", "fit", "numbers", "fitted", "worst")),
    ],
)
def test_a_terminal_shows_whole_numbers_and_says_what_it_has_no_room_for(width, left_out):
    lines = shown(RESULT, width)
    assert all(len(line) <= (width or 90) for line in lines)
    cells = dict(zip(COLUMNS, ("1.23", "2.34", "45.6", "7.89", "91 %", "201", "21.4 s", "1456"), strict=True))
    line = next(line for line in lines if line.startswith("network 40 lm"))
    assert line.removeprefix("network 40 lm").split() == [
        word for heading, cell in cells.items() if heading not in left_out for word in cell.split()
    ]
    caption = " ".join(" ".join(lines[2:]).split()).partition("a wider terminal also shows: ")[2]
    assert sorted(caption.replace(" µm", "").split(", ")) == sorted(left_out or [""])


def test_rows_of_one_design_that_have_no_figure_for_one_reason_are_one_sentence():
    rows = [Row(name=f"network 40 {name}", kind=Kind.NETWORK, reason=TOO_FEW) for name in ("lm", "scg", "bfgs")]
    other = Row(name="effects", kind=Kind.MODEL, reason="nothing found")
    said = training_sentence(comparison(row("none", "none", 0.085), *rows, other)).splitlines()
    assert said[:3] == [
        "No predictor has a figure.",
        f"network 40 lm, scg and bfgs: {TOO_FEW}",
        "effects: nothing found",
    ]


@pytest.mark.parametrize(
    ("table_mm", "verdict"), [(0.00107, "as good"), (0.0015, "50 % more"), (0.034, "34 times as much")]
)
def test_the_best_of_another_kind_stands_beside_the_best(table_mm, verdict):
    result = comparison(
        row("none", "none", 0.085), row("network 40 lm", "network", 0.001), row("table", "table", table_mm)
    )
    assert f"The best table (table): {table_mm * 1e3:.3g} µm with 1342 numbers, {verdict}." in training_sentence(
        result
    )


def test_it_is_said_where_no_predictor_is_better_than_none():
    worth = "no predictor is worth its place here"
    assert worth in training_sentence(comparison(row("none", "none", 0.084), row("table", "table", 0.0828)))
    assert worth not in training_sentence(comparison(row("none", "none", 0.084), row("table", "table", 0.07)))
