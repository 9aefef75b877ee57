"""The diagnosis as a judge of the game: what it answers, and what it leaves once the true effects are known."""

from __future__ import annotations

from rtec.blind.answer import Answer, answer_of
from rtec.dataset.load import load_dataset
from rtec.effects import effect_named
from rtec.inference.compare import compare
from rtec.inference.diagnose import diagnose
from rtec.inference.model import Model, Term
from rtec.metrology import Measurement


def judged(measurement: Measurement) -> Answer:
    """Return what the diagnosis says of a measurement.

    Examples
    --------
    >>> from rtec.blind.game import play
    >>> from rtec.blind.scenario import Scenario
    >>> answer = judged(play(Scenario(names=("backlash",), strength_sigma=5.0), seed=2)[0])
    >>> answer.verdict, answer.effects
    ('NAMED', ('backlash',))
    """
    return answer_of(diagnose(load_dataset(measurement)))


def refitted(measurement: Measurement, names: tuple[str, ...]) -> tuple[float, float]:
    """Return held-out RMS and noise floor, in mm, with the effects of these names, everything about them fitted.

    Examples
    --------
    >>> from rtec.blind.game import play
    >>> from rtec.blind.scenario import Scenario
    >>> heldout, floor = refitted(play(Scenario(names=("backlash",), strength_sigma=5.0), seed=2)[0], ("backlash",))
    >>> heldout < 1.1 * floor
    True
    """
    dataset = load_dataset(measurement)
    terms = tuple(Term(effect=effect_named(name)) for name in names)
    found = compare(dataset, Model(observe=dataset.observe, units=dataset.units, terms=terms))
    return found.rms_heldout, found.noise.sigma
