"""The search for what is missing: every model with its own noise, the likeliest in which every effect is sure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.many_rows import search_sample, shortened
from rtec.dataset.outliers import at_turns, far, far_from_neighbours
from rtec.effects import Shape
from rtec.errors import ArgumentError
from rtec.inference.answer import probabilities, settled
from rtec.inference.experiment import experiment_for_more
from rtec.inference.finding import Finding
from rtec.inference.fit import check_testable, fit_model, opened_model, residual_of
from rtec.inference.forms import forms_of
from rtec.inference.judgement import judged
from rtec.inference.model import Model, Term
from rtec.inference.noise import knowing_its_noise, noise_floor
from rtec.inference.probes import Probe
from rtec.inference.results import Diagnosis, Experiment, Outlier, Verdict
from rtec.inference.scored import Judge, Scored
from rtec.inference.search import Search
from rtec.inference.space import Choice, Space

Progress = Callable[[float], None]


def diagnose(
    dataset: Dataset,
    model: Model | None = None,
    heldout: Dataset | None = None,
    *,
    locked: bool = False,
    begin: Model | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Find which physical effects a model lacks.

    Parameters
    ----------
    model
        What is known already; its effects are refitted with the ones found. None: nothing.
    heldout
        Another measurement, on which effects are judged and the found model is scored; else parts of the first are
        held out.
    begin
        Where the search goes on: what fewer readings of the same axis have shown. Unlike those of ``model`` its
        effects have to earn their places again. None: it begins with nothing.
    locked
        Whether ``heldout`` is only scored, when everything is decided.
    seed
        Draws the readings that are looked at, where there are very many.
    progress
        Called with the share done.

    Raises
    ------
    ArgumentError
        A model of another quantity, or one with effects that the data cannot show.
    """
    tell = progress or (lambda share: None)
    dataset = shortened(knowing_its_noise(dataset), seed=seed)
    start = model if model is not None else Model(observe=dataset.observe, units=dataset.units)
    if start.observe != dataset.observe:
        raise ArgumentError("model", f"a model of {start.observe}", f"one of {dataset.observe}")
    dataset = _sided(dataset)
    dataset, outliers = _without(dataset, far_from_neighbours(dataset))
    begun = fit_model(dataset, start, all_open=True) if start.terms else start
    given: tuple[Choice, ...] = tuple((term.effect, term.shape) for term in begun.terms if term.shape is not None)
    space = Space(dataset)
    tell(0.05)
    if dataset.never_changes or not any(not isinstance(effect, Probe) for effect in space.library):
        return nothing_testable(Search(Judge(space), given), begun)
    part = search_sample(dataset, seed)
    known = () if begin is None else tuple((t.effect, t.shape) for t in begin.terms if t.shape is not None)
    search = Search(Judge(space if part is dataset else Space(part)), given, known)
    best = search.run(lambda share: tell(0.05 + 0.6 * share))
    more, off = _without(dataset, _off(search, best)) if part is dataset else (dataset, ())
    if off:  # what no noise explains beside the best model may have hidden the rest of it
        dataset, outliers = more, (*outliers, *off)
        search = Search(Judge(Space(dataset)), given, known)
        best = search.run(lambda share: tell(0.4 + 0.25 * share))
    found = Finding(
        search=search,
        model=best,
        scout=search,
        scouted=best,
        begun=begun,
        probability={},
        outliers=tuple(sorted(outliers, key=lambda one: one.row)),
        heldout=heldout,
    )
    found = _on_all(found, dataset)
    if heldout is not None and not locked:
        found = _confirmed(found)
    tell(0.75)
    result = judged(found)
    tell(1.0)
    return result


def _sided(dataset: Dataset) -> Dataset:
    turns = at_turns(dataset)
    if not turns.any():
        return dataset
    note = f"{turns.sum()} readings at reversals are left out: the direction of motion there is uncertain"
    return replace(dataset.take(~turns), notes=(*dataset.notes, note))


def _without(dataset: Dataset, out: np.ndarray) -> tuple[Dataset, tuple[Outlier, ...]]:
    if not out.any():
        return dataset, ()
    order = dataset.coordinates.order[out]
    found = tuple(Outlier(int(row) + 1, float(y)) for row, y in zip(order, dataset.observed[out], strict=True))
    return dataset.take(~out), found


def _off(search: Search, model: Scored) -> np.ndarray:
    """Return which readings the best model leaves far off, by the steps of what is left; shape (rows,)."""
    left = search.judge.left(model)
    return far(search.space.view(model.colour).project(left[None, :])[0])


def _on_all(found: Finding, dataset: Dataset) -> Finding:
    """Return what a search found that every effect is sure of, on all rows: shapes refined, what fails struck off."""
    scout = found.scout
    scouted, probability = settled(scout, found.scouted)
    found = replace(found, model=scouted, scouted=scouted, probability=probability)
    if scout.space.dataset is dataset:
        return found
    whole = Search(Judge(Space(dataset)), scout.given, refused=scout.gate.refused)
    library = {effect.name: effect for effect in whole.space.library}
    choices = [(library.get(effect.name, effect), shape) for effect, shape in scouted.choices]
    lasting = [c for c in choices if not isinstance(c[0], Probe) or c[0].name in library]
    # more readings at rest show more harmonics; in a log, whose form is never exact, they would follow its hairs
    still = not dataset.conditions.moving
    model = whole.gate.earned(whole.exchanges.reshaped(whole.judge.score(lasting), maps=True, waves=still))
    # how an effect changes is asked of all rows anew: the probe for it was made of those drawn
    return replace(found, search=whole, model=model if len(lasting) == len(choices) else whole.changing(model))


def _confirmed(found: Finding) -> Finding:
    """Return what was found without the effects that make another measurement worse."""
    search, best = found.search, found.model
    while True:
        error = found.rms_heldout(best)
        worse = [
            (found.rms_heldout(rest), k, rest)
            for k, choice in enumerate(best.choices)
            if choice not in search.given
            for rest in [search.neighbours.without(best, k)]
            if found.rms_heldout(rest) < error
        ]
        if not worse:
            return replace(found, model=best)
        _, k, rest = min(worse, key=lambda item: item[0])
        search.gate.refused[best.choices[k][0].name] = "it raises the error on the held-out measurement"
        best = rest


def with_step_before(first: Diagnosis, then: Diagnosis) -> Diagnosis:
    """Return the diagnosis of an addition that went on where another ended, with the steps of both."""
    return replace(
        then,
        start=first.start,
        steps=(*first.steps, *then.steps),
        rms_before=first.rms_before,
        rms_heldout_before=first.rms_heldout_before,
    )


def nothing_testable(search: Search, begun: Model) -> Diagnosis:
    """Return the diagnosis of data that can show nothing at all."""
    dataset, judge = search.space.dataset, search.judge
    reasons = {name: why for name, why in search.space.reasons.items() if why is not None}
    experiment = experiment_for_more(dataset, reasons, {}, None)
    if dataset.never_changes:
        reasons = dict.fromkeys(search.space.reasons, "the observed column never changes")
        experiment = Experiment(text=f"see that {dataset.observe} is recorded at all, and with enough digits")
    left = dataset.rms(residual_of(dataset, begun))
    return Diagnosis(
        verdict=Verdict.NOT_TESTABLE,
        dataset=dataset,
        start=begun,
        model=begun,
        noise=noise_floor(judge, judge.score(search.given)),
        rms_before=left,
        rms_after=left,
        rms_heldout=left,
        not_testable=tuple(reasons.items()),
        experiment=experiment,
        notes=dataset.notes,
    )


def add(
    effect_name: str,
    dataset: Dataset,
    model: Model | None = None,
    heldout: Dataset | None = None,
    *,
    shape: Shape | None = None,
    seed: int = 0,
) -> Diagnosis:
    """Add an effect to a model, refit everything, and judge the result.

    The effect is added whether it is significant or not: its step says what it brought, with its adjusted probability
    and held-out gain. There is one step.

    Parameters
    ----------
    model
        What is known already, refitted; None: nothing.
    heldout
        Another measurement, on which the model is only scored: what is added as the user says is never taken out.
    shape
        Period, nodes, ...; None: the best of the scan.
    seed
        Draws the readings that are looked at, where there are very many.

    Raises
    ------
    ArgumentError
        An unknown effect, one that the model holds already, also as the best form of a second one, or one that the
        data cannot show.
    """
    effect = dataset.library.named(effect_name)
    dataset = shortened(knowing_its_noise(dataset), seed=seed)
    if dataset.never_changes:
        problem = f"not testable (the column {dataset.observe} never changes)"
        raise ArgumentError(f"effect {effect_name}", problem, "data in which something changes")
    start = Model(observe=dataset.observe, units=dataset.units) if model is None else model
    if start.names.count(effect_name) >= forms_of(effect).at_most:
        allowed = f"an effect that the model does not hold yet ({', '.join(start.names)})"
        raise ArgumentError("EFFECT", effect_name, allowed)
    term = Term(effect=effect, shape=shape)
    check_testable(dataset, [term])  # refuses what the data cannot show
    begun = fit_model(dataset, start, all_open=True) if start.terms else start
    given: tuple[Choice, ...] = tuple((t.effect, t.shape) for t in begun.terms if t.shape is not None)
    opened = opened_model(dataset, begun.with_terms([*begun.terms, term]), all_open=True)
    assert opened is not None  # noqa: S101 - a term without amplitudes is open
    new = next((choice for choice in opened.scored.choices if choice[0] is effect and choice not in given), None)
    if new is None:
        allowed = "another effect, or a shape that the model does not hold"
        raise ArgumentError("EFFECT", effect_name, allowed, problem="is in the model in the form that explains most")
    search = Search(Judge(Space(dataset)), given)
    found = search.judge.score([*given, new])
    if shape is None:
        found = search.exchanges.reshaped(found)
    search.neighbours.children(search.judge.score(given))  # what would do as well in its place
    return judged(
        Finding(
            search=search,
            model=found,
            scout=search,
            scouted=found,
            begun=begun,
            probability=probabilities(search, found),
            heldout=heldout,
            searched=False,
        )
    )
