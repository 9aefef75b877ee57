"""``rtec blind``: the hidden-effect game - play it, measure again, guess, open it, and score the diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _measured
from rtec.cli._console import announce_compilation, print_json
from rtec.cli._groups import verbs_under
from rtec.cli._parameters import force, needs, option, whole, written
from rtec.cli._words import EFFECTS, PLANS, completing
from rtec.errors import ArgumentError

if TYPE_CHECKING:
    from rtec.blind.hidden import Secret
    from rtec.blind.scenario import Scenario


def frame() -> None:
    """Hide physical effects in an emulated axis, and find out whether they are named.

    Example: rtec blind new --seed 7 -o data.csv && rtec diagnose data.csv && rtec blind guess data.csv backlash
    Example: rtec blind new --hide 'backlash=3 um' -o data.csv && rtec blind guess data.csv 'backlash=3.2 um' --by Ada
    Example: rtec blind score data.csv
    """


def new(
    output: Path = written("-o --output", "data.csv", "The measurement.", default=...),
    seed: int | None = whole("--seed", "Decides everything; another one each time without it.", low=0, high=1 << 62),
    hide: list[str] | None = option(
        "--hide",
        "EFFECT[=SIZE]",
        "What to hide, and how much of it, as backlash='3 um'; may be given again. Five times the noise "
        "without a size; the seed decides without --hide.",
        complete=completing(EFFECTS),
    ),
    plan: str | None = option(
        "--plan", "NAME", "Of the measurement, with --hide; base without it.", complete=completing(PLANS)
    ),
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Hide none to three effects in the emulated axis, measure it, and seal the secret beside the data.

    The seal keeps the secret from a glance only. A size is the number of the effect that 'rtec blind reveal' shows;
    its sign is drawn.

    Example: rtec blind new --seed 7 -o data.csv
    Example: rtec blind new --hide 'backlash=3 um' --hide 'cyclic=6 um' -o data.csv
    Example: rtec blind new --hide thermal_growth --plan one_heating -o poor.csv
    """
    from secrets import randbelow

    from rtec.blind.sealing import new as played

    drawn = seed is None
    number = randbelow(1 << 31) if seed is None else seed
    announce_compilation()
    scenario = _scenario(hide or [], plan, number)
    seal = played(number, output, scenario=scenario, force=force)
    if json:
        print_json({"data": str(output), "sealed": str(seal), "seed": number})
    else:
        typer.echo(f"Measured: {output}; try: rtec diagnose {output}")
        typer.echo(f"Sealed: {seal}; open it with: rtec blind reveal {output}")
        if drawn:
            typer.echo(f"Seed: {number}, drawn; --seed {number} plays the same game again")


def _scenario(hide: list[str], plan: str | None, seed: int) -> Scenario | None:
    from rtec.blind.plan import plan_named
    from rtec.blind.scenario import Scenario
    from rtec.blind.sizes import plans_showing, read_size, scenario_of_sizes

    if not hide:
        if plan is not None:
            raise needs("--plan", "--hide", "without, the seed decides on the plan, too")
        return None
    pairs = [(name.strip(), equals, text) for name, equals, text in (word.partition("=") for word in hide)]
    names = tuple(name for name, _, _ in pairs)
    try:
        measured_by = plan_named(plan or "base")
        Scenario(names=names, plan=measured_by)  # a wrong name is said before a wrong size
        sizes = [(name, read_size(name, text, where="--hide") if equals else None) for name, equals, text in pairs]
        return scenario_of_sizes(sizes, measured_by, seed)
    except ArgumentError as error:
        name = {"names": "--hide", "plan": "--plan"}.get(error.name, error.name)
        others = plans_showing(str(error.value)) if error.value in names else ()
        hint = f"{error.hint}; it shows in the plans {', '.join(others)}" if others else error.hint
        raise ArgumentError(name, error.value, error.allowed, hint, problem=error.problem) from None


def measure(
    data: Path = typer.Argument(..., help="A measurement of 'new' or 'measure'.", show_default=False),
    plan: Path = option("--plan", "P.toml", "The experiment, as 'diagnose --suggest' writes it.", default=...),
    output: Path = written("-o --output", "SECOND.csv", "The measurement.", default=...),
    seed: int | None = whole(
        "--seed", "Of noise and surroundings; one seed, one set of readings.", low=1, high=1 << 62
    ),
    force: bool = force("Write over files that exist."),
    json: bool = _measured.JSON,
) -> None:
    """Carry out an experiment on the same axis, with the same effects in it, and seal the secret beside the new data.

    Example: rtec diagnose data.csv --suggest plan.toml && rtec blind measure data.csv --plan plan.toml -o second.csv
    Example: rtec blind measure data.csv --plan plan.toml -o second.csv --seed 4
    Example: rtec blind measure data.csv --plan plan.toml -o second.csv --force --json
    """
    from rtec.blind.sealing import measure as measured

    announce_compilation()
    seal = measured(data, plan, output, seed=seed, force=force)
    if json:
        print_json({"data": str(output), "sealed": str(seal), "plan": str(plan)})
    else:
        typer.echo(f"Measured: {output}; try: rtec diagnose {output}")
        typer.echo(f"Sealed: {seal}; answer with: rtec blind guess {output} EFFECT...")


def reveal(
    data: Path = typer.Argument(..., help="The measurement that 'new' wrote.", show_default=False),
    json: bool = _measured.JSON,
) -> None:
    """Say what is hidden in a measurement.

    Example: rtec blind reveal data.csv
    Example: rtec blind reveal data.csv --json
    Example: rtec blind guess data.csv backlash && rtec blind reveal data.csv
    """
    from rtec.blind.sealing import document_of, reveal as opened

    secret = opened(data)
    if json:
        print_json(document_of(secret))
    else:
        _show_secret(secret)


def application(group: type[typer.core.TyperGroup]) -> typer.Typer:
    """Return the verbs of the game as one."""
    from rtec.cli.blind_answers import guess, score

    return verbs_under(frame, {verb.__name__: verb for verb in (new, measure, guess, reveal, score)}, group)


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
