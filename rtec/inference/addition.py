"""Adding one effect to a model: refit everything, and say what it brought."""

from __future__ import annotations

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.dataset.many_rows import looked_at
from rtec.effects import Shape, effect_named
from rtec.errors import ArgumentError
from rtec.inference.calibration import independent_tests
from rtec.inference.fit import fit_model, noise_after, opened_model, shapes_found
from rtec.inference.judgement import judged
from rtec.inference.model import Model, Term
from rtec.inference.results import Diagnosis
from rtec.inference.trial import Search, first_noise, refitted
from rtec.inference.workspace import Choice, Workspace


def add(
    effect_name: str,
    dataset: Dataset,
    model: Model | None = None,
    heldout: Dataset | None = None,
    *,
    locked: bool = False,
    shape: Shape | None = None,
    seed: int = 0,
) -> Diagnosis:
    """Add an effect to a model, refit everything, and judge the result.

    The effect is added whether it is significant or not: its step says what it brought, with its adjusted probability
    and held-out gain.

    Parameters
    ----------
    effect_name
        Of the library.
    dataset
        The measurement.
    model
        What is known already, refitted; None: nothing.
    heldout
        Another measurement, on which the model is scored.
    locked
        Whether ``heldout`` is only scored: what the effect brings is then judged by held-out parts of ``dataset``.
    shape
        Period, nodes, ...; None: the best of the scan.
    seed
        Of the draws that calibrate.

    Returns
    -------
    Diagnosis
        With one step.

    Raises
    ------
    ArgumentError
        An unknown effect, one that the model holds already, or one that the data cannot show.
    """
    effect, dataset = effect_named(effect_name), looked_at(dataset)
    if dataset.never_changes:
        raise ArgumentError(
            f"effect {effect_name}", f"not testable (the column {dataset.observe} never changes)",
            "data in which something changes",
        )  # fmt: skip
    start = Model(observe=dataset.observe, units=dataset.units) if model is None else model
    if effect_name in start.names and not effect.repeatable:
        raise ArgumentError(
            "EFFECT", effect_name, f"an effect that the model does not hold yet ({', '.join(start.names)})"
        )
    term = Term(effect=effect, shape=shape)
    opened_model(dataset, start.with_terms([term]))  # refuses what the data cannot show
    begun = fit_model(dataset, start, all_open=True) if start.terms else start
    base: list[Choice] = [(t.effect, t.shape) for t in begun.terms if t.shape is not None]
    rng = np.random.default_rng(seed)
    workspace = Workspace(dataset, first_noise(dataset, base))
    state = Search(
        dataset=dataset,
        heldout=heldout,
        locked=locked,
        start=begun,
        workspace=workspace,
        rng=rng,
        searched=False,
    )
    state.tests = independent_tests(workspace.strict, rng)
    new = shapes_found(workspace, [*begun.terms, term])[-1]
    state.kept = [*base, new] if shape is not None else refitted(workspace, [*base, new])
    state.workspace = Workspace(dataset, noise_after(workspace, state.kept, datum=workspace.has_datum))
    return judged(state, begun, base, rng, lambda share: None)
