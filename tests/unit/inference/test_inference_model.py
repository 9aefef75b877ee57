"""What a model says about each reading, against sums written out."""

from __future__ import annotations

import numpy as np
import pytest

from rtec.dataset.dataset import Dataset
from rtec.effects import Conditions, Observable, Shape, Units
from rtec.effects.backlash import Backlash
from rtec.effects.scale import Scale
from rtec.inference.model import Model, Term

UNITS = Units("mm", "mm", "reading")
SCALE = Term(effect=Scale(), shape=Shape(), amplitudes=(2e-5,))
BACKLASH = Term(effect=Backlash(), shape=Shape(), amplitudes=(0.012,))


def _dataset() -> Dataset:
    position = np.array([0.0, 100.0, 200.0, 200.0, 100.0, 0.0])
    conditions = Conditions(
        position=position,
        position_unit="mm",
        run=np.ones(6, dtype=np.int64),
        direction=np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0]),
    )
    return Dataset(
        source="axis.csv",
        observe="deviation",
        observable=Observable.DEVIATION,
        units=UNITS,
        observed=np.zeros(6),
        conditions=conditions,
        cell=np.full(6, -1),
    )


def test_a_prediction_is_datum_plus_every_contribution():
    model = Model(observe="deviation", units=UNITS, terms=(SCALE, BACKLASH), datum=0.5)
    expected = [0.506, 0.508, 0.510, 0.498, 0.496, 0.494]
    assert model.predict(_dataset()) == pytest.approx(expected)


def test_without_effects_the_datum_is_left():
    assert Model(observe="deviation", units=UNITS, datum=-2.0).predict(_dataset()).tolist() == [-2.0] * 6


def test_components_and_datum_add_up():
    dataset, model = _dataset(), Model(observe="deviation", units=UNITS, terms=(SCALE, BACKLASH), datum=0.1)
    total = 0.1 + sum(term.component(dataset) for term in model.terms)
    assert model.predict(dataset) == pytest.approx(total)


def test_a_term_that_is_not_fitted_is_named():
    with pytest.raises(ValueError, match="backlash is not fitted"):
        Term(effect=Backlash(), shape=Shape()).component(_dataset())
