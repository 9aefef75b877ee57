"""``rtec campaign``: plans of many independent jobs, on this machine or on a cluster."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rtec.cli import _console, _measured
from rtec.cli._parameters import apart, flag, folder, force, option, whole, written
from rtec.cli._verb import said
from rtec.cli._words import CAMPAIGNS, completing
from rtec.errors import ArgumentError, RtecError

if TYPE_CHECKING:
    from rtec.verify.campaign.executors import Executor
    from rtec.verify.campaign.plan import Plan
    from rtec.verify.campaign.store import Store

_OUTPUT, _PLAN = "Output", "Plan"


def campaign(
    context: typer.Context,
    plan: str | None = typer.Argument(
        None,
        metavar="PLAN",
        autocompletion=completing(CAMPAIGNS),
        help="A file PLAN.toml, or one that --list shows.",
        show_default=False,
    ),
    only: list[str] | None = option(
        "--only", "WORD,...", "Only these values, as glitches, place=bus, frequency=20kHz.", panel=_PLAN
    ),
    runs: int | None = whole("--runs", "Jobs of each combination; as the plan says.", low=1, high=10**7, panel=_PLAN),
    seed: int | None = whole("--seed", "Of everything random; as the plan says.", low=0, high=2**32 - 1, panel=_PLAN),
    by: str | None = option("--by", "WORD,...", "Count by these parameters, as design,phase.", panel=_PLAN),
    yes: bool = flag("--yes", "Also a plan of more than 100000 jobs.", panel=_PLAN),
    list_: bool = flag("--list", "List the plans that come with rtec.", panel=_PLAN),
    show: str | None = option("--show", "PLAN", "Print a plan, to begin one of your own with.", panel=_PLAN),
    count: bool = flag("--count", "Say how many jobs there are, and how many are stored.", panel=_PLAN),
    workers: int | None = whole("--workers", "Processes; as many as there are cores.", low=1, high=1024),
    scheduler: str | None = option("--scheduler", "tcp://HOST:8786", "Run jobs on this Dask cluster instead."),
    store: Path | None = option("--store", "FILE.db", "Records are kept here; campaign-PLAN.db."),
    merge: list[Path] | None = option("--merge", "OTHER.db", "First take over the records of another store."),
    job: str | None = option("--job", "ADDRESS", "Run one job again and compare the records; with -o draw it."),
    output: Path | None = folder("-o --output", "Folder of a report, its map and its jobs.", panel=_OUTPUT),
    page: Path | None = option(
        "--page", "FILE.md", "Write tables into a page that has places for them.", panel=_OUTPUT
    ),
    csv: Path | None = written("--csv", "FILE.csv", "Write a row for each job.", endings=(".csv",), panel=_OUTPUT),
    junit: Path | None = written(
        "--junit", "FILE.xml", "Write a test case for each job.", endings=(".xml",), panel=_OUTPUT
    ),
    parquet: Path | None = written(
        "--parquet", "FILE.parquet", "As --csv, with pyarrow.", endings=(".parquet",), panel=_OUTPUT
    ),
    force: bool = force("Write over files that exist.", panel=_OUTPUT),
    json: bool = _measured.JSON,
) -> None:
    """Carry out a plan of many jobs, resume it where it was left, and say what was tried and what failed.

    Records are stored as they come. After Ctrl-C or a crash the same command goes on, and no job counts twice. Exits
    with 1 where a job failed or has no record, or a fault took effect in none of its jobs.

    Example: rtec campaign safety --only glitches,cable-open -o glitches
    Example: rtec campaign motions --only c,fast --runs 200 --csv motions.csv
    Example: rtec campaign envelope --scheduler tcp://10.0.0.5:8786 --json
    """
    from rtec.verify.campaign.plan import plan_text

    if list_:
        _list(json)
        return
    if show is not None:
        typer.echo(plan_text(show)[1], nl=False)
        return
    if plan is None:
        raise ArgumentError("PLAN", None, f"a file PLAN.toml, or one of {', '.join(CAMPAIGNS)}")
    if scheduler is not None and workers is not None:
        raise apart("--workers", "--scheduler", "the cluster has its own")
    chosen = _plan(plan, only or [], runs, seed)
    if by is not None:
        chosen = chosen.counted_by(_words(by))
    _check_size(chosen, yes)
    file = Path(f"campaign-{chosen.name}.db") if store is None else store
    again = shlex.join(["rtec", "campaign", plan, *said(context, "only", "runs", "seed", "by", "store")])
    from rtec.verify.campaign.store import Store

    next(chosen.jobs())  # a plan that can prove nothing is refused before a file is made
    files = {
        kind: each
        for kind, each in (("csv", csv), ("junit", junit), ("parquet", parquet), ("report", output), ("page", page))
        if each
    }
    _check_files(chosen, files, "--count" if count else "--job" if job is not None else None)
    if count or job is not None:
        with Store(file if file.exists() else ":memory:") as kept:
            if count:
                _count(chosen, kept, json)
            else:
                _one(chosen, kept, str(job), again, output)
        return
    with _executor(chosen, workers, scheduler) as executor, Store(file) as kept:
        for other in merge or []:
            _console.note(f"{kept.merge(other)} records taken over from {other}")
        good = _carry_out(chosen, kept, executor, again, files, json)
    if not good:
        raise typer.Exit(1)


def _check_files(plan: Plan, files: dict[str, Path], part: str | None) -> None:
    """Refuse files of a whole campaign beside a part of it, and a page without a place for the plan."""
    for name in files:
        if part == "--count" or (part == "--job" and name != "report"):
            raise apart("-o" if name == "report" else f"--{name}", part, "it is of the whole plan")
    if "page" in files:
        from rtec.report.campaign_page import check_page

        check_page(files["page"], plan)


def _list(json: bool) -> None:
    from rtec.io import parse_toml
    from rtec.verify.campaign.plan import BUILT_IN, plan_text

    # what the jobs do is not loaded: that of all plans together takes seconds
    plans = {name: parse_toml(plan_text(name)[1], name)["about"] for name in BUILT_IN}
    if json:
        _console.print_json({"plans": [{"plan": name, "about": about} for name, about in plans.items()]})
        return
    for name, about in plans.items():
        typer.echo(f"{name:11} {about}")


def _plan(word: str, only: list[str], runs: int | None, seed: int | None) -> Plan:
    from rtec.verify.campaign.plan import read_plan

    found = read_plan(word)
    found = replace(found, runs=found.runs if runs is None else runs, seed=found.seed if seed is None else seed)
    return found.only(word for words in only for word in _words(words))


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _check_size(plan: Plan, yes: bool) -> None:
    """Refuse a product that is too large to be meant.

    Raises
    ------
    ArgumentError
        It is.
    """
    from rtec.verify.campaign.plan import MOST_JOBS

    if plan.size > MOST_JOBS and not yes:
        raise ArgumentError(
            f"plan {plan.name}",
            f"{plan.size} jobs",
            f"at most {MOST_JOBS} jobs, or --yes",
            problem="is a large product",
        )


@contextmanager
def _executor(plan: Plan, workers: int | None, scheduler: str | None) -> Iterator[Executor]:
    from rtec.jobs import cores
    from rtec.verify.campaign.executors import Processes, Serial

    if scheduler is not None:
        from rtec.verify.campaign.cluster import Cluster

        with Cluster(scheduler, plan.kind.function) as cluster:
            yield cluster
        return
    number = cores() if workers is None else workers
    yield Serial() if number == 1 else Processes(number)


def _carry_out(plan: Plan, store: Store, executor: Executor, again: str, files: dict[str, Path], json: bool) -> bool:
    from rtec.verify.campaign.export import write_csv, write_junit, write_parquet
    from rtec.verify.campaign.run import addresses_of, run_campaign

    _say_others(plan, store)
    try:
        with _console.progress(plan.name, lines="; the same command resumes") as progress:
            found = run_campaign(plan, store, executor, progress)
    except (KeyboardInterrupt, SystemExit):
        _console.note(f"what is done is in {store.path}; the same command goes on with the rest")
        raise
    addresses = addresses_of(plan)
    if "csv" in files:
        write_csv(files["csv"], lambda: store.records(addresses), again, plan)
    if "junit" in files:
        write_junit(files["junit"], lambda: store.records(addresses), again, plan)
    if "parquet" in files:
        write_parquet(files["parquet"], lambda: store.records(addresses), again, plan)
    if "report" in files:
        from rtec.io import report_folder
        from rtec.report.campaign import write_campaign

        with report_folder(files["report"], "campaign") as folder_:
            files["report"] = write_campaign(found, store, addresses, folder_, again=again)
    if "page" in files:
        from rtec.report.campaign_page import fill_page

        fill_page(files["page"], found, store, addresses)
    if json:
        _console.print_json(
            found.to_dict() | {"store": str(store.path)} | {kind: str(p) for kind, p in files.items()}
        )
    else:
        from rtec.report.terminal_campaign import show

        show(found, again)
        typer.echo(f"Records: {store.path}" + "".join(f", {each}" for each in files.values()))
    return found.good


def _say_others(plan: Plan, store: Store) -> None:
    from rtec.verify.campaign.code import code_of

    others = store.of_other_code(code_of(plan.kind.function))
    if others:
        _console.note(
            f"{store.path} also holds {others} records made by other code or for other plans; they do not count"
        )


def _count(plan: Plan, store: Store, json: bool) -> None:
    from rtec.verify.campaign.run import addresses_of

    addresses = addresses_of(plan)
    done = len(store.known(addresses))
    if json:
        _console.print_json({"plan": plan.name, "jobs": len(addresses), "done": done})
    else:
        typer.echo(f"{len(addresses)} jobs, {done} of them stored")


def _one(plan: Plan, store: Store, address: str, again: str, output: Path | None) -> None:
    """Run one job again, print its record, draw it into a folder, and hold it against the stored one.

    Raises
    ------
    ArgumentError
        The plan has no such job, or several; a folder for a job that has nothing to be drawn.
    RtecError
        The record differs from the stored one.
    """
    from rtec.verify.campaign.code import code_of
    from rtec.verify.campaign.run import addresses_of

    addresses = addresses_of(plan)
    found = [k for k, each in enumerate(addresses) if each.startswith(address)]
    if len(found) != 1:
        problem = "is no job of this plan with this code" if not found else f"begins {len(found)} addresses"
        raise ArgumentError(
            "--job", repr(address[:60]), "an address from --csv, --junit or the list", problem=problem
        )
    job = next(one for k, one in enumerate(plan.jobs()) if k == found[0])
    record = job.carry_out()
    stored = next((done.record for done in store.records([addresses[found[0]]])), None)
    document = {
        "job": addresses[found[0]], "code": code_of(job.function), **job.parameters, "seed": job.seed, "run": job.run,
        "requirement": plan.requirement_ids(job.parameters),
        **record, "as_stored": None if stored is None else stored == record,
    }  # fmt: skip
    if output is not None:
        from rtec.io import report_folder
        from rtec.report.campaign_job import write_job
        from rtec.verify.campaign.trace import trace_of

        trace = trace_of(plan.kind, job)
        if trace is None:
            raise apart("-o", "--job here", "there are no lines to be drawn")
        said_ = document | {"command": f"{again} --job {addresses[found[0]]}"}
        with report_folder(output, "campaign") as folder_:
            document["report"] = str(write_job(trace, said_, plan.name, folder_))
    _console.print_json(document)
    if stored is not None and stored != record:
        raise RtecError(f"job {addresses[found[0]]} gives another record than the one in {store.path}")
