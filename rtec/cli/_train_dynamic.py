"""``rtec train --dynamic``: models of motion fitted to the log of a drive and compared in free run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli._console import note, print_json, progress
from rtec.errors import ArgumentError
from rtec.io import check_file

if TYPE_CHECKING:
    from rtec.cli._train_options import TrainOptions
    from rtec.training.dynamic_results import DynamicComparison, DynamicRow

_BUDGET_S = 90.0
_WHOLE_LINES = 1000


def train_dynamic(data: Path, asked: TrainOptions) -> bool:
    """Fit, compare, show and write; return whether Ctrl-C ended it.

    Raises
    ------
    RtecError
        A log that cannot be read, or an option that does not fit it.
    """
    from rtec.dataset.dynamic_log import dynamic_log, log_like
    from rtec.training.compare_dynamic import compare_dynamic
    from rtec.training.dynamic_methods import dynamic_methods
    from rtec.training.dynamic_results import DynamicKind

    pick = asked.row([one.name for one in dynamic_methods() if one.kind is not DynamicKind.NONE], "model of motion")
    asked.refuse_itself(data, "the second half judges")
    heldout = asked.heldout
    with progress(f"training on {data.name}", lines="") as show:
        choices = asked.columns.choices()
        log = dynamic_log(data, observe=asked.observe, inputs=asked.inputs, choices=choices)
        result = compare_dynamic(
            log,
            None if heldout is None else log_like(log.head, heldout, choices),
            starts=asked.starts,
            budget_s=_BUDGET_S if asked.budget_s is None else asked.budget_s,
            seed=asked.seed,
            progress=lambda what, share: show(share, what),
        )
    if not asked.json:  # before anything is written: a full disk shall not take the figures with it
        _show(result)
    written = {} if asked.output is None else _write(asked.output, result, pick, force=asked.force)
    if asked.json:
        from rtec.report.dynamic_training import dynamic_document

        print_json(dynamic_document(result) | written)
    elif asked.output is not None:
        typer.echo(f"{asked.output}: {written['written']}")
    return result.interrupted


def _show(result: DynamicComparison) -> None:
    from rich.console import Console

    from rtec.report.dynamic_training import dynamic_sentence, dynamic_table

    for sentence in result.log.notes:
        note(sentence)
    console = Console(highlight=False)
    if console.is_terminal:
        console.print(dynamic_table(result, console.width))
    else:  # a file or another program gets whole lines
        Console(highlight=False, width=_WHOLE_LINES).print(dynamic_table(result))
    console.print(dynamic_sentence(result), soft_wrap=True, markup=False)


def _write(path: Path, result: DynamicComparison, pick: str | None, *, force: bool) -> dict[str, str]:
    """Write the model of a row, the chosen one where none is named."""
    from rtec.predictors.motion_file import KnownMotion, write_motion

    check_file("-o", path, force=force)  # somebody may have written it in the meantime
    row: DynamicRow | None = result.named(result.chosen if pick is None else pick)
    if row is None or row.model is None or not row.works:
        why = "no model has a figure" if row is None or row.reason is None else row.reason
        raise ArgumentError("-o" if pick is None else "--pick", pick or "the chosen row", "a row with a figure", why)
    known = KnownMotion(
        model=row.model,
        head=result.log.head,
        name=row.name,
        source=Path(result.log.measurement.source).name,
        interval=row.interval,
    )
    write_motion(path, known)
    return {"model": str(path), "written": row.name}
