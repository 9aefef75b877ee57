"""``rtec firmware compare``: the behavioural box held against the firmware's trace."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli import _console, _measured
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.campaign.behaviour import Behaviour
    from rtec.injector import Design


def compare(
    design: Annotated[str, typer.Option(metavar="original|a|b|c|all", help="Insertion design.")],
    hold_latch: Annotated[
        bool, typer.Option("--hold-latch", help="A latch holds real edges back meanwhile.")
    ] = False,
    phases: Annotated[
        int, typer.Option(min=1, max=144, metavar="N", help="Phases of the steady motion, 1/12 us apart.")
    ] = 72,
    edges: Annotated[int, typer.Option(min=100, max=10**7, metavar="N", help="Length of the long run.")] = 60_000,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, metavar="N", help="Of the long run.")] = 0,
    figure: Annotated[
        Path | None, typer.Option(metavar="FILE.png|FILE.svg", help="Draw the staircase of the difference.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the figure.")] = False,
    json: _measured.Json = False,
) -> None:
    """Send the same edges through the firmware on the 12 MHz 8051 and through the behavioural box.

    The behavioural timing is given one effect after the other, from the report's words to `--timing firmware`; after
    each, the insertions of the two are compared in clocks of 1/12 us. Exits with 1 where a difference is left.

    Example: rtec firmware compare --design c --figure staircase.png
    """
    from rtec.campaign.behaviour import compare_behaviour
    from rtec.injector import Design

    if figure is not None:
        _measured.check_new_file("--figure", figure, force=force)
        if figure.suffix not in {".png", ".svg"}:
            raise ArgumentError("--figure", figure.name, "a name that ends in .png or .svg")
    designs = list(Design) if design == "all" else [_named(design)]
    _console.announce_compilation()
    found: list[Behaviour] = []
    for number, each in enumerate(designs):
        with _console.progress(f"design {each.value}") as show:
            show(number / len(designs))
            found.append(compare_behaviour(each, hold_latch=hold_latch, phases=phases, edges=edges, seed=seed))
    if figure is not None:
        from rtec.report.figures_behaviour import write_behaviour_figure

        write_behaviour_figure(found, figure)
    if json:
        _console.print_json({"rows": [one.to_dict() for one in found], **({"figure": str(figure)} if figure else {})})
    else:
        for one in found:
            _show(one)
    if not all(one.good for one in found):
        raise typer.Exit(1)


def _named(design: str) -> Design:
    """Return the design that the user named."""
    from rtec.injector import Design

    try:
        return Design.named(design)
    except ArgumentError as error:
        raise ArgumentError("--design", error.value, f"{error.allowed}, all", error.hint) from error


def _show(found: Behaviour) -> None:
    """Print the staircase for people."""
    latch = ", lines held" if found.hold_latch else ""
    typer.echo(f"design {found.design}{latch}: firmware less model, in clocks of 1/12 us")
    typer.echo(f"{'with':<11}{'steady':<34}{'long run':<34}")
    typer.echo(f"{'':<11}{2 * f'''{'worst':>8}{'rms':>8}{'zero':>8}{'same':>8}  '''}cause")
    for rung in found.rungs:
        row = "".join(
            f"{part.worst_clocks:8.1f}{part.rms_clocks:8.2f}{part.share_zero:8.1%}{part.share_same:8.1%}  "
            for part in (rung.steady, rung.long)
        )
        typer.echo(f"{rung.name:<11}{row}{rung.cause}")
    last = found.rungs[-1]
    made = last.steady.insertions + last.long.insertions
    same = "every change of the lines is the same to the picosecond" if last.identical else "the lines differ"
    typer.echo(f"{made} insertions; in the end {same}")
