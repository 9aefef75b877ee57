"""``rtec blind``: the hidden-effect game - play it, measure again, guess, open it, and score the diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rtec.cli import _measured
from rtec.cli._arguments import option, whole_option
from rtec.cli._console import announce_compilation, print_json, progress
from rtec.errors import ArgumentError
from rtec.whole_file import check_file

if TYPE_CHECKING:
    from rtec.blind import Confusion, LineScore, Scenario, Secret

_MISSED = 1
_PLAIN_SIGMA = 5.0
"""Strength of what '--hide' hides, in units of the noise."""
_PATIENCE = 4
"""Times the trials that are played at most until so many count."""


def frame() -> None:
    """Hide physical effects in an emulated axis, and find out whether they are named.

    Example: rtec blind new --seed 7 -o data.csv && rtec diagnose data.csv && rtec blind guess data.csv backlash
    """


def new(
    output: Annotated[
        Path, option("-o", "--output", metavar="data.csv", help="The measurement.", show_default=False)
    ],
    seed: Annotated[int, whole_option(low=0, high=1 << 62, help="Decides what is hidden, and everything else.")] = 0,
    hide: Annotated[
        list[str] | None,
        option("--hide", metavar="EFFECT", help="What to hide, for teaching; repeatable."),
    ] = None,
    plan: Annotated[
        str | None,
        option("--plan", metavar="NAME", help="Of the measurement, with --hide (else: base)."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    json: _measured.Json = False,
) -> None:
    """Hide none to three effects in the emulated axis, measure it, and seal the secret beside the data.

    The seal keeps the secret from a glance only.

    Example: rtec blind new --seed 7 -o data.csv
    """
    from rtec.blind import new as played

    check_file("-o", output, force=force)
    scenario = _scenario(hide or [], plan)
    announce_compilation()
    seal = played(seed, output, scenario=scenario, force=force)
    if json:
        print_json({"data": str(output), "sealed": str(seal), "seed": seed})
    else:
        typer.echo(f"Measured: {output}; try: rtec diagnose {output}")
        typer.echo(f"Sealed: {seal}; open it with: rtec blind reveal {output}")


def _scenario(hide: list[str], plan: str | None) -> Scenario | None:
    """Return what options hide, at five times the noise; None where the seed decides."""
    from rtec.blind import Scenario, plan_named

    if not hide:
        if plan is not None:
            raise ArgumentError("--plan", plan, "a plan beside --hide", "the seed decides on both")
        return None
    try:
        return Scenario(names=tuple(hide), strength_sigma=_PLAIN_SIGMA, plan=plan_named(plan or "base"))
    except ArgumentError as error:
        option = {"names": "--hide", "plan": "--plan"}.get(error.name, error.name)
        raise ArgumentError(option, error.value, error.allowed, error.hint) from None


def measure(
    data: Annotated[Path, typer.Argument(help="A measurement of 'new' or 'measure'.", show_default=False)],
    plan: Annotated[
        Path,
        option(
            "--plan", metavar="P.toml", help="The experiment, as 'diagnose --suggest' writes it.", show_default=False
        ),
    ],
    output: Annotated[
        Path, option("-o", "--output", metavar="SECOND.csv", help="The measurement.", show_default=False)
    ],
    seed: Annotated[
        int | None,
        whole_option(low=1, high=1 << 62, help="Of noise and surroundings; one seed, one set of readings."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over files that exist.")] = False,
    json: _measured.Json = False,
) -> None:
    """Carry out an experiment on the same axis, with the same effects in it, and seal the secret beside the new data.

    Example: rtec diagnose data.csv --suggest plan.toml && rtec blind measure data.csv --plan plan.toml -o second.csv
    """
    from rtec.blind import measure as measured

    check_file("-o", output, force=force)
    announce_compilation()
    seal = measured(data, plan, output, seed=seed, force=force)
    if json:
        print_json({"data": str(output), "sealed": str(seal), "plan": str(plan)})
    else:
        typer.echo(f"Measured: {output}; try: rtec diagnose {output}")
        typer.echo(f"Sealed: {seal}; answer with: rtec blind guess {output} EFFECT...")


def guess(
    data: Annotated[Path, typer.Argument(help="A measurement of 'new' or 'measure'.", show_default=False)],
    effects: Annotated[
        list[str],
        typer.Argument(
            metavar="EFFECT...",
            help="What is hidden; 'unknown' for what no effect is, or 'nothing'.",
            show_default=False,
        ),
    ],
    json: _measured.Json = False,
) -> None:
    """Score an answer against the seal: which effects are right, missed and wrong.

    Exit code 1: the answer is not all that is hidden, or more.

    Example: rtec blind guess data.csv backlash cyclic
    """
    from rtec.blind import guessed, reveal as opened

    found = guessed(opened(data), effects)
    if json:
        lists = {"right": list(found.right), "missed": list(found.missed), "wrong": list(found.wrong)}
        print_json({"data": str(data), "solved": found.solved, **lists})
    else:
        typer.echo("Solved." if found.solved else "Not solved.")
        for heading, names in (("Right", found.right), ("Missed", found.missed), ("Wrong", found.wrong)):
            if names:
                typer.echo(f"{heading}: {', '.join(names)}")
    raise typer.Exit(0 if found.solved else _MISSED)


def reveal(
    data: Annotated[Path, typer.Argument(help="The measurement that 'new' wrote.", show_default=False)],
    json: _measured.Json = False,
) -> None:
    """Say what is hidden in a measurement.

    Example: rtec blind reveal data.csv
    """
    from rtec.blind import document_of, reveal as opened

    secret = opened(data)
    if json:
        print_json(document_of(secret))
    else:
        _show_secret(secret)


def score(
    trials: Annotated[int, whole_option(low=1, high=100_000, help="Games on each line.")] = 20,
    output: Annotated[
        Path | None, option("-o", "--output", metavar="FILE.md", help="Write the table, with all matrices.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write over a file that exists.")] = False,
    seed: Annotated[int, whole_option(low=0, high=1 << 32, help="Of all games.")] = 0,
    jobs: Annotated[
        int, whole_option(low=1, high=64, help="Games played at the same time; the result is the same.")
    ] = 1,
    json: _measured.Json = False,
) -> None:
    """Let the diagnosis play many games, and print how often it is right, with the confusion matrices.

    Where games are too weak to count, others are played in their place. Exit code 1: a share of right answers lies
    below its bar.

    Example: rtec blind score --trials 200 --jobs 2 -o confusion.md
    """
    from rtec.blind import confusion, the_lines
    from rtec.blind.judged import judged, refitted
    from rtec.metrology.text_file import write_lines

    if output is not None:
        check_file("-o", output, force=force)
    announce_compilation()
    with progress("games") as show:
        result = confusion(
            the_lines(),
            trials,
            judged,
            seed,
            lambda _, share: show(share),
            refit=refitted,
            workers=jobs,
            patience=_PATIENCE,
        )
    if output is not None:
        write_lines(output, result.as_markdown().splitlines())
    if json:
        print_json(_document(result) | ({} if output is None else {"table": str(output)}))
    else:
        typer.echo(result.as_markdown(), nl=False)
    reached = all(line.reached for line in result.scores) and all(pool.reached for pool in result.pools)
    raise typer.Exit(0 if reached else _MISSED)


def application(group: type[typer.core.TyperGroup]) -> typer.Typer:
    """Return the verbs of the game as one."""
    app = typer.Typer(cls=group, rich_markup_mode="rich", pretty_exceptions_enable=False)
    app.callback()(frame)
    for verb in (new, measure, guess, reveal, score):
        app.command(verb.__name__)(verb)
    return app


def _document(result: Confusion) -> dict[str, object]:
    return {"trials": result.trials, "seed": result.seed, "lines": [_line_document(line) for line in result.scores]}


def _line_document(scored: LineScore) -> dict[str, object]:
    return {
        "title": scored.line.title,
        "right_is": scored.line.rule.value,
        "bar": scored.line.share,
        "right": scored.right,
        "trials": scored.trials,
        "left_out": scored.left_out,
        "share": scored.share,
        "wilson_95": scored.interval,
        "reached": scored.reached,
        "confusion": [{"hidden": hidden, "answered": said, "count": count} for hidden, said, count in scored.cells],
        "games": [
            {
                "trial": game.trial,
                "seed": game.seed,
                "plan": game.plan,
                "hidden": game.hidden,
                "answered": game.said,
                "right": game.right,
                "effects": game.effects,
            }
            for game in scored.games
        ],
    }


def _show_secret(secret: Secret) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(highlight=False)
    noise = f"{secret.noise} noise of {secret.sigma_um:.3g} um, {secret.plan} plan, seed {secret.seed}"
    if not secret.effects:
        console.print(f"Nothing is hidden: {noise}.", markup=False)
        return
    table = Table(title=Text(noise), title_justify="left", box=None, padding=(0, 2, 0, 0))
    for heading, justify in (("hidden", "left"), ("RMS (um)", "right"), ("in sigma", "right"), ("what", "left")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]  # two of rich's words
    for hidden in secret.effects:
        outside = " (outside the library)" if hidden.name in secret.outside else ""
        values = ", ".join(f"{p.name} {p.value:.4g} {p.unit}".rstrip() for p in hidden.parameters)
        what = f"{hidden.description}{outside}" + (f"; {values}" if values else "")
        rms = f"{hidden.rms_sigma * secret.sigma_um:.3g}"
        table.add_row(Text(hidden.name), rms, f"{hidden.rms_sigma:.3g}", Text(what))
    console.print(table)
