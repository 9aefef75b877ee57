"""What a model says about each reading of a data set, as a whole and effect by effect."""

from __future__ import annotations

import numpy as np

from rtec.dataset.dataset import Dataset
from rtec.effects import Floats
from rtec.inference.model import Model, Term


def component(dataset: Dataset, term: Term) -> Floats:
    """Return what one effect contributes to each reading.

    Parameters
    ----------
    dataset
        Where the columns of an effect were filtered and thinned like the observed quantity, so is the contribution.
    term
        Fitted.

    Returns
    -------
    ndarray
        Shape (rows,), in the observed unit inside.

    Raises
    ------
    ValueError
        The term is not fitted.
    """
    if term.shape is None or term.amplitudes is None:
        raise ValueError(f"{term.name} is not fitted")
    added: Floats = dataset.columns(term.effect, term.shape) @ np.asarray(term.amplitudes, dtype=np.float64)
    return added


def dataset_prediction(dataset: Dataset, model: Model) -> Floats:
    """Return what a model says about each reading: its datum and the contribution of every effect.

    Parameters
    ----------
    dataset
        The readings.
    model
        Every effect is fitted.

    Returns
    -------
    ndarray
        Shape (rows,), in the observed unit inside.

    Raises
    ------
    ValueError
        A term is not fitted.
    """
    total = np.full(dataset.rows, model.datum)
    for term in model.terms:
        total += component(dataset, term)
    return total
