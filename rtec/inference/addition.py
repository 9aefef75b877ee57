"""Adding one effect to a model: refit everything, and say what it brought."""

from __future__ import annotations

from rtec.dataset.dataset import Dataset
from rtec.dataset.many_rows import looked_at
from rtec.effects import Shape, effect_named
from rtec.errors import ArgumentError
from rtec.inference.answer import probabilities
from rtec.inference.finding import Finding
from rtec.inference.fit import check_testable, fit_model, opened_model
from rtec.inference.judgement import judged
from rtec.inference.model import Model, Term
from rtec.inference.results import Diagnosis
from rtec.inference.scored import Judge
from rtec.inference.search import Search
from rtec.inference.space import Choice, Space


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
        An unknown effect, one that the model holds already, or one that the data cannot show.
    """
    effect, dataset = effect_named(effect_name), looked_at(dataset, seed=seed)
    if dataset.never_changes:
        problem = f"not testable (the column {dataset.observe} never changes)"
        raise ArgumentError(f"effect {effect_name}", problem, "data in which something changes")
    start = Model(observe=dataset.observe, units=dataset.units) if model is None else model
    if start.names.count(effect_name) >= effect.at_most:
        allowed = f"an effect that the model does not hold yet ({', '.join(start.names)})"
        raise ArgumentError("EFFECT", effect_name, allowed)
    term = Term(effect=effect, shape=shape)
    check_testable(dataset, [term])  # refuses what the data cannot show
    begun = fit_model(dataset, start, all_open=True) if start.terms else start
    given: tuple[Choice, ...] = tuple((t.effect, t.shape) for t in begun.terms if t.shape is not None)
    opened = opened_model(dataset, begun.with_terms([*begun.terms, term]), all_open=True)
    assert opened is not None  # noqa: S101 - a term without amplitudes is open
    new = next(choice for choice in opened.scored.choices if choice[0] is effect and choice not in given)
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
